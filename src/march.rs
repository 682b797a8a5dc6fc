//! Backends that march an ensemble through a plan.

pub mod backend_selection;
pub mod batching;
pub mod cpu;
pub mod fallback;
mod gauge_bounds;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod monitor;
mod record_peaks;
pub mod richardson;

use crate::ensemble::Ensemble;
use crate::physics::layout::GasTransport;
use crate::plan::Plan;
use crate::plan::pyrometer_readings::TraceRows;
use crate::traces::{Gauge, MemberStatus, Traces};
use monitor::Monitor;
use rayon::prelude::*;
use record_peaks::RecordPeaks;
use std::ops::Range;

/// Floating-point precision of a march.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "command", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// Single precision.
    ///
    /// Temperatures have two words.
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

/// Description of the backend, for the record of a study.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Backend {
    /// The device: `AMD EPYC, 2 threads`, `llvmpipe (LLVM 15.0.6, 256 bits)`.
    pub name: String,
    /// `cpu`, `gpu`, or `software` for a Vulkan device that runs on the CPU.
    pub kind: &'static str,
    /// The driver of a device, and its version; `None` for the CPU.
    pub driver: Option<String>,
    /// Floating-point precision of the march.
    pub precision: Precision,
}

/// Error of a march as a whole.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MarchError {
    /// No device was found.
    #[error("no Vulkan device: {reason}; {remedy}")]
    NoDevice {
        /// Reason why no device was found.
        reason: String,
        /// How to remedy it.
        remedy: String,
    },
    /// The device computes incorrectly.
    #[error("device {device:?} failed its self-test {test}: {found}")]
    SelfTest {
        /// Name of the device.
        device: String,
        /// Name of the test.
        test: &'static str,
        /// Computed and expected result.
        found: String,
    },
    /// The device ended a loop early.
    #[error("member {member} stopped at step {step} of {steps}: the device terminated a loop early")]
    Incomplete {
        /// The first such member.
        member: usize,
        /// The last step that the member completed.
        step: usize,
        /// Number of steps of the plan.
        steps: usize,
    },
    /// The plan does not fit a binding of the device.
    #[error("device {device:?}: {needed} bytes for {what} exceed the limit of {limit} bytes of one binding")]
    TooLarge {
        /// Name of the device.
        device: String,
        /// Most bytes of one binding.
        limit: u64,
        /// Name of the data.
        what: &'static str,
        /// Size of the data, bytes.
        needed: u64,
    },
    /// The rows of the plan do not fit together, so a device may not read them.
    #[error(transparent)]
    InconsistentPlan(crate::plan::InconsistentPlan),
    /// The driver reports an error.
    #[error("device {device:?}: {message}")]
    Device {
        /// Name of the device.
        device: String,
        /// Message of the driver.
        message: String,
    },
    /// The device has too little free memory, also for one member.
    #[error("device {device:?} is out of memory: close other programs that use it, or use the backend \"cpu\"")]
    OutOfMemory {
        /// Name of the device.
        device: String,
    },
    /// The march was cancelled.
    #[error("cancelled")]
    Cancelled,
    /// The march was stopped by its token or its time limit.
    #[error("stopped before there was an answer")]
    Stopped,
}

impl MarchError {
    /// Whether another backend may succeed: the error is not of the plan and not wanted.
    pub fn is_of_device(&self) -> bool {
        !matches!(self, Self::InconsistentPlan(_) | Self::Cancelled | Self::Stopped)
    }
}

/// A batch in progress: waits for the members and returns their traces.
pub type PendingBatch<'a> = Box<dyn FnOnce() -> Result<Traces, MarchError> + 'a>;

/// A backend, or a wrapper of one, that marches members of an ensemble through a plan.
pub trait March: Send {
    /// Description of the backend, for the record of a study.
    fn backend(&self) -> Backend;
    /// Maximum number of members in one batch.
    fn capacity(&self, plan: &Plan) -> usize;

