//! A binomial proportion: a count out of a total.

use statrs::distribution::{Binomial, DiscreteCDF, Hypergeometric};
use statrs::function::beta::beta_reg;
use statrs::function::gamma::ln_gamma;

/// A count out of a total.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Proportion {
    /// The count.
    pub count: usize,
    /// The total.
    pub total: usize,
}

impl Proportion {
    /// The proportion; NaN for a total of zero.
    pub fn fraction(self) -> f64 {
        self.count as f64 / self.total as f64
    }

    /// 95 % confidence interval of the probability, by Clopper & Pearson (Biometrika 26, 1934). Its coverage is at
    /// least 95 % for any total and any probability.
    pub fn interval_95(self) -> (f64, f64) {
        self.interval(0.025)
    }

    /// [`interval_95`](Self::interval_95) for another probability of each tail.
    pub fn interval(self, tail: f64) -> (f64, f64) {
        let (count, of) = (self.count as f64, self.total as f64);
        // P(X ≥ k) for n draws with probability q is I_q(k, n − k + 1), which rises with q.
        let at_least = |least: f64, q: f64| if least <= 0.0 { 1.0 } else { beta_reg(least, of - least + 1.0, q) };
        let low = if self.count == 0 { 0.0 } else { bisect(|q| at_least(count, q) - tail) };
        let high = if self.count == self.total { 1.0 } else { bisect(|q| at_least(count + 1.0, q) - (1.0 - tail)) };
        (low, high)
    }

    /// Whether two counts are consistent with one probability at the 95 % level: Fisher's exact test, because a normal
    /// approximation fails for rare events.
    pub fn is_consistent_with(self, other: Self) -> bool {
        let (all, had) = ((self.total + other.total) as u64, (self.count + other.count) as u64);
        let Ok(chance) = Hypergeometric::new(all, had, other.total as u64) else { return false };
        let count = other.count as u64;
        let at_most = chance.cdf(count);
        let at_least = if count == 0 { 1.0 } else { 1.0 - chance.cdf(count - 1) };
        at_most.min(at_least) >= 0.025
    }
}

/// Root of a rising function on 0 to 1, by bisection.
fn bisect(rising: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if rising(middle) < 0.0 { low = middle } else { high = middle }
    }
    (low + high) / 2.0
}

/// Ranks, counted from one, of the two ordered draws that enclose a quantile with 95 % confidence for any distribution
/// (David & Nagaraja, *Order Statistics*, 2003, section 7.1); `None` where there are too few draws.
pub fn quantile_ranks_95(draws: usize, probability: f64) -> (Option<usize>, Option<usize>) {
    quantile_ranks(draws, probability, 0.025)
}

/// [`quantile_ranks_95`] for another probability of each tail.
pub fn quantile_ranks(draws: usize, probability: f64, tail: f64) -> (Option<usize>, Option<usize>) {
    let Ok(binomial) = Binomial::new(probability, draws as u64) else { return (None, None) };
    let low = usize::try_from(binomial.inverse_cdf(tail)).unwrap_or(usize::MAX);
    let high = usize::try_from(binomial.inverse_cdf(1.0 - tail)).unwrap_or(usize::MAX).saturating_add(1);
    ((low >= 1).then_some(low), (high <= draws).then_some(high))
}

/// Rank, counted from one, of the smallest ordered draw that is above a quantile with a given confidence, for any
/// distribution: a one-sided tolerance bound (Wilks, Ann. Math. Stat. 12, 1941); `None` where there are too few draws.
pub fn upper_bound_rank(draws: usize, content: f64, confidence: f64) -> Option<usize> {
    // The number of draws below the quantile is binomial: P(X ≤ rank − 1) ≥ confidence.
    let below = Binomial::new(content, draws as u64).ok()?;
    let rank = usize::try_from(below.inverse_cdf(confidence)).ok()? + 1;
    (rank <= draws).then_some(rank)
}

/// 95 % range of the number of further draws below the draw of a rank (counted from one) among earlier ones. For any
/// distribution the number is negative hypergeometric: binomial with a probability of Beta(rank, draws − rank + 1)
/// (David & Nagaraja, *Order Statistics*, 2003, section 2.5). Each tail has at most 2.5 %.
pub fn counts_below_95(rank: usize, draws: usize, further: usize) -> (usize, usize) {
    let (k, n, m) = (rank as f64, draws as f64, further as f64);
    // P(X = x) = C(x + k − 1, x) C(m − x + n − k, m − x)/C(n + m, m), in logarithms to avoid underflow.
    let choose = |n: f64, k: f64| ln_gamma(n + 1.0) - ln_gamma(k + 1.0) - ln_gamma(n - k + 1.0);
    let chance = |x: usize| {
        let x = x as f64;
        (choose(x + k - 1.0, x) + choose(m - x + n - k, m - x) - choose(n + m, m)).exp()
    };
    let end = |mut counts: Box<dyn Iterator<Item = usize>>| {
        let mut beyond = 0.0;
        let is_end = |&x: &usize| {
            beyond += chance(x);
            beyond > 0.025
        };
        counts.find(is_end).unwrap_or(further)
    };
    (end(Box::new(0..=further)), end(Box::new((0..=further).rev())))
}

