//! Which factors make the prediction meet the measurement?

mod combination;
mod estimand;
mod landscape;
mod profile;

pub use combination::Combination;
pub use estimand::Estimand;
pub use landscape::Landscape;
pub use profile::Profile;

use super::nominal::{Misfit, Nominal};
use super::sensitivity::{Identifiability, difference_step};
use super::thermocouples::{Part, Sample, Thermocouples, samples};
use crate::case::{Bounds, Case};
use crate::ensemble::{Ensemble, Sampling, SamplingKind};
use crate::fit::interval::{effective_samples, inflation, lag_one, noise_autocorrelation, student_95};
use crate::fit::{Fit, Loss, Options, Prior, Robust, Rules, Weighed, WithPriors, known, minimize_all};
use crate::march::{March, MarchError, Precision};
use crate::plan::Plan;
use crate::traces::Traces;
use estimand::estimands;
use nalgebra::DMatrix;
use profile::{About, profiles};

/// Estimated factors and how they were found.
#[derive(Clone, Debug)]
pub struct Estimated {
    /// In the order of every vector here.
    pub factors: Vec<Estimand>,
    pub values: Vec<f64>,
    /// From the covariance scaled by the residuals, as if they were independent; infinite where not determined.
    pub standard_errors: Vec<f64>,
    /// 95 % confidence intervals to first order, widened by the residuals' autocorrelation.
    pub intervals: Vec<(f64, f64)>,
    /// Whether an estimate stands on one of its bounds.
    pub at_bound: Vec<bool>,
    pub identifiability: Identifiability,
    /// What pairs of estimates determine that neither does alone.
    pub combinations: Vec<Combination>,
    /// How samples counted that were far off, and the side constraints that priors were made of, if any.
    pub loss: Loss,
    pub prior: Option<Bounds>,
    /// Sum of squared residuals in K² (the paper's S), at the start and at the end.
    pub objective_k2: (f64, f64),
    /// The points visited, the start first.
    pub path: Vec<Turn>,
    /// Where every start ended, the case's own first; the estimate is the lowest.
    pub ends: Vec<End>,
    /// Members marched.
    pub marches: usize,
    pub termination: String,
    pub converged: bool,
    pub advice: String,
    /// One a case, in their order.
    pub fitted: Vec<Fitted>,
    /// Lag-one autocorrelation of the weighted residuals, and the number of independent samples that the noise leaves
    /// which it tells of.
    pub autocorrelation: f64,
    pub effective_samples: f64,
    pub samples: usize,
    /// By how much the standard deviations of the data fall short of how they scatter and follow each other: intervals and
    /// profiles are of data with so many times their deviations, the estimates of data with their own.
    pub shortfall: f64,
    /// Of a pair of factors: the objective over the plane of the two.
    pub landscape: Option<Landscape>,
    /// Of the factors they were asked of.
    pub profiles: Vec<Profile>,
}

/// One of the cases fitted.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// Indices of the sensors whose observations were fitted.
    pub sensors: Vec<usize>,
    /// The nominal march and the one at the estimates.
    pub before: Nominal,
    pub after: Nominal,
    /// Misfit of each fitted observation before and after, over its window.
    pub misfits: Vec<(Misfit, Misfit)>,
    /// One a fitted observation: times and measured less predicted, over its window.
    pub residuals: Vec<(Vec<f64>, Vec<f64>)>,
}

/// One accepted iteration.
#[derive(Clone, Debug)]
pub struct Turn {
    pub values: Vec<f64>,
    /// S, K².
    pub objective_k2: f64,
    pub damping: f64,
}

/// One start and where it led.
#[derive(Clone, Debug)]
pub struct End {
    pub start: Vec<f64>,
    pub values: Vec<f64>,
    /// What is made least: weighted squares or their loss, and those of priors.
    pub objective: f64,
    pub converged: bool,
    /// Whether no data tell this end from the estimate: its objective is higher by less than a hundredth of what one
    /// standard error adds.
    pub is_least: bool,
}

