//! What pairs of estimates determine that neither does alone.

/// Of two estimates that stand in each other's way, what the data do determine: what one gains the other gives in the
/// same proportion, or takes in the inverse one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Combination {
    /// Places among the estimated factors.
    pub pair: (usize, usize),
    /// Of their estimates.
    pub correlation: f64,
    /// The ratio of the first to the second, where they rise together; else their product.
    pub is_ratio: bool,
    pub value: f64,
    /// One standard deviation relative to the value, to first order, of residuals that are independent.
    pub relative_error: f64,
}

/// Two estimates that correlate beyond this cannot be told apart in practice (Beck & Arnold, *Parameter
/// Estimation*, 1977, draw the line at 0.9).
const CORRELATION: f64 = 0.95;

impl Combination {
    /// Of every pair of estimates that cannot be told apart. Where one has no standard error its share cancels no more,
    /// and the combination's is no number.
    pub fn all(values: &[f64], standard_errors: &[f64], correlation: &[Vec<f64>]) -> Vec<Self> {
        let pairs = (0..values.len()).flat_map(|second| (0..second).map(move |first| (first, second)));
        pairs
            .filter(|&(first, second)| correlation[second][first].abs() > CORRELATION)
            .map(|(first, second)| {
                let correlation = correlation[second][first];
                let is_ratio = correlation > 0.0;
                let [a, b] = [first, second].map(|place| standard_errors[place] / values[place]);
                let variance = (a - b).powi(2) + 2.0 * a * b * (1.0 - correlation.abs());
                let (one, other) = (values[first], values[second]);
                Self {
                    pair: (first, second),
                    correlation,
                    is_ratio,
                    value: if is_ratio { one / other } else { one * other },
                    relative_error: variance.sqrt(),
                }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::identify::certainty;
    use nalgebra::DMatrix;

    /// Residuals in the logarithms of two variables, which they know through sum or difference far better than alone.
    fn judged(sign: f64) -> (Vec<f64>, Vec<f64>, Vec<Vec<f64>>) {
        let values = vec![0.5, 2.0];
        let row = |together: f64, apart: f64| [together + apart, sign * (together - apart)];
        let rows = [row(100.0, 0.0), row(0.0, 1.0), row(100.0, 0.0), row(0.0, 1.0)];
        let jacobian = DMatrix::from_fn(4, 2, |i, j| rows[i][j] / values[j]);
        let found = certainty(&jacobian, 1.0);
        let correlation = found.correlation.row_iter().map(|row| row.iter().copied().collect()).collect();
        (values, found.standard_errors, correlation)
    }

    #[test]
    fn what_two_estimates_determine_together_has_the_error_of_its_logarithm() {
        for (sign, is_ratio, value) in [(1.0, false, 1.0), (-1.0, true, 0.25)] {
            let (values, errors, correlation) = judged(sign);
            assert!(errors[0] / values[0] > 0.3 && errors[1] / values[1] > 0.3, "neither is known: {errors:?}");
            let [found] = Combination::all(&values, &errors, &correlation)[..] else { panic!("one pair") };
            assert_eq!((found.pair, found.is_ratio, found.value), ((0, 1), is_ratio, value));
            assert_eq!(found.correlation < 0.0, !is_ratio);
            // Two residuals of 100 times the logarithm: 1/(100 √2).
            assert!((found.relative_error - 0.01 / 2f64.sqrt()).abs() < 1e-9, "{found:?}");
        }
    }

    #[test]
    fn estimates_that_can_be_told_apart_need_no_combination() {
        let found = Combination::all(&[1.0, 1.0], &[0.1, 0.1], &[vec![1.0, 0.9], vec![0.9, 1.0]]);
        assert!(found.is_empty());
    }
}
