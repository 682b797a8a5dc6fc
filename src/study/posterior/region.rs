//! What was drawn of one factor, and of two.

use crate::fit::Mixing;

/// What was drawn of one factor.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Marginal {
    /// Convergence diagnostics of its chains.
    pub mixing: Mixing,
    /// The median.
    pub median: f64,
    /// Between which 95 % lie.
    pub interval: (f64, f64),
    /// Where the bins of its histogram begin and end: what all but one in a thousand on either side lie between.
    pub range: (f64, f64),
    /// The share of the draws in each bin.
    pub shares: Vec<f64>,
}

/// What was drawn of two factors.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Pair {
    /// Their places among the factors of the estimate, across and up.
    pub places: (usize, usize),
    /// Of the draws.
    pub correlation: f64,
    /// `enclosed[j][i]`: the share of the draws that lie where they are at least as dense as in bin i across, j up. Where it
    /// is no more than 0.95 is the smallest region that holds 95 %.
    pub enclosed: Vec<Vec<f64>>,
}

/// Bins of a range: as many as draws fill in two directions, and no more than a panel shows.
fn bins(draws: usize) -> usize {
    ((draws as f64).powf(0.28) as usize).clamp(8, 48)
}

impl Marginal {
    /// Of a trail, move × walker, of a factor between bounds.
    pub(super) fn of(trail: &[f64], walkers: usize, (least, most): (f64, f64)) -> Self {
        let mut sorted = trail.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| sorted[((share * sorted.len() as f64) as usize).min(sorted.len() - 1)];
        let (low, high) = (at(0.001), at(0.999));
        // What never moved has no range of its own.
        let range = if low < high { (low, high) } else { (least, most) };
        let mut counts = vec![0.0; bins(trail.len())];
        for &value in trail {
            if let Some(bin) = bin(value, range, counts.len()) {
                counts[bin] += 1.0;
            }
        }
        Self {
            mixing: Mixing::of(trail, walkers),
            median: at(0.5),
            interval: (at(0.025), at(0.975)),
            range,
            shares: counts.iter().map(|count| count / trail.len() as f64).collect(),
        }
    }

    /// The middle of each bin.
    pub fn middles(&self) -> Vec<f64> {
        let ((low, high), bins) = (self.range, self.shares.len());
        (0..bins).map(|bin| low + (high - low) * (bin as f64 + 0.5) / bins as f64).collect()
    }
}

/// The bin of a value, of so many in a range.
fn bin(value: f64, (low, high): (f64, f64), bins: usize) -> Option<usize> {
    let place = (value - low) / (high - low) * bins as f64;
    (0.0..=bins as f64).contains(&place).then(|| (place as usize).min(bins - 1))
}

impl Pair {
    pub(super) fn of(x: (usize, &[f64], &Marginal), y: (usize, &[f64], &Marginal)) -> Self {
        let bins = x.2.shares.len();
        let mut counts = vec![0.0f64; bins * bins];
        let mut all = 0.0;
        for (&across, &up) in x.1.iter().zip(y.1) {
            if let (Some(i), Some(j)) = (bin(across, x.2.range, bins), bin(up, y.2.range, bins)) {
                counts[j * bins + i] += 1.0;
                all += 1.0;
            }
        }
        let mut order: Vec<usize> = (0..counts.len()).collect();
        order.sort_by(|&a, &b| counts[b].total_cmp(&counts[a]));
        let mut enclosed = vec![1.0; counts.len()];
        let mut within = 0.0;
        for place in order.into_iter().filter(|&place| counts[place] > 0.0) {
            within += counts[place];
            enclosed[place] = within / all;
        }
        Self {
            places: (x.0, y.0),
            correlation: correlation(x.1, y.1),
            enclosed: enclosed.chunks(bins).map(<[f64]>::to_vec).collect(),
        }
    }
}

fn correlation(x: &[f64], y: &[f64]) -> f64 {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (mx, my) = (mean(x), mean(y));
    let moment = |f: fn(f64, f64) -> f64| x.iter().zip(y).map(|(a, b)| f(a - mx, b - my)).sum::<f64>();
    let both = (moment(|a, _| a * a) * moment(|_, b| b * b)).sqrt();
    if both > 0.0 { moment(|a, b| a * b) / both } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::Numbers;

    /// 95 % of a normal lie within 1.96 deviations, and of two independent ones a share of 1 − exp(−r²/2) within r. A bin's count
    /// is off by 4 % by chance, and with it what it encloses by 0.02: four of that.
    #[test]
    fn intervals_and_regions_hold_the_share_that_they_say() {
        let mut numbers = Numbers::of(3, 0);
        let [x, y]: [Vec<f64>; 2] = std::array::from_fn(|_| (0..200_000).map(|_| numbers.normal()).collect());
        let [a, b] = [&x, &y].map(|trail| Marginal::of(trail, 100, (-9.0, 9.0)));
        assert!((a.interval.0 + 1.96).abs() < 0.03 && (a.interval.1 - 1.96).abs() < 0.03 && a.median.abs() < 0.01);
        assert!((a.shares.iter().sum::<f64>() - 0.998).abs() < 1e-3);
        let pair = Pair::of((0, &x, &a), (1, &y, &b));
        assert!(pair.correlation.abs() < 0.01);
        for (j, up) in b.middles().into_iter().enumerate() {
            for (i, across) in a.middles().into_iter().enumerate() {
                let radius = across.hypot(up);
                let exact = 1.0 - (-radius * radius / 2.0).exp();
                assert!((pair.enclosed[j][i] - exact).abs() < 0.08, "{radius}: {} for {exact}", pair.enclosed[j][i]);
            }
        }
    }
}
