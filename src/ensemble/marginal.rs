//! The marginal distribution of one factor.

use super::SamplingKind;
use statrs::distribution::{Continuous, ContinuousCDF, Normal};

/// The distribution of one factor between its bounds, irrespective of correlation with other factors.
#[derive(Clone, Debug, PartialEq)]
pub struct Marginal {
    /// The nominal value of the factor.
    pub nominal: f64,
    centre: f64,
    deviation: f64,
    low: f64,
    high: f64,
    /// Probabilities of the untruncated normal distribution below `low` and between `low` and `high`; `None` for the
    /// uniform distribution.
    normal: Option<(f64, f64)>,
}

impl Marginal {
    /// Marginal of a factor between these bounds for a sampling kind: see [`SamplingKind`].
    pub fn new(nominal: f64, (low, high): (f64, f64), kind: SamplingKind) -> Self {
        let centre = nominal.max(low).min(high);
        let deviation = (high - low) / 4.0;
        let share =
            |value: f64| if deviation > 0.0 { Normal::standard().cdf((value - centre) / deviation) } else { 0.5 };
        let normal = (kind != SamplingKind::Uniform).then(|| (share(low), share(high) - share(low)));
        Self { nominal, centre, deviation, low, high, normal }
    }

    /// Quantile: the value with this cumulative probability.
    pub fn quantile(&self, share: f64) -> f64 {
        let value = match self.normal {
            Some((below, inside)) => {
                self.centre + self.deviation * Normal::standard().inverse_cdf(below + share * inside)
            }
            None => self.low + share * (self.high - self.low),
        };
        // Rounding can exceed a bound by one unit in the last place.
        value.max(self.low).min(self.high)
    }

    /// Derivative of the value at a standard normal score by the score: that of `quantile(Φ(score))`.
    pub fn slope_by_score(&self, score: f64) -> f64 {
        let standard = Normal::standard();
        match self.normal {
            Some((below, inside)) => {
                let own = standard.inverse_cdf(below + standard.cdf(score) * inside);
                let slope = self.deviation * inside * (0.5 * (own * own - score * score)).exp();
                if slope.is_finite() { slope } else { 0.0 }
            }
            None => (self.high - self.low) * standard.pdf(score),
        }
    }

    /// Cumulative probability of a value; 0.5 for a fixed factor.
    pub fn cumulative(&self, value: f64) -> f64 {
        if self.is_fixed() {
            return 0.5;
        }
        let share = match self.normal {
            Some((below, inside)) => (Normal::standard().cdf((value - self.centre) / self.deviation) - below) / inside,
            None => (value - self.low) / (self.high - self.low),
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
