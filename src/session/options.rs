//! Options of a session and of its questions. Every default is that of the command.

use super::error::{InputError, SessionError, find};
use crate::case::{Bounds, Case, LossFunction};
use crate::ensemble::{Sampling, SamplingKind};
use crate::fit::Rules;
use crate::march::Precision;
use crate::march::choose::{Choice, Kind};
use crate::march::monitored::{CancelToken, Monitor, Progress, ProgressCallback};
use crate::study::estimate::{Search, no_factors};
use crate::study::history::{Smoothing, Sought, Wanted};
use crate::study::posterior::Walkers;
use crate::study::proportion::fewest_draws;
use crate::study::sensitivity::difference_step;
use crate::study::size::Demand;
use crate::study::twin::Noise;
use crate::study::uncertainty::Sweep;

/// What marches, how exactly, and who watches.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Options {
    /// The default takes a hardware GPU where there is one and the work is worth it, otherwise the processor.
    pub backend: Kind,
    /// `None` takes f64 on the processor and f32 on a GPU.
    pub precision: Option<Precision>,
    /// Part of the name of a Vulkan device.
    pub device: Option<String>,
    /// Discretisation error that the adaptation of cells and time steps aims at, K; `None` takes the case's own.
    pub tolerance_k: Option<f64>,
    /// Threads of a pool of the session's own; `None` takes the pool of the caller.
    pub threads: Option<usize>,
    /// Called after every batch of members.
    pub progress: Option<ProgressCallback>,
    /// Ends a question, and the opening of a session, between two batches of members.
    pub cancel: CancelToken,
}

impl Options {
    /// What marches: the processor, a GPU, or the better of the two.
    #[must_use]
    pub fn backend(mut self, backend: Kind) -> Self {
        self.backend = backend;
        self
    }

    /// The arithmetic of the march.
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

    /// The discretisation error that the adaptation aims at, K.
    #[must_use]
    pub fn tolerance_k(mut self, tolerance_k: f64) -> Self {
        self.tolerance_k = Some(tolerance_k);
        self
    }

    /// The number of threads of the session's own pool.
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

    /// A token that ends a question between two batches of members.
    #[must_use]
    pub fn cancel(mut self, cancel: &CancelToken) -> Self {
        self.cancel = cancel.clone();
        self
    }

    pub(super) fn check(&self) -> Result<(), SessionError> {
        if let (Kind::Cpu, Some(device)) = (self.backend, &self.device) {
            let message = format!(" {device:?}: the processor marches, expected no device or another backend");
            return Err(InputError::of("device", message).into());
        }
        if let Some(tolerance_k) = self.tolerance_k.filter(|tolerance_k| !is_positive(*tolerance_k)) {
            let message = format!(" {tolerance_k}: expected a temperature difference above 0 K");
            return Err(InputError::of("tolerance_k", message).into());
        }
        if self.threads == Some(0) {
            return Err(InputError::of("threads", " 0: expected 1 at least").into());
        }
        Ok(())
    }

    pub(super) fn monitor(&self) -> Monitor {
        Monitor::new(self.progress.clone(), self.cancel.clone())
    }

    pub(super) fn choice(&self) -> Choice {
        Choice { kind: self.backend, precision: self.precision, device: self.device.clone() }
    }
}

/// Which observations to use; what is empty or `None` the case says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObservationSelection {
    /// Names of sensors.
    pub sensors: Vec<String>,
    /// Start and end of the samples used of every sensor, s.
    pub window_s: Option<(f64, f64)>,
    /// Side constraints of the factors.
    pub bounds: Option<Bounds>,
}

/// The start of one factor.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// Its name.
    pub factor: String,
    /// The id of the case whose factor it is; `None` sets the start in every case that estimates it.
    pub case: Option<String>,
    /// Where the minimisation starts.
    pub value: f64,
}

