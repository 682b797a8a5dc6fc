//! One case, adapted once and asked many questions: the entry point of the library.
//!
//! A session gives the numbers of the command, to the last bit: cells and time steps adapted to the case's tolerance,
//! every march extrapolated from two resolutions. The command itself is made of sessions.
//!
//! See the [crate] for an example.

#[cfg(feature = "report")]
mod answers;
mod error;
#[cfg(feature = "serde")]
mod merge;
mod options;
mod selection;

pub use crate::march::choose::Kind;
pub use crate::march::monitored::{CancelToken, Progress, ProgressCallback};
pub use crate::study::answers::Answers;
pub use error::{InputError, SessionError};
#[cfg(feature = "serde")]
pub use merge::merge;
pub use options::{
    Derivatives, EstimateOptions, FitOptions, HistoryOptions, ObservationSelection, Options, SensitivityOptions,
    SizeOptions, Start, StudyOptions, TwinOptions, TwinStudyOptions, UncertaintyOptions,
};

use crate::case::{Bounds, Case};
use crate::ensemble::Ensemble;
use crate::march::monitored::Monitored;
use crate::march::{Backend, March, Precision, choose, march_all};
use crate::pilot::pilot_monitored;
use crate::plan::Plan;
#[cfg(feature = "report")]
use crate::report::files::OutputFolder;
use crate::study::beside::beside;
use crate::study::estimate::{Estimated, Search, estimate};
use crate::study::history::{History, history};
use crate::study::nominal::{Nominal, nominal};
use crate::study::posterior::{Walkers, posterior};
use crate::study::recovery::{Design, Recovery, recovery};
use crate::study::seconds::Seconds;
use crate::study::sensitivity::{Sensitivity, sensitivity};
use crate::study::size::{Sizing, size};
use crate::study::twin::{Twin, twin};
use crate::study::uncertainty::{Gathered, Uncertainty, reason};
use crate::study::whole_traces::Envelope;
use crate::traces::Traces;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::ops::Range;
#[cfg(feature = "report")]
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// For `auto`, members that an estimate or derivatives march at a time.
const ESTIMATE_MEMBERS: usize = 16;

/// Is shown each batch of members as it arrives, with the ensemble that it belongs to.
pub type MembersCallback<'a> = dyn FnMut(&Ensemble, &Traces) + Send + 'a;

/// A case with its cells, time steps and march.
pub struct Session {
    case: Case,
    plan: Plan,
    options: Options,
    pool: Option<ThreadPool>,
    marches: Vec<Opened>,
    opening: Opening,
    answers: Option<Answers>,
}

/// A march, and for which questions it was opened.
struct Opened {
    precision: Option<Precision>,
    seeks_hardware: bool,
    march: Monitored,
}

/// What opening the session took, until the first question reports it.
#[derive(Clone, Copy, Default)]
struct Opening {
    all: Duration,
    plan_s: f64,
}

/// Statistics of some members of a sweep, about its nominal march.
#[non_exhaustive]
pub struct SweepPart {
    /// The march at nominal factors.
    pub nominal: Nominal,
    /// The statistics.
    pub gathered: Gathered,
    /// What marched.
    pub backend: Backend,
}

impl Session {
    /// Adapt cells and time steps to the case, and open the march. Progress counts the members of the adaptation.
    ///
    /// # Errors
    /// When an option is wrong, the adaptation is cancelled or the device that the options name cannot be opened.
    pub fn open(case: Case, options: &Options) -> Result<Self, SessionError> {
        let began = Instant::now();
        options.check()?;
        let pool = match options.threads {
            None => None,
            Some(threads) => {
                let pool = ThreadPoolBuilder::new().num_threads(threads).build();
                Some(pool.map_err(|error| InputError::of("threads", format!(" {threads}: {error}")))?)
            }
        };
        let case = toleranced(case, options.tolerance_k);
        options.cancel.check()?;
        let plan = in_pool(pool.as_ref(), || pilot_monitored(&case, &options.monitor()))?;
        let plan_s = began.elapsed().as_secs_f64();
        let options = options.clone();
        let opening = Opening::default();
        let mut session = Self { case, plan, options, pool, marches: Vec::new(), opening, answers: None };
        // An explicit device fails here. With `auto`, each question says whether its work is worth a device.
        session.opened(1, session.options.precision)?;
        session.opening = Opening { all: began.elapsed(), plan_s };
        Ok(session)
    }

