//! The linearised posterior of the variables: covariance of least squares with priors, for a noise model and with
//! numerical error.
//!
//! The objective is `|r|²/c + |priors|²`. Its Hessian is `2H`, `H = JᵀJ/c + Λ`, and errors e of the data and errors of
//! the priors move the minimum by `H⁻¹ (Jᵀe/c + …)`. A quantity with gradient g in the variables therefore has the
//! variance
//!
//! ```text
//! uᵀ (JᵀΣJ s²/c² + Λ) u + (uᵀ Jᵀd/c)²,   u = H⁻¹ g
//! ```
//!
//! The first term is the sandwich covariance for the noise model. The last term is the numerical error d of the
//! prediction, propagated like an error of the data. The size of d is known and its remainder after extrapolation is
//! not, so it counts as one standard deviation.

use super::identifiability::{CovarianceSummary, covariance_summary};
use super::interval::NORMAL_95;
use super::noise_model::{NoiseProcess, ScoreCovariances};
use super::prior::LinearizedPrior;
use nalgebra::{DMatrix, DVector};

/// Maximum iterations for the objective scale, and the relative change at which it has converged. Where priors alone
/// determine the variables, the iteration need not converge.
const MAX_SCALE_ITERATIONS: usize = 40;
const SCALE_TOLERANCE: f64 = 1e-4;

/// The posterior of data and priors to first order.
#[derive(Clone, Debug)]
pub struct LinearizedPosterior {
    /// Inverse Hessian of the objective, with its correlations and determined directions.
    pub covariance_summary: CovarianceSummary,
    noise: NoiseProcess,
    score_covariances: ScoreCovariances,
    scale: f64,
    /// Λ, a diagonal.
    prior_precision: DVector<f64>,
    /// Jᵀd/c.
    numerical_gradient: DVector<f64>,
}

impl LinearizedPosterior {
    /// From the Jacobian of the data (of the untransformed residuals where the loss is robust), the priors, c, the
    /// noise model, and the numerical error of each residual.
    pub fn new(
        data: &DMatrix<f64>,
        priors: &[LinearizedPrior],
        scale: f64,
        noise: &NoiseProcess,
        numerical_error: &DVector<f64>,
    ) -> Self {
        let (samples, variables) = data.shape();
        let mut stacked = data.clone().resize_vertically(samples + priors.len(), 0.0) / scale.sqrt();
        let mut precision = DVector::zeros(variables);
        for (index, prior) in priors.iter().enumerate() {
            stacked[(samples + index, prior.variable)] = 1.0 / prior.deviation;
            precision[prior.variable] += prior.deviation.powi(-2);
        }
        Self {
            covariance_summary: covariance_summary(&stacked, 1.0),
            score_covariances: noise.score_covariances(data),
            noise: noise.clone(),
            scale,
            prior_precision: precision,
            numerical_gradient: data.tr_mul(numerical_error) / scale,
        }
    }

    /// Ratio of the interval variance to the variance of the objective alone, averaged over the variables. NaN where no
    /// variable is determined.
    fn width_ratio(&self) -> f64 {
        let determined =
            (0..self.prior_precision.len()).filter(|&j| self.covariance_summary.standard_errors[j].is_finite());
        let ratios: Vec<f64> = determined
            .map(|j| {
                (self.half_width(&self.unit_vector(j)) / NORMAL_95).powi(2) / self.covariance_summary.covariance[(j, j)]
            })
            .collect();
        ratios.iter().sum::<f64>() / ratios.len() as f64
    }

    /// The scale c for which the objective of data and priors alone is as wide as the intervals, so that estimate,
    /// profile and posterior share one objective. Not normal where the data leave no degrees of freedom.
    pub fn objective_scale(
        data: &DMatrix<f64>,
        priors: &[LinearizedPrior],
        noise: &NoiseProcess,
        numerical_error: &DVector<f64>,
    ) -> f64 {
        let mut scale = Self::new(data, &[], 1.0, noise, numerical_error).width_ratio();
        // Without priors the ratio is inversely proportional to the scale, so the first value is exact.
        for _ in 0..if priors.is_empty() { 0 } else { MAX_SCALE_ITERATIONS } {
            if !scale.is_normal() {
                break;
            }
            let ratio = Self::new(data, priors, scale, noise, numerical_error).width_ratio();
            scale *= ratio;
            if (ratio - 1.0).abs() < SCALE_TOLERANCE {
                break;
            }
        }
        scale
    }

    /// Half-width of the 95 % interval of a quantity with this gradient in the variables.
    pub fn half_width(&self, gradient: &DVector<f64>) -> f64 {
        let moved = &self.covariance_summary.covariance * gradient;
        let prior_variance = moved.component_mul(&moved).dot(&self.prior_precision);
        let noise_half_width = self.noise.half_width(&self.score_covariances, &(&moved / self.scale), prior_variance);
        noise_half_width.hypot(NORMAL_95 * moved.dot(&self.numerical_gradient))
    }

    /// Half-widths of the variables' 95 % intervals; infinite for undetermined variables.
    pub fn half_widths(&self) -> Vec<f64> {
        let half_width = |j: usize| {
            if self.covariance_summary.standard_errors[j].is_finite() {
                self.half_width(&self.unit_vector(j))
            } else {
                f64::INFINITY
            }
        };
        (0..self.prior_precision.len()).map(half_width).collect()
    }

    /// Standard deviations of normal distributions with these intervals.
    pub fn standard_errors(&self) -> Vec<f64> {
        self.half_widths().into_iter().map(|half| half / NORMAL_95).collect()
    }

    /// Shift of each variable due to the numerical error.
    pub fn numerical_errors(&self) -> Vec<f64> {
        (&self.covariance_summary.covariance * &self.numerical_gradient).iter().map(|moved| moved.abs()).collect()
    }

    /// [`NoiseProcess::noise_inflation`] of data without priors.
    pub fn noise_inflation(&self) -> (f64, f64) {
        let unscaled = &self.covariance_summary.covariance / self.scale;
        self.noise.noise_inflation(&self.score_covariances, &unscaled, self.covariance_summary.rank)
    }

    fn unit_vector(&self, index: usize) -> DVector<f64> {
        DVector::from_fn(self.prior_precision.len(), |j, _| if j == index { 1.0 } else { 0.0 })
    }
}
