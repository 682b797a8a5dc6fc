//! The effect of the emissivity of a hot face that is held by the readings of a pyrometer.

use super::nominal::Prediction;
use crate::case::{Case, Face, PyrometerDriver};
use crate::ensemble::Ensemble;
use crate::march::{March, MarchError};
use crate::plan::Plan;

/// What the standard deviation of the emissivity changes.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct DriverEmissivity {
    /// The pyrometer.
    pub driver: PyrometerDriver,
    /// Largest change of the prediction with an emissivity lower, and higher, by the standard deviation, K, and its
    /// time, s; one pair per sensor.
    pub changes: Vec<[(f64, f64); 2]>,
}

/// March the case with the temperature of the face for a lower and a higher emissivity, and compare with the
/// prediction; `None` if no pyrometer holds the hot face.
///
/// # Errors
/// When the device fails.
pub fn driver_emissivity(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    nominal: &Prediction,
) -> Result<Option<DriverEmissivity>, MarchError> {
    let Some(driver) = case.pyrometer_driver() else { return Ok(None) };
    let mut changes = vec![[(0.0, 0.0); 2]; case.sensors.len()];
    for (side, face_k) in driver.face_k.iter().enumerate() {
        let mut exposure = case.exposure.clone();
        exposure.hot_face = Face::Held(face_k.clone());
        let traces = march.march(&plan.with_exposure(&exposure), &Ensemble::nominal(&case.factors), 0..1)?;
        for (sensor, change) in changes.iter_mut().enumerate() {
            let (difference_k, time_s) = nominal.largest_difference(sensor, traces.trace(0, sensor));
            change[side] = (-difference_k, time_s);
        }
    }
    Ok(Some(DriverEmissivity { driver: driver.clone(), changes }))
}