    /// The case as it was opened.
    pub fn case(&self) -> &Case {
        &self.case
    }

    /// Its cells, time steps and instants.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The answers to the last question; none after a question that failed.
    pub fn answers(&self) -> Option<&Answers> {
        self.answers.as_ref()
    }

    /// March the case at its nominal factors and compare it with its observations.
    ///
    /// # Errors
    /// When the device fails or the march is cancelled.
    pub fn predict(&mut self) -> Result<Nominal, SessionError> {
        self.ask("predict", self.case.clone(), 1, |question| question.predict())
    }

    /// A Monte Carlo sweep over the factors: spreads, and the shares of the factors in them.
    ///
    /// # Errors
    /// When an option is wrong, the case has no factors, the device fails or the march is cancelled.
    pub fn uncertainty(&mut self, options: &UncertaintyOptions) -> Result<Uncertainty, SessionError> {
        self.uncertainty_with(options, &mut |_, _| {})
    }

    /// [`uncertainty`](Self::uncertainty), with a function that is shown every batch of members.
    ///
    /// # Errors
    /// As [`uncertainty`](Self::uncertainty).
    pub fn uncertainty_with(
        &mut self,
        options: &UncertaintyOptions,
        members: &mut MembersCallback<'_>,
    ) -> Result<Uncertainty, SessionError> {
        options.check(&self.case)?;
        self.ask("uncertainty", self.case.clone(), options.members, |question| {
            question.predict()?;
            question.uncertainty(options, members)
        })
    }

    /// March some members of a sweep, and count them so that parts of one sweep can be merged. It is no answer that can
    /// be reported.
    ///
    /// # Errors
    /// As [`uncertainty`](Self::uncertainty), and when the nominal march fails, about which members are counted.
    pub fn uncertainty_part(
        &mut self,
        options: &UncertaintyOptions,
        part: Range<usize>,
        members: &mut MembersCallback<'_>,
    ) -> Result<SweepPart, SessionError> {
        options.check(&self.case)?;
        if part.is_empty() || part.end > options.members {
            let message = format!(
                " {}..{}: expected a first member before the end, and an end no higher than the {} drawn",
                part.start, part.end, options.members
            );
            return Err(InputError::of("part", message).into());
        }
        let found = self.ask("uncertainty", self.case.clone(), options.members, |question| {
            let nominal = question.predict()?;
            if let Some(reason) = reason(&question.answers.case, &nominal.arrival) {
                let why = format!("nothing to count members from: the nominal march did not arrive: {reason}");
                return Err(InputError::plain(why).into());
            }
            let gathered = question.gather(options, &nominal, part, members)?;
            Ok(SweepPart { nominal, gathered, backend: question.march.backend() })
        });
        self.answers = None;
        found
    }

    /// Derivatives of every temperature by every factor, and which factors can be estimated together.
    ///
    /// # Errors
    /// When an option is wrong, the case has no factors, the device fails or the march is cancelled.
    pub fn sensitivity(&mut self, options: &SensitivityOptions) -> Result<Sensitivity, SessionError> {
        let case = options.prepared(&self.case)?;
        self.ask("sensitivity", case, ESTIMATE_MEMBERS, |question| {
            question.predict()?;
            question.sensitivity(options)
        })
    }

    /// Fit factors to observations. A posterior and a comparison, where asked for, are in [`answers`](Self::answers).
    ///
    /// # Errors
    /// When an option is wrong, there is nothing to estimate or to estimate from, the device fails or the march is
    /// cancelled. That the minimisation did not converge is an answer.
    pub fn estimate(&mut self, options: &EstimateOptions) -> Result<Estimated, SessionError> {
        let prepared = options.prepared(&self.case)?;
        self.ask("estimate", prepared.case, ESTIMATE_MEMBERS, |question| {
            let others = prepared.others.into_iter().map(|other| toleranced(other, question.tolerance_k));
            question.answers.others = others.collect();
            let found = question.estimate(&options.fit, options.posterior.as_ref())?;
            if let Some(other) = prepared.beside {
                question.beside(other, &options.fit, &found)?;
            }
            Ok(found)
        })
    }

