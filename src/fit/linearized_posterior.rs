//! The posterior of variables to first order: covariance of least squares with priors, under a noise model and with numerical error.
//!
//! What is minimised is `|r|²/c + |priors|²`. Its Hessian is `2H`, `H = JᵀJ/c + Λ`, and errors e of the data and errors of the priors
//! move the minimum by `H⁻¹ (Jᵀe/c + …)`. So a number that changes by g with the variables has the variance
//!
//! ```text
//! uᵀ (JᵀΣJ s²/c² + Λ) u + (uᵀ Jᵀd/c)²,   u = H⁻¹ g
//! ```
//!
//! The first term is the sandwich covariance under the noise model; the last one is the numerical error d of the prediction, propagated as
//! an error of the data is. Its size is known and its remainder after extrapolation is not, so that it counts as one standard deviation.

use super::identify::{Certainty, certainty};
use super::interval::NORMAL_95;
use super::noise_model::{NoiseProcess, NoiseSums};
use super::prior::Prior;
use nalgebra::{DMatrix, DVector};

/// Rounds of the search for the scale, and the change of one at which it has settled. Where priors alone decide, it need not settle.
const ROUNDS: usize = 40;
const SETTLED: f64 = 1e-4;

/// Data and priors to first order.
#[derive(Clone, Debug)]
pub struct LinearizedPosterior {
    /// Of the Hessian: the covariance that the objective has by itself, correlations and determined directions.
    pub certainty: Certainty,
    noise: NoiseProcess,
    sums: NoiseSums,
    scale: f64,
    /// Λ, a diagonal.
    precision: DVector<f64>,
    /// Jᵀd/c.
    numerical: DVector<f64>,
}

impl LinearizedPosterior {
    /// From derivatives of the data, straightened where the loss was robust; the priors; c; the noise model; and the numerical error of each
    /// residual.
    pub fn new(
        data: &DMatrix<f64>,
        priors: &[Prior],
        scale: f64,
        noise: &NoiseProcess,
        numerical_error: &DVector<f64>,
    ) -> Self {
        let (samples, variables) = data.shape();
        let mut stacked = data.clone().resize_vertically(samples + priors.len(), 0.0) / scale.sqrt();
        let mut precision = DVector::zeros(variables);
        for (place, prior) in priors.iter().enumerate() {
            stacked[(samples + place, prior.variable)] = 1.0 / prior.deviation;
            precision[prior.variable] += prior.deviation.powi(-2);
        }
        Self {
            certainty: certainty(&stacked, 1.0),
            sums: noise.sums(data),
            noise: noise.clone(),
            scale,
            precision,
            numerical: data.tr_mul(numerical_error) / scale,
        }
    }

    /// The ratio of the variances of the intervals to those of the objective by itself, averaged over the variables. Not a number where
    /// nothing is determined.
    fn width_ratio(&self) -> f64 {
        let determined = (0..self.precision.len()).filter(|&j| self.certainty.standard_errors[j].is_finite());
        let ratios: Vec<f64> = determined
            .map(|j| (self.half_width(&self.unit(j)) / NORMAL_95).powi(2) / self.certainty.covariance[(j, j)])
            .collect();
        ratios.iter().sum::<f64>() / ratios.len() as f64
    }

    /// The scale c with which the objective of data and priors is by itself as wide as the intervals are, so that estimate, profile and
    /// posterior are of one objective. Not normal where the data leave nothing to judge by.
    pub fn objective_scale(
        data: &DMatrix<f64>,
        priors: &[Prior],
        noise: &NoiseProcess,
        numerical_error: &DVector<f64>,
    ) -> f64 {
        let mut scale = Self::new(data, &[], 1.0, noise, numerical_error).width_ratio();
        // Without priors the ratio falls as the scale rises, so that the first is the last.
        for _ in 0..if priors.is_empty() { 0 } else { ROUNDS } {
            if !scale.is_normal() {
                break;
            }
            let ratio = Self::new(data, priors, scale, noise, numerical_error).width_ratio();
            scale *= ratio;
            if (ratio - 1.0).abs() < SETTLED {
                break;
            }
        }
        scale
    }

    /// Half the width of the 95 % interval of a number that changes by `gradient` with the variables.
    pub fn half_width(&self, gradient: &DVector<f64>) -> f64 {
        let moved = &self.certainty.covariance * gradient;
        let of_priors = moved.component_mul(&moved).dot(&self.precision);
        let of_noise = self.noise.half_width(&self.sums, &(&moved / self.scale), of_priors);
        of_noise.hypot(NORMAL_95 * moved.dot(&self.numerical))
    }

    /// Half-widths of the variables' 95 % intervals; infinite where they are not determined.
    pub fn half_widths(&self) -> Vec<f64> {
        let of = |j: usize| {
            if self.certainty.standard_errors[j].is_finite() { self.half_width(&self.unit(j)) } else { f64::INFINITY }
        };
        (0..self.precision.len()).map(of).collect()
    }

    /// Standard deviations of the normal distributions that have these intervals.
    pub fn standard_errors(&self) -> Vec<f64> {
        self.half_widths().into_iter().map(|half| half / NORMAL_95).collect()
    }

    /// By how much the numerical error moves each variable.
    pub fn numerical_errors(&self) -> Vec<f64> {
        (&self.certainty.covariance * &self.numerical).iter().map(|moved| moved.abs()).collect()
    }

    /// As [`NoiseProcess::strength`], of data without priors.
    pub fn strength(&self) -> (f64, f64) {
        let unscaled = &self.certainty.covariance / self.scale;
        self.noise.strength(&self.sums, &unscaled, self.certainty.rank)
    }

    fn unit(&self, place: usize) -> DVector<f64> {
        DVector::from_fn(self.precision.len(), |j, _| if j == place { 1.0 } else { 0.0 })
    }
}