    /// The monitor of this march. A study that needs other marches, for an adaptation or an envelope, passes it on to
    /// them.
    fn monitor(&self) -> Monitor {
        Monitor::default()
    }

    /// Deviations from the planned run, for the record of a study.
    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }

    /// March `members` of the ensemble through the plan.
    ///
    /// # Errors
    /// When the device fails. A member that diverges is no error but has a [`MemberStatus`].
    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError>;

    /// Start to march `members`; pass the result to [`finish`](Self::finish). A GPU runs asynchronously, so that the
    /// host can prepare the next batch and process the previous one; a CPU backend marches at once.
    ///
    /// # Errors
    /// As [`march`](Self::march).
    fn begin<'a>(
        &mut self,
        plan: &'a Plan,
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<PendingBatch<'a>, MarchError> {
        let traces = self.march(plan, ensemble, members)?;
        Ok(Box::new(|| Ok(traces)))
    }

    /// Wait for a batch.
    ///
    /// # Errors
    /// As [`march`](Self::march).
    fn finish(&mut self, pending: PendingBatch<'_>) -> Result<Traces, MarchError> {
        pending()
    }

    /// March members with their derivatives by some factors (forward-mode tangents). For every point the traces hold
    /// the member, then for each factor a row with the derivative of every output per unit of the factor, with the
    /// status of the member. `None` from a backend without derivatives.
    ///
    /// # Errors
    /// As [`march`](Self::march).
    fn tangents(&mut self, _plan: &Plan, _points: &Ensemble, _factors: &[usize]) -> Result<Option<Traces>, MarchError> {
        Ok(None)
    }

    /// March members through each of several plans with different schedules, which no factor can scale: one plan after
    /// another unless a backend overrides this.
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

/// March a whole ensemble in batches of the backend's capacity, in order; `take` receives the traces of each batch.
///
/// # Errors
/// As [`March::march`].
pub fn march_all(
    march: &mut dyn March,
    plan: &Plan,
    ensemble: &Ensemble,
    take: &mut dyn FnMut(Traces),
) -> Result<(), MarchError> {
    march_members(march, plan, ensemble, 0..ensemble.len(), take)
}

/// March some members of an ensemble as [`march_all`] does.
///
/// # Errors
/// As [`March::march`].
pub fn march_members(
    march: &mut dyn March,
    plan: &Plan,
    ensemble: &Ensemble,
    members: Range<usize>,
    take: &mut dyn FnMut(Traces),
) -> Result<(), MarchError> {
    let capacity = march.capacity(plan).max(1);
    let mut before = None;
    for first in members.clone().step_by(capacity) {
        // Two batches at a time: enough that a GPU never waits for the host, with bounded memory.
        let pending = march.begin(plan, ensemble, first..(first + capacity).min(members.end))?;
        if let Some(before) = before.replace(pending) {
            take(march.finish(before)?);
        }
    }
    before.map_or(Ok(()), |last| march.finish(last).map(take))
}

/// The rows of some members, each followed by its derivatives by `derivatives`.
fn trace_rows(plan: &Plan, ensemble: &Ensemble, members: Range<usize>, derivatives: &[usize]) -> TraceRows {
    let column = plan.rows.face_columns[0].emissivity as usize;
    let factor = |member| if column == 0 { 1.0 } else { ensemble.member(member)[column - 1] };
    let has_pyrometers = !plan.pyrometers.is_empty();
    TraceRows {
        rows_per_member: 1 + derivatives.len(),
        emissivity_factors: if has_pyrometers { members.map(factor).collect() } else { Vec::new() },
        derivative_row: derivatives.iter().position(|&factor| factor + 1 == column).map(|position| position + 1),
    }
}

/// Traces that a task interpolates at least: some ten microseconds.
const TRACES_PER_TASK: usize = 16;