/// Why nothing was estimated.
#[derive(Debug, thiserror::Error)]
pub enum EstimateError {
    #[error("nothing to estimate: the case names no factors; give --factors")]
    NoFactors,
    #[error("nothing to estimate in {0:?}: it has none of the factors of the others")]
    NothingShared(String),
    #[error("nothing to estimate from: the sensors chosen of {case:?} have no samples between {from_s} s and {to_s} s")]
    NoSamples { case: String, from_s: f64, to_s: f64 },
    #[error(
        "factor {factor:?}: the cases allow no value in common; the highest low bound is {low}, the lowest high one {high}"
    )]
    NoRoom { factor: String, low: f64, high: f64 },
    #[error("no profile of {name:?}: it is not estimated; there are {known}")]
    NoProfile { name: String, known: String },
    #[error("{case:?} asks for another loss or prior than {first:?}; give --loss and --prior for all")]
    OtherObjective { first: String, case: String },
    #[error(transparent)]
    March(#[from] MarchError),
}

/// How to look for the least.
#[derive(Clone, Debug)]
pub struct Search {
    pub options: Options,
    /// The case's own start, and as many drawn evenly between the bounds as make up this number, all side by side; the
    /// lowest end counts. At least one.
    pub starts: usize,
    /// The factors whose profiles are wanted, by name.
    pub profiles: Vec<String>,
    /// Whether the objective over the plane of a pair of factors is wanted: it takes more members than the estimate.
    pub landscape: bool,
}

impl Search {
    /// From one start, with derivatives by differences of marches in a precision: a reduction below their error is not
    /// waited for, for it never comes.
    pub fn of(precision: Precision) -> Self {
        let difference_step = difference_step(precision);
        let options = match precision {
            Precision::F32 => Options { difference_step, tolerance_reduction: 1e-6, ..Options::default() },
            Precision::F64 => Options { difference_step, ..Options::default() },
        };
        Self { options, starts: 1, profiles: Vec::new(), landscape: true }
    }
}

/// The paper's rules, whose tolerances it leaves open, for residuals in standard deviations: S of 1 is an estimate off by
/// its standard error, so that 0.01 is off by a tenth of it, and nobody reads a millionth of a factor.
pub const PAPER: Rules =
    Rules::Paper { damping: 1e-3, tolerance_objective: 1e-2, tolerance_slope: 1e-2, tolerance_step: 1e-6 };

/// The seed of the starts drawn: which they are does not matter, and that they are the same does.
const STARTS_SEED: u64 = 1;

