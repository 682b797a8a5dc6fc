//! Step-dependent data of a plan: truncation in time, and another exposure.

use super::forcing::{Forcing, final_rows};
use super::time_grid::TimeGrid;
use super::{HeldReading, Plan};
use crate::case::{Case, Exposure};
use crate::physics::layout::{Bead, NO_INSTANT, PlanData, PlanRows};
use std::sync::Arc;

impl Plan {
    /// The same cells, steps and tables up to an instant, at both resolutions. Planning a shorter case anew would
    /// choose other cells and steps, and tabulate other pressures.
    ///
    /// # Panics
    /// When the instant is zero or beyond the last.
    pub fn truncated_at(&self, instant: usize) -> Self {
        let interpolation = self.interpolation.until(instant);
        // The last record of a march has no step after it, which with gas flow changes it by microkelvins: readings
        // must not use it.
        let last = (interpolation.last_record() + 1).min(self.rows.records - 1);
        let steps = self.rows.record_at_step.iter().position(|&at| at == last as u32).expect("a record of the plan");
        let mut forcing = self.rows.data.boundary_forcing[..4 * steps].to_vec();
        forcing.extend(final_rows(&forcing));
        Self {
            coarse: self.coarse.as_ref().map(|coarse| Box::new(coarse.truncated_at(instant))),
            instants_s: self.instants_s[..=instant].to_vec(),
            times_s: self.times_s[..=steps].to_vec(),
            held_readings: self.held_readings.iter().map(|reading| reading.truncated_at(instant)).collect(),
            pyrometers: self.pyrometers.iter().map(|reading| reading.truncated_at(instant, &interpolation)).collect(),
            interpolation,
            rows: PlanRows {
                record_at_step: self.rows.record_at_step[..=steps].to_vec(),
                records: last + 1,
                data: PlanData {
                    step_lengths_s: self.rows.data.step_lengths_s[..steps].to_vec(),
                    beads: self.rows.data.beads[..steps * self.rows.sensor_locations.len()].to_vec(),
                    boundary_forcing: forcing,
                    ..self.rows.data.clone()
                },
                ..self.rows.clone()
            },
            ..self.clone()
        }
    }

    /// The same cells, steps and tables under another exposure, at both resolutions. Steps end on the corners of the
    /// exposure of the original plan; a held face must stay held.
    pub fn with_exposure(&self, exposure: &Exposure) -> Self {
        self.with_forcing(&Arc::new(self.forcing.with_exposure(exposure)), exposure)
    }

    fn with_forcing(&self, forcing: &Arc<Forcing>, exposure: &Exposure) -> Self {
        let under_forcing = |reading: &HeldReading| HeldReading {
            temperatures_k: forcing.held_k(reading.face, &self.times_s, &self.instants_s),
            peak: forcing.highest_held(reading.face),
            ..*reading
        };
        let mut plan = Self {
            coarse: self.coarse.as_ref().map(|coarse| Box::new(coarse.with_forcing(forcing, exposure))),
            held_readings: self.held_readings.iter().map(under_forcing).collect(),
            pyrometers: (self.pyrometers.iter())
                .map(|one| one.with_exposure(exposure, &self.instants_s, &self.interpolation))
                .collect(),
            limits: self.limits.iter().map(|limit| limit.with_forcing(forcing)).collect(),
            forcing: Arc::clone(forcing),
            ..self.clone()
        };
        plan.rows.data.boundary_forcing = forcing.at_step_ends(&self.times_s);
        plan
    }
}

impl HeldReading {
    fn truncated_at(&self, instant: usize) -> Self {
        let temperatures_k = self.temperatures_k.as_ref().map(|temperatures_k| temperatures_k[..=instant].to_vec());
        Self { temperatures_k, ..*self }
    }
}

/// Number of the record at the start of each step and at the end of the last, or `NO_INSTANT`.
pub(super) fn records_at_steps(steps: usize, recorded_steps: &[usize]) -> Vec<u32> {
    let mut records = vec![NO_INSTANT; steps + 1];
    for (record, &step) in recorded_steps.iter().enumerate() {
        records[step] = record as u32;
    }
    records
}

/// Exact weights of a first-order lag (thermocouple bead) for a reading that is linear in time over the step. Readings
/// beyond the sensors of the case have no lag.
pub(super) fn lag_weights(case: &Case, time_grid: &TimeGrid, readings: usize) -> Vec<Bead<f64>> {
    let mut beads = Vec::with_capacity(time_grid.times_s.len() * readings);
    for step in time_grid.times_s.windows(2) {
        let lags_s = case.sensors.iter().map(|sensor| sensor.time_constant_s);
        for time_constant_s in lags_s.chain(std::iter::repeat(0.0)).take(readings) {
            beads.push(if time_constant_s > 0.0 {
                let lags = (step[1] - step[0]) / time_constant_s;
                let mean = -(-lags).exp_m1() / lags;
                Bead { start: mean - (-lags).exp(), end: 1.0 - mean }
            } else {
                Bead { start: 0.0, end: 1.0 }
            });
        }
    }
    beads
}
