//! Who carries the ensemble.

pub mod choose;
pub mod cpu;
pub mod extrapolated;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod monitored;
pub mod together;

use crate::ensemble::Ensemble;
use crate::plan::Plan;
use crate::traces::{Arrival, Traces};
use monitored::Monitor;
use std::ops::Range;

/// Arithmetic of a march.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(rename_all = "lowercase"))]
pub enum Precision {
    /// Single precision, with temperatures in two words.
    F32,
    /// Double precision.
    F64,
}

impl Precision {
    /// `f32` or `f64`.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F64 => "f64",
        }
    }
}

/// What carries a march, for the record of a study.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Backend {
    /// The device in words: `AMD EPYC, 2 threads`, `llvmpipe (LLVM 15.0.6, 256 bits)`.
    pub name: String,
    /// `cpu` or `gpu`.
    pub kind: &'static str,
    /// Arithmetic of the march.
    pub precision: Precision,
}

/// Why a march could not be carried out at all.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MarchError {
    /// No device was found.
    #[error("no Vulkan device: {reason}; {remedy}")]
    NoDevice {
        /// What was looked for and not found.
        reason: String,
        /// What to install.
        remedy: String,
    },
    /// The device computes wrongly.
    #[error("device {device:?} failed its self-test {test}: {found}")]
    SelfTest {
        /// Its name.
        device: String,
        /// Which test.
        test: &'static str,
        /// What it computed, and what was expected.
        found: String,
    },
    /// The device ended a loop early.
    #[error("member {member} was cut short at step {step} of {steps}: the device ended a loop early")]
    CutShort {
        /// The first such member.
        member: usize,
        /// The step that it reached.
        step: usize,
        /// The steps of the plan.
        steps: usize,
    },
    /// The plan does not fit a binding of the device.
    #[error("device {device:?} holds {limit} bytes in one binding; {what} need {needed}")]
    TooLarge {
        /// Its name.
        device: String,
        /// The most bytes of one binding.
        limit: u64,
        /// Which rows.
        what: &'static str,
        /// Their bytes.
        needed: u64,
    },
    /// The rows of the plan do not fit together, so a device may not read them.
    #[error(transparent)]
    InconsistentPlan(crate::plan::InconsistentPlan),
    /// The driver reports an error.
    #[error("device {device:?}: {message}")]
    Device {
        /// Its name.
        device: String,
        /// What its driver reports.
        message: String,
    },
    /// The march was cancelled.
    #[error("cancelled")]
    Cancelled,
}

/// Members that are on their way: waits for them, and tells what came of them.
pub type Begun<'a> = Box<dyn FnOnce() -> Result<Traces, MarchError> + 'a>;

/// Carries members of an ensemble through a plan.
pub trait March: Send {
    /// Which device marches, for the record of a study.
    fn backend(&self) -> Backend;
    /// Members it can carry at once.
    fn capacity(&self, plan: &Plan) -> usize;

    /// What sees this march. A study that marches by other means on the way, to adapt cells and steps or to find an
    /// envelope, is seen by it there as well.
    fn monitor(&self) -> Monitor {
        Monitor::default()
    }

    /// Carry `members` of the ensemble through the plan.
    ///
    /// # Errors
    /// When the device fails; a member that runs away is an [`Arrival`], not an error.
    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError>;

