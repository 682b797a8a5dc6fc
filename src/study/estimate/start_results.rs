//! The ends of several minimisations: the lowest, and which are equal within tolerance.

use crate::fit::Fit;
use crate::march::Precision;
use crate::study::thermocouple_residuals::Sample;

/// Rounding error of a marched temperature, K.
fn rounding_k(precision: Precision) -> f64 {
    match precision {
        Precision::F64 => 1e-6,
        Precision::F32 => 1e-3,
    }
}

/// A minimisation may end this many step tolerances from the minimum.
const STEP_TOLERANCES: f64 = 10.0;

/// Tolerance for comparing objectives of two minima: rounding of the temperatures, and steps below the tolerance. It
/// does not vanish with the residuals, unlike a fraction of the objective for noise-free data. `weight` multiplies the
/// samples' residuals.
fn objective_tolerance(fit: &Fit, samples: &[Sample], precision: Precision, tolerance_step: f64, weight: f64) -> f64 {
    let rounded = samples.iter().map(|sample| (weight * rounding_k(precision) / sample.sigma_k).powi(2)).sum::<f64>();
    let effects = fit.point.iter().zip(fit.jacobian.column_iter());
    let distance: f64 = effects.map(|(value, column)| value.powi(2) * column.norm_squared()).sum();
    rounded + (STEP_TOLERANCES * tolerance_step).powi(2) * distance
}

/// The end of the minimisation from one start.
pub(super) struct StartEnd {
    /// The start between the bounds.
    pub start: Vec<f64>,
    /// The end.
    pub values: Vec<f64>,
    pub objective: f64,
    /// [`objective_tolerance`] of the end.
    pub tolerance: f64,
    pub converged: bool,
    /// Members marched.
    pub marches: usize,
}

impl StartEnd {
    /// `weight` multiplies the samples' residuals; each point is a member of each of the `cases`.
    pub(super) fn of(
        fit: &Fit,
        samples: &[Sample],
        precision: Precision,
        tolerance_step: f64,
        weight: f64,
        cases: usize,
    ) -> Self {
        Self {
            start: fit.path[0].point.iter().copied().collect(),
            values: fit.point.iter().copied().collect(),
            objective: fit.objective,
            tolerance: objective_tolerance(fit, samples, precision, tolerance_step, weight),
            converged: fit.termination.converged(),
            marches: cases * (fit.evaluations + fit.tangent_evaluations),
        }
    }

    /// Numbers of a row in the log of an estimate of this number of factors.
    pub(super) fn columns(factors: usize) -> usize {
        2 * factors + 4
    }

    pub(super) fn row(&self) -> Vec<f64> {
        let last = [self.objective, self.tolerance, f64::from(u8::from(self.converged)), self.marches as f64];
        self.start.iter().chain(&self.values).copied().chain(last).collect()
    }

    pub(super) fn from_row(row: &[f64], factors: usize) -> Self {
        Self {
            start: row[..factors].to_vec(),
            values: row[factors..2 * factors].to_vec(),
            objective: row[2 * factors],
            tolerance: row[2 * factors + 1],
            converged: row[2 * factors + 2] == 1.0,
            marches: row[2 * factors + 3] as usize,
        }
    }
}

/// Index of the first end whose objective equals the lowest within its tolerance; a NaN objective is never lowest.
pub(super) fn lowest(ends: &[StartEnd]) -> usize {
    const ROUNDING: f64 = 1e-6;
    let least = ends.iter().map(|end| end.objective).fold(f64::INFINITY, f64::min);
    ends.iter().position(|end| end.objective - least <= ROUNDING * least + end.tolerance).unwrap_or(0)
}