/// Estimate the factors that the cases name from the sensors and the windows they name, all at once: one vector of
/// residuals, in which a factor that cases share is one variable.
///
/// # Errors
/// When a case names nothing to estimate or to estimate from, the cases do not go together, or the device fails.
pub fn estimate(runs: &[(&Case, &Plan)], march: &mut dyn March, search: &Search) -> Result<Estimated, EstimateError> {
    let cases: Vec<&Case> = runs.iter().map(|(case, _)| *case).collect();
    let factors = estimands(&cases)?;
    let (loss, prior) = objective(&cases)?;
    let observed: Vec<Vec<Vec<Sample>>> = runs.iter().map(|(case, plan)| samples(case, plan)).collect();
    check(&cases, &factors, &observed)?;
    let profiled = profiled(&factors, &search.profiles)?;
    let flat: Vec<Sample> = observed.iter().flatten().flatten().copied().collect();
    let bounds: Vec<(f64, f64)> = factors.iter().map(|factor| factor.bounds).collect();

    let parts = runs.iter().zip(&observed).enumerate().map(|(which, ((case, plan), observed))| {
        let places = factors.iter().map(|factor| factor.places[which]).collect();
        Part::new(case, plan, places, observed.concat())
    });
    let mut thermocouples = Thermocouples::new(march, parts.collect(), bounds.clone());
    if matches!(search.options.rules, Rules::Paper { .. }) {
        thermocouples = thermocouples.by_differences();
    }
    let problem = Robust { problem: thermocouples, loss };
    let mut problem = WithPriors { problem, priors: priors(&factors, prior) };
    let fits = minimize_all(&mut problem, &starts(&factors, search.starts), &search.options)?;
    let least = lowest(&fits);
    let fit = &fits[least];
    let WithPriors { problem: Robust { mut problem, .. }, priors } = problem;
    let path: Vec<Vec<f64>> = fit.path.iter().map(|turn| turn.point.iter().copied().collect()).collect();
    let nominal = problem.nominal()?;
    let (path_k2, last) = problem.objectives_k2(&path)?;
    let landscape = if search.landscape { landscape::landscape(&mut problem, &bounds)? } else { None };
    let fitted: Vec<Fitted> = (runs.iter().zip(&observed).zip(nominal.iter().zip(&last)))
        .map(|((run, observed), traces)| Fitted::of(*run, observed, traces))
        .collect();

    let found = known(fit, loss, priors.len());
    let mut weighted = found.residuals().iter().copied();
    let traces: Vec<Vec<f64>> =
        observed.iter().flatten().map(|trace| weighted.by_ref().take(trace.len()).collect()).collect();
    let autocorrelation = lag_one(&traces);
    let noise = noise_autocorrelation(autocorrelation, flat.len(), factors.len());
    let values: Vec<f64> = fit.point.iter().copied().collect();
    let names: Vec<&str> = factors.iter().map(|factor| factor.factor.name.as_str()).collect();
    let all: Vec<usize> = (0..factors.len()).collect();
    let variance = found.variance;
    let judged = Identifiability::of(&names, &all, &values, &found.jacobian(variance), &flat, variance);
    // Residuals that follow each other are worth fewer samples: the interval is as wide as theirs would be, which what is
    // known beforehand narrows. The degrees of freedom stay those of all samples, for of one or two effective ones
    // Student's t is unbounded and says nothing.
    let inflation = inflation(flat.len(), factors.len(), noise);
    let errors = found.certainty(variance * inflation).standard_errors;
    let half = student_95(flat.len() as f64 - factors.len() as f64);

    // A fit without a residual left, or without samples to spare, has no scatter to weigh the data by.
    let shortfall = (found.scale * inflation).sqrt();
    let weight = 1.0 / shortfall;
    let profiled = if weight.is_normal() && half.is_finite() { profiled } else { Vec::new() };
    let data = Weighed { problem: Robust { problem: &mut problem, loss }, weight };
    let about = About { values: &values, bounds: &bounds, errors: &errors, half, correlation: &judged.correlation };
    let profiles = profiles(&mut WithPriors { problem: data, priors }, &profiled, &about, &search.options)?;
    let ends = fits.iter().map(|other| End {
        start: other.path[0].point.iter().copied().collect(),
        values: other.point.iter().copied().collect(),
        objective: other.objective,
        converged: other.termination.converged(),
        is_least: other.objective - fit.objective <= 0.01 * found.scale,
    });
    Ok(Estimated {
        standard_errors: judged.standard_errors.clone(),
        intervals: values
            .iter()
            .zip(&errors)
            .map(|(value, error)| (value - half * error, value + half * error))
            .collect(),
        at_bound: values.iter().zip(&bounds).map(|(value, (low, high))| value <= low || value >= high).collect(),
        combinations: Combination::all(&values, &judged.standard_errors, &judged.correlation),
        identifiability: judged,
        loss,
        prior,
        objective_k2: (path_k2[0], path_k2[path_k2.len() - 1]),
        path: (fit.path.iter().zip(path.iter().zip(&path_k2)))
            .map(|(turn, (values, &objective_k2))| Turn { values: values.clone(), objective_k2, damping: turn.damping })
            .collect(),
        ends: ends.collect(),
        marches: problem.marches,
        termination: fit.termination.to_string(),
        converged: fit.termination.converged(),
        advice: fit.termination.advice().to_owned(),
        fitted,
        autocorrelation,
        effective_samples: effective_samples(flat.len(), noise),
        samples: flat.len(),
        shortfall,
        landscape,
        profiles,
        values,
        factors,
    })
}

/// The loss and the priors that all cases ask for.
fn objective(cases: &[&Case]) -> Result<(Loss, Option<Bounds>), EstimateError> {
    let asked = |case: &Case| (case.estimate.loss, case.estimate.prior);
    let first = cases.first().ok_or(EstimateError::NoFactors)?;
    match cases.iter().find(|case| asked(case) != asked(first)) {
        Some(case) => Err(EstimateError::OtherObjective { first: first.id.clone(), case: case.id.clone() }),
        None => Ok(asked(first)),
    }
}