    /// Begin to carry `members`; what is handed back is to be [finished](Self::finish). A device marches on by itself meanwhile, so that
    /// its host can prepare the members after these and count those before; whoever marches on the host carries them at once.
    ///
    /// # Errors
    /// As [`march`](Self::march).
    fn begin<'a>(
        &mut self,
        plan: &'a Plan,
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<Begun<'a>, MarchError> {
        let traces = self.march(plan, ensemble, members)?;
        Ok(Box::new(|| Ok(traces)))
    }

    /// Wait for members that were begun.
    ///
    /// # Errors
    /// As [`march`](Self::march).
    fn finish(&mut self, begun: Begun<'_>) -> Result<Traces, MarchError> {
        begun()
    }

    /// Carry members together with how they change by some of their factors: of every point first the member, then for each
    /// of the factors what all that is told of it changes by a unit of the factor, as if that were a member; it arrives as the
    /// member does. `None` from a backend that knows no derivatives.
    ///
    /// # Errors
    /// As [`march`](Self::march).
    fn tangents(&mut self, _plan: &Plan, _points: &Ensemble, _factors: &[usize]) -> Result<Option<Traces>, MarchError> {
        Ok(None)
    }

    /// Carry members through each of several plans, whose schedules differ: what a factor cannot scale. Plans one after another, but for
    /// a backend that has room for more at once.
    ///
    /// # Errors
    /// As [`march`](Self::march).
    fn march_plans(
        &mut self,
        plans: &[&Plan],
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<Vec<Traces>, MarchError> {
        plans.iter().map(|plan| self.march(plan, ensemble, members.clone())).collect()
    }
}

/// Carry a whole ensemble, a capacity at a time and in order; `take` receives each run of members.
///
/// # Errors
/// As [`March::march`].
pub fn march_all(
    march: &mut dyn March,
    plan: &Plan,
    ensemble: &Ensemble,
    take: &mut dyn FnMut(Traces),
) -> Result<(), MarchError> {
    march_some(march, plan, ensemble, 0..ensemble.len(), take)
}

/// Carry some members of an ensemble as [`march_all`] carries all.
///
/// # Errors
/// As [`March::march`].
pub fn march_some(
    march: &mut dyn March,
    plan: &Plan,
    ensemble: &Ensemble,
    members: Range<usize>,
    take: &mut dyn FnMut(Traces),
) -> Result<(), MarchError> {
    let capacity = march.capacity(plan).max(1);
    let mut before = None;
    for first in members.clone().step_by(capacity) {
        // Two runs at a time, so that a device never waits for its host, and no more, so that memory has a bound.
        let begun = march.begin(plan, ensemble, first..(first + capacity).min(members.end))?;
        if let Some(before) = before.replace(begun) {
            take(march.finish(before)?);
        }
    }
    before.map_or(Ok(()), |last| march.finish(last).map(take))
}

/// Readings at the instants of a plan, from records at its steps. Every so many rows there is a member; those between are derivatives.
fn read_out(records: Traces, plan: &Plan, rows_per_member: usize) -> Traces {
    let mut readings = match &plan.readout {
        None => records,
        Some(readout) => {
            let read = |records_of: &[f64]| {
                let mut readings = Vec::with_capacity(records_of.len() / plan.records * readout.instants());
                records_of.chunks_exact(plan.records).for_each(|records| readout.read(records, &mut readings));
                readings
            };
            Traces {
                instants: readout.instants(),
                temperatures_k: read(&records.temperatures_k),
                gauges: read(&records.gauges),
                ..records
            }
        }
    };
    let (sensors, instants) = (readings.sensors, readings.instants);
    for held in &plan.held_readings {
        let Some(held_k) = &held.temperatures_k else { continue };
        let rows = readings.temperatures_k.chunks_exact_mut((sensors * instants).max(1));
        rows.step_by(rows_per_member).for_each(|row| row[held.sensor * instants..][..instants].copy_from_slice(held_k));
    }
    readings
}

/// How a member arrived, from the step on which it strayed and from where its plies have been.
fn arrival(plan: &Plan, strayed: Option<usize>, extremes_k: &[(f64, f64)]) -> Arrival {
    if let Some(step) = strayed {
        return Arrival::Strayed { time_s: plan.times_s[step + 1] };
    }
    for (ply, (&(coldest, hottest), &(low, high))) in extremes_k.iter().zip(&plan.allowed_k).enumerate() {
        if coldest < low || hottest > high {
            let temperature_k = if hottest > high { hottest } else { coldest };
            return Arrival::LeftTable { ply, temperature_k };
        }
    }
    Arrival::Done
}