/// Smallest number of draws whose maximum exceeds a quantile with 97.5 % confidence, `pⁿ ≤ 0.025`; with fewer draws the
/// interval has no upper end (Wilks, Ann. Math. Stat. 12, 1941).
pub fn min_draws_for_upper_bound(probability: f64) -> usize {
    (0.025_f64.ln() / probability.ln()).ceil() as usize
}

/// Number of draws for a relative standard error of 10 % in the estimated probability of the complementary rare event.
pub fn draws_for_ten_percent_error(probability: f64) -> usize {
    (100.0 * probability / (1.0 - probability)).ceil() as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tables of Clopper and Pearson: 8 of 10, 0 of 20 (`1 − 0.025^(1/20)`), 95 of 100.
    #[test]
    fn limits_of_a_proportion_equal_the_tables() {
        for (count, of, low, high) in
            [(8, 10, 0.4439, 0.9748), (0, 20, 0.0, 0.1684), (20, 20, 0.8316, 1.0), (95, 100, 0.8872, 0.9836)]
        {
            let found = Proportion { count, total: of }.interval_95();
            assert!((found.0 - low).abs() < 6e-5 && (found.1 - high).abs() < 6e-5, "{count} of {of}: {found:?}");
        }
    }

    #[test]
    fn counts_of_rare_events_differ_only_beyond_chance() {
        let failed = |count| Proportion { count, total: 400 };
        assert!(
            failed(4).is_consistent_with(failed(4))
                && failed(4).is_consistent_with(failed(12))
                && failed(12).is_consistent_with(failed(4))
        );
        assert!(!failed(4).is_consistent_with(failed(16)) && !failed(16).is_consistent_with(failed(4)));
        let held = |count| Proportion { count, total: 2000 };
        assert!(held(1980).is_consistent_with(held(1975)) && !held(1980).is_consistent_with(held(1955)));
    }

    #[test]
    fn a_quantile_lies_between_its_ranks_with_the_stated_confidence() {
        let (Some(low), Some(high)) = quantile_ranks_95(1000, 0.99) else { panic!("a thousand are enough") };
        let binomial = Binomial::new(0.99, 1000).expect("a probability");
        let within = binomial.cdf(high as u64 - 1) - binomial.cdf(low as u64 - 1);
        assert!((0.95..0.98).contains(&within), "{low} to {high}: {within}");
    }

    /// Monte Carlo: 400 draws, the 380th of them in order, and the number of 400 further draws below it.
    #[test]
    fn counts_below_a_ranked_draw_lie_between_their_limits_in_95_of_100_pairs_of_samples() {
        let (low, high) = counts_below_95(380, 400, 400);
        let mut bits = 26_u64;
        let mut even = || {
            bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (bits >> 11) as f64 / (1_u64 << 53) as f64
        };
        let (mut within, mut clopper_pearson) = (0, 0);
        for _ in 0..4000 {
            let mut draws: Vec<f64> = (0..400).map(|_| even()).collect();
            draws.sort_by(f64::total_cmp);
            let count = (0..400).filter(|_| even() < draws[379]).count();
            within += usize::from((low..=high).contains(&count));
            let (least, most) = Proportion { count, total: 400 }.interval_95();
            clopper_pearson += usize::from((least..=most).contains(&0.95));
        }
        assert!((3780..=3880).contains(&within), "{low} to {high} hold {within} of 4000");
        // Negative control: the binomial interval of the check, which ignores the scatter of the thickness.
        assert!(clopper_pearson < 3500, "{clopper_pearson}");
    }

    /// Wilks' numbers of draws for 95 % confidence of 99 % content: 299 for the largest draw, 473 for the second one.
    #[test]
    fn the_tolerance_bound_is_the_largest_draw_from_299_on_and_the_second_largest_from_473_on() {
        let rank = |draws| upper_bound_rank(draws, 0.99, 0.95);
        assert_eq!([298, 299, 472, 473].map(rank), [None, Some(299), Some(472), Some(472)]);
    }

    #[test]
    fn too_few_draws_leave_the_upper_end_open() {
        let fewest = min_draws_for_upper_bound(0.99);
        assert_eq!(fewest, 368);
        assert!(quantile_ranks_95(fewest, 0.99).1.is_some() && quantile_ranks_95(fewest - 1, 0.99).1.is_none());
        assert_eq!(draws_for_ten_percent_error(0.99), 9_900);
    }
}
