//! The effect of the emissivity of a hot face that is held by the readings of a pyrometer.

use super::nominal::Prediction;
use crate::case::{Case, Face, PyrometerDriver, Schedule};
use crate::ensemble::Ensemble;
use crate::march::{March, MarchError};
use crate::plan::Plan;
use crate::random::RandomStream;
use crate::traces::{Peak, Traces};

/// Effect of the standard deviation of the emissivity.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct DriverEmissivity {
    /// The pyrometer.
    pub driver: PyrometerDriver,
    /// Largest change of the prediction with an emissivity lower, and higher, by the standard deviation, K, and its
    /// time, s; one pair per sensor.
    pub changes: Vec<[(f64, f64); 2]>,
    /// Change of the traces of a member of a sweep with the emissivity.
    #[serde(skip)]
    pub(crate) shift: TraceShift,
}

/// The change of all traces with the emissivity by its standard deviation, to first order: half the difference between
/// the marches for a higher and a lower emissivity. It is that of the nominal member; the effects of emissivity and
/// factors are taken to add up.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct TraceShift {
    /// Sensor × instant, K.
    sensors_k: Vec<f64>,
    /// Temperature limit × instant, K.
    limits_k: Vec<f64>,
    /// Peaks of sensors.
    peaks: Vec<Peak>,
    /// Peaks of the parts with temperature limits.
    limited_peaks: Vec<Peak>,
    /// Times above temperature limits, s.
    times_above_s: Vec<f64>,
}

/// Added to the seed of a sweep for the emissivities of its members, so that they are independent of the factors.
const EMISSIVITY_SEED: u64 = 0x656d_6973_7369_7665;

impl TraceShift {
    fn of(lower: &Traces, higher: &Traces) -> Self {
        let half_peaks = |lower: &[Peak], higher: &[Peak]| {
            let half = |(l, h): (&Peak, &Peak)| Peak {
                temperature_k: 0.5 * (h.temperature_k - l.temperature_k),
                time_s: 0.5 * (h.time_s - l.time_s),
            };
            lower.iter().zip(higher).map(half).collect()
        };
        let half = |lower: &[f64], higher: &[f64]| lower.iter().zip(higher).map(|(l, h)| 0.5 * (h - l)).collect();
        Self {
            sensors_k: half(&lower.temperatures_k, &higher.temperatures_k),
            limits_k: half(&lower.limited_k, &higher.limited_k),
            peaks: half_peaks(&lower.peaks, &higher.peaks),
            limited_peaks: half_peaks(&lower.limited_peaks, &higher.limited_peaks),
            times_above_s: half(&lower.times_above_s, &higher.times_above_s),
        }
    }

    /// Change the traces of every member by the change for a standard deviation times a standard normal number, which
    /// depends on the seed of the sweep and the index of the member alone. Times stay within the march.
    pub(crate) fn apply(&self, traces: &mut Traces, seed: u64, end_s: f64) {
        let scores: Vec<f64> = (traces.first..traces.first + traces.members())
            .map(|member| RandomStream::new(seed.wrapping_add(EMISSIVITY_SEED), member as u64).normal())
            .collect();
        for (values_k, change_k) in
            [(&mut traces.temperatures_k, &self.sensors_k), (&mut traces.limited_k, &self.limits_k)]
        {
            for (member_k, score) in values_k.chunks_exact_mut(change_k.len().max(1)).zip(&scores) {
                member_k.iter_mut().zip(change_k).for_each(|(value_k, change_k)| *value_k += score * change_k);
            }
        }
        for (peaks, changes) in [(&mut traces.peaks, &self.peaks), (&mut traces.limited_peaks, &self.limited_peaks)] {
            for (of_member, score) in peaks.chunks_exact_mut(changes.len().max(1)).zip(&scores) {
                for (peak, change) in of_member.iter_mut().zip(changes) {
                    peak.temperature_k += score * change.temperature_k;
                    peak.time_s = (peak.time_s + score * change.time_s).clamp(0.0, end_s);
                }
            }
        }
        for (of_member, score) in traces.times_above_s.chunks_exact_mut(self.times_above_s.len().max(1)).zip(&scores) {
            for (above_s, change_s) in of_member.iter_mut().zip(&self.times_above_s) {
                *above_s = (*above_s + score * change_s).clamp(0.0, end_s);
            }
        }
    }
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
    let mut marched = |face_k: &Schedule| {
        let mut exposure = case.exposure.clone();
        exposure.hot_face = Face::Held(face_k.clone());
        march.march(&plan.with_exposure(&exposure), &Ensemble::nominal(&case.factors), 0..1)
    };
    let [lower, higher] = &driver.face_k;
    let sides = [marched(lower)?, marched(higher)?];
    let mut changes = vec![[(0.0, 0.0); 2]; case.sensors.len()];
    for (side, traces) in sides.iter().enumerate() {
        for (sensor, change) in changes.iter_mut().enumerate() {
            let (difference_k, time_s) = nominal.largest_difference(sensor, traces.trace(0, sensor));
            change[side] = (-difference_k, time_s);
        }
    }
    let shift = TraceShift::of(&sides[0], &sides[1]);
    Ok(Some(DriverEmissivity { driver: driver.clone(), changes, shift }))
}
