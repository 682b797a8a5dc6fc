//! A number with its 95 % confidence interval, and that of a pair of factors.

/// The 97.5 % quantile of the standard normal distribution.
pub(super) const NORMAL_95: f64 = 1.96;

/// Variance of the influences of members, such that 1.96 standard errors by it are those of Student's t. The sample
/// variance of n numbers of kurtosis κ scatters as one with `2n/(κ − 1)` degrees of freedom (Satterthwaite, Biometrics
/// Bulletin 2, 1946): few where a rare jump has all the influence. The quantile is by its expansion in the inverse of
/// the degrees of freedom (Abramowitz & Stegun, 26.7.5).
pub(super) fn influence_variance(influences: &[f64]) -> f64 {
    let count = influences.len() as f64;
    let centre = influences.iter().sum::<f64>() / count;
    let powers = influences.iter().map(|influence| (influence - centre).powi(2));
    let [squares, fourths] =
        powers.fold([0.0; 2], |[squares, fourths], square| [squares + square, fourths + square * square]);
    if squares <= 0.0 {
        return 0.0;
    }
    let kurtosis = fourths * count / (squares * squares);
    let (inverse_freedom, z) = ((kurtosis - 1.0).max(0.0) / (2.0 * count), NORMAL_95);
    let second = (5.0 * z.powi(4) + 16.0 * z.powi(2) + 3.0) / 96.0;
    let ratio = 1.0 + inverse_freedom * ((z * z + 1.0) / 4.0 + inverse_freedom * second);
    squares / (count - 1.0) * ratio * ratio
}

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

    /// The interval of a number that is at least the number of another interval.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::interval::student_95;

    #[test]
    fn a_rare_influence_has_the_quantile_of_students_t() {
        // One in twenty of 400 members: a kurtosis of 18.05, and 46.9 degrees of freedom.
        let influences: Vec<f64> = (0..400).map(|member| f64::from(u8::from(member % 20 == 0))).collect();
        let (variance, quantile) = (0.05 * 0.95 * 400.0 / 399.0, student_95(800.0 / 17.052_6));
        let found = influence_variance(&influences);
        assert!((NORMAL_95 * found.sqrt() - quantile * f64::sqrt(variance)).abs() < 1e-4, "{found}");
        let even: Vec<f64> = (0..100_000).map(f64::from).collect();
        assert!((influence_variance(&even) / (1e10 / 12.0) - 1.0).abs() < 1e-4);
        assert_eq!(influence_variance(&[2.0; 9]), 0.0);
    }
}
