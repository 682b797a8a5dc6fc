//! Which factors make the prediction meet the measurement?

mod combination;
mod ends;
mod error;
mod estimand;
mod landscape;
mod likelihood;
mod profile;

pub use combination::Combination;
pub use error::{EstimateError, no_factors};
pub use estimand::Estimand;
pub use landscape::{Landscape, NODES};
pub use profile::Profile;

use super::nominal::{Misfit, Nominal};
use super::sensitivity::{Identifiability, difference_step};
use super::thermocouples::{Part, Sample, Thermocouples, samples};
use crate::case::{Bounds, Case, LossFunction};
use crate::ensemble::{Ensemble, Sampling, SamplingKind};
use crate::fit::interval::{NORMAL_95, lag_one, residual_variance};
use crate::fit::{Loss, Options, Prior, Robust, Rules, Weighed, WithPriors, certainty, minimize_all};
use crate::march::{March, Precision};
use crate::plan::Plan;
use crate::traces::Traces;
use ends::{indistinct, lowest};
use estimand::estimands;
use landscape::Minimised;
use likelihood::{Likelihood, has_effect, times_s, with_priors};
use nalgebra::DMatrix;
use profile::{About, profiled, profiles};

/// Estimated factors and how they were found.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Estimated {
    /// In the order of every vector here.
    pub factors: Vec<Estimand>,
    /// The estimates, one a factor.
    pub values: Vec<f64>,
    /// Half-widths of the intervals over 1.96, so that they have in them what the intervals have; infinite where not determined.
    pub standard_errors: Vec<f64>,
    /// 95 % intervals to first order, under the noise model of the residuals and with the numerical error of the march.
    pub intervals: Vec<(f64, f64)>,
    /// Standard errors of linear least squares, as if residuals were independent and the march exact.
    pub independent_errors: Vec<f64>,
    /// By how much the discretisation error of the march moves each estimate, to first order.
    pub numerical_errors: Vec<f64>,
    /// Whether the data change with each factor between its bounds by more than a tenth of a millikelvin (root mean square).
    pub has_effect: Vec<bool>,
    /// Whether an estimate stands on one of its bounds.
    pub at_bound: Vec<bool>,
    /// Correlations and condition of the estimates.
    pub identifiability: Identifiability,
    /// What pairs of estimates determine that neither does alone.
    pub combinations: Vec<Combination>,
    /// The loss function of the residuals.
    pub loss: Loss,
    /// The side constraints that priors were made of; `None` where there are no priors.
    pub prior: Option<Bounds>,
    /// The points visited, the start first; the objective falls from each to the next.
    pub path: Vec<Turn>,
    /// Where every start ended, the case's own first; the estimate is the lowest.
    pub ends: Vec<End>,
    /// Members marched.
    pub marches: usize,
    /// Why the minimisation ended, as a clause.
    pub termination: String,
    /// Whether it ended at a minimum.
    pub converged: bool,
    /// What to do where it did not converge, as sentences.
    pub advice: String,
    /// One a case, in their order.
    pub fitted: Vec<Fitted>,
    /// Lag-one autocorrelation of the weighted residuals.
    pub autocorrelation: f64,
    /// Correlation time of the most probable noise model, s; zero of white noise.
    pub correlation_time_s: f64,
    /// The share of white noise in the variance of the most probable noise model.
    pub white_share: f64,
    /// Variance of the most probable noise model, in squares of the stated deviations.
    pub noise_variance: f64,
    /// How many independent samples would determine the factors as well.
    pub effective_samples: f64,
    /// Samples fitted, over all cases and sensors.
    pub samples: usize,
    /// By how much the stated deviations fall short of how the data scatter and follow each other: beside priors, in profiles
    /// and in the posterior data count with so many times their deviations.
    pub shortfall: f64,
    /// Of a pair of factors: the objective over the plane of the two.
    pub landscape: Option<Landscape>,
    /// Of the factors they were asked of.
    pub profiles: Vec<Profile>,
}

impl Estimated {
    /// The objective at the start and at the estimates.
    pub fn objectives(&self) -> (f64, f64) {
        let of = |turn: Option<&Turn>| turn.map_or(f64::NAN, |turn| turn.objective);
        (of(self.path.first()), of(self.path.last()))
    }

    /// Whether the data determine an estimate: they change with it, and its interval is no wider than twice its bounds.
    pub fn is_determined(&self, place: usize) -> bool {
        let ((low, high), (least, most)) = (self.intervals[place], self.factors[place].bounds);
        self.has_effect[place] && high - low <= 2.0 * (most - least)
    }
}

