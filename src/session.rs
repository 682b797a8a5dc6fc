//! The entry point of the library: a session adapts the grid to a case once and runs any number of studies of it.
//!
//! A session gives the numbers of the command, to the last bit: cells and time steps are chosen for the case's
//! tolerance, and every march is Richardson-extrapolated from two resolutions. The command itself uses sessions.
//!
//! See the [crate] for an example.

mod answers;
mod ask;
mod design;
mod error;
mod log_parts;
mod merge;
mod open_march;
mod options;
mod plan_cache;
mod running_study;
mod sweep_merger;
mod trade;
mod until;

pub use crate::kept_work::log_part::LogPart;
pub use crate::kept_work::sweep_piece::{CaseIdentity, Piece, fingerprint};
pub use crate::kept_work::{Checkpoint, KeptWork};
pub use crate::march::backend_selection::{BackendKind, BackendOptions};
pub use crate::march::cpu::InstructionSet;
pub use crate::march::monitor::{CancelToken, Progress, ProgressCallback};
pub use crate::question::InputError;
pub use crate::study::answers::Answers;
pub use error::SessionError;
pub use merge::{MissingMembers, merge, missing_members};
pub use options::Options;
pub use plan_cache::PlanCache;
pub use sweep_merger::SweepMerger;

use crate::adapt::adapt_monitored;
use crate::case::Case;
use crate::ensemble::Ensemble;
use crate::march::monitor::Monitor;
use crate::march::{Backend, March, MarchError};
use crate::plan::{ErrorEstimate, Plan};
use crate::question::{Question, QuestionRecord, SessionRecord};
use crate::report::files::OutputFolder;
use crate::study::nominal::Prediction;
use crate::study::run_record::RunRecord;
use crate::study::timing::Timing;
use crate::study::uncertainty::SweepStatistics;
use crate::traces::Traces;
use open_march::{OpenMarch, in_pool};
use rayon::{ThreadPool, ThreadPoolBuilder};
use running_study::RunningStudy;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Members per batch of an estimate or of derivatives, by which `auto` chooses the backend.
const ESTIMATE_MEMBERS: usize = 16;

/// Called with each completed batch of members, and the ensemble that it belongs to. If it cancels the token of the
/// session, the sweep ends, and a checkpoint does not take the batch.
pub type MembersCallback<'a> = dyn FnMut(&Ensemble, &Traces) + Send + 'a;

/// A case with its grid, its time steps and its open marches.
pub struct Session {
    case: Case,
    plan: Plan,
    options: Options,
    pool: Option<ThreadPool>,
    marches: Vec<OpenMarch>,
    /// Discretisation error of the plan; a march in f32 adds its rounding.
    discretisation_error: Option<ErrorEstimate>,
    opening: OpeningTime,
    answers: Option<Answers>,
}

/// Time that opening the session took. The first study includes it in its report.
#[derive(Clone, Copy, Default)]
struct OpeningTime {
    total: Duration,
    plan_s: f64,
}

/// Statistics of a part of the members of a sweep, relative to its nominal march.
#[non_exhaustive]
pub struct SweepPart {
    /// The march at nominal factors.
    pub nominal: Prediction,
    /// The statistics.
    pub statistics: SweepStatistics,
    /// The backend that computed them.
    pub backend: Backend,
    /// When, by which command and from which files.
    pub run: RunRecord,
}

impl Session {
    /// Choose cells and time steps for the case, and open a march. Progress counts the members of the adaptation.
    ///
    /// # Errors
    /// When an option is wrong, the adaptation is cancelled or the device cannot be opened.
    pub fn open(case: Case, options: &Options) -> Result<Self, SessionError> {
        let began = Instant::now();
        options.check()?;
        let pool = match options.threads {
            None => None,
            Some(threads) => {
                let pool = ThreadPoolBuilder::new().num_threads(threads).build();
                Some(pool.map_err(|error| InputError::for_option("threads", format!(" {threads}: {error}")))?)
            }
        };
        let case = with_tolerance(case, options.tolerance_k);
        options.cancel.check()?;
        let plan = in_pool(pool.as_ref(), || adapted(&case, options, &options.monitor()))?;
        let plan_s = began.elapsed().as_secs_f64();
        let options = options.clone();
        let opening = OpeningTime::default();
        let (marches, answers) = (Vec::new(), None);
        let discretisation_error = plan.error_estimate.clone();
        let mut session = Self { case, plan, options, pool, marches, discretisation_error, opening, answers };
        // A named device that cannot be opened fails here. With `auto`, each study chooses by its number of members.
        session.open_march(1, session.options.march.precision)?;
        session.opening = OpeningTime { total: began.elapsed(), plan_s };
        Ok(session)
    }

