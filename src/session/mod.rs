//! The entry point of the library: a session adapts the grid to a case once and runs any number of studies of it.
//!
//! A session gives the numbers of the command, to the last bit: cells and time steps are chosen for the case's
//! tolerance, and every march is Richardson-extrapolated from two resolutions. The command itself uses sessions.
//!
//! See the [crate] for an example.

#[cfg(feature = "report")]
mod answers;
#[cfg(feature = "serde")]
mod checkpoint;
mod design;
mod error;
#[cfg(feature = "serde")]
mod log_parts;
#[cfg(feature = "serde")]
mod merge;
mod open_march;
mod options;
#[cfg(feature = "serde")]
mod plan_cache;
mod running_study;
mod selection;
#[cfg(feature = "serde")]
mod sweep_merger;
mod trade;
mod until;

pub use crate::march::backend_selection::BackendKind;
pub use crate::march::cpu::InstructionSet;
pub use crate::march::monitor::{CancelToken, Progress, ProgressCallback};
pub use crate::study::answers::Answers;
#[cfg(feature = "serde")]
pub use crate::study::log_part::LogPart;
#[cfg(feature = "serde")]
pub use checkpoint::{Checkpoint, KeptWork};
pub use error::{InputError, SessionError};
#[cfg(feature = "serde")]
pub use merge::{MissingMembers, merge, missing_members};
pub use options::{
    Derivatives, DesignOptions, EstimateOptions, FitOptions, HistoryOptions, ObservationSelection, Options, PlyChoice,
    SensitivityOptions, SizeOptions, Start, StudyOptions, TradeOptions, TwinOptions, TwinStudyOptions,
    UncertaintyOptions,
};
#[cfg(feature = "serde")]
pub use plan_cache::PlanCache;
#[cfg(feature = "serde")]
pub use sweep_merger::SweepMerger;