/// That every case has something to estimate and to estimate it from.
fn check(cases: &[&Case], factors: &[Estimand], observed: &[Vec<Vec<Sample>>]) -> Result<(), EstimateError> {
    if factors.is_empty() {
        return Err(EstimateError::NoFactors);
    }
    for (which, (case, observed)) in cases.iter().zip(observed).enumerate() {
        if factors.iter().all(|factor| factor.places[which].is_none()) {
            return Err(EstimateError::NothingShared(case.id.clone()));
        }
        if observed.iter().all(Vec::is_empty) {
            let (from_s, to_s) = case.trusted_s();
            return Err(EstimateError::NoSamples { case: case.id.clone(), from_s, to_s });
        }
    }
    Ok(())
}

/// The places of the factors of these names; one that cases tell apart is meant in all of them.
fn profiled(factors: &[Estimand], names: &[String]) -> Result<Vec<usize>, EstimateError> {
    let mut places = Vec::new();
    for name in names {
        let is_meant = |factor: &Estimand| {
            let known = &factor.factor.name;
            known == name || known.split('@').next() == Some(name)
        };
        let meant: Vec<usize> = (0..factors.len()).filter(|&place| is_meant(&factors[place])).collect();
        if meant.is_empty() {
            let known: Vec<&str> = factors.iter().map(|factor| factor.factor.name.as_str()).collect();
            return Err(EstimateError::NoProfile { name: name.clone(), known: known.join(", ") });
        }
        places.extend(meant);
    }
    places.sort_unstable();
    places.dedup();
    Ok(places)
}

/// What is known of the factors beforehand, where side constraints are taken to say it.
pub(super) fn priors(factors: &[Estimand], prior: Option<Bounds>) -> Vec<Prior> {
    let of = |bounds| {
        let each = factors.iter().enumerate();
        each.map(move |(variable, Estimand { factor, .. })| Prior {
            variable,
            mean: factor.nominal,
            deviation: factor.deviation(bounds),
        })
    };
    prior.map(of).into_iter().flatten().collect()
}

/// The cases' own start, and others drawn evenly between the bounds, one a column.
fn starts(factors: &[Estimand], starts: usize) -> DMatrix<f64> {
    let within: Vec<_> = factors
        .iter()
        .map(|estimand| crate::case::Factor { small: estimand.bounds, ..estimand.factor.clone() })
        .collect();
    let sampling = Sampling { kind: SamplingKind::Uniform, seed: STARTS_SEED };
    let drawn = Ensemble::sample(&within, Bounds::Small, &sampling, starts.saturating_sub(1));
    let own = factors.iter().map(|factor| factor.start);
    let others = (0..drawn.len()).flat_map(|member| drawn.member(member));
    DMatrix::from_iterator(factors.len(), starts.max(1), own.chain(others))
}

/// The first of those that ended lowest but for rounding; one that could not be computed is not lower than any.
fn lowest(fits: &[Fit]) -> usize {
    const ROUNDING: f64 = 1e-6;
    let least = fits.iter().map(|fit| fit.objective).fold(f64::INFINITY, f64::min);
    fits.iter().position(|fit| fit.objective <= (1.0 + ROUNDING) * least).unwrap_or(0)
}

impl Fitted {
    /// A case from its nominal march and one that ends with the estimates.
    fn of((case, plan): (&Case, &Plan), observed: &[Vec<Sample>], (nominal, last): (&Traces, &Traces)) -> Self {
        let before = Nominal::of(case, plan, nominal, 0);
        let after = Nominal::of(case, plan, last, last.members() - 1);
        let sensors: Vec<usize> = case.judges().map(|seen| seen.sensor).collect();
        let all = case.observations.iter().zip(before.misfits.iter().zip(&after.misfits));
        let fitted = all.filter(|(seen, _)| sensors.contains(&seen.sensor));
        let residuals = |samples: &Vec<Sample>| {
            samples
                .iter()
                .map(|s| (plan.instants_s[s.instant], s.measured_k - after.temperatures_k[s.sensor][s.instant]))
                .unzip()
        };
        Self {
            misfits: fitted.map(|(_, (before, after))| (*before, *after)).collect(),
            sensors,
            residuals: observed.iter().map(residuals).collect(),
            before,
            after,
        }
    }
}