    /// The case as it was opened.
    pub fn case(&self) -> &Case {
        &self.case
    }

    /// Cells, time steps and output instants.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The answers of the last study; `None` after a study that failed.
    pub fn answers(&self) -> Option<&Answers> {
        self.answers.as_ref()
    }

    /// Write the report of the last study into a folder, as the command does: the page, figures, tables and
    /// `summary.json`. Returns the paths of the files, `summary.json` last.
    ///
    /// # Errors
    /// When the last study failed or the folder cannot be written.
    pub fn report(&self, folder: &OutputFolder) -> Result<Vec<PathBuf>, SessionError> {
        self.answers.as_ref().ok_or_else(nothing_to_report)?.report(folder)
    }

    /// The report of the last study as text for a terminal.
    ///
    /// # Errors
    /// When the last study failed.
    pub fn summary(&self) -> Result<String, SessionError> {
        Ok(self.answers.as_ref().ok_or_else(nothing_to_report)?.summary())
    }

    /// Run a study and store its answers. `auto` chooses the backend by the number of `members`.
    fn run<T: Send>(
        &mut self,
        question: &Question,
        case: Case,
        members: usize,
        work: impl FnOnce(&mut RunningStudy<'_>) -> Result<T, SessionError> + Send,
    ) -> Result<T, SessionError> {
        self.answers = None;
        let opening = std::mem::take(&mut self.opening);
        let now = Instant::now();
        let began = now.checked_sub(opening.total).unwrap_or(now);
        let options = self.options.clone();
        let (answer, answers) = self.with_march(members, self.options.march.precision, |plan, march| {
            let start = Instant::now();
            let seconds = Timing { plan_s: opening.plan_s, march_s: 0.0, other_s: 0.0, start: began };
            let backend = march.backend();
            let mut run = RunRecord::new(options.command_line.clone(), &backend, rayon::current_num_threads());
            run.add_files(&case);
            let answers = Answers::new(question.name(), case, backend, seconds, run);
            let mut study = RunningStudy { plan, march, options, answers };
            let answer = work(&mut study).map_err(|error| match (error, study.answers.unusable_reason()) {
                // An input error that a study reports may be due to a nominal march that is worthless.
                (SessionError::Input(_), Some(reason)) => SessionError::Unusable(reason),
                (error, _) => error,
            })?;
            let RunningStudy { march, mut answers, options, .. } = study;
            let (study_s, march_s) = (start.elapsed().as_secs_f64(), march.seconds());
            answers.run.remarks.extend(march.remarks());
            answers.timing = Timing { march_s, other_s: (study_s - march_s).max(0.0), ..seconds };
            let session = SessionRecord::new(&options.march, &answers.backend, options.tolerance_k);
            answers.asked = Some(QuestionRecord::new(question, &answers.case, session, &answers.run));
            Ok((answer, answers))
        })?;
        self.answers = Some(answers);
        Ok(answer)
    }
}

/// The plan of a case: kept by an earlier session, or adapted now.
fn adapted(case: &Case, options: &Options, monitor: &Monitor) -> Result<Plan, MarchError> {
    let cache = options.plan_cache.as_ref().filter(|_| case.resolution.tolerance_k.is_some());
    if let Some(plan) = cache.and_then(|cache| cache.find(case)) {
        return Ok(plan);
    }
    let plan = adapt_monitored(case, monitor)?;
    if let Some(cache) = cache {
        cache.keep(case, &plan);
    }
    Ok(plan)
}

/// A case with the tolerance of the session, if it has one.
fn with_tolerance(case: Case, tolerance_k: Option<f64>) -> Case {
    match tolerance_k {
        Some(tolerance_k) => case.with_tolerance_k(tolerance_k),
        None => case,
    }
}

fn nothing_to_report() -> SessionError {
    InputError::general("there is nothing to report: no study was run, or the last one failed").into()
}
