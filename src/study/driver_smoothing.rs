//! The effect of smoothing the measured temperature of a held face on the prediction.

use super::nominal::Prediction;
use crate::case::{Case, SmoothedDriver};
use crate::ensemble::Ensemble;
use crate::march::{March, MarchError};
use crate::plan::Plan;

/// Effect of smoothing the drivers of a case.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct DriverSmoothing {
    /// The drivers.
    pub drivers: Vec<SmoothedDriver>,
    /// Largest difference between the predictions from the smoothed and from the measured temperatures, K, and its
    /// time, s; one per sensor.
    pub changes: Vec<(f64, f64)>,
}

/// March the case with the temperatures of held faces as measured, and compare with the prediction; `None` if none was
/// smoothed.
///
/// # Errors
/// When the device fails.
pub fn driver_smoothing(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    nominal: &Prediction,
) -> Result<Option<DriverSmoothing>, MarchError> {
    let Some(exposure) = case.measured_exposure() else { return Ok(None) };
    let traces = march.march(&plan.with_exposure(&exposure), &Ensemble::nominal(&case.factors), 0..1)?;
    let change = |sensor: usize| nominal.largest_difference(sensor, traces.trace(0, sensor));
    let changes = (0..case.sensors.len()).map(change).collect();
    Ok(Some(DriverSmoothing { drivers: case.smoothed_drivers().to_vec(), changes }))
}
