//! Likelihood of the data: noise model, and the scale that weights data against priors.
//!
//! The scale comes from a fit without priors. Residuals of a fit with priors would be larger where the priors pull the
//! estimate away from the data, which would lower the weight of the data and pull the estimate further.

use crate::case::Case;
use crate::fit::{Fit, LinearizedPosterior, LinearizedPrior, NoiseProcess, Prior, RobustLoss, Tangent};
use crate::plan::Plan;
use crate::study::thermocouple_residuals::Sample;
use nalgebra::{DMatrix, DVector};

/// Noise model and scale of the data of a fit.
pub(super) struct Likelihood {
    noise: NoiseProcess,
    numerical_error: DVector<f64>,
    loss: RobustLoss,
    /// Scale c that divides squared linearised residuals; not normal where the data leave no residual.
    scale: f64,
    /// Mean stiffness of the loss.
    stiffness: f64,
    /// Variance s² of the noise, in squares of the stated deviations.
    pub variance: f64,
    pub effective_samples: f64,
}

impl Likelihood {
    /// From a fit without priors, the priors, the discretisation error of each residual, and the sample times of each
    /// trace.
    pub(super) fn of(
        fit: &Fit,
        loss: RobustLoss,
        priors: &[Prior],
        numerical_error: DVector<f64>,
        times_s: &[Vec<f64>],
    ) -> Self {
        let (n, p) = fit.jacobian.shape();
        let Tangent { residuals, jacobian } = loss.untransformed(&fit.residuals, &fit.jacobian);
        let pseudo = loss.pseudo_residuals(&residuals, p as f64);
        let noise = NoiseProcess::estimate(&pseudo, &jacobian, times_s);
        let found = LinearizedPosterior::new(&jacobian, &[], 1.0, &noise, &numerical_error);
        let (strength, effective_samples) = found.noise_inflation();
        // A fit removes p directions, in which the noise is `strength` times as strong, but at most half of the
        // noise.
        let left = (n as f64 - p as f64 * strength).max(n as f64 / 2.0);
        let priors = Prior::linearized(priors, &fit.point);
        Self {
            scale: LinearizedPosterior::objective_scale(&jacobian, &priors, &noise, &numerical_error),
            stiffness: loss.mean_influence_derivative(&residuals),
            variance: pseudo.norm_squared() / left,
            effective_samples,
            noise,
            numerical_error,
            loss,
        }
    }

    /// Ratio of the effective to the stated standard deviations in the objective, `√(c ψ̄′)`.
    pub(super) fn noise_inflation(&self) -> f64 {
        (self.scale * self.stiffness).sqrt()
    }

    /// Weight of the data residuals: the inverse of the noise inflation, or one where the data leave no residual.
    pub(super) fn weight(&self) -> f64 {
        let weight = 1.0 / self.noise_inflation();
        if weight.is_normal() { weight } else { 1.0 }
    }

    /// Linearised residuals and Jacobian of the data at the end of a fit with the given weight.
    pub(super) fn tangent(&self, fit: &Fit, weight: f64, samples: usize) -> Tangent {
        let residuals = fit.residuals.rows(0, samples) / weight;
        let jacobian = fit.jacobian.rows(0, samples) / weight;
        self.loss.untransformed(&residuals, &jacobian)
    }

    /// Linearised posterior of data and priors at the end of a fit.
    pub(super) fn linearized(&self, tangent: &Tangent, priors: &[LinearizedPrior]) -> LinearizedPosterior {
        LinearizedPosterior::new(&tangent.jacobian, priors, self.scale_or_one(), &self.noise, &self.numerical_error)
    }

    /// The scale c, or one where the data leave no residual.
    pub(super) fn scale_or_one(&self) -> f64 {
        if self.scale.is_normal() { self.scale } else { 1.0 }
    }

    /// Correlation time and white fraction of the most probable noise model.
    pub(super) fn noise_parameters(&self) -> (f64, f64) {
        let mode = self.noise.mode();
        (mode.correlation_time, mode.white_fraction)
    }

    pub(super) fn correlation_probability(&self) -> f64 {
        self.noise.correlation_probability()
    }
}

/// Effect of a factor over its whole bounds below which the data do not depend on it, K.
const NO_EFFECT_K: f64 = 1e-4;

/// Whether the data depend on each factor, from their weighted Jacobian.
pub(super) fn has_effect(jacobian: &DMatrix<f64>, samples: &[Sample], bounds: &[(f64, f64)]) -> Vec<bool> {
    let rms_k = |column: usize| {
        let squares = samples.iter().enumerate().map(|(i, s)| (jacobian[(i, column)] * s.sigma_k).powi(2));
        (squares.sum::<f64>() / samples.len() as f64).sqrt()
    };
    bounds.iter().enumerate().map(|(column, (low, high))| rms_k(column) * (high - low) > NO_EFFECT_K).collect()
}

/// Jacobian of the data stacked on that of the priors. The prior rows are multiplied by the square root of `variance`,
/// which is then the variance of all rows.
pub(super) fn with_priors(jacobian: &DMatrix<f64>, priors: &[LinearizedPrior], variance: f64) -> DMatrix<f64> {
    let samples = jacobian.nrows();
    let mut stacked = jacobian.clone().resize_vertically(samples + priors.len(), 0.0);
    for (place, prior) in priors.iter().enumerate() {
        stacked[(samples + place, prior.variable)] = variance.sqrt() / prior.deviation;
    }
    stacked
}

/// Sample times of each trace of each case, s.
pub(super) fn sample_times_s(runs: &[(&Case, &Plan)], observed: &[Vec<Vec<Sample>>]) -> Vec<Vec<f64>> {
    let of_case = |((_, plan), traces): (&(&Case, &Plan), &Vec<Vec<Sample>>)| -> Vec<Vec<f64>> {
        traces.iter().map(|trace| trace.iter().map(|sample| plan.instants_s[sample.instant]).collect()).collect()
    };
    runs.iter().zip(observed).flat_map(of_case).collect()
}
