//! The fit of the data without priors: their noise model, and the scale by which they count beside priors.
//!
//! The scale comes from the data alone. Were it taken from residuals of a fit with priors, data that priors draw the estimate away from
//! would scatter more, count less, and be drawn further.

use crate::case::Case;
use crate::fit::{Fit, LinearizedPosterior, Loss, NoiseProcess, Prior, Tangent};
use crate::plan::Plan;
use crate::study::thermocouples::Sample;
use nalgebra::{DMatrix, DVector};

/// Noise and scale of the data of a fit.
pub(super) struct Likelihood {
    noise: NoiseProcess,
    numerical_error: DVector<f64>,
    loss: Loss,
    /// c, by which squares of straightened residuals are divided; not normal where the data leave no residual to judge by.
    scale: f64,
    /// Mean stiffness of the loss.
    stiffness: f64,
    /// s² of the noise, in squares of the stated deviations.
    pub variance: f64,
    pub effective_samples: f64,
}

impl Likelihood {
    /// From a fit of data alone, the priors that they are to count beside, the numerical error of each residual, and the times of each trace.
    pub(super) fn of(
        fit: &Fit,
        loss: Loss,
        priors: &[Prior],
        numerical_error: DVector<f64>,
        times_s: &[Vec<f64>],
    ) -> Self {
        let (n, p) = fit.jacobian.shape();
        let Tangent { residuals, jacobian } = loss.straightened(&fit.residuals, &fit.jacobian);
        let pseudo = loss.pseudo_residuals(&residuals, p as f64);
        let noise = NoiseProcess::estimate(&pseudo, &jacobian, times_s);
        let found = LinearizedPosterior::new(&jacobian, &[], 1.0, &noise, &numerical_error);
        let (strength, effective_samples) = found.strength();
        // A fit takes p directions in which the noise is `strength` times as strong, though never more than half of the noise.
        let left = (n as f64 - p as f64 * strength).max(n as f64 / 2.0);
        Self {
            scale: LinearizedPosterior::objective_scale(&jacobian, priors, &noise, &numerical_error),
            stiffness: loss.mean_stiffness(&residuals),
            variance: pseudo.norm_squared() / left,
            effective_samples,
            noise,
            numerical_error,
            loss,
        }
    }

    /// By how much the stated deviations are too small for what is minimised, `√(c ψ̄′)`.
    pub(super) fn inflation(&self) -> f64 {
        (self.scale * self.stiffness).sqrt()
    }

    /// The weight of the data's residuals: one over the inflation, or one where there is nothing to judge by.
    pub(super) fn weight(&self) -> f64 {
        let weight = 1.0 / self.inflation();
        if weight.is_normal() { weight } else { 1.0 }
    }

    /// The data's tangent at the end of a fit whose data counted by a weight, straightened.
    pub(super) fn tangent(&self, fit: &Fit, weight: f64, samples: usize) -> Tangent {
        let residuals = fit.residuals.rows(0, samples) / weight;
        let jacobian = fit.jacobian.rows(0, samples) / weight;
        self.loss.straightened(&residuals, &jacobian)
    }

    /// Data and priors to first order about the end of a fit.
    pub(super) fn linearized(&self, tangent: &Tangent, priors: &[Prior]) -> LinearizedPosterior {
        LinearizedPosterior::new(&tangent.jacobian, priors, self.unit(), &self.noise, &self.numerical_error)
    }

    /// c, or one where there is nothing to judge by.
    pub(super) fn unit(&self) -> f64 {
        if self.scale.is_normal() { self.scale } else { 1.0 }
    }

    /// Correlation time and white share of the most probable noise.
    pub(super) fn memory(&self) -> (f64, f64) {
        let mode = self.noise.mode();
        (mode.correlation_time, mode.white_share)
    }
}

/// Effects of a factor over all of its bounds that no reading shows, K.
const NO_EFFECT_K: f64 = 1e-4;

/// Whether weighted data change with each factor between its bounds.
pub(super) fn has_effect(jacobian: &DMatrix<f64>, samples: &[Sample], bounds: &[(f64, f64)]) -> Vec<bool> {
    let rms_k = |column: usize| {
        let squares = samples.iter().enumerate().map(|(i, s)| (jacobian[(i, column)] * s.sigma_k).powi(2));
        (squares.sum::<f64>() / samples.len() as f64).sqrt()
    };
    bounds.iter().enumerate().map(|(column, (low, high))| rms_k(column) * (high - low) > NO_EFFECT_K).collect()
}

/// Derivatives of the data over those of the priors, these times the root of a variance, which is then that of all.
pub(super) fn with_priors(jacobian: &DMatrix<f64>, priors: &[Prior], variance: f64) -> DMatrix<f64> {
    let samples = jacobian.nrows();
    let mut stacked = jacobian.clone().resize_vertically(samples + priors.len(), 0.0);
    for (place, prior) in priors.iter().enumerate() {
        stacked[(samples + place, prior.variable)] = variance.sqrt() / prior.deviation;
    }
    stacked
}

/// The instants of the samples of each trace of each case.
pub(super) fn times_s(runs: &[(&Case, &Plan)], observed: &[Vec<Vec<Sample>>]) -> Vec<Vec<f64>> {
    let of_case = |((_, plan), traces): (&(&Case, &Plan), &Vec<Vec<Sample>>)| -> Vec<Vec<f64>> {
        traces.iter().map(|trace| trace.iter().map(|sample| plan.instants_s[sample.instant]).collect()).collect()
    };
    runs.iter().zip(observed).flat_map(of_case).collect()
}
