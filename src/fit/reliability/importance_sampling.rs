//! Probability of exceedance by importance sampling about design points, and plain sampling of what they leave out.
//!
//! Members are drawn from a mixture: a share of the standard normal density itself, and the rest about the design
//! points, in equal parts. Where the shifted densities are high enough, exceedances are weighted by the density of the
//! variables over that of the mixture, which is unbiased for any centres (Hesterberg, Technometrics 37, 1995; Owen &
//! Zhou, J. Am. Stat. Assoc. 95, 2000). Elsewhere the shifted members would not have met an exceedance; the plainly
//! drawn ones count it, with an exact interval, also where they meet none. The intervals of both parts are combined by
//! the squares of the distances of their ends (Zou & Donner, Stat. Med. 27, 2008).

use crate::fit::proportion::Proportion;
use crate::random::RandomStream;
use statrs::distribution::{ContinuousCDF, Normal};

/// Share of the members that are drawn plainly. Most of them: an interval of a tenth of a probability is not narrow
/// before the plain members bound what is left out to a tenth of it, which takes more members than the rest.
pub const PLAIN_SHARE: f64 = 0.8;

/// Shifted density over the plain one from which a point counts as covered by the design points. The shifted members
/// then meet an exceedance there as often as the plain ones.
const COVERED_RATIO: f64 = 4.0;

/// Draws members about design points.
#[derive(Clone, Debug)]
pub struct ImportanceSampling {
    centres: Vec<Vec<f64>>,
    seed: u64,
}

/// A drawn member.
#[derive(Clone, Debug, PartialEq)]
pub struct WeightedMember {
    /// Standard normal variables.
    pub scores: Vec<f64>,
    /// Density of the variables over that of the draw; at most `1/PLAIN_SHARE`.
    pub weight: f64,
    /// Whether it was drawn plainly.
    pub is_plain: bool,
    /// Whether it lies where members about the design points are drawn.
    pub is_covered: bool,
}

impl ImportanceSampling {
    /// Members about one or more centres. A member depends on the seed and its index alone.
    pub fn new(centres: Vec<Vec<f64>>, seed: u64) -> Self {
        Self { centres, seed }
    }

    /// A member.
    pub fn member(&self, index: usize) -> WeightedMember {
        let mut numbers = RandomStream::new(self.seed, index as u64);
        let (place, count) = (numbers.uniform(), self.centres.len());
        let shifted = (place - PLAIN_SHARE) / (1.0 - PLAIN_SHARE);
        let centre = &self.centres[((shifted * count as f64).max(0.0) as usize).min(count - 1)];
        let is_plain = shifted < 0.0;
        let shift = if is_plain { 0.0 } else { 1.0 };
        let scores: Vec<f64> = centre.iter().map(|centre| shift * centre + numbers.normal()).collect();
        // Density about a centre over that about the origin: exp(c·u − |c|²/2).
        let ratio = |centre: &Vec<f64>| {
            centre.iter().zip(&scores).map(|(c, u)| c * u - 0.5 * c * c).sum::<f64>().exp() / count as f64
        };
        let ratio: f64 = self.centres.iter().map(ratio).sum();
        let weight = 1.0 / (PLAIN_SHARE + (1.0 - PLAIN_SHARE) * ratio);
        WeightedMember { scores, weight, is_plain, is_covered: ratio >= COVERED_RATIO }
    }
}

/// Sums over the members so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct ImportanceEstimate {
    /// Members drawn.
    pub members: usize,
    /// Members drawn plainly.
    pub plain: usize,
    /// Members that exceed the limit.
    pub exceeding: usize,
    /// Sum of the weights of those where the design points cover it.
    pub sum: f64,
    /// Sum of their squares.
    pub squares: f64,
    /// Plainly drawn members that exceed the limit elsewhere.
    pub elsewhere: usize,
}

impl ImportanceEstimate {
    /// Add a member.
    pub fn add(&mut self, member: &WeightedMember, is_exceeding: bool) {
        self.members += 1;
        self.plain += usize::from(member.is_plain);
        if is_exceeding {
            self.exceeding += 1;
            if member.is_covered {
                self.sum += member.weight;
                self.squares += member.weight * member.weight;
            } else {
                self.elsewhere += usize::from(member.is_plain);
            }
        }
    }

    /// The probability of exceedance.
    pub fn probability(&self) -> f64 {
        self.covered() + self.elsewhere as f64 / self.plain.max(1) as f64
    }

    /// The part of the probability that the design points cover.
    pub fn covered(&self) -> f64 {
        self.sum / self.members as f64
    }

    /// Standard error of that part.
    pub fn covered_standard_error(&self) -> f64 {
        let members = self.members as f64;
        ((self.squares / members - self.covered().powi(2)).max(0.0) / (members - 1.0)).sqrt()
    }

    /// Equally weighted members with the information of those that exceed the limit (Kish, *Survey Sampling*, 1965).
    pub fn effective_exceeding(&self) -> f64 {
        let covered = if self.squares > 0.0 { self.sum * self.sum / self.squares } else { 0.0 };
        covered + self.elsewhere as f64
    }

    /// Plainly drawn members whose interval of these tails would be as wide.
    pub fn equivalent_members(&self, tail: f64) -> f64 {
        let (p, (low, high)) = (self.probability(), self.interval(tail));
        p * (1.0 - p) * (2.0 * reach(tail) / (high - low)).powi(2)
    }

    /// Confidence interval of the part of the probability that the design points leave out, with this probability of
    /// each tail (Clopper & Pearson, Biometrika 26, 1934).
    pub fn elsewhere_interval(&self, tail: f64) -> (f64, f64) {
        Proportion { count: self.elsewhere, total: self.plain.max(1) }.interval(tail)
    }