    /// Prediction, uncertainty, sensitivity and, where the case has observations and factors for it, an estimate.
    ///
    /// # Errors
    /// As those questions.
    pub fn study(&mut self, options: &StudyOptions) -> Result<&Answers, SessionError> {
        let (case, why_not) = options.prepared(&self.case)?;
        let asked = self.ask_for_all("study", case, options.sweep.members, |question| {
            question.predict()?;
            question.uncertainty(&options.sweep, &mut |_, _| {})?;
            question.sensitivity(&SensitivityOptions::default())?;
            if why_not.is_none() {
                question.estimate(&options.fit, options.posterior.as_ref())?;
            }
            question.answers.not_estimated = why_not;
            Ok(())
        });
        asked.map(|((), answers)| answers)
    }

    /// The thickness of a ply that keeps a sensor below a limit.
    ///
    /// # Errors
    /// When an option is wrong, the ply cannot be sized, the device fails or the march is cancelled. That no thickness
    /// allowed suffices is an answer.
    pub fn size(&mut self, options: &SizeOptions) -> Result<Sizing, SessionError> {
        let (demand, sweep) = (options.demand(&self.case)?, options.sweep);
        self.ask("size", self.case.clone(), sweep.members, |question| {
            question.predict()?;
            let Question { march, answers, .. } = question;
            let found = size(&answers.case, *march, &demand, &sweep.sweep())?;
            answers.seed = Some(sweep.seed);
            answers.sizing = Some(found.clone());
            Ok(found)
        })
    }

    /// How the hot face was heated, from observations (inverse heat conduction).
    ///
    /// # Errors
    /// When an option is wrong, the case has not the quantity that is sought, the device fails or the march is
    /// cancelled.
    pub fn history(&mut self, options: &HistoryOptions) -> Result<History, SessionError> {
        let case = options.prepared(&self.case)?;
        self.ask("history", case, 1, |question| {
            question.predict()?;
            let Question { march, answers, .. } = question;
            let found = history(&answers.case, *march, &options.wanted())?;
            answers.history = Some(found.clone());
            Ok(found)
        })
    }

    /// One synthetic data set: what the sensors would read with these true factors. It is marched in f64 unless the
    /// session has a precision, and is no answer that can be reported.
    ///
    /// # Errors
    /// When an option is wrong, the truth cannot be marched, the device fails or the march is cancelled.
    pub fn twin(&mut self, options: &TwinOptions) -> Result<Twin, SessionError> {
        let (truth, case) = (options.row(&self.case)?, self.case.clone());
        let precision = self.options.precision.or(Some(Precision::F64));
        self.on_march(1, precision, |plan, march| {
            Ok(twin(&case, plan, march, truth, options.noise_k, &options.noise())?)
        })
    }

    /// Many synthetic data sets of random truths, each of them fitted: how often intervals hold the truth.
    ///
    /// # Errors
    /// When an option is wrong, there is nothing to estimate, the device fails or the march is cancelled. A fit that
    /// fails is counted.
    pub fn twin_study(&mut self, options: &TwinStudyOptions) -> Result<Recovery, SessionError> {
        let case = options.prepared(&self.case)?;
        self.ask("twin", case, options.twins, |question| {
            question.predict()?;
            let Question { plan, march, answers, .. } = question;
            let search = Search { landscape: false, ..options.fit.search(march.backend().precision) };
            let (twins, noise_k, noise) = (options.twins, options.noise_k, options.noise());
            let design = Design { twins, drawn: Bounds::Small, noise_k, noise, search };
            let found = recovery(&answers.case, plan, *march, &design)?;
            answers.seed = Some(options.seed);
            answers.recovery = Some(found.clone());
            Ok(found)
        })
    }

    /// March rows of factor values: temperatures of member × sensor × instant, and how each member ended.
    ///
    /// # Errors
    /// When rows have not one value a factor, the device fails or the march is cancelled.
    pub fn march(&mut self, points: &Ensemble) -> Result<Traces, SessionError> {
        self.check_points(points, &[])?;
        self.on_march(points.len(), self.options.precision, |plan, march| {
            let mut traces = Traces::none(0, plan.places.len(), plan.instants_s.len());
            march.expect(points.len());
            march_all(march, plan, points, &mut |batch| traces.extend(&batch, 0..batch.members()))?;
            Ok(traces)
        })
    }

    /// March rows of factor values with their derivatives: of every row the member, then, as if it were a member, the
    /// derivative of everything by each of `factors` (indices). `None` from a backend without derivatives.
    ///
    /// # Errors
    /// As [`march`](Self::march), and when there is no such factor.
    pub fn tangents(&mut self, points: &Ensemble, factors: &[usize]) -> Result<Option<Traces>, SessionError> {
        self.check_points(points, factors)?;
        self.on_march(points.len() * (1 + factors.len()), self.options.precision, |plan, march| {
            Ok(march.tangents(plan, points, factors)?)
        })
    }