/// What to estimate, and how; what is empty or `None` the case says.
#[derive(Clone, Debug, PartialEq)]
pub struct FitOptions {
    /// Names of the factors to estimate.
    pub factors: Vec<String>,
    /// Starts by name; the others start at their nominal values.
    pub start: Vec<Start>,
    /// How residuals count.
    pub loss: Option<LossFunction>,
    /// The side constraints that a prior is made of; `Some(None)` is no prior.
    pub prior: Option<Option<Bounds>>,
    /// The rules of the damping and of its end.
    pub rules: Rules,
    /// Minimisations side by side: the first from the case's start, the others from random points between the bounds.
    pub starts: usize,
    /// Names of factors whose profile likelihood is computed.
    pub profiles: Vec<String>,
    /// Iterations at most.
    pub max_iterations: usize,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            factors: Vec::new(),
            start: Vec::new(),
            loss: None,
            prior: None,
            rules: Rules::Radius,
            starts: 1,
            profiles: Vec::new(),
            max_iterations: 50,
        }
    }
}

impl FitOptions {
    pub(super) fn search(&self, precision: Precision) -> Search {
        let mut search = Search { starts: self.starts, profiles: self.profiles.clone(), ..Search::of(precision) };
        search.options.patience = self.max_iterations;
        search.options.rules = self.rules;
        search
    }
}

/// A Monte Carlo sweep over the factors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UncertaintyOptions {
    /// Members to draw and march, two at least.
    pub members: usize,
    /// The distribution and the way of drawing.
    pub sampling: SamplingKind,
    /// The same seed draws the same members.
    pub seed: u64,
    /// The side constraints to draw between.
    pub bounds: Bounds,
}

impl Default for UncertaintyOptions {
    fn default() -> Self {
        Self { members: 5000, sampling: SamplingKind::Normal, seed: 1, bounds: Bounds::Small }
    }
}

impl UncertaintyOptions {
    pub(super) fn sweep(&self) -> Sweep {
        let sampling = Sampling { kind: self.sampling, seed: self.seed };
        Sweep { members: self.members, sampling, bounds: self.bounds }
    }

    /// Check the options for a case, before anything is marched.
    ///
    /// # Errors
    /// As [`Session::uncertainty`](super::Session::uncertainty) for its input.
    pub fn check(&self, case: &Case) -> Result<(), SessionError> {
        if case.factors.is_empty() {
            return Err(InputError::plain("the case has no factors to vary").into());
        }
        if self.members < 2 {
            let message = format!(" {}: a spread needs at least 2 members, not {}", self.members, self.members);
            return Err(InputError::of("members", message).into());
        }
        Ok(())
    }
}

/// How to differentiate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Derivatives {
    /// Exact, marched beside the temperatures; central differences on a backend without derivatives.
    #[default]
    Exact,
    /// Central differences of this relative step; `None` takes 1e-5 in f64 and 1e-3 in f32.
    Difference(Option<f64>),
}

/// Derivatives of temperatures by factors.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SensitivityOptions {
    /// The observations by which factors are judged.
    pub observations: ObservationSelection,
    /// How to differentiate.
    pub derivatives: Derivatives,
}

impl SensitivityOptions {
    /// Check the options for a case, before anything is marched.
    ///
    /// # Errors
    /// As [`Session::sensitivity`](super::Session::sensitivity) for its input.
    pub fn check(&self, case: &Case) -> Result<(), SessionError> {
        self.prepared(case).map(|_| ())
    }

    /// The case with these options in place of its own.
    pub(super) fn prepared(&self, case: &Case) -> Result<Case, SessionError> {
        if case.factors.is_empty() {
            return Err(InputError::plain("the case has no factors to differentiate by").into());
        }
        if let Derivatives::Difference(Some(step)) = self.derivatives
            && !(1e-9..=0.2).contains(&step)
        {
            let message = format!(" {step}: expected a relative step from 1e-9 to 0.2");
            return Err(InputError::of("step", message).into());
        }
        selected(case, |cases| self.observations.apply(cases))
    }

    pub(super) fn step(&self, precision: Precision) -> Option<f64> {
        match self.derivatives {
            Derivatives::Exact => None,
            Derivatives::Difference(step) => Some(step.unwrap_or(difference_step(precision))),
        }
    }
}