/// Peaks, and readings at the instants of a plan: from records at its steps and the curve between them, prescribed on
/// held faces, and of pyrometers.
fn readings(mut records: Traces, plan: &Plan, rows: &TraceRows) -> Traces {
    read_first_outflows(&mut records, plan);
    let RecordPeaks { peaks, limited_peaks, times_above_s, gauge_peaks } = RecordPeaks::of(&records, plan, rows);
    let (curve, instants) = (&plan.interpolation, plan.interpolation.instant_count());
    let read = |records_of: &[f64]| {
        let mut readings = vec![0.0; records_of.len() / plan.rows.records * instants];
        let traces = records_of.par_chunks_exact(plan.rows.records).zip(readings.par_chunks_exact_mut(instants));
        traces.with_min_len(TRACES_PER_TASK).for_each(|(records, readings)| curve.interpolate(records, readings));
        readings
    };
    let gauge_records = std::mem::take(&mut records.gauges);
    let mut readings = Traces {
        instants,
        temperatures_k: read(&records.temperatures_k),
        gauges: read(&gauge_records),
        peaks,
        limited_peaks,
        times_above_s,
        gauge_peaks,
        ..records
    };
    gauge_bounds::keep_between_records(&mut readings, &gauge_records, plan, rows.rows_per_member);
    let (sensors, instants) = (readings.sensors, readings.instants);
    for held in &plan.held_readings {
        let Some(held_k) = &held.temperatures_k else { continue };
        let members = readings.temperatures_k.chunks_exact_mut((sensors * instants).max(1));
        members
            .step_by(rows.rows_per_member)
            .for_each(|row| row[held.sensor * instants..][..instants].copy_from_slice(held_k));
    }
    plan.read_pyrometers(&mut readings.temperatures_k, rows);
    separate_limits(readings, plan)
}

/// Gas flux at the start and after the first step, from the steps that follow: it is read from the means of two steps.
/// Under Darcy's law the flux starts at zero, as the pressure is uniform.
fn read_first_outflows(records: &mut Traces, plan: &Plan) {
    if plan.rows.gas == Some(GasTransport::Darcy) {
        return;
    }
    let known_s = plan.times_s[2.min(plan.times_s.len() - 1)];
    let gauges = records.gauges.chunks_exact_mut(plan.rows.records);
    let outflows = gauges.skip(Gauge::GasFlux as usize).step_by(Gauge::ALL.len());
    outflows.for_each(|outflow| plan.interpolation.extrapolate_start(known_s, outflow));
}

/// Traces with the readings of temperature limits apart from those of the sensors.
fn separate_limits(readings: Traces, plan: &Plan) -> Traces {
    if plan.limits.is_empty() {
        return readings;
    }
    let (rows, instants) = (readings.sensors, readings.instants);
    let (mut temperatures_k, mut limited_k) = (Vec::new(), Vec::new());
    for member in readings.temperatures_k.chunks_exact((rows * instants).max(1)) {
        temperatures_k.extend_from_slice(&member[..plan.rows.sensors * instants]);
        limited_k.extend(plan.limits.iter().flat_map(|limit| &member[limit.row * instants..][..instants]));
    }
    Traces { sensors: plan.rows.sensors, temperatures_k, limited_k, ..readings }
}

/// Status of a member, from the step on which it diverged, if any, and the temperature range of each ply.
fn member_status(plan: &Plan, diverged: Option<usize>, extremes_k: &[(f64, f64)]) -> MemberStatus {
    if let Some(step) = diverged {
        return MemberStatus::Diverged { time_s: plan.times_s[step + 1] };
    }
    for (ply, (&(coldest, hottest), &(low, high))) in extremes_k.iter().zip(&plan.table_limits_k).enumerate() {
        if coldest < low || hottest > high {
            let temperature_k = if hottest > high { hottest } else { coldest };
            return MemberStatus::OutOfTable { ply, temperature_k };
        }
    }
    MemberStatus::Completed
}
