//! Options of a session.

use super::plan_cache::PlanCache;
use crate::kept_work::Checkpoint;
use crate::limits::{THREADS, check_thread_variable};
use crate::march::Precision;
use crate::march::backend_selection::{BackendKind, BackendOptions};
use crate::march::cpu::InstructionSet;
use crate::march::monitor::{CancelToken, Monitor, Progress, ProgressCallback};
use crate::question::{InputError, check_limit, is_positive};
use std::time::Instant;

/// Options of a session: backend, accuracy, threads, progress and cancellation.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Options {
    /// Backend, precision and device. Every instruction set of the CPU gives the same results, to the last bit.
    pub march: BackendOptions,
    /// Discretisation error for which cells and time steps are chosen, K; `None`: that of the case.
    pub tolerance_k: Option<f64>,
    /// Threads of the session's own pool; `None`: the pool of the caller.
    pub threads: Option<usize>,
    /// Called after every batch of members.
    pub progress: Option<ProgressCallback>,
    /// Cancels a study, or the opening of a session, between two batches of members. A stopped sweep answers from the
    /// members that are complete.
    pub cancel: CancelToken,
    /// The time from which a study ends as if it were stopped.
    pub deadline: Option<Instant>,
    /// Where a sweep, a coverage study, a posterior or a sizing keeps its finished work. It goes on from what it finds
    /// there.
    pub checkpoint: Option<Checkpoint>,
    /// Where adapted plans are kept for later sessions; `None`: nowhere. The command and the Python package use
    /// [`PlanCache::of_user`].
    pub plan_cache: Option<PlanCache>,
    /// The command that runs the session, for the record of its results.
    pub command_line: Option<Vec<String>>,
}

impl Options {
    /// The backend: the CPU, a GPU, or the faster of the two.
    #[must_use]
    pub fn backend(mut self, backend: BackendKind) -> Self {
        self.march.backend = backend;
        self
    }

    /// Floating-point precision.
    #[must_use]
    pub fn precision(mut self, precision: Precision) -> Self {
        self.march.precision = Some(precision);
        self
    }

    /// The Vulkan device whose name contains this text.
    #[must_use]
    pub fn device(mut self, device: impl Into<String>) -> Self {
        self.march.device = Some(device.into());
        self
    }

    /// SIMD instruction set of the CPU, one of [`InstructionSet::available`].
    #[must_use]
    pub fn instruction_set(mut self, instruction_set: InstructionSet) -> Self {
        self.march.instruction_set = Some(instruction_set);
        self
    }

    /// Discretisation error for which cells and time steps are chosen, K.
    #[must_use]
    pub fn tolerance_k(mut self, tolerance_k: f64) -> Self {
        self.tolerance_k = Some(tolerance_k);
        self
    }

    /// Number of threads of the session's own pool.
    #[must_use]
    pub fn threads(mut self, threads: usize) -> Self {
        self.threads = Some(threads);
        self
    }

    /// A function that is called after every batch of members, on a thread of the session.
    #[must_use]
    pub fn progress(mut self, report: impl Fn(Progress) + Send + Sync + 'static) -> Self {
        self.progress = Some(ProgressCallback::new(report));
        self
    }

    /// A token that cancels a study between two batches of members.
    #[must_use]
    pub fn cancel(mut self, cancel: &CancelToken) -> Self {
        self.cancel = cancel.clone();
        self
    }

    /// The time from which a study ends as if it were stopped.
    #[must_use]
    pub fn deadline(mut self, deadline: Instant) -> Self {
        self.deadline = Some(deadline);
        self
    }

    /// Where a sweep, a coverage study, a posterior or a sizing keeps its finished work.
    #[must_use]
    pub fn checkpoint(mut self, checkpoint: Checkpoint) -> Self {
        self.checkpoint = Some(checkpoint);
        self
    }

    /// Where adapted plans are kept for later sessions.
    #[must_use]
    pub fn plan_cache(mut self, cache: PlanCache) -> Self {
        self.plan_cache = Some(cache);
        self
    }

    /// The command that runs the session, with its arguments. Reports record it.
    #[must_use]
    pub fn command_line(mut self, words: impl IntoIterator<Item = String>) -> Self {
        self.command_line = Some(words.into_iter().collect());
        self
    }

    pub(super) fn check(&self) -> Result<(), InputError> {
        if let (BackendKind::Cpu, Some(device)) = (self.march.backend, &self.march.device) {
            let message = format!(" {device:?}: the backend is the CPU; expected no device, or another backend");
            return Err(InputError::for_option("device", message));
        }
        let is_on_device = self.march.backend == BackendKind::Gpu || self.march.device.is_some();
        if let (true, Some(set)) = (is_on_device, self.march.instruction_set) {
            let message = format!(" {:?}: that of the CPU, which a GPU does not use", set.name());
            return Err(InputError::for_option("instruction_set", message));
        }
        if let Some(tolerance_k) = self.tolerance_k.filter(|tolerance_k| !is_positive(*tolerance_k)) {
            let message = format!(" {tolerance_k}: expected a temperature difference above 0 K");
            return Err(InputError::for_option("tolerance_k", message));
        }
        if self.threads == Some(0) {
            return Err(InputError::for_option("threads", " 0: expected at least 1"));
        }
        if self.threads.is_none() {
            check_thread_variable().map_err(InputError::general)?;
        }
        check_limit(&THREADS, self.threads.unwrap_or(1) as f64, "threads")
    }

    pub(super) fn monitor(&self) -> Monitor {
        Monitor::new(self.progress.clone(), self.cancel.clone(), self.deadline)
    }
}