use crate::adapt::adapt_monitored;
use crate::case::{Bounds, Case};
use crate::ensemble::Ensemble;
use crate::march::monitor::Monitor;
use crate::march::{Backend, March, MarchError, Precision};
use crate::plan::{ErrorEstimate, Plan};
#[cfg(feature = "report")]
use crate::report::files::OutputFolder;
#[cfg(feature = "serde")]
use crate::study::coverage_study;
use crate::study::coverage_study::CoverageStudy;
use crate::study::depth_profiles::ProfileInstants;
use crate::study::estimate::{ParameterEstimates, SearchOptions};
use crate::study::flux_inversion::{FluxInversion, invert_flux};
use crate::study::nominal::Prediction;
use crate::study::observation_check::{ObservationCheck, check_observations};
use crate::study::run_record::RunRecord;
use crate::study::sensitivity::Sensitivity;
#[cfg(feature = "serde")]
use crate::study::size::{LOG_COLUMNS, SizeError};
use crate::study::size::{Sizing, size_from};
use crate::study::timing::Timing;
use crate::study::twin::{SyntheticData, twin};
use crate::study::uncertainty::{SweepStatistics, Uncertainty, failure_reason};
use crate::study::work_log::{NoLog, WorkLog};
use crate::traces::Traces;
#[cfg(feature = "serde")]
use checkpoint::{FITS, MARCHES};
use open_march::{OpenMarch, in_pool};
use rayon::{ThreadPool, ThreadPoolBuilder};
use running_study::RunningStudy;
#[cfg(feature = "serde")]
use running_study::end_of_log;
use std::ops::Range;
#[cfg(feature = "report")]
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
    /// Of the plan; a march in f32 adds its rounding.
    discretisation_error: Option<ErrorEstimate>,
    opening: OpeningTime,
    depth_profiles: Option<ProfileInstants>,
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
        let (marches, depth_profiles, answers) = (Vec::new(), None, None);
        let discretisation_error = plan.error_estimate.clone();
        let mut session =
            Self { case, plan, options, pool, marches, discretisation_error, opening, depth_profiles, answers };
        // A named device that cannot be opened fails here. With `auto`, each study chooses by its number of members.
        session.open_march(1, session.options.precision)?;
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

    /// The profiles through the thickness that [`predict`](Self::predict), [`uncertainty`](Self::uncertainty) and
    /// [`study`](Self::study) add to their answers from now on; `None`: no profiles.
    ///
    /// # Errors
    /// When an instant is outside the exposure, or there are none or too many.
    pub fn set_depth_profiles(&mut self, instants: Option<ProfileInstants>) -> Result<(), SessionError> {
        if let Some(instants) = &instants {
            instants
                .check(&self.case)
                .map_err(|message| InputError::for_option("depth_profiles", format!(": {message}")))?;
        }
        self.depth_profiles = instants;
        Ok(())
    }

    /// Temperatures and heat balance at nominal factors, compared with the observations.
    ///
    /// # Errors
    /// When the device fails or the march is cancelled.
    pub fn predict(&mut self) -> Result<Prediction, SessionError> {
        self.run("predict", self.case.clone(), 1, |study| {
            let found = study.predict(Bounds::Small)?;
            study.depth_profiles(None)?;
            Ok(found)
        })
    }

    /// What was read of the observations: rate, gaps, noise, spikes, channels that are stuck or open, drift before the
    /// start. Nothing is marched and no sample is changed.
    ///
    /// # Errors
    /// When the case has no observations, or the device fails.
    pub fn observations(&mut self) -> Result<ObservationCheck, SessionError> {
        if self.case.observations.is_empty() {
            return Err(InputError::general("the case has no observations").into());
        }
        self.run("observations", self.case.clone(), 1, |study| {
            let found = check_observations(&study.answers.case);
            study.answers.observation_check = Some(found.clone());
            Ok(found)
        })
    }

    /// A Monte Carlo sweep over the factors: percentiles of temperatures, and sensitivity indices of the factors.
    ///
    /// A sweep that is stopped answers from the members that are complete, if there are two: see
    /// [`Uncertainty::is_partial`].
    ///
    /// # Errors
    /// When an option is wrong, the case has no factors, the device fails or the march is cancelled.
    pub fn uncertainty(&mut self, options: &UncertaintyOptions) -> Result<Uncertainty, SessionError> {
        self.uncertainty_with(options, &mut |_, _| {})
    }

    /// [`uncertainty`](Self::uncertainty), with a function that is called with every batch of members.
    ///
    /// # Errors
    /// As [`uncertainty`](Self::uncertainty).
    pub fn uncertainty_with(
        &mut self,
        options: &UncertaintyOptions,
        members: &mut MembersCallback<'_>,
    ) -> Result<Uncertainty, SessionError> {
        options.check(&self.case)?;
        self.run("uncertainty", self.case.clone(), options.members, |study| {
            study.predict(options.bounds)?;
            let found = study.uncertainty(options, members)?;
            if !found.is_partial() {
                study.depth_profiles(Some(options))?;
            }
            Ok(found)
        })
    }

    /// Statistics of a part of the members of a sweep, which can be merged with those of its other parts. They have no
    /// report.
    ///
    /// # Errors
    /// As [`uncertainty`](Self::uncertainty), and when the nominal march fails, as statistics are relative to it.
    pub fn uncertainty_part(
        &mut self,
        options: &UncertaintyOptions,
        part: Range<usize>,
        members: &mut MembersCallback<'_>,
    ) -> Result<SweepPart, SessionError> {
        options.check(&self.case)?;
        if part.is_empty() || part.end > options.members {
            let message = format!(
                " {}..{}: expected a first member before the end, and an end of at most {}",
                part.start, part.end, options.members
            );
            return Err(InputError::for_option("part", message).into());
        }
        let found = self.run("uncertainty", self.case.clone(), options.members, |study| {
            let nominal = study.predict(Bounds::Small)?;
            if let Some(reason) = failure_reason(&study.answers.case, &nominal.status) {
                let message = format!("no statistics without a reference: the nominal march failed: {reason}");
                return Err(InputError::general(message).into());
            }
            let gathered = study.sweep_statistics(options, &nominal, part.clone(), members)?;
            if gathered.members() < part.len() {
                return Err(SessionError::Stopped);
            }
            let run = study.answers.run.clone();
            Ok(SweepPart { nominal, statistics: gathered, backend: study.march.backend(), run })
        });
        self.answers = None;
        found
    }

    /// Derivatives of all temperatures with respect to the factors, and which factors can be estimated together.
    ///
    /// # Errors
    /// When an option is wrong, the case has no factors, the device fails or the march is cancelled.
    pub fn sensitivity(&mut self, options: &SensitivityOptions) -> Result<Sensitivity, SessionError> {
        let case = options.prepared(&self.case)?;
        self.run("sensitivity", case, ESTIMATE_MEMBERS, |study| {
            study.predict(study.answers.case.estimate.bounds)?;
            study.sensitivity(options)
        })
    }

    /// Fit factors to observations by least squares. The posterior and the comparison, if the options include them, are
    /// in [`answers`](Self::answers).
    ///
    /// # Errors
    /// When an option is wrong, there are no factors to estimate or no observations, the device fails or the march is
    /// cancelled. A minimisation that does not converge is no error: see [`ParameterEstimates::converged`].
    pub fn estimate(&mut self, options: &EstimateOptions) -> Result<ParameterEstimates, SessionError> {
        self.estimate_with_log(options, |_, _| Ok(NoLog))
    }

    /// [`estimate`](Self::estimate), with a log of the minimisations.
    fn estimate_with_log<L: WorkLog>(
        &mut self,
        options: &EstimateOptions,
        log: impl FnOnce(&RunningStudy<'_>, &SearchOptions) -> Result<L, SessionError> + Send,
    ) -> Result<ParameterEstimates, SessionError> {
        let prepared = options.prepared(&self.case)?;
        self.run("estimate", prepared.case, ESTIMATE_MEMBERS, |study| {
            study.add_other_cases(prepared.others);
            prepared.comparison.iter().for_each(|case| study.answers.run.add_files(case));
            let found = study.estimate(&options.fit, options.posterior.as_ref(), log)?;
            if let Some(other) = prepared.comparison {
                study.compare(other, &options.fit, &found)?;
            }
            Ok(found)
        })
    }

    /// Prediction, uncertainty and sensitivity, and an estimate if the case has observations and factors for it.
    ///
    /// # Errors
    /// As those studies.
    pub fn study(&mut self, options: &StudyOptions) -> Result<&Answers, SessionError> {
        let (case, not_estimated) = options.prepared(&self.case)?;
        let result = self.run_with_answers("study", case, options.sweep.members, |study| {
            study.predict(options.sweep.bounds)?;
            if study.uncertainty(&options.sweep, &mut |_, _| {})?.is_partial() {
                study.answers.not_estimated = Some("the sweep was stopped".to_owned());
                return Ok(());
            }
            study.depth_profiles(Some(&options.sweep))?;
            study.sensitivity(&SensitivityOptions::default())?;
            if not_estimated.is_none() {
                study.estimate(&options.fit, options.posterior.as_ref(), |_, _| Ok(NoLog))?;
            }
            study.answers.not_estimated = not_estimated;
            Ok(())
        });
        result.map(|((), answers)| answers)
    }

    /// The thickness of a ply that keeps a sensor below a temperature limit.
    ///
    /// # Errors
    /// When an option is wrong, the ply cannot be sized, the device fails or the march is cancelled. If no allowed
    /// thickness suffices, that is no error: see [`Sizing`].
    pub fn size(&mut self, options: &SizeOptions) -> Result<Sizing, SessionError> {
        let (demand, sweep) = (options.requirement(&self.case)?, options.sweep);
        self.run("size", self.case.clone(), sweep.members, |study| {
            study.predict(sweep.bounds)?;
            let draw = sweep.sweep();
            #[cfg(feature = "serde")]
            let mut log = {
                let options = format!("{demand:?}, {draw:?}");
                study.row_keeper(MARCHES, &options, (LOG_COLUMNS, None))?
            };
            #[cfg(not(feature = "serde"))]
            let mut log = NoLog;
            let RunningStudy { march, answers, .. } = study;
            let found = size_from(&answers.case, *march, &demand, &draw, &mut log);
            #[cfg(feature = "serde")]
            answers.run.remarks.extend(end_of_log(log, matches!(found, Err(SizeError::March(_)))));
            let found = found?;
            answers.seed = Some(sweep.seed);
            answers.sizing = Some(found.clone());
            Ok(found)
        })
    }

    /// The heating of the hot face over time, from observations (inverse heat conduction).
    ///
    /// # Errors
    /// When an option is wrong, the case does not have the quantity to estimate, the device fails or the march is
    /// cancelled.
    pub fn history(&mut self, options: &HistoryOptions) -> Result<FluxInversion, SessionError> {
        let case = options.prepared(&self.case)?;
        self.run("history", case, 1, |study| {
            study.predict(Bounds::Small)?;
            let RunningStudy { march, answers, .. } = study;
            let found = invert_flux(&answers.case, *march, &options.request())?;
            answers.flux_inversion = Some(found.clone());
            Ok(found)
        })
    }

    /// One synthetic data set: the readings of the sensors for true values of the factors, with noise. It is computed
    /// in f64 unless the session has a precision, and has no report.
    ///
    /// # Errors
    /// When an option is wrong, the march with the true factors fails, the device fails or the march is cancelled.
    pub fn twin(&mut self, options: &TwinOptions) -> Result<SyntheticData, SessionError> {
        let (truth, case) = (options.true_factors(&self.case)?, self.case.clone());
        let precision = self.options.precision.or(Some(Precision::F64));
        self.with_march(1, precision, |plan, march| {
            Ok(twin(&case, plan, march, truth, options.noise_k, &options.noise())?)
        })
    }

    /// A coverage study: many synthetic data sets with random true factors are fitted, and the 95 % intervals that
    /// contain the truth are counted.
    ///
    /// # Errors
    /// When an option is wrong, there are no factors to estimate, the device fails or the march is cancelled. A fit
    /// that does not converge is counted.
    pub fn twin_study(&mut self, options: &TwinStudyOptions) -> Result<CoverageStudy, SessionError> {
        let case = options.prepared(&self.case)?;
        self.run("twin", case, options.data_sets, |study| {
            let design = options.design(study.march.backend().precision);
            #[cfg(feature = "serde")]
            let mut log = {
                let size = (coverage_study::log_columns(&study.answers.case)?, Some(design.data_sets));
                study.row_keeper(FITS, &format!("{design:?}"), size)?
            };
            #[cfg(not(feature = "serde"))]
            let mut log = NoLog;
            let found = study.coverage(&design, &mut log);
            #[cfg(feature = "serde")]
            {
                let is_complete = found.as_ref().is_ok_and(|found| !found.is_partial());
                study.answers.run.remarks.extend(end_of_log(log, !is_complete));
            }
            found
        })
    }

    /// Write the report of the last study into a folder, as the command does: the page, figures, tables and
    /// `summary.json`. Returns the paths of the files, `summary.json` last.
    ///
    /// # Errors
    /// When the last study failed or the folder cannot be written.
    #[cfg(feature = "report")]
    pub fn report(&self, folder: &OutputFolder) -> Result<Vec<PathBuf>, SessionError> {
        self.answers.as_ref().ok_or_else(nothing_to_report)?.report(folder)
    }

    /// The report of the last study as text for a terminal.
    ///
    /// # Errors
    /// When the last study failed.
    #[cfg(feature = "report")]
    pub fn summary(&self) -> Result<String, SessionError> {
        Ok(self.answers.as_ref().ok_or_else(nothing_to_report)?.summary())
    }

    /// Run a study and store its answers. `auto` chooses the backend by the number of `members`.
    fn run<T: Send>(
        &mut self,
        command: &'static str,
        case: Case,
        members: usize,
        work: impl FnOnce(&mut RunningStudy<'_>) -> Result<T, SessionError> + Send,
    ) -> Result<T, SessionError> {
        self.run_with_answers(command, case, members, work).map(|(answer, _)| answer)
    }

    /// [`run`](Self::run), with all answers of the study.
    fn run_with_answers<T: Send>(
        &mut self,
        command: &'static str,
        case: Case,
        members: usize,
        work: impl FnOnce(&mut RunningStudy<'_>) -> Result<T, SessionError> + Send,
    ) -> Result<(T, &Answers), SessionError> {
        self.answers = None;
        let opening = std::mem::take(&mut self.opening);
        let now = Instant::now();
        let began = now.checked_sub(opening.total).unwrap_or(now);
        let (options, depth_profiles) = (self.options.clone(), self.depth_profiles.clone());
        let (answer, answers) = self.with_march(members, self.options.precision, |plan, march| {
            let start = Instant::now();
            let seconds = Timing { plan_s: opening.plan_s, march_s: 0.0, other_s: 0.0, start: began };
            let backend = march.backend();
            let mut run = RunRecord::new(options.command_line.clone(), &backend, rayon::current_num_threads());
            run.add_files(&case);
            let answers = Answers::new(command, case, backend, seconds, run);
            let mut study = RunningStudy { plan, march, options, depth_profiles, answers };
            let answer = work(&mut study)?;
            let RunningStudy { march, mut answers, .. } = study;
            let (study_s, march_s) = (start.elapsed().as_secs_f64(), march.seconds());
            answers.run.remarks.extend(march.remarks());
            answers.timing = Timing { march_s, other_s: (study_s - march_s).max(0.0), ..seconds };
            Ok((answer, answers))
        })?;
        Ok((answer, self.answers.insert(answers)))
    }
}

/// The plan of a case: kept by an earlier session, or adapted now.
#[cfg(feature = "serde")]
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

#[cfg(not(feature = "serde"))]
fn adapted(case: &Case, _options: &Options, monitor: &Monitor) -> Result<Plan, MarchError> {
    adapt_monitored(case, monitor)
}

/// A case with the tolerance of the session, if it has one.
fn with_tolerance(case: Case, tolerance_k: Option<f64>) -> Case {
    match tolerance_k {
        Some(tolerance_k) => case.with_tolerance_k(tolerance_k),
        None => case,
    }
}

#[cfg(feature = "report")]
fn nothing_to_report() -> SessionError {
    InputError::general("there is nothing to report: no study was run, or the last one failed").into()
}
