//! What of a plan goes step by step, and so ends with it.

use super::clock::{Clock, same_instant_s};
use super::layout::{Bead, Drive, NO_INSTANT};
use super::{Plan, Rows};
use crate::case::{Case, Exposure, Face, Holder, Schedule};

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
            rows: Rows {
                lengths_s: self.rows.lengths_s[..steps].to_vec(),
                beads: self.rows.beads[..steps * self.places.len()].to_vec(),
                drives,
                ..self.rows.clone()
            },
            ..self.clone()
        }
    }

    /// The same cells, steps and tables under another exposure, and so at half of both. Its corners should be those that the plan was
    /// made for, as steps land on no others; and a face that is held must have been held.
    pub fn driven(&self, exposure: &Exposure) -> Self {
        Self {
            coarse: self.coarse.as_ref().map(|coarse| Box::new(coarse.driven(exposure))),
            rows: Rows { drives: drives(exposure, &self.times_s), ..self.rows.clone() },
            ..self.clone()
        }
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

pub(super) fn drives(exposure: &Exposure, times_s: &[f64]) -> Vec<Drive<f64>> {
    let mut drives = Vec::with_capacity(4 * times_s.len());
    let back_pressure_pa = exposure.back_pressure_pa.as_ref().unwrap_or(&exposure.pressure_pa);
    // A step ends on the first of the times that are one instant, which need not be the one that a schedule has.
    let close_s = same_instant_s(exposure.duration_s);
    let sides = [(&exposure.hot_face, &exposure.pressure_pa), (&exposure.back_face, back_pressure_pa)];
    for step in times_s.windows(2) {
        for (face, pressure_pa) in sides {
            let holder = exposure.holder.as_ref();
            drives.push(drive(face, holder, pressure_pa, |schedule| schedule.after_within(step[0], close_s)));
            drives.push(drive(face, holder, pressure_pa, |schedule| schedule.before_within(step[1], close_s)));
        }
    }
    drives.extend(last_drives(&drives));
    drives
}

/// The drives of the end of a march: those at the end of its last step.
fn last_drives(drives: &[Drive<f64>]) -> [Drive<f64>; 4] {
    let [hot, back] = [drives[drives.len() - 3], drives[drives.len() - 1]];
    [hot, hot, back, back]
}

fn drive(face: &Face, holder: Option<&Holder>, pressure_pa: &Schedule, read: impl Fn(&Schedule) -> f64) -> Drive<f64> {
    let holder_k = holder.map_or(0.0, |holder| read(&holder.temperature_k));
    let pressure_pa = read(pressure_pa);
    match face {
        Face::Held(temperature_k) => Drive {
            flux_w_m2: 0.0,
            radiant_w_m2: 0.0,
            gas_k: 0.0,
            surroundings_k: 0.0,
            pressure_pa,
            held_k: read(temperature_k),
            holder_k,
        },
        Face::Open(open) => Drive {
            flux_w_m2: read(&open.flux_w_m2),
            radiant_w_m2: read(&open.radiant_w_m2),
            gas_k: read(&open.gas_k),
            surroundings_k: read(&open.surroundings_k),
            pressure_pa,
            held_k: 0.0,
            holder_k,
        },
    }
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