/// One of the cases fitted.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Fitted {
    /// Indices of the sensors whose observations were fitted.
    pub sensors: Vec<usize>,
    /// The nominal march.
    pub before: Nominal,
    /// The march at the estimates.
    pub after: Nominal,
    /// Misfit of each fitted observation before and after, over its window.
    pub misfits: Vec<(Misfit, Misfit)>,
    /// One a fitted observation: times and measured less predicted, over its window.
    pub residuals: Vec<(Vec<f64>, Vec<f64>)>,
}

/// One accepted iteration.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Turn {
    /// The point, one value a factor.
    pub values: Vec<f64>,
    /// S, the objective that is minimised (the paper's Eqs 3 and 4 for deviations of 1 K): squares of the residuals in their
    /// standard deviations, or their losses; beside priors over the square of the shortfall, and squares of the priors.
    pub objective: f64,
    /// The damping parameter of the Levenberg-Marquardt step that led here.
    pub damping: f64,
}

/// One start and where it led.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct End {
    /// Where the minimisation started, one value a factor.
    pub start: Vec<f64>,
    /// Where it ended, one value a factor.
    pub values: Vec<f64>,
    /// What is made least: weighted squares or their loss, and those of priors.
    pub objective: f64,
    /// Whether it ended at a minimum.
    pub converged: bool,
    /// Whether no data tell this end from the estimate: its objective is higher by less than a hundredth of what one
    /// standard error adds, or than rounding and the tolerance of the last step account for.
    pub is_least: bool,
}

/// How to look for the least.
#[derive(Clone, Debug)]
pub struct Search {
    /// Options of the minimisation.
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

    let precision = march.backend().precision;
    let parts = runs.iter().zip(&observed).enumerate().map(|(which, ((case, plan), observed))| {
        let places = factors.iter().map(|factor| factor.places[which]).collect();
        Part::new(case, plan, places, observed.concat())
    });
    let mut thermocouples = Thermocouples::new(march, parts.collect(), bounds.clone());
    if matches!(search.options.rules, Rules::Paper { .. }) {
        thermocouples = thermocouples.by_differences();
    }
    let mut problem = Robust { problem: thermocouples, loss };
    let (starts, options) = (starts(&factors, search.starts), &search.options);
    let alone = minimize_all(&mut problem, &starts, options)?;
    let tolerance = search.options.tolerance_step;
    let of_data = &alone[lowest(&alone, |fit| indistinct(fit, &flat, precision, tolerance, 1.0))];
    let numerical_error = problem.problem.discretisation_errors(of_data.point.as_slice())?;
    let priors = priors(&factors, prior);
    let data = Likelihood::of(of_data, loss, &priors, numerical_error, &times_s(runs, &observed));
    let (fits, weight) = if priors.is_empty() {
        (alone, 1.0)
    } else {
        let weighed = Weighed { problem: &mut problem, weight: data.weight() };
        (minimize_all(&mut WithPriors { problem: weighed, priors: priors.clone() }, &starts, options)?, data.weight())
    };
    let least = lowest(&fits, |fit| indistinct(fit, &flat, precision, tolerance, weight));
    let fit = &fits[least];
    let Robust { mut problem, .. } = problem;
    let nominal = problem.nominal()?;
    let last = problem.at(fit.point.as_slice())?;
    let minimised = Minimised { loss, weight, priors: &priors };
    let step = search.options.difference_step;
    let landscape =
        if search.landscape { minimised.landscape(&mut problem, &bounds, &fit.jacobian, step)? } else { None };
    let fitted: Vec<Fitted> = (runs.iter().zip(&observed).zip(nominal.iter().zip(&last)))
        .map(|((run, observed), traces)| Fitted::of(*run, observed, traces))
        .collect();

    let tangent = data.tangent(fit, weight, flat.len());
    let mut weighted = tangent.residuals.iter().copied();
    let traces: Vec<Vec<f64>> =
        observed.iter().flatten().map(|trace| weighted.by_ref().take(trace.len()).collect()).collect();
    let found = data.linearized(&tangent, &priors);
    let values: Vec<f64> = fit.point.iter().copied().collect();
    let names: Vec<&str> = factors.iter().map(|factor| factor.factor.name.as_str()).collect();
    let all: Vec<usize> = (0..factors.len()).collect();
    let independent = residual_variance(
        loss.pseudo_residuals(&tangent.residuals, all.len() as f64).norm_squared(),
        flat.len(),
        factors.len(),
    );
    let judged = Identifiability::of(
        &names,
        &all,
        &values,
        &with_priors(&tangent.jacobian, &priors, data.unit()),
        &flat,
        data.unit(),
    );
    let independent_errors = certainty(&with_priors(&tangent.jacobian, &priors, independent), independent);
    let has_effect = has_effect(&tangent.jacobian, &flat, &bounds);
    let known = |(half, has_effect): (f64, &bool)| if *has_effect { half } else { f64::INFINITY };
    let halves: Vec<f64> = found.half_widths().into_iter().zip(&has_effect).map(known).collect();

