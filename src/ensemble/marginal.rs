//! The marginal distribution of one factor.

use super::SamplingKind;
use statrs::distribution::{Continuous, ContinuousCDF, Normal};

/// Distance of a bound from the nominal value of a split normal distribution, in standard deviations of its side.
const BOUND_SCORE: f64 = 2.0;

/// The distribution of one factor between its bounds, irrespective of correlation with other factors.
#[derive(Clone, Debug, PartialEq)]
pub struct Marginal {
    /// The nominal value of the factor.
    pub nominal: f64,
    low: f64,
    high: f64,
    shape: Shape,
}

#[derive(Clone, Debug, PartialEq)]
enum Shape {
    Uniform,
    /// Split normal distribution (Wallis, Stat. Sci. 29, 2014): the density has its maximum at `mode` and is normal on
    /// each side, with standard deviations of its own; truncated at two of them.
    SplitNormal {
        mode: f64,
        /// Standard deviations below and above the mode.
        deviations: [f64; 2],
        /// Probability below the mode.
        below: f64,
    },
}

/// Probabilities of a standard normal variable below −2, and from there to zero.
fn tail_and_half() -> (f64, f64) {
    let tail = Normal::standard().cdf(-BOUND_SCORE);
    (tail, 0.5 - tail)
}

impl Marginal {
    /// Marginal of a factor between these bounds for a sampling kind: see [`SamplingKind`].
    pub fn new(nominal: f64, (low, high): (f64, f64), kind: SamplingKind) -> Self {
        let mode = nominal.max(low).min(high);
        let deviations = [(mode - low) / BOUND_SCORE, (high - mode) / BOUND_SCORE];
        let below = if high > low { deviations[0] / (deviations[0] + deviations[1]) } else { 0.5 };
        let shape = match kind {
            SamplingKind::Uniform => Shape::Uniform,
            _ => Shape::SplitNormal { mode, deviations, below },
        };
        Self { nominal, low, high, shape }
    }

    /// Quantile: the value with this cumulative probability.
    pub fn quantile(&self, share: f64) -> f64 {
        let value = match self.shape {
            Shape::SplitNormal { mode, deviations, below } => {
                let (score, side) = Self::score(share, below);
                mode + deviations[side] * score
            }
            Shape::Uniform => self.low + share * (self.high - self.low),
        };
        // Rounding can exceed a bound by one unit in the last place.
        value.max(self.low).min(self.high)
    }

    /// Distance from the mode at a cumulative probability, in standard deviations of the side that it lies on, and that
    /// side: 0 below, 1 above.
    fn score(share: f64, below: f64) -> (f64, usize) {
        let (tail, half) = tail_and_half();
        if share < below {
            (Normal::standard().inverse_cdf(tail + share / below * half), 0)
        } else {
            // From the upper end, where the probability of the tail is exact.
            (-Normal::standard().inverse_cdf(tail + (1.0 - share) / (1.0 - below) * half), 1)
        }
    }

    /// Derivative of the value at a standard normal score by the score: that of `quantile(Φ(score))`.
    pub fn slope_by_score(&self, score: f64) -> f64 {
        let standard = Normal::standard();
        match self.shape {
            Shape::SplitNormal { deviations, below, .. } => {
                let (own, _) = Self::score(standard.cdf(score), below);
                let (_, half) = tail_and_half();
                let slope = half * (deviations[0] + deviations[1]) * (0.5 * (own * own - score * score)).exp();
                if slope.is_finite() { slope } else { 0.0 }
            }
            Shape::Uniform => (self.high - self.low) * standard.pdf(score),
        }
    }

    /// Cumulative probability of a value; 0.5 for a fixed factor.
    pub fn cumulative(&self, value: f64) -> f64 {
        if self.is_fixed() {
            return 0.5;
        }
        let share = match self.shape {
            Shape::SplitNormal { mode, deviations, below } => {
                let (tail, half) = tail_and_half();
                // Probability of the side of the value from its bound to the value.
                let from_bound = |distance: f64| (Normal::standard().cdf(-distance) - tail) / half;
                if value < mode {
                    below * from_bound((mode - value) / deviations[0])
                } else if value < self.high {
                    1.0 - (1.0 - below) * from_bound((value - mode) / deviations[1])
                } else {
                    1.0
                }
            }
            Shape::Uniform => (value - self.low) / (self.high - self.low),
        };
        share.clamp(0.0, 1.0)
    }

