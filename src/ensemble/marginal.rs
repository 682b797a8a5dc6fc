//! How one factor is distributed.

use super::SamplingKind;
use statrs::distribution::{ContinuousCDF, Normal};

/// The distribution of one factor between its side constraints, whatever it has to do with the others.
#[derive(Clone, Debug, PartialEq)]
pub struct Marginal {
    /// The nominal value of the factor.
    pub nominal: f64,
    centre: f64,
    deviation: f64,
    low: f64,
    high: f64,
    /// Of the normal distribution: its share below `low`, and its share between `low` and `high`; `None` of the uniform.
    normal: Option<(f64, f64)>,
}

impl Marginal {
    /// Of a factor between these side constraints, as members are drawn by this kind: see [`SamplingKind`].
    pub fn new(nominal: f64, (low, high): (f64, f64), kind: SamplingKind) -> Self {
        let centre = nominal.max(low).min(high);
        let deviation = (high - low) / 4.0;
        let share =
            |value: f64| if deviation > 0.0 { Normal::standard().cdf((value - centre) / deviation) } else { 0.5 };
        let normal = (kind != SamplingKind::Uniform).then(|| (share(low), share(high) - share(low)));
        Self { nominal, centre, deviation, low, high, normal }
    }

    /// The value below which a share of all draws lies.
    pub fn value(&self, share: f64) -> f64 {
        let value = match self.normal {
            Some((below, inside)) => {
                self.centre + self.deviation * Normal::standard().inverse_cdf(below + share * inside)
            }
            None => self.low + share * (self.high - self.low),
        };
        // Rounding may carry a draw past the bound by a unit in the last place.
        value.max(self.low).min(self.high)
    }

    /// The share of all draws that lie below a value; a half where the factor is fixed.
    pub fn share(&self, value: f64) -> f64 {
        if self.is_fixed() {
            return 0.5;
        }
        let share = match self.normal {
            Some((below, inside)) => (Normal::standard().cdf((value - self.centre) / self.deviation) - below) / inside,
            None => (value - self.low) / (self.high - self.low),
        };
        share.clamp(0.0, 1.0)
    }

    /// Where a value lies between the side constraints: −1 at the low one, 1 at the high one; zero where the factor is fixed.
    pub fn place(&self, value: f64) -> f64 {
        if self.is_fixed() { 0.0 } else { (2.0 * value - self.low - self.high) / (self.high - self.low) }
    }

    /// Whether nothing lies between the side constraints.
    pub fn is_fixed(&self) -> bool {
        self.high <= self.low
    }
}
