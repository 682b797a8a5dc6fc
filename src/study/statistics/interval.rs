//! A number with its 95 % confidence interval, and that of a pair of factors.

/// The 97.5 % quantile of the standard normal distribution.
pub(super) const NORMAL_95: f64 = 1.96;

/// A number with its 95 % confidence interval; all NaN where there are too few members.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct ConfidenceInterval {
    /// The estimate.
    pub value: f64,
    /// The lower end of its 95 % interval.
    pub low: f64,
    /// The upper end of its 95 % interval.
    pub high: f64,
}

/// Second-order Sobol index: fraction of the variance from the interaction of two factors.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct PairIndex {
    /// Indices of the factors, the lower first.
    pub factors: (usize, usize),
    /// The index.
    pub index: ConfidenceInterval,
}

impl ConfidenceInterval {
    pub(super) const UNKNOWN: Self = Self { value: f64::NAN, low: f64::NAN, high: f64::NAN };
    pub(super) const ZERO: Self = Self { value: 0.0, low: 0.0, high: 0.0 };

    /// That of a number which is at least the one of another interval.
    pub(super) fn or_above(self, other: Self) -> Self {
        let Self { value, low, high } = self;
        Self { value: value.max(other.value), low: low.max(other.low), high: high.max(other.high) }
    }

    /// A correlation with `free` degrees of freedom: Fisher's transform, with the variance `scatter/(free − 3)`.
    pub(super) fn correlation(value: f64, free: f64, scatter: f64) -> Self {
        if value.is_nan() {
            return Self::UNKNOWN;
        }
        if free <= 3.0 {
            return Self { value, low: -1.0, high: 1.0 };
        }
        let reach = NORMAL_95 * (scatter / (free - 3.0)).sqrt();
        Self { value, low: (value.atanh() - reach).tanh(), high: (value.atanh() + reach).tanh() }
    }
}