    /// Confidence interval of the probability, with this probability of each tail: of the covered part from the central
    /// limit theorem.
    pub fn interval(&self, tail: f64) -> (f64, f64) {
        let (covered, p) = (reach(tail) * self.covered_standard_error(), self.probability());
        let (elsewhere, (low, high)) = (p - self.covered(), self.elsewhere_interval(tail));
        let end = |by: f64| covered.hypot(by - elsewhere);
        ((p - end(low)).max(0.0), (p + end(high)).min(1.0))
    }
}

/// Standard errors from the estimate to the end of an interval.
fn reach(tail: f64) -> f64 {
    -Normal::standard().inverse_cdf(tail)
}

#[cfg(test)]
mod tests {
    use super::super::test_states::{Curved, Planes};
    use super::super::{LimitState, find_design_points};
    use super::*;
    use std::convert::Infallible;

    fn estimate<L: LimitState<Error = Infallible>>(
        state: &mut L,
        centres: &[Vec<f64>],
        seed: u64,
        members: usize,
    ) -> ImportanceEstimate {
        let sampling = ImportanceSampling::new(centres.to_vec(), seed);
        let mut found = ImportanceEstimate::default();
        for index in 0..members {
            let member = sampling.member(index);
            let Ok(values) = state.values(std::slice::from_ref(&member.scores));
            found.add(&member, values[0] < 0.0);
        }
        found
    }

    fn centres<L: LimitState<Error = Infallible>>(state: &mut L) -> Vec<Vec<f64>> {
        let Ok(found) = find_design_points(state);
        found.points.into_iter().map(|point| point.scores).collect()
    }

    /// Seeds of 200 whose interval of 95 % contains the probability. Three standard errors of a share of 95 % are 9;
    /// what is left out makes the intervals of the rarest wider, so that up to all may.
    fn held<L: LimitState<Error = Infallible>>(state: &mut L, centres: &[Vec<f64>], truth: f64) -> usize {
        let within = |seed| {
            let (low, high) = estimate(state, centres, seed, 4000).interval(0.025);
            (low..=high).contains(&truth)
        };
        (0..200).map(within).filter(|&is_within| is_within).count()
    }

    #[test]
    fn the_95_percent_interval_of_a_linear_limit_state_contains_its_probability_in_95_of_100_seeds() {
        for distance in [2.3, 3.7, 5.2] {
            let mut plane = Planes::one(distance);
            let (centres, truth) = (centres(&mut plane), Normal::standard().cdf(-distance));
            let count = held(&mut plane, &centres, truth);
            assert!(count >= 181, "{count} of 200 at {distance}");
        }
        // Negative control: the probability of another plane.
        let mut plane = Planes::one(2.3);
        let centres = centres(&mut plane);
        let count = held(&mut plane, &centres, Normal::standard().cdf(-2.1));
        assert!(count < 40, "{count} of 200");
    }

    /// A centre that is off makes the interval wider, not wrong.
    #[test]
    fn the_estimate_is_unbiased_for_a_centre_off_the_design_point() {
        let mut plane = Planes::one(3.0);
        let off = centres(&mut plane)
            .iter()
            .map(|centre| centre.iter().map(|score| 1.3 * score).collect())
            .collect::<Vec<_>>();
        let count = held(&mut plane, &off, Normal::standard().cdf(-3.0));
        assert!(count >= 178, "{count} of 200");
    }

    /// P(u₂ > 3 + u₁²/4) = ∫ φ(x) Φ(−3 − x²/4) dx, by the trapezium rule.
    #[test]
    fn a_curved_limit_state_has_the_probability_of_its_integral_where_form_is_off() {
        let normal = Normal::standard();
        let density = |x: f64| (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
        let truth: f64 = (-8000..8000)
            .map(|n| 1e-3 * f64::from(n))
            .map(|x| 1e-3 * density(x) * normal.cdf(-3.0 - 0.25 * x * x))
            .sum();
        let centres = centres(&mut Curved);
        let count = held(&mut Curved, &centres, truth);
        assert!(count >= 178, "{count} of 200");
        let first_order = normal.cdf(-3.0);
        assert!(first_order > 1.4 * truth, "{first_order} and {truth}");
    }

    #[test]
    fn a_second_plane_that_no_search_found_is_part_of_the_interval() {
        let mut planes = Planes::some(&[2.5, 2.5]);
        let both = 1.0 - Normal::standard().cdf(2.5).powi(2);
        let found = centres(&mut planes);
        for centres in [&found[..], &found[..1]] {
            let count = held(&mut planes, centres, both);
            assert!(count >= 181, "{count} of 200 with {} of two", centres.len());
        }
        // Negative control: the weighted part alone is that of the plane that was found.
        let alone = estimate(&mut planes, &found[..1], 1, 40_000).covered();
        assert!((alone / both - 0.5).abs() < 0.1, "{alone} of {both}");
    }

    #[test]
    fn what_the_design_points_leave_out_is_bounded_by_the_plainly_drawn_members() {
        let found = estimate(&mut Planes::one(3.7), &centres(&mut Planes::one(3.7)), 7, 20_000);
        let (low, high) = found.elsewhere_interval(0.025);
        assert!(found.elsewhere == 0 && low == 0.0 && (high - 3.689 / found.plain as f64).abs() < 1e-6, "{found:?}");
        let (_, end) = found.interval(0.025);
        assert!(end - found.probability() >= high, "{found:?}");
        assert!((0.79..0.81).contains(&(found.plain as f64 / 20_000.0)), "{}", found.plain);
        // The covered part alone is known as well as by a hundred times as many plain members.
        let truth = Normal::standard().cdf(-3.7);
        assert!(found.covered_standard_error() < 0.1 * (truth / 20_000.0).sqrt(), "{found:?}");
    }
}
