//! Probability of exceedance by importance sampling about a design point, with a defensive mixture: a share of the
//! members is drawn plainly. The estimate is unbiased for any centre, and no weight exceeds the inverse of that share,
//! so that its variance is finite and its interval comes from the members themselves (Hesterberg, Technometrics 37,
//! 1995; Owen & Zhou, J. Am. Stat. Assoc. 95, 2000).

use crate::random::RandomStream;
use statrs::distribution::{ContinuousCDF, Normal};

/// Share of the members that are drawn plainly.
pub const PLAIN_SHARE: f64 = 0.1;

/// Draws members about a centre.
#[derive(Clone, Debug)]
pub struct ImportanceSampling {
    centre: Vec<f64>,
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
}

impl ImportanceSampling {
    /// Members about a centre. A member depends on the seed and its index alone.
    pub fn new(centre: Vec<f64>, seed: u64) -> Self {
        Self { centre, seed }
    }

    /// A member.
    pub fn member(&self, index: usize) -> WeightedMember {
        let mut numbers = RandomStream::new(self.seed, index as u64);
        let is_plain = numbers.uniform() < PLAIN_SHARE;
        let shift = if is_plain { 0.0 } else { 1.0 };
        let scores: Vec<f64> = self.centre.iter().map(|centre| shift * centre + numbers.normal()).collect();
        // Density about the centre over that about the origin: exp(c·u − |c|²/2).
        let exponent: f64 = self.centre.iter().zip(&scores).map(|(c, u)| c * u - 0.5 * c * c).sum();
        WeightedMember { scores, weight: 1.0 / (PLAIN_SHARE + (1.0 - PLAIN_SHARE) * exponent.exp()), is_plain }
    }
}

/// Sums over the members so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct ImportanceEstimate {
    /// Members drawn.
    pub members: usize,
    /// Members drawn plainly.
    pub plain: usize,
    /// Members that exceed the limit.
    pub exceeding: usize,
    /// Sum of the weights of the members that exceed the limit.
    pub sum: f64,
    /// Sum of their squares.
    pub squares: f64,
    /// The largest of them.
    pub largest: f64,
}

impl ImportanceEstimate {
    /// Add a member.
    pub fn add(&mut self, member: &WeightedMember, is_exceeding: bool) {
        self.members += 1;
        self.plain += usize::from(member.is_plain);
        if is_exceeding {
            self.exceeding += 1;
            self.sum += member.weight;
            self.squares += member.weight * member.weight;
            self.largest = self.largest.max(member.weight);
        }
    }

    /// The probability of exceedance.
    pub fn probability(&self) -> f64 {
        self.sum / self.members as f64
    }

    /// Standard error of the probability.
    pub fn standard_error(&self) -> f64 {
        let members = self.members as f64;
        ((self.squares / members - self.probability().powi(2)).max(0.0) / (members - 1.0)).sqrt()
    }

    /// Equally weighted members with the information of those that exceed the limit (Kish, *Survey Sampling*, 1965).
    pub fn effective_exceeding(&self) -> f64 {
        if self.squares > 0.0 { self.sum * self.sum / self.squares } else { 0.0 }
    }

    /// Plainly drawn members that would have the same standard error.
    pub fn equivalent_members(&self) -> f64 {
        let p = self.probability();
        p * (1.0 - p) / self.standard_error().powi(2)
    }

    /// Confidence interval of the probability, with this probability of each tail, from the central limit theorem. If
    /// no member exceeds the limit, the upper end is the one of the plainly drawn members.
    pub fn interval(&self, tail: f64) -> (f64, f64) {
        if self.exceeding == 0 {
            // The probability that none of n members exceeds the limit, (1 − p)ⁿ, is that of the tail.
            return (0.0, 1.0 - tail.powf(1.0 / self.plain.max(1) as f64));
        }
        let reach = -Normal::standard().inverse_cdf(tail) * self.standard_error();
        ((self.probability() - reach).max(0.0), (self.probability() + reach).min(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_states::{Curved, Plane};
    use super::super::{LimitState, find_design_point};
    use super::*;

    fn estimate<L: LimitState<Error = std::convert::Infallible>>(
        state: &mut L,
        centre: &[f64],
        seed: u64,
        members: usize,
    ) -> ImportanceEstimate {
        let sampling = ImportanceSampling::new(centre.to_vec(), seed);
        let mut found = ImportanceEstimate::default();
        for index in 0..members {
            let member = sampling.member(index);
            let Ok(values) = state.values(std::slice::from_ref(&member.scores));
            found.add(&member, values[0] < 0.0);
        }
        found
    }

    fn held<L: LimitState<Error = std::convert::Infallible>>(state: &mut L, truth: f64, shift: f64) -> usize {
        let Ok(design) = find_design_point(state);
        let centre: Vec<f64> = design.scores.iter().map(|score| shift * score).collect();
        let within = |seed| {
            let (low, high) = estimate(state, &centre, seed, 2000).interval(0.025);
            (low..=high).contains(&truth)
        };
        (0..200).map(within).filter(|&is_within| is_within).count()
    }

    /// Three standard errors of a share of 95 % of 200 are 9; a plane at β has the probability Φ(−β).
    #[test]
    fn the_95_percent_interval_of_a_linear_limit_state_contains_its_probability_in_95_of_100_seeds() {
        for distance in [2.3, 3.7, 5.2] {
            let truth = Normal::standard().cdf(-distance);
            let count = held(&mut Plane::at(distance), truth, 1.0);
            assert!((181..=199).contains(&count), "{count} of 200 at {distance}");
        }
        // Negative control: the probability of another plane.
        let count = held(&mut Plane::at(3.7), Normal::standard().cdf(-3.5), 1.0);
        assert!(count < 40, "{count} of 200");
    }

    /// A centre that is off makes the interval wider, not wrong.
    #[test]
    fn the_estimate_is_unbiased_for_a_centre_off_the_design_point() {
        let truth = Normal::standard().cdf(-3.0);
        let count = held(&mut Plane::at(3.0), truth, 1.3);
        assert!((178..=199).contains(&count), "{count} of 200");
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
        let count = held(&mut Curved, truth, 1.0);
        assert!((178..=199).contains(&count), "{count} of 200");
        let first_order = normal.cdf(-3.0);
        assert!(first_order > 1.4 * truth, "{first_order} and {truth}");
    }

    #[test]
    fn a_member_of_importance_sampling_is_worth_hundreds_of_plain_ones() {
        let Ok(design) = find_design_point(&mut Plane::at(3.7));
        let found = estimate(&mut Plane::at(3.7), &design.scores, 7, 2000);
        assert!(found.equivalent_members() > 200.0 * 2000.0, "{found:?}");
        assert!(found.largest <= 1.0 / PLAIN_SHARE && found.effective_exceeding() > 100.0);
        assert!((150..250).contains(&found.plain), "{}", found.plain);
    }

    #[test]
    fn without_exceedance_the_interval_ends_where_the_plain_members_say() {
        let found = estimate(&mut Plane::at(40.0), &[0.0; 5], 1, 3000);
        let (low, high) = found.interval(0.025);
        assert!(low == 0.0 && (high - 3.689 / found.plain as f64).abs() < 1e-4 && found.exceeding == 0, "{high}");
    }
}