    /// Write the report of the last question into a folder, as the command does: the page, figures, tables and
    /// `summary.json`, whose path is the last of those returned.
    ///
    /// # Errors
    /// When there is no answer or the folder cannot be written.
    #[cfg(feature = "report")]
    pub fn report(&self, folder: &OutputFolder) -> Result<Vec<PathBuf>, SessionError> {
        self.answers.as_ref().ok_or_else(nothing_to_report)?.report(folder)
    }

    /// The report of the last question as text for a terminal.
    ///
    /// # Errors
    /// When there is no answer.
    #[cfg(feature = "report")]
    pub fn summary(&self) -> Result<String, SessionError> {
        Ok(self.answers.as_ref().ok_or_else(nothing_to_report)?.summary())
    }

    fn check_points(&self, points: &Ensemble, factors: &[usize]) -> Result<(), SessionError> {
        let known = self.case.factors.len();
        if points.factors() != known {
            let message = format!(": rows of {} values, expected one for each of {known} factors", points.factors());
            return Err(InputError::of("points", message).into());
        }
        match factors.iter().find(|&&factor| factor >= known) {
            None => Ok(()),
            Some(factor) => {
                let message = format!(": no factor {factor}, expected an index below {known}");
                Err(InputError::of("factors", message).into())
            }
        }
    }

    /// Ask a question and keep its answers. `members` says to `auto` how much work it is.
    fn ask<T: Send>(
        &mut self,
        question: &'static str,
        case: Case,
        members: usize,
        work: impl FnOnce(&mut Question<'_>) -> Result<T, SessionError> + Send,
    ) -> Result<T, SessionError> {
        self.ask_for_all(question, case, members, work).map(|(answer, _)| answer)
    }

    /// [`ask`](Self::ask), with all the answers that the question left.
    fn ask_for_all<T: Send>(
        &mut self,
        question: &'static str,
        case: Case,
        members: usize,
        work: impl FnOnce(&mut Question<'_>) -> Result<T, SessionError> + Send,
    ) -> Result<(T, &Answers), SessionError> {
        self.answers = None;
        let opening = std::mem::take(&mut self.opening);
        let now = Instant::now();
        let began = now.checked_sub(opening.all).unwrap_or(now);
        let tolerance_k = self.options.tolerance_k;
        let (answer, answers) = self.on_march(members, self.options.precision, |plan, march| {
            let study = Instant::now();
            let seconds = Seconds { plan_s: opening.plan_s, march_s: 0.0, reduce_s: 0.0, began };
            let answers = Answers::new(question, case, march.backend(), seconds);
            let mut question = Question { plan, march, tolerance_k, answers };
            let answer = work(&mut question)?;
            let Question { march, mut answers, .. } = question;
            let (study_s, march_s) = (study.elapsed().as_secs_f64(), march.seconds());
            answers.seconds = Seconds { march_s, reduce_s: (study_s - march_s).max(0.0), ..seconds };
            Ok((answer, answers))
        })?;
        Ok((answer, self.answers.insert(answers)))
    }

    /// Work with the march for so many members, on the session's threads.
    fn on_march<T: Send>(
        &mut self,
        members: usize,
        precision: Option<Precision>,
        work: impl FnOnce(&Plan, &mut Monitored) -> Result<T, SessionError> + Send,
    ) -> Result<T, SessionError> {
        self.options.cancel.check()?;
        let place = self.opened(members, precision)?;
        let (plan, march) = (&self.plan, &mut self.marches[place].march);
        march.restart();
        in_pool(self.pool.as_ref(), || work(plan, march))
    }

    /// The place of the march for so many members in this precision, which is opened where there is none yet.
    fn opened(&mut self, members: usize, precision: Option<Precision>) -> Result<usize, SessionError> {
        let choice = choose::Choice { precision, ..self.options.choice() };
        let seeks_hardware = choose::seeks_hardware(&choice, &self.plan, members);
        let is_open = |open: &Opened| (open.precision, open.seeks_hardware) == (precision, seeks_hardware);
        if let Some(place) = self.marches.iter().position(is_open) {
            return Ok(place);
        }
        let march = in_pool(self.pool.as_ref(), || choose::open_extrapolated(&choice, &self.plan, members))?;
        let march = Monitored::new(march, self.options.monitor());
        self.marches.push(Opened { precision, seeks_hardware, march });
        Ok(self.marches.len() - 1)
    }
}

/// A question while it is worked on.
struct Question<'a> {
    plan: &'a Plan,
    march: &'a mut Monitored,
    tolerance_k: Option<f64>,
    answers: Answers,
}

impl Question<'_> {
    fn predict(&mut self) -> Result<Nominal, SessionError> {
        let found = nominal(&self.answers.case, self.plan, self.march)?;
        self.answers.nominal = Some(found.clone());
        Ok(found)
    }

