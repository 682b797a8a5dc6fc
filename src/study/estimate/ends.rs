//! Which of several descents ended lowest, and which ends are the same.

use crate::fit::Fit;
use crate::march::Precision;
use crate::study::thermocouples::Sample;

/// The rounding error of a temperature that was marched, K.
fn rounding_k(precision: Precision) -> f64 {
    match precision {
        Precision::F64 => 1e-6,
        Precision::F32 => 1e-3,
    }
}

/// A descent ends within some tolerances of its last step: so many are allowed for.
const STEPS: f64 = 10.0;

/// A difference of objectives that is no difference between minima: what rounding of temperatures and steps below the
/// tolerance make of it. It does not vanish with the residuals, as a share of the objective does where data are free of
/// noise. The samples count by `weight`.
pub(super) fn indistinct(fit: &Fit, samples: &[Sample], precision: Precision, tolerance_step: f64, weight: f64) -> f64 {
    let rounded = samples.iter().map(|sample| (weight * rounding_k(precision) / sample.sigma_k).powi(2)).sum::<f64>();
    let effects = fit.point.iter().zip(fit.jacobian.column_iter());
    let distance: f64 = effects.map(|(value, column)| value.powi(2) * column.norm_squared()).sum();
    rounded + (STEPS * tolerance_step).powi(2) * distance
}

/// The first of those that ended lowest but for what is [`indistinct`]; one that could not be computed is not lower than any.
pub(super) fn lowest(fits: &[Fit], indistinct: impl Fn(&Fit) -> f64) -> usize {
    const ROUNDING: f64 = 1e-6;
    let least = fits.iter().map(|fit| fit.objective).fold(f64::INFINITY, f64::min);
    fits.iter().position(|fit| fit.objective - least <= ROUNDING * least + indistinct(fit)).unwrap_or(0)
}
