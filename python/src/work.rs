//! Long work off the interpreter: the thread of the caller watches for signals and reports progress meanwhile.

use bondline::session::{CancelToken, Progress};
use pyo3::prelude::*;
use std::panic::resume_unwind;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

/// Time between two looks at signals.
const INTERVAL: Duration = Duration::from_millis(50);

/// The last progress of some work, and the token that cancels it.
#[derive(Clone, Default)]
pub(crate) struct Watch {
    pub(crate) cancel: CancelToken,
    progress: Arc<Mutex<Option<Progress>>>,
}

impl Watch {
    /// Takes the progress, from any thread.
    pub(crate) fn set(&self, progress: Progress) {
        *self.progress.lock().unwrap_or_else(PoisonError::into_inner) = Some(progress);
    }

    fn take(&self) -> Option<Progress> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Runs `work` without the interpreter. A signal or an exception of `report`, which is called with the members
    /// marched and their number, cancels the work and is raised once it has ended.
    pub(crate) fn run<T: Send>(
        &self,
        py: Python<'_>,
        report: Option<&Bound<'_, PyAny>>,
        work: impl FnOnce() -> T + Send,
    ) -> PyResult<T> {
        thread::scope(|scope| {
            let (ended, end) = channel::<()>();
            let worker = scope.spawn(move || {
                let result = work();
                drop(ended);
                result
            });
            let mut raised = None;
            let mut end = end;
            loop {
                let waited;
                (waited, end) = py.detach(move || (end.recv_timeout(INTERVAL), end));
                let look = || {
                    py.check_signals()?;
                    if let (Some(report), Some(Progress { marched, expected, .. })) = (report, self.take()) {
                        report.call1((marched, expected))?;
                    }
                    Ok(())
                };
                if raised.is_none()
                    && let Err(error) = look()
                {
                    self.cancel.cancel();
                    raised = Some(error);
                }
                if waited != Err(RecvTimeoutError::Timeout) {
                    break;
                }
            }
            let result = py.detach(|| worker.join());
            match raised {
                Some(error) => Err(error),
                None => Ok(result.unwrap_or_else(|panic| resume_unwind(panic))),
            }
        })
    }
}
