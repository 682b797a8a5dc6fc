//! What of a plan goes step by step, and so ends with it.

use super::clock::Clock;
use super::forcing::{Forcing, last_drives};
use super::layout::{Bead, NO_INSTANT};
use super::same_instant::same_instant_s;
use super::{HeldReading, Plan, Rows};
use crate::case::{Case, Exposure};
use std::sync::Arc;

impl Plan {
    /// The same cells, steps and tables up to one of the instants, and so at half of both. Planning a shorter case anew would share
    /// out cells and steps for another error, and tabulate pressures that it does not meet.
    ///
    /// # Panics
    /// When there is no such instant, or it is the start.
    pub fn until(&self, instant: usize) -> Self {
        let readout = self.readout.as_ref().map(|readout| readout.until(instant));
        // A march reads its end without a step after it, which where gas moves differs by microkelvin: that record is to be no reading's.
        let last = readout.as_ref().map_or(instant, |readout| (readout.last() + 1).min(self.records - 1));
        let steps = self.instants.iter().position(|&at| at == last as u32).expect("an instant of the plan");
        let mut drives = self.rows.drives[..4 * steps].to_vec();
        drives.extend(last_drives(&drives));
        Self {
            coarse: self.coarse.as_ref().map(|coarse| Box::new(coarse.until(instant))),
            instants_s: self.instants_s[..=instant].to_vec(),
            times_s: self.times_s[..=steps].to_vec(),
            instants: self.instants[..=steps].to_vec(),
            records: last + 1,
            readout,
            held_readings: self.held_readings.iter().map(|reading| reading.until(instant)).collect(),
            rows: Rows {
                lengths_s: self.rows.lengths_s[..steps].to_vec(),
                beads: self.rows.beads[..steps * self.places.len()].to_vec(),
                drives,
                ..self.rows.clone()
            },
            ..self.clone()
        }
    }

    /// The same cells, steps and tables under another exposure, and so at half of both. Steps land on the corners of the exposure that
    /// the plan was made for; a face that is held must have been held.
    pub fn driven(&self, exposure: &Exposure) -> Self {
        self.forced(&Arc::new(self.forcing.of(exposure)))
    }

    fn forced(&self, forcing: &Arc<Forcing>) -> Self {
        let held = |reading: &HeldReading| HeldReading {
            temperatures_k: forcing.held_k(reading.face, &self.times_s, &self.instants_s),
            ..*reading
        };
        Self {
            coarse: self.coarse.as_ref().map(|coarse| Box::new(coarse.forced(forcing))),
            held_readings: self.held_readings.iter().map(held).collect(),
            forcing: Arc::clone(forcing),
            rows: Rows { drives: forcing.drives(&self.times_s), ..self.rows.clone() },
            ..self.clone()
        }
    }
}

impl HeldReading {
    fn until(&self, instant: usize) -> Self {
        let temperatures_k = self.temperatures_k.as_ref().map(|temperatures_k| temperatures_k[..=instant].to_vec());
        Self { temperatures_k, ..*self }
    }
}

/// The instant at the start of each step and at the end of the last.
pub(super) fn instants(clock: &Clock) -> Vec<u32> {
    let close_s = same_instant_s(clock.times_s.last().copied().unwrap_or_default());
    let mut next = 0;
    clock
        .times_s
        .iter()
        .map(|&time_s| {
            if clock.instants_s.get(next).is_some_and(|&instant_s| instant_s <= time_s + close_s) {
                next += 1;
                next as u32 - 1
            } else {
                NO_INSTANT
            }
        })
        .collect()
}

/// Exact weights of a first-order lag under a reading that moves in a straight line over the step.
pub(super) fn beads(case: &Case, clock: &Clock) -> Vec<Bead<f64>> {
    let mut beads = Vec::with_capacity(clock.times_s.len() * case.sensors.len());
    for step in clock.times_s.windows(2) {
        for sensor in &case.sensors {
            beads.push(if sensor.lag_s > 0.0 {
                let lags = (step[1] - step[0]) / sensor.lag_s;
                let mean = -(-lags).exp_m1() / lags;
                Bead { start: mean - (-lags).exp(), end: 1.0 - mean }
            } else {
                Bead { start: 0.0, end: 1.0 }
            });
        }
    }
    beads
}