/// Least squares over the factors.
#[derive(Clone, Debug, Default)]
pub struct EstimateOptions {
    /// Further cases to fit at once: factors of one name are one factor.
    pub others: Vec<Case>,
    /// A case that is fitted to the same observations on its own, for comparison.
    pub beside: Option<Case>,
    /// The observations to fit.
    pub observations: ObservationSelection,
    /// What to estimate, and how.
    pub fit: FitOptions,
    /// The walkers of a posterior; `None` computes none.
    pub posterior: Option<Walkers>,
}

/// The cases of an estimate, with its options in place of their own.
pub(super) struct Prepared {
    pub(super) case: Case,
    pub(super) others: Vec<Case>,
    pub(super) beside: Option<Case>,
}

impl EstimateOptions {
    /// Check the options for a case, before anything is marched.
    ///
    /// # Errors
    /// As [`Session::estimate`](super::Session::estimate) for its input.
    pub fn check(&self, case: &Case) -> Result<(), SessionError> {
        self.prepared(case).map(|_| ())
    }

    pub(super) fn prepared(&self, case: &Case) -> Result<Prepared, SessionError> {
        check_walkers(self.posterior.as_ref())?;
        let apply = |cases| self.fit.apply(self.observations.apply(cases)?);
        let beside = self.beside.as_ref().map(|beside| selected(beside, apply)).transpose()?;
        let mut cases = vec![case.clone()];
        for other in &self.others {
            if cases.iter().any(|known| known.id == other.id) {
                return Err(InputError::plain(format!("two cases are called {:?}", other.id)).into());
            }
            cases.push(other.clone());
        }
        let mut cases = apply(cases)?;
        let others = cases.split_off(1);
        Ok(Prepared { case: cases.remove(0), others, beside })
    }
}

/// Prediction, uncertainty, sensitivity and estimate at once.
#[derive(Clone, Debug, Default)]
pub struct StudyOptions {
    /// The sweep.
    pub sweep: UncertaintyOptions,
    /// The observations to fit.
    pub observations: ObservationSelection,
    /// What to estimate, and how.
    pub fit: FitOptions,
    /// The walkers of a posterior; `None` computes none.
    pub posterior: Option<Walkers>,
}

impl StudyOptions {
    /// Check the options for a case, before anything is marched. Returns the reason where nothing will be estimated.
    ///
    /// # Errors
    /// As [`Session::study`](super::Session::study) for its input.
    pub fn check(&self, case: &Case) -> Result<Option<String>, SessionError> {
        self.prepared(case).map(|(_, why_not)| why_not)
    }

    pub(super) fn prepared(&self, case: &Case) -> Result<(Case, Option<String>), SessionError> {
        check_walkers(self.posterior.as_ref())?;
        self.sweep.check(case)?;
        let case = selected(case, |cases| self.fit.apply(self.observations.apply(cases)?))?;
        let why_not = if case.observations.is_empty() {
            Some("the case has no observations".to_owned())
        } else {
            case.estimate.factors.is_empty().then(|| no_factors(&[&case]))
        };
        Ok((case, why_not))
    }
}

/// The thickness of a ply that keeps a sensor below a limit.
#[derive(Clone, Debug, PartialEq)]
pub struct SizeOptions {
    /// A ply, or a group whose plies are stretched alike.
    pub ply: String,
    /// The sensor whose highest temperature is limited.
    pub sensor: String,
    /// The limit, K.
    pub limit_k: f64,
    /// The share of members that are to hold the limit.
    pub probability: f64,
    /// The thinnest and the thickest allowed, m; `None` takes a quarter to four times the case's thickness.
    pub within_m: Option<(f64, f64)>,
    /// The members that count.
    pub sweep: UncertaintyOptions,
}

impl SizeOptions {
    /// A limit that 99 % of 5,000 members are to hold.
    pub fn new(ply: impl Into<String>, sensor: impl Into<String>, limit_k: f64) -> Self {
        Self {
            ply: ply.into(),
            sensor: sensor.into(),
            limit_k,
            probability: 0.99,
            within_m: None,
            sweep: UncertaintyOptions::default(),
        }
    }

    /// Check the options for a case, before anything is marched.
    ///
    /// # Errors
    /// As [`Session::size`](super::Session::size) for its input.
    pub fn check(&self, case: &Case) -> Result<(), SessionError> {
        self.demand(case).map(|_| ())
    }

