//! Products and ratios of two correlated estimates, which the data determine better than each alone.

use crate::fit::LinearizedPosterior;
use crate::fit::interval::NORMAL_95;
use nalgebra::DVector;

/// The well-determined combination of two highly correlated estimates: their ratio or their product.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Combination {
    /// Indices of the two estimated factors.
    pub pair: (usize, usize),
    /// Correlation of the two estimates.
    pub correlation: f64,
    /// Whether the combination is the ratio of the first to the second (positive correlation) or the product
    /// (negative).
    pub is_ratio: bool,
    /// The value of the ratio or product.
    pub value: f64,
    /// Relative standard error of the value, to first order; NaN where one of the two is not determined.
    pub relative_error: f64,
}

/// Correlation above which two estimates cannot be separated in practice (Beck & Arnold, *Parameter Estimation*, 1977,
/// use 0.9).
const CORRELATION: f64 = 0.95;

impl Combination {
    /// The combinations of all pairs of estimates that cannot be separated.
    pub fn all(values: &[f64], correlation: &[Vec<f64>], found: &LinearizedPosterior) -> Vec<Self> {
        let pairs = (0..values.len()).flat_map(|second| (0..second).map(move |first| (first, second)));
        pairs
            .filter(|&(first, second)| correlation[second][first].abs() > CORRELATION)
            .map(|(first, second)| {
                let correlation = correlation[second][first];
                let is_ratio = correlation > 0.0;
                let (one, other) = (values[first], values[second]);
                // Gradient of the logarithm of the combination.
                let mut gradient = DVector::zeros(values.len());
                gradient[first] = 1.0 / one;
                gradient[second] = if is_ratio { -1.0 / other } else { 1.0 / other };
                let is_known =
                    [first, second].iter().all(|&place| found.covariance_summary.standard_errors[place].is_finite());
                let error = if is_known { found.half_width(&gradient) / NORMAL_95 } else { f64::NAN };
                Self {
                    pair: (first, second),
                    correlation,
                    is_ratio,
                    value: if is_ratio { one / other } else { one * other },
                    relative_error: error,
                }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::NoiseProcess;
    use nalgebra::DMatrix;

    const VALUES: [f64; 2] = [0.5, 2.0];

    /// Residuals in the logarithms of two variables; the data determine their sum or difference `ratio` times
    /// better than the other. White noise of a hundredth of the sum.
    fn judged(sign: f64, ratio: f64) -> (Vec<Vec<f64>>, LinearizedPosterior) {
        let row = |together: f64, apart: f64| [together + apart, sign * (together - apart)];
        let rows =
            DMatrix::from_fn(400, 2, |i, j| row([100.0, 0.0][i % 2], [0.0, 100.0 / ratio][i % 2])[j] / VALUES[j]);
        let signs = DVector::from_fn(400, |i, _| [1.0, 1.0, -1.0, -1.0][i % 4] * [1.0, -1.0, 1.0][i % 3]);
        let noise = NoiseProcess::estimate(&signs, &rows, &[(0..400).map(f64::from).collect()]);
        let found = LinearizedPosterior::new(&rows, &[], 1.0, &noise, &DVector::zeros(400));
        let correlation =
            found.covariance_summary.correlation.row_iter().map(|row| row.iter().copied().collect()).collect();
        (correlation, found)
    }

    #[test]
    fn a_combination_has_the_error_of_its_logarithm() {
        for (sign, is_ratio, value) in [(1.0, false, 1.0), (-1.0, true, 0.25)] {
            let (correlation, judged) = judged(sign, 100.0);
            let errors = judged.standard_errors();
            assert!(errors.iter().zip(VALUES).all(|(error, value)| error / value > 0.03), "{errors:?}");
            let [found] = Combination::all(&VALUES, &correlation, &judged)[..] else { panic!("one pair") };
            assert_eq!((found.pair, found.is_ratio, found.value), ((0, 1), is_ratio, value));
            assert_eq!(found.correlation < 0.0, !is_ratio);
            // 200 residuals of 100 times the logarithm.
            let exact = 0.01 / 200f64.sqrt();
            assert!((0.9..1.3).contains(&(found.relative_error / exact)), "{found:?} for {exact}");
        }
    }

    #[test]
    fn separable_estimates_have_no_combination() {
        let (correlation, found) = judged(1.0, 3.0);
        assert!(correlation[0][1].abs() < 0.95 && Combination::all(&VALUES, &correlation, &found).is_empty());
    }
}
