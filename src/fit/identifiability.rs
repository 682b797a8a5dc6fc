//! Identifiability of variables from a weighted Jacobian.
//!
//! The covariance of the estimates is `s² (JᵀJ)⁻¹ = s² V Σ⁻² Vᵀ` with `J = U Σ Vᵀ` (Beck & Arnold, *Parameter
//! Estimation in Engineering and Science*, 1977). The columns of J are scaled to unit norm first, so only the standard
//! errors depend on the units of the variables.

use nalgebra::{DMatrix, DVector};

/// Singular values below this fraction of the largest count as zero: derivatives are rarely accurate to more than seven
/// digits, and weaker directions consist of their error.
pub const RANK_TOLERANCE: f64 = 1e-7;

/// Components of undetermined directions below this come from the error of the derivatives.
const NEGLIGIBLE_COMPONENT: f64 = 1e-5;

/// Condition number from which an estimate is called ill-conditioned. Belsley, Kuh & Welsch (*Regression
/// Diagnostics*, 1980) call 30 to 100 strong collinearity.
pub(crate) const ILL_CONDITIONED: f64 = 50.0;

/// Covariance, correlation and rank of the variables at a point, to first order.
#[derive(Clone, Debug, PartialEq)]
pub struct CovarianceSummary {
    /// Norms of the Jacobian's columns.
    pub column_norms: Vec<f64>,
    /// One standard deviation of each estimate, in the unit of its variable; infinite where it is not determined.
    pub standard_errors: Vec<f64>,
    /// Correlation of the estimates. An undetermined direction dominates it: two variables that act only through their
    /// product have −1.
    pub correlation: DMatrix<f64>,
    /// Cosines of the angles between the columns of the Jacobian.
    pub column_cosines: DMatrix<f64>,
    /// Ratio of the largest to the smallest singular value of the Jacobian with unit columns.
    pub condition_number: f64,
    /// Number of determined directions.
    pub rank: usize,
    /// Unit vector of the smallest singular value, in variables scaled by `column_norms`.
    pub weakest_direction: DVector<f64>,
    /// `s² (JᵀJ)⁺`: covariance over the determined directions, with the others held.
    pub covariance: DMatrix<f64>,
}

/// Covariance summary of a Jacobian (residual × variable, weighted like the residuals).
///
/// `variance` is that of the residuals: one where they were divided by their true standard deviations, else
/// [`residual_variance`](super::interval::residual_variance). A Jacobian that is not finite determines nothing.
pub fn covariance_summary(jacobian: &DMatrix<f64>, variance: f64) -> CovarianceSummary {
    let n = jacobian.ncols();
    let lengths: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
    if n == 0 || lengths.iter().any(|length| !length.is_finite()) {
        return undetermined(lengths);
    }
    // Zero rows are appended so that there are as many singular values as variables.
    let mut scaled = DMatrix::zeros(jacobian.nrows().max(n), n);
    for j in (0..n).filter(|&j| lengths[j] > 0.0) {
        scaled.view_mut((0, j), (jacobian.nrows(), 1)).copy_from(&(jacobian.column(j) / lengths[j]));
    }
    // R has the singular values and right singular vectors of J in fewer rows. No matrix of this size should reach the
    // iteration limit; without it a failure to converge would not return.
    let decomposed = scaled.qr().r().try_svd(false, true, f64::EPSILON, 10_000);
    let Some((values, directions)) = decomposed.and_then(|svd| Some((svd.singular_values, svd.v_t?))) else {
        return undetermined(lengths);
    };

    let largest = values.iter().copied().fold(0.0, f64::max);
    let floor = RANK_TOLERANCE * largest;
    let rank = values.iter().filter(|&&value| value > floor).count();
    // Σ⁻² with singular values of undetermined directions raised to the floor: they dominate the correlations and stay
    // finite.
    let spread = |i: usize, j: usize| -> f64 {
        let along = |k: usize| directions[(k, i)] * directions[(k, j)] / values[k].max(floor).powi(2);
        (0..n).filter(|_| floor > 0.0).map(along).sum()
    };
    let determined = |j: usize| (rank..n).all(|k| directions[(k, j)].abs() < NEGLIGIBLE_COMPONENT);
    let error = |j: usize| (variance * spread(j, j)).sqrt() / lengths[j];
    let smallest = values.iter().copied().fold(f64::INFINITY, f64::min);
    CovarianceSummary {
        standard_errors: (0..n).map(|j| if determined(j) { error(j) } else { f64::INFINITY }).collect(),
        correlation: DMatrix::from_fn(n, n, |i, j| {
            let both = (spread(i, i) * spread(j, j)).sqrt();
            if i == j {
                1.0
            } else if both > 0.0 {
                (spread(i, j) / both).clamp(-1.0, 1.0)
            } else {
                0.0
            }
        }),
        column_cosines: column_cosines(jacobian, &lengths),
        condition_number: if smallest > 0.0 { largest / smallest } else { f64::INFINITY },
        rank,
        weakest_direction: directions.row(n - 1).transpose(),
        covariance: DMatrix::from_fn(n, n, |i, j| {
            let along = |k: usize| directions[(k, i)] * directions[(k, j)] / values[k].powi(2);
            let both = lengths[i] * lengths[j];
            if both > 0.0 { variance * (0..rank).map(along).sum::<f64>() / both } else { 0.0 }
        }),
        column_norms: lengths,
    }
}