    /// Value scaled to −1 at the low bound and 1 at the high bound; zero for a fixed factor.
    pub fn scaled(&self, value: f64) -> f64 {
        if self.is_fixed() { 0.0 } else { (2.0 * value - self.low - self.high) / (self.high - self.low) }
    }

    /// Whether the bounds coincide, so that the factor does not vary.
    pub fn is_fixed(&self) -> bool {
        self.high <= self.low
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Median and mean of a standard normal variable between 0 and 2.
    const HALF_MEDIAN: f64 = 0.639_111_9;
    const HALF_MEAN: f64 = 0.722_789_8;

    fn mean(marginal: &Marginal) -> f64 {
        (0..100_000).map(|node| marginal.quantile((f64::from(node) + 0.5) / 1e5)).sum::<f64>() / 1e5
    }

    #[test]
    fn each_bound_of_an_off_centre_factor_is_two_standard_deviations_of_its_side_away() {
        let marginal = Marginal::new(1.0, (0.9, 1.4), SamplingKind::Normal);
        // σ is 0.05 below and 0.2 above, so a fifth of the probability lies below the nominal value.
        assert!((marginal.cumulative(1.0) - 0.2).abs() < 1e-12);
        assert!((marginal.quantile(0.1) - (1.0 - 0.05 * HALF_MEDIAN)).abs() < 1e-6);
        assert!((marginal.quantile(0.6) - (1.0 + 0.2 * HALF_MEDIAN)).abs() < 1e-6);
        let expected = 1.0 - 0.2 * 0.05 * HALF_MEAN + 0.8 * 0.2 * HALF_MEAN;
        assert!((mean(&marginal) - expected).abs() < 1e-5, "{}", mean(&marginal));
        // Negative control: one standard deviation, a quarter of the width, about the nominal value.
        let centred = Marginal::new(1.15, (0.9, 1.4), SamplingKind::Normal);
        assert!((mean(&centred) - expected).abs() > 0.03);
    }

    #[test]
    fn a_factor_with_its_nominal_value_at_a_bound_is_half_normal() {
        for (bounds, sign) in [((1.0, 1.3), 1.0), ((0.7, 1.0), -1.0)] {
            let marginal = Marginal::new(1.0, bounds, SamplingKind::Normal);
            assert!((marginal.quantile(0.5) - (1.0 + sign * 0.15 * HALF_MEDIAN)).abs() < 1e-6);
            assert!((mean(&marginal) - (1.0 + sign * 0.15 * HALF_MEAN)).abs() < 1e-5);
        }
    }

    #[test]
    fn quantile_and_cumulative_probability_are_inverse_and_the_slope_is_the_derivative() {
        for (nominal, bounds) in [(1.0, (0.75, 1.25)), (1.0, (0.9, 1.4)), (1.0, (1.0, 1.3)), (1.0, (0.5, 1.0))] {
            for kind in [SamplingKind::Normal, SamplingKind::Uniform] {
                let marginal = Marginal::new(nominal, bounds, kind);
                assert_eq!((marginal.cumulative(bounds.0), marginal.cumulative(bounds.1)), (0.0, 1.0));
                for step in 1..200 {
                    let share = f64::from(step) / 200.0;
                    let found = marginal.cumulative(marginal.quantile(share));
                    assert!((found - share).abs() < 1e-10, "{nominal} in {bounds:?}: {found} for {share}");
                    let score = Normal::standard().inverse_cdf(share) + 1e-3;
                    let at = |score: f64| marginal.quantile(Normal::standard().cdf(score));
                    let slope = (at(score + 1e-5) - at(score - 1e-5)) / 2e-5;
                    assert!(
                        (marginal.slope_by_score(score) - slope).abs() < 1e-5,
                        "{nominal} in {bounds:?} at {score}"
                    );
                }
            }
        }
    }
}