    fn uncertainty(
        &mut self,
        options: &UncertaintyOptions,
        members: &mut MembersCallback<'_>,
    ) -> Result<Uncertainty, SessionError> {
        let nominal = match &self.answers.nominal {
            Some(nominal) => nominal.clone(),
            None => self.predict()?,
        };
        let gathered = self.gather(options, &nominal, 0..options.members, members)?;
        let found = gathered.answer(&nominal, &options.sweep().sampling, options.members);
        self.answers.seed = Some(options.seed);
        self.answers.uncertainty = Some(found.clone());
        Ok(found)
    }

    /// March some members of a sweep and count them.
    fn gather(
        &mut self,
        options: &UncertaintyOptions,
        nominal: &Nominal,
        part: Range<usize>,
        members: &mut MembersCallback<'_>,
    ) -> Result<Gathered, SessionError> {
        let (case, sweep) = (&self.answers.case, options.sweep());
        let (bounds, kind) = (sweep.bounds, sweep.sampling.kind);
        let envelope = Envelope::of(case, self.plan, nominal, bounds, kind, &self.march.monitor())?;
        let mut gathered = Gathered::new(case, nominal, &envelope, bounds, kind);
        self.march.expect(part.len());
        gathered.march(case, self.plan, self.march, &sweep.ensemble(case), part, members)?;
        Ok(gathered)
    }

    fn sensitivity(&mut self, options: &SensitivityOptions) -> Result<Sensitivity, SessionError> {
        let step = options.step(self.march.backend().precision);
        let found = sensitivity(&self.answers.case, self.plan, self.march, step)?;
        self.answers.sensitivity = Some(found.clone());
        Ok(found)
    }

    fn estimate(&mut self, fit: &FitOptions, walkers: Option<&Walkers>) -> Result<Estimated, SessionError> {
        let search = fit.search(self.march.backend().precision);
        let Answers { case, others, .. } = &self.answers;
        let monitor = self.march.monitor();
        let plans: Vec<Plan> = others.iter().map(|other| pilot_monitored(other, &monitor)).collect::<Result<_, _>>()?;
        let runs: Vec<(&Case, &Plan)> = std::iter::once((case, self.plan)).chain(others.iter().zip(&plans)).collect();
        let found = estimate(&runs, self.march, &search)?;
        if let Some(walkers) = walkers {
            self.march.expect(runs.len() * walkers.number * walkers.moves);
            self.answers.posterior = Some(posterior(&runs, self.march, &found, walkers)?);
            self.answers.seed = Some(walkers.seed);
        }
        self.answers.estimated = Some(found.clone());
        Ok(found)
    }

    /// Fit another case to the same observations.
    fn beside(&mut self, other: Case, fit: &FitOptions, found: &Estimated) -> Result<(), SessionError> {
        let Some(first) = found.fitted.first() else { return Ok(()) };
        let (search, other) = (fit.search(self.march.backend().precision), toleranced(other, self.tolerance_k));
        let plan = pilot_monitored(&other, &self.march.monitor())?;
        self.answers.beside = Some(beside((&self.answers.case, first), (&other, &plan), self.march, &search)?);
        Ok(())
    }
}

/// A case with the tolerance of the session, where it has one.
fn toleranced(case: Case, tolerance_k: Option<f64>) -> Case {
    match tolerance_k {
        Some(tolerance_k) => case.with_tolerance_k(tolerance_k),
        None => case,
    }
}

fn in_pool<T: Send>(pool: Option<&ThreadPool>, work: impl FnOnce() -> T + Send) -> T {
    match pool {
        Some(pool) => pool.install(work),
        None => work(),
    }
}

#[cfg(feature = "report")]
fn nothing_to_report() -> SessionError {
    InputError::plain("there is nothing to report: the last question failed or none was asked").into()
}
