//! Options of a session and of its studies. Every default is that of the command.

mod design;
mod estimate;
mod history;
mod sensitivity;
mod size;
mod study;
mod trade;
mod twin;
mod uncertainty;

pub use design::DesignOptions;
pub(super) use design::checked_noise_k;
pub use estimate::{EstimateOptions, FitOptions, Start};
pub use history::HistoryOptions;
pub use sensitivity::{Derivatives, SensitivityOptions};
pub use size::SizeOptions;
pub use study::StudyOptions;
pub use trade::{PlyChoice, TradeOptions};
pub use twin::{TwinOptions, TwinStudyOptions};
pub use uncertainty::UncertaintyOptions;

use super::error::{InputError, SessionError};
use crate::case::{Bounds, Case};
use crate::limits::{Limit, THREADS, check_thread_variable};
use crate::march::Precision;
use crate::march::backend_selection::{BackendKind, BackendOptions};
use crate::march::cpu::InstructionSet;
use crate::march::monitor::{CancelToken, Monitor, Progress, ProgressCallback};
#[cfg(feature = "serde")]
use crate::session::checkpoint::Checkpoint;
#[cfg(feature = "serde")]
use crate::session::plan_cache::PlanCache;
use std::time::Instant;

/// Options of a session: backend, accuracy, threads, progress and cancellation.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Options {
    /// The default chooses a hardware GPU if there is one and the run is long enough to pay for opening it, otherwise
    /// the CPU.
    pub backend: BackendKind,
    /// `None`: f64 on the CPU, f32 on a GPU.
    pub precision: Option<Precision>,
    /// Part of the name of a Vulkan device.
    pub device: Option<String>,
    /// SIMD instruction set of the CPU; `None`: the widest. Every one gives the same results, to the last bit.
    pub instruction_set: Option<InstructionSet>,
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
    pub until: Option<Instant>,
    /// Where a sweep, a coverage study, a posterior or a sizing keeps its finished work. It goes on from what it finds
    /// there.
    #[cfg(feature = "serde")]
    pub checkpoint: Option<Checkpoint>,
    /// Where adapted plans are kept for later sessions; `None`: nowhere. The command and the Python package use
    /// [`PlanCache::of_user`].
    #[cfg(feature = "serde")]
    pub plan_cache: Option<PlanCache>,
    /// The command that runs the session, for the record of its results.
    pub command_line: Option<Vec<String>>,
}

impl Options {
    /// The backend: the CPU, a GPU, or the faster of the two.
    #[must_use]
    pub fn backend(mut self, backend: BackendKind) -> Self {
        self.backend = backend;
        self
    }

    /// Floating-point precision.
    #[must_use]
    pub fn precision(mut self, precision: Precision) -> Self {
        self.precision = Some(precision);
        self
    }

    /// The Vulkan device whose name contains this text.
    #[must_use]
    pub fn device(mut self, device: impl Into<String>) -> Self {
        self.device = Some(device.into());
        self
    }

    /// SIMD instruction set of the CPU, one of [`InstructionSet::available`].
    #[must_use]
    pub fn instruction_set(mut self, instruction_set: InstructionSet) -> Self {
        self.instruction_set = Some(instruction_set);
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
    pub fn until(mut self, until: Instant) -> Self {
        self.until = Some(until);
        self
    }

    /// Where a sweep, a coverage study, a posterior or a sizing keeps its finished work.
    #[cfg(feature = "serde")]
    #[must_use]
    pub fn checkpoint(mut self, checkpoint: Checkpoint) -> Self {
        self.checkpoint = Some(checkpoint);
        self
    }

    /// Where adapted plans are kept for later sessions.
    #[cfg(feature = "serde")]
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

    pub(super) fn check(&self) -> Result<(), SessionError> {
        if let (BackendKind::Cpu, Some(device)) = (self.backend, &self.device) {
            let message = format!(" {device:?}: the backend is the CPU; expected no device, or another backend");
            return Err(InputError::for_option("device", message).into());
        }
        if let (true, Some(set)) = (self.backend == BackendKind::Gpu || self.device.is_some(), self.instruction_set) {
            let message = format!(" {:?}: that of the CPU, which a GPU does not use", set.name());
            return Err(InputError::for_option("instruction_set", message).into());
        }
        if let Some(tolerance_k) = self.tolerance_k.filter(|tolerance_k| !is_positive(*tolerance_k)) {
            let message = format!(" {tolerance_k}: expected a temperature difference above 0 K");
            return Err(InputError::for_option("tolerance_k", message).into());
        }
        if self.threads == Some(0) {
            return Err(InputError::for_option("threads", " 0: expected at least 1").into());
        }
        if self.threads.is_none() {
            check_thread_variable().map_err(InputError::general)?;
        }
        check_limit(&THREADS, self.threads.unwrap_or(1) as f64, "threads")
    }

    pub(super) fn monitor(&self) -> Monitor {
        Monitor::new(self.progress.clone(), self.cancel.clone(), self.until)
    }

    pub(super) fn choice(&self) -> BackendOptions {
        BackendOptions {
            kind: self.backend,
            precision: self.precision,
            device: self.device.clone(),
            instruction_set: self.instruction_set,
        }
    }
}

/// Refuse a number of an option above its limit.
pub(super) fn check_limit(limit: &Limit, found: f64, option: &'static str) -> Result<(), SessionError> {
    limit.check(found).map_err(|message| InputError::for_option(option, format!(": {message}")).into())
}

/// The observations to use. What is empty or `None` is taken from the case.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObservationSelection {
    /// Names of sensors.
    pub sensors: Vec<String>,
    /// Start and end of the time window of every sensor, s.
    pub window_s: Option<(f64, f64)>,
    /// Bounds of the factors.
    pub bounds: Option<Bounds>,
}

fn is_positive(value: f64) -> bool {
    value.is_finite() && value > 0.0
}

/// One case, with options in place of its own.
fn with_selection(
    case: &Case,
    apply: impl Fn(Vec<Case>) -> Result<Vec<Case>, SessionError>,
) -> Result<Case, SessionError> {
    Ok(apply(vec![case.clone()])?.remove(0))
}
