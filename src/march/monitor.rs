//! Progress reports, timing and cancellation of marches.

use super::{Backend, March, MarchError, PendingBatch};
use crate::ensemble::Ensemble;
use crate::plan::Plan;
use crate::traces::Traces;
use std::fmt;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Cancels or stops marches from another thread or from a progress callback. Clones share one state. A cancelled or
/// stopped token stays so until it is reset.
#[derive(Clone, Debug, Default)]
pub struct CancelToken {
    cancelled: Arc<AtomicBool>,
    stopped: Arc<AtomicBool>,
}

impl CancelToken {
    /// A token that is not cancelled.
    pub fn new() -> Self {
        Self::default()
    }

    /// Stop the marches that hold this token before their next batch of members.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// As [`cancel`](Self::cancel), but a sweep ends with an answer from the members that are complete.
    pub fn stop(&self) {
        self.stopped.store(true, Ordering::Relaxed);
    }

    /// The flag that [`stop`](Self::stop) sets, for a signal handler.
    pub fn stop_flag(&self) -> Arc<AtomicBool> {
        self.stopped.clone()
    }

    /// Allow marches again.
    pub fn reset(&self) {
        self.cancelled.store(false, Ordering::Relaxed);
        self.stopped.store(false, Ordering::Relaxed);
    }

    /// Whether the token is cancelled.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// # Errors
    /// [`MarchError::Cancelled`] once the token is cancelled, [`MarchError::Stopped`] once it is stopped.
    pub fn check(&self) -> Result<(), MarchError> {
        if self.is_cancelled() {
            return Err(MarchError::Cancelled);
        }
        if self.stopped.load(Ordering::Relaxed) { Err(MarchError::Stopped) } else { Ok(()) }
    }
}

/// Progress of a computation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Progress {
    /// Members marched: of the current sweep if `expected` gives its size, otherwise since the computation began.
    pub marched: usize,
    /// Members of the current sweep; `None` where their number is unknown in advance.
    pub expected: Option<usize>,
}

/// A function that is called with the progress after every batch of members, one call at a time.
#[derive(Clone)]
pub struct ProgressCallback(Arc<dyn Fn(Progress) + Send + Sync>);

impl ProgressCallback {
    /// Calls `report` on a thread that runs the computation.
    pub fn new(report: impl Fn(Progress) + Send + Sync + 'static) -> Self {
        Self(Arc::new(report))
    }
}

impl fmt::Debug for ProgressCallback {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("ProgressCallback")
    }
}

/// Receives the progress of marches and stops them once cancelled. Clones share one state.
#[derive(Clone, Debug, Default)]
pub struct Monitor {
    progress: Option<ProgressCallback>,
    cancel: CancelToken,
    until: Option<Instant>,
}

impl Monitor {
    /// Reports to `progress`, and stops marches once `cancel` is cancelled or stopped, or after `until`.
    pub fn new(progress: Option<ProgressCallback>, cancel: CancelToken, until: Option<Instant>) -> Self {
        Self { progress, cancel, until }
    }

    /// # Errors
    /// [`MarchError::Cancelled`] once the monitor is cancelled, [`MarchError::Stopped`] once it is stopped.
    pub fn check(&self) -> Result<(), MarchError> {
        self.cancel.check()?;
        if self.until.is_some_and(|until| Instant::now() >= until) { Err(MarchError::Stopped) } else { Ok(()) }
    }

    /// The monitor without progress reports, for marches that are not part of a sweep.
    #[must_use]
    pub fn without_progress(&self) -> Self {
        Self { progress: None, ..self.clone() }
    }

    /// Reports progress.
    pub fn report(&self, progress: Progress) {
        if let Some(ProgressCallback(report)) = &self.progress {
            report(progress);
        }
    }
}

/// A march with a monitor.
pub struct MonitoredMarch {
    march: Box<dyn March>,
    monitor: Monitor,
    marched: usize,
    /// Members marched before the current sweep, and the size of the sweep.
    sweep: Option<(usize, usize)>,
    seconds: f64,
    remark: Option<String>,
}

impl MonitoredMarch {
    /// A march that reports to `monitor`.
    pub fn new(march: Box<dyn March>, monitor: Monitor) -> Self {
        Self { march, monitor, marched: 0, sweep: None, seconds: 0.0, remark: None }
    }

    /// The march with a remark on its choice.
    #[must_use]
    pub(crate) fn with_remark(self, remark: Option<String>) -> Self {
        Self { remark, ..self }
    }

    /// Reset the count of members and the time.
    pub fn restart(&mut self) {
        (self.marched, self.sweep, self.seconds) = (0, None, 0.0);
    }

    /// Announce a sweep of `members`.
    pub fn begin_sweep(&mut self, members: usize) {
        self.sweep = Some((self.marched, members));
        self.report();
    }

    /// Time inside the march since the last restart, s.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// March `members`, adding to the time.
    fn timed<T>(
        &mut self,
        members: usize,
        march: impl FnOnce(&mut dyn March) -> Result<T, MarchError>,
    ) -> Result<T, MarchError> {
        self.monitor.check()?;
        let began = Instant::now();
        let marched = march(&mut *self.march);
        self.seconds += began.elapsed().as_secs_f64();
        if marched.is_ok() && members > 0 {
            self.count(members);
        }
        marched
    }

    fn count(&mut self, members: usize) {
        self.marched += members;
        self.report();
        if self.sweep.is_some_and(|(before, size)| self.marched >= before + size) {
            self.sweep = None;
        }
    }

    fn report(&self) {
        self.monitor.report(match self.sweep {
            Some((before, size)) => Progress { marched: self.marched - before, expected: Some(size) },
            None => Progress { marched: self.marched, expected: None },
        });
    }
}

impl March for MonitoredMarch {
    fn backend(&self) -> Backend {
        self.march.backend()
    }

    fn capacity(&self, plan: &Plan) -> usize {
        self.march.capacity(plan)
    }

    fn monitor(&self) -> Monitor {
        self.monitor.clone()
    }

    fn remarks(&self) -> Vec<String> {
        self.remark.iter().cloned().chain(self.march.remarks()).collect()
    }

    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        let count = members.len();
        self.timed(count, |march| march.march(plan, ensemble, members))
    }

    fn begin<'a>(
        &mut self,
        plan: &'a Plan,
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<PendingBatch<'a>, MarchError> {
        self.timed(0, |march| march.begin(plan, ensemble, members))
    }

    fn finish(&mut self, pending: PendingBatch<'_>) -> Result<Traces, MarchError> {
        let traces = self.timed(0, |march| march.finish(pending))?;
        self.count(traces.members());
        Ok(traces)
    }

    fn tangents(&mut self, plan: &Plan, points: &Ensemble, factors: &[usize]) -> Result<Option<Traces>, MarchError> {
        self.timed(points.len(), |march| march.tangents(plan, points, factors))
    }

    fn march_plans(
        &mut self,
        plans: &[&Plan],
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<Vec<Traces>, MarchError> {
        let count = plans.len() * members.len();
        self.timed(count, |march| march.march_plans(plans, ensemble, members))
    }
}