    pub(super) fn demand(&self, case: &Case) -> Result<Demand, SessionError> {
        let Self { limit_k, probability, within_m, sweep: UncertaintyOptions { members, .. }, .. } = *self;
        let names = case.sensors.iter().map(|sensor| sensor.name.as_str());
        let sensor = find(names, &self.sensor, "sensor", "sensor")?;
        if !is_positive(limit_k) {
            return Err(InputError::of("limit_k", format!(" {limit_k}: expected a temperature above 0 K")).into());
        }
        if !(probability > 0.0 && probability < 1.0) {
            let message = format!(" {probability}: expected a share between 0 and 1, such as 0.99");
            return Err(InputError::of("probability", message).into());
        }
        if let Some((low_m, high_m)) = within_m.filter(|&(low_m, high_m)| !(low_m > 0.0 && low_m < high_m)) {
            let message = format!(" {low_m} m to {high_m} m: expected a thinnest above zero and below the thickest");
            return Err(InputError::of("within_m", message).into());
        }
        let fewest = fewest_draws(probability).max(2);
        if members < fewest {
            return Err(InputError::of(
                "members",
                format!(
                    " {members}: a probability of {probability} takes at least {fewest} members: of fewer the chance \
                     is above 2.5 % that none is among those that need more"
                ),
            )
            .into());
        }
        Ok(Demand { ply: self.ply.clone(), sensor, limit_k, probability, within_m })
    }
}

/// The heating of the hot face, from observations.
#[derive(Clone, Debug, PartialEq)]
pub struct HistoryOptions {
    /// The observations to use. No factor is estimated, so bounds are refused.
    pub observations: ObservationSelection,
    /// The quantity to find; `None` takes the only one that the case has.
    pub sought: Option<Sought>,
    /// Knots beside the corners of the case's own schedule.
    pub knots: usize,
    /// How the smoothness is chosen.
    pub smoothing: Smoothing,
}

impl Default for HistoryOptions {
    fn default() -> Self {
        let observations = ObservationSelection::default();
        Self { observations, sought: None, knots: 20, smoothing: Smoothing::Discrepancy }
    }
}

impl HistoryOptions {
    /// Check the options for a case, before anything is marched.
    ///
    /// # Errors
    /// As [`Session::history`](super::Session::history) for its input.
    pub fn check(&self, case: &Case) -> Result<(), SessionError> {
        self.prepared(case).map(|_| ())
    }

    pub(super) fn prepared(&self, case: &Case) -> Result<Case, SessionError> {
        if self.observations.bounds.is_some() {
            let message = ": a history estimates no factor; what is sought is kept from falling below zero";
            return Err(InputError::of("bounds", message).into());
        }
        if let Smoothing::Stated(weight) = self.smoothing
            && !(weight.is_finite() && weight >= 0.0)
        {
            let message = format!(" {weight}: expected a weight of 0 or more");
            return Err(InputError::of("smoothing", message).into());
        }
        selected(case, |cases| self.observations.apply(cases))
    }

    pub(super) fn wanted(&self) -> Wanted {
        Wanted { sought: self.sought, knots: self.knots, smoothing: self.smoothing }
    }
}

/// One synthetic data set.
#[derive(Clone, Debug, PartialEq)]
pub struct TwinOptions {
    /// True values of factors by name; the others are nominal.
    pub truth: Vec<(String, f64)>,
    /// Standard deviation of the noise, K.
    pub noise_k: f64,
    /// Time over which noise is correlated, s; zero for noise that is independent from reading to reading.
    pub correlation_s: f64,
    /// The same seed makes the same noise.
    pub seed: u64,
}

impl Default for TwinOptions {
    fn default() -> Self {
        Self { truth: Vec::new(), noise_k: 0.0, correlation_s: 0.0, seed: 1 }
    }
}

impl TwinOptions {
    /// Check the options for a case, before anything is marched.
    ///
    /// # Errors
    /// As [`Session::twin`](super::Session::twin) for its input.
    pub fn check(&self, case: &Case) -> Result<(), SessionError> {
        self.row(case).map(|_| ())
    }

