//! Comparison of the ends of several minimisations: the lowest, and which are equal within tolerance.

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
pub(super) fn objective_tolerance(
    fit: &Fit,
    samples: &[Sample],
    precision: Precision,
    tolerance_step: f64,
    weight: f64,
) -> f64 {
    let rounded = samples.iter().map(|sample| (weight * rounding_k(precision) / sample.sigma_k).powi(2)).sum::<f64>();
    let effects = fit.point.iter().zip(fit.jacobian.column_iter());
    let distance: f64 = effects.map(|(value, column)| value.powi(2) * column.norm_squared()).sum();
    rounded + (STEP_TOLERANCES * tolerance_step).powi(2) * distance
}

/// Index of the first fit whose objective equals the lowest within [`objective_tolerance`]; a NaN objective is never
/// lowest.
pub(super) fn lowest_fit(fits: &[Fit], indistinct: impl Fn(&Fit) -> f64) -> usize {
    const ROUNDING: f64 = 1e-6;
    let least = fits.iter().map(|fit| fit.objective).fold(f64::INFINITY, f64::min);
    fits.iter().position(|fit| fit.objective - least <= ROUNDING * least + indistinct(fit)).unwrap_or(0)
}