/// The summary where no variable is determined.
fn undetermined(lengths: Vec<f64>) -> CovarianceSummary {
    let n = lengths.len();
    CovarianceSummary {
        standard_errors: vec![f64::INFINITY; n],
        correlation: DMatrix::identity(n, n),
        column_cosines: DMatrix::identity(n, n),
        condition_number: f64::INFINITY,
        rank: 0,
        weakest_direction: DVector::zeros(n),
        covariance: DMatrix::zeros(n, n),
        column_norms: lengths,
    }
}

fn column_cosines(jacobian: &DMatrix<f64>, lengths: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(lengths.len(), lengths.len(), |i, j| {
        let both = lengths[i] * lengths[j];
        if i == j {
            1.0
        } else if both > 0.0 {
            (jacobian.column(i).dot(&jacobian.column(j)) / both).clamp(-1.0, 1.0)
        } else {
            0.0
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Straight line through five points at −2 … 2: independent offset and slope with known standard errors.
    #[test]
    fn offset_and_slope_of_a_centred_line_have_their_textbook_errors() {
        let jacobian = DMatrix::from_fn(5, 2, |i, j| if j == 0 { 1.0 } else { i as f64 - 2.0 });
        let found = covariance_summary(&jacobian, 0.25);
        assert!((found.standard_errors[0] - 0.5 / 5f64.sqrt()).abs() < 1e-14);
        assert!((found.standard_errors[1] - 0.5 / 10f64.sqrt()).abs() < 1e-14);
        assert!(found.correlation[(0, 1)].abs() < 1e-14);
        assert!((found.condition_number - 1.0).abs() < 1e-12);
        assert_eq!(found.rank, 2);
    }

    /// With abscissae 1 … 5 the correlation of offset and slope is −x̄/√(mean x²) = −3/√11.
    #[test]
    fn correlation_of_estimates_opposes_the_alignment_of_two_columns() {
        let jacobian = DMatrix::from_fn(5, 2, |i, j| if j == 0 { 1.0 } else { i as f64 + 1.0 });
        let found = covariance_summary(&jacobian, 1.0);
        assert!((found.correlation[(0, 1)] + 3.0 / 11f64.sqrt()).abs() < 1e-13);
        assert!((found.column_cosines[(0, 1)] - 3.0 / 11f64.sqrt()).abs() < 1e-13);
        let cosine = 3.0 / 11f64.sqrt();
        assert!((found.condition_number - ((1.0 + cosine) / (1.0 - cosine)).sqrt()).abs() < 1e-10);
    }

    #[test]
    fn two_factors_that_act_only_through_their_product_are_undetermined_and_the_third_is_determined() {
        let noise = |i: usize, j: usize| 1e-10 * ((i * 7 + j * 3) % 5) as f64;
        let jacobian = DMatrix::from_fn(40, 3, |i, j| {
            let t = i as f64 / 40.0;
            (if j == 2 { 30.0 * t * t } else { 100.0 * (1.0 - t) }) + noise(i, j)
        });
        let found = covariance_summary(&jacobian, 1.0);
        assert_eq!(found.rank, 2);
        assert!(found.standard_errors[0].is_infinite() && found.standard_errors[1].is_infinite());
        assert!(found.standard_errors[2].is_finite());
        assert!(found.correlation[(0, 1)] < -0.999_999);
        assert!(
            (found.weakest_direction[0].abs() - 0.5f64.sqrt()).abs() < 1e-6 && found.weakest_direction[2].abs() < 1e-6
        );
    }

    #[test]
    fn a_factor_without_effect_is_undetermined_and_does_not_affect_the_others() {
        let jacobian = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 2.0, 0.0, 2.0, 0.0]);
        let found = covariance_summary(&jacobian, 9.0);
        assert_eq!(found.standard_errors, [1.0, f64::INFINITY]);
        assert!((found.rank, found.condition_number) == (1, f64::INFINITY));
        assert_eq!(found.correlation[(0, 1)], 0.0);
    }

    #[test]
    fn too_few_residuals_and_nan_reduce_the_rank() {
        assert_eq!(covariance_summary(&DMatrix::from_row_slice(1, 2, &[1.0, 1.0]), 1.0).rank, 1);
        assert_eq!(covariance_summary(&DMatrix::from_row_slice(2, 1, &[1.0, f64::NAN]), 1.0).rank, 0);
        assert_eq!(covariance_summary(&DMatrix::zeros(3, 0), 1.0).rank, 0);
        assert!(covariance_summary(&DMatrix::zeros(3, 2), 1.0).standard_errors.iter().all(|error| error.is_infinite()));
    }
}