    /// The true value of every factor.
    pub(super) fn row(&self, case: &Case) -> Result<Vec<f64>, SessionError> {
        check_noise(self.noise_k, self.correlation_s)?;
        let mut row: Vec<f64> = case.factors.iter().map(|factor| factor.nominal).collect();
        for (name, value) in &self.truth {
            let factor = find(case.factors.iter().map(|factor| factor.name.as_str()), name, "truth", "factor")?;
            if !is_positive(*value) {
                return Err(InputError::of("truth", format!(" {name}={value}: expected a number above zero")).into());
            }
            row[factor] = *value;
        }
        Ok(row)
    }

    pub(super) fn noise(&self) -> Noise {
        Noise { correlation_s: self.correlation_s, seed: self.seed }
    }
}

/// Many synthetic data sets of random truths, each of them fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct TwinStudyOptions {
    /// Data sets, two at least.
    pub twins: usize,
    /// The observations whose times the data sets have.
    pub observations: ObservationSelection,
    /// What to estimate, and how.
    pub fit: FitOptions,
    /// Standard deviation of the noise, K; `None` takes those of the observations.
    pub noise_k: Option<f64>,
    /// Time over which noise is correlated, s.
    pub correlation_s: f64,
    /// The same seed makes the same truths and noise.
    pub seed: u64,
}

impl TwinStudyOptions {
    /// So many data sets with independent noise of the observations' standard deviations.
    pub fn new(twins: usize) -> Self {
        Self {
            twins,
            observations: ObservationSelection::default(),
            fit: FitOptions::default(),
            noise_k: None,
            correlation_s: 0.0,
            seed: 1,
        }
    }

    /// Check the options for a case, before anything is marched.
    ///
    /// # Errors
    /// As [`Session::twin_study`](super::Session::twin_study) for its input.
    pub fn check(&self, case: &Case) -> Result<(), SessionError> {
        self.prepared(case).map(|_| ())
    }

    pub(super) fn prepared(&self, case: &Case) -> Result<Case, SessionError> {
        if self.twins < 2 {
            let message = format!(" {}: a study needs at least 2 data sets", self.twins);
            return Err(InputError::of("twins", message).into());
        }
        if !self.fit.profiles.is_empty() {
            let message = ": a study judges the intervals that every estimate has; no profile is part of it";
            return Err(InputError::of("profiles", message).into());
        }
        check_noise(self.noise_k.unwrap_or(0.0), self.correlation_s)?;
        selected(case, |cases| self.fit.apply(self.observations.apply(cases)?))
    }

    pub(super) fn noise(&self) -> Noise {
        Noise { correlation_s: self.correlation_s, seed: self.seed }
    }
}

fn is_positive(value: f64) -> bool {
    value.is_finite() && value > 0.0
}

fn check_noise(noise_k: f64, correlation_s: f64) -> Result<(), SessionError> {
    for (option, value, unit) in [("noise_k", noise_k, "K"), ("correlation_s", correlation_s, "s")] {
        if !(value.is_finite() && value >= 0.0) {
            return Err(InputError::of(option, format!(" {value} {unit}: expected no less than 0 {unit}")).into());
        }
    }
    Ok(())
}

fn check_walkers(walkers: Option<&Walkers>) -> Result<(), SessionError> {
    // The position of each walker after every move is held for every factor: 0.8 GB a factor.
    const MOST: usize = 100_000_000;
    const FEWEST_MOVES: usize = 10;
    let Some(&Walkers { number, moves, .. }) = walkers else { return Ok(()) };
    if moves < FEWEST_MOVES {
        return Err(InputError::of("moves", format!(" {moves}: expected {FEWEST_MOVES} at least")).into());
    }
    if number.checked_mul(moves).is_none_or(|positions| positions > MOST) {
        let message = format!(" {number} with {moves} moves each: expected no more than {MOST} moves in all");
        return Err(InputError::of("walkers", message).into());
    }
    Ok(())
}

/// One case with options in place of its own.
fn selected(case: &Case, apply: impl Fn(Vec<Case>) -> Result<Vec<Case>, SessionError>) -> Result<Case, SessionError> {
    Ok(apply(vec![case.clone()])?.remove(0))
}