    // The rise of the objective at the ends of the linear interval, were the problem linear.
    let levels = halves.iter().zip(&judged.standard_errors).map(|(half, error)| (half / error).powi(2));
    let levels: Vec<f64> = levels.map(|level| if level.is_finite() { level } else { NORMAL_95.powi(2) }).collect();
    let shortfall = data.inflation();
    // A fit without a residual left, or without samples to spare, has no scatter to weigh the data by.
    let profiled = if shortfall.is_normal() { profiled } else { Vec::new() };
    let weighed = Weighed { problem: Robust { problem: &mut problem, loss }, weight: data.weight() };
    let about = About {
        values: &values,
        bounds: &bounds,
        errors: &judged.standard_errors,
        levels: &levels,
        correlation: &judged.correlation,
    };
    let profiles = profiles(&mut WithPriors { problem: weighed, priors }, &profiled, &about, &search.options)?;
    // S of one is one standard error: by itself where priors are, else in units of the data's inflation.
    let unit = if prior.is_some() || !shortfall.is_finite() { 1.0 } else { shortfall.powi(2) };
    let indistinct = indistinct(fit, &flat, precision, tolerance, weight);
    let ends = fits.iter().map(|other| End {
        start: other.path[0].point.iter().copied().collect(),
        values: other.point.iter().copied().collect(),
        objective: other.objective,
        converged: other.termination.converged(),
        is_least: other.objective - fit.objective <= 0.01 * unit + indistinct,
    });
    Ok(Estimated {
        standard_errors: halves.iter().map(|half| half / NORMAL_95).collect(),
        intervals: values.iter().zip(&halves).map(|(value, half)| (value - half, value + half)).collect(),
        independent_errors: independent_errors.standard_errors,
        numerical_errors: found.numerical_errors(),
        has_effect,
        at_bound: values.iter().zip(&bounds).map(|(value, (low, high))| value <= low || value >= high).collect(),
        combinations: Combination::all(&values, &judged.correlation, &found),
        identifiability: judged,
        loss,
        prior,
        path: (fit.path.iter())
            .map(|turn| Turn {
                values: turn.point.iter().copied().collect(),
                objective: turn.objective,
                damping: turn.damping,
            })
            .collect(),
        ends: ends.collect(),
        marches: problem.marches,
        termination: fit.termination.to_string(),
        converged: fit.termination.converged(),
        advice: fit.termination.advice().to_owned(),
        fitted,
        autocorrelation: lag_one(&traces),
        correlation_time_s: data.memory().0,
        white_share: data.memory().1,
        noise_variance: data.variance,
        effective_samples: data.effective_samples,
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
    let first = cases.first().ok_or_else(|| EstimateError::no_factors(cases))?;
    match cases.iter().find(|case| asked(case) != asked(first)) {
        Some(case) => Err(EstimateError::OtherObjective { first: first.id.clone(), case: case.id.clone() }),
        None => Ok((first.estimate.loss.into(), first.estimate.prior)),
    }
}

impl From<LossFunction> for Loss {
    fn from(loss: LossFunction) -> Self {
        match loss {
            LossFunction::Squares => Self::Squares,
            LossFunction::SoftL1 { width } => Self::SoftL1 { width },
            LossFunction::Huber { width } => Self::Huber { width },
        }
    }
}

/// That every case has something to estimate and to estimate it from.
fn check(cases: &[&Case], factors: &[Estimand], observed: &[Vec<Vec<Sample>>]) -> Result<(), EstimateError> {
    if factors.is_empty() {
        return Err(EstimateError::no_factors(cases));
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

impl Fitted {
    /// A case from its nominal march and the one at the estimates.
    fn of((case, plan): (&Case, &Plan), observed: &[Vec<Sample>], (nominal, last): (&Traces, &Traces)) -> Self {
        let before = Nominal::of(case, plan, nominal, 0);
        let after = Nominal::of(case, plan, last, 0);
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
