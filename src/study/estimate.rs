//! Estimation of factors: weighted nonlinear least squares on thermocouple data, with intervals, profiles and
//! diagnostics.

mod combination;
mod error;
mod estimand;
mod landscape;
mod likelihood;
mod multi_start;
mod profile;
mod residual_faults;
mod start_results;

pub use combination::Combination;
pub use error::{EstimateError, no_factors};
pub use estimand::Estimand;
pub use landscape::{Landscape, NODES};
pub use profile::Profile;

pub(in crate::study) use multi_start::priors;

use super::nominal::{Misfit, Prediction};
use super::sensitivity::{Identifiability, difference_step};
use super::thermocouple_residuals::Sample;
use crate::case::{Bounds, Case, LossFunction};
use crate::ensemble::Ensemble;
use crate::fit::interval::{NORMAL_95, lag_one_autocorrelation, residual_variance};
use crate::fit::{
    DampingStrategy, GoodnessOfFit, Options, Prior, RobustLoss, RobustProblem, WeightedProblem, WithPriors,
    covariance_summary,
};
use crate::kept_work::work_log::WorkLog;
use crate::march::{March, Precision};
use crate::plan::Plan;
use crate::traces::Traces;
use estimand::estimands;
use landscape::Objective;
use likelihood::{has_effect, with_priors};
use multi_start::{Minimisations, MultiStart};
use profile::{LinearApproximation, profile_indices, profiles};
use start_results::StartEnd;
use std::ops::Range;

/// Estimated factors, their uncertainty, and the minimisation that found them.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct ParameterEstimates {
    /// The factors; every other vector has their order.
    pub factors: Vec<Estimand>,
    /// The estimates, one per factor.
    pub values: Vec<f64>,
    /// Half-widths of the intervals divided by 1.96, so they include noise correlation and numerical error; infinite
    /// where the factor is not determined.
    pub standard_errors: Vec<f64>,
    /// Linearised 95 % intervals, under the noise model of the residuals and including the discretisation error of the
    /// march.
    pub intervals: Vec<(f64, f64)>,
    /// Standard errors of linear least squares, for independent residuals and an exact march.
    pub independent_errors: Vec<f64>,
    /// Shift of each estimate due to the discretisation error of the march, to first order.
    pub numerical_errors: Vec<f64>,
    /// Whether the data depend on each factor: varying it between its bounds changes them by more than 0.1 mK (root
    /// mean square).
    pub has_effect: Vec<bool>,
    /// Whether each estimate is on one of its bounds.
    pub at_bound: Vec<bool>,
    /// Correlations and condition number of the estimates.
    pub identifiability: Identifiability,
    /// Products and ratios of correlated estimates that are determined better than each alone.
    pub combinations: Vec<Combination>,
    /// The loss function of the residuals.
    pub loss: RobustLoss,
    /// The side constraints that define the priors; `None` without priors.
    pub prior: Option<Bounds>,
    /// Accepted iterations, the start first; the objective decreases along the path.
    pub iterations: Vec<Iteration>,
    /// The end of the minimisation from each start, the case's own first; the estimate is the lowest.
    pub start_results: Vec<StartResult>,
    /// Members marched.
    pub marches: usize,
    /// Reason of termination, as a clause.
    pub termination: String,
    /// Whether it ended at a minimum.
    pub converged: bool,
    /// Advice where it did not converge, as sentences.
    pub advice: String,
    /// One per case, in their order.
    pub fitted: Vec<CaseFit>,
    /// Lag-one autocorrelation of the weighted residuals.
    pub autocorrelation: f64,
    /// Probability that the residuals are correlated, by the noise model.
    pub correlation_probability: f64,
    /// Correlation time of the most probable noise model, s; zero for white noise.
    pub correlation_time_s: f64,
    /// Fraction of white noise in the variance of the most probable noise model.
    pub white_share: f64,
    /// Variance of the most probable noise model, in squares of the stated deviations.
    pub noise_variance: f64,
    /// Root mean square of the stated standard deviations, K.
    pub stated_deviation_k: f64,
    /// Effective sample size: independent samples that would determine the factors as well.
    pub effective_samples: f64,
    /// Samples fitted, over all cases and sensors.
    pub samples: usize,
    /// χ² of the residuals over their stated standard deviations, and what follows from it.
    pub goodness_of_fit: GoodnessOfFit,
    /// Ratio of the effective noise level, from scatter and autocorrelation of the residuals, to the stated standard
    /// deviations. Next to priors, in profiles and in the posterior, the stated deviations are multiplied by it.
    pub noise_inflation: f64,
    /// Objective over the plane of the two factors, for an estimate of two.
    pub landscape: Option<Landscape>,
    /// Profiles of the requested factors.
    pub profiles: Vec<Profile>,
}

impl ParameterEstimates {
    /// The objective at the start and at the estimates.
    pub fn objectives(&self) -> (f64, f64) {
        let of = |turn: Option<&Iteration>| turn.map_or(f64::NAN, |turn| turn.objective);
        (of(self.iterations.first()), of(self.iterations.last()))
    }

    /// Standard deviation of the noise of a sample, K: that of the noise model, of a sample with the mean square of the
    /// stated standard deviations.
    pub fn noise_deviation_k(&self) -> f64 {
        self.noise_variance.sqrt() * self.stated_deviation_k
    }

    /// Whether the data determine an estimate: they depend on it, and its interval is at most twice as wide as its
    /// bounds.
    pub fn is_determined(&self, place: usize) -> bool {
        let ((low, high), (least, most)) = (self.intervals[place], self.factors[place].bounds);
        self.has_effect[place] && high - low <= 2.0 * (most - least)
    }
}

/// Fit of one case.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct CaseFit {
    /// Indices of the sensors whose observations were fitted.
    pub sensors: Vec<usize>,
    /// The prediction at the nominal factors.
    pub before: Prediction,
    /// The prediction at the estimates.
    pub after: Prediction,
    /// Misfit of each fitted observation before and after, over its window.
    pub misfits: Vec<(Misfit, Misfit)>,
    /// One per fitted observation: times (s) and measured minus predicted temperature (K), over its window.
    pub residuals: Vec<(Vec<f64>, Vec<f64>)>,
}

impl ParameterEstimates {
    /// Members of one of the cases at some points, with the other factors at their nominal values.
    pub(crate) fn members<'p>(&self, case: &Case, which: usize, points: impl Iterator<Item = &'p [f64]>) -> Ensemble {
        let row = |point: &[f64]| {
            let mut row: Vec<f64> = case.factors.iter().map(|factor| factor.nominal).collect();
            for (factor, &value) in self.factors.iter().zip(point) {
                if let Some(index) = factor.factor_indices[which] {
                    row[index] = value;
                }
            }
            row
        };
        Ensemble::from_values(case.factors.len(), points.flat_map(row).collect())
    }
}

/// One accepted iteration of the minimisation.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct Iteration {
    /// The point, one value per factor.
    pub values: Vec<f64>,
    /// The objective S (the paper's Eqs 3 and 4 for standard deviations of 1 K): the sum of squared standardised
    /// residuals, or of their losses. With priors this sum is divided by the square of the noise inflation, and the
    /// squared standardised deviations from the priors are added.
    pub objective: f64,
    /// Damping parameter of the Levenberg–Marquardt step that led here.
    pub damping: f64,
}

/// One start of the minimisation and its end.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct StartResult {
    /// Start, one value per factor.
    pub start: Vec<f64>,
    /// End, one value per factor.
    pub values: Vec<f64>,
    /// The objective at the end.
    pub objective: f64,
    /// Whether it ended at a minimum.
    pub converged: bool,
    /// Whether the objective equals that of the estimate within tolerance: the excess is below a hundredth of the rise
    /// at one standard error, or below rounding and the tolerance of the last step.
    pub is_best: bool,
}

/// Settings of the minimisation.
#[derive(Clone, Debug)]
pub struct SearchOptions {
    /// Options of the minimisation.
    pub options: Options,
    /// Number of starts, at least one: the case's own, and others drawn uniformly between the bounds. All are minimised
    /// as one batch, and the lowest end is the estimate.
    pub starts: usize,
    /// Names of the factors whose profiles are computed.
    pub profiles: Vec<String>,
    /// Whether the objective is mapped over a pair of factors; the map takes more members than the estimate.
    pub landscape: bool,
}

impl SearchOptions {
    /// One start, with the finite-difference step of a precision. In f32 the tolerance of the reduction is above the
    /// error of the differences, below which no reduction is reliable.
    pub fn for_precision(precision: Precision) -> Self {
        let difference_step = difference_step(precision);
        let options = match precision {
            Precision::F32 => Options { difference_step, tolerance_reduction: 1e-6, ..Options::default() },
            Precision::F64 => Options { difference_step, ..Options::default() },
        };
        Self { options, starts: 1, profiles: Vec::new(), landscape: true }
    }
}

/// The paper's minimisation rules. The paper leaves the tolerances open. For standardised residuals a rise of S by 1 is
/// one standard error, so 0.01 is a tenth of a standard error; a step of a millionth of a factor is below any reported
/// digit.
pub const PAPER_RULES: DampingStrategy = DampingStrategy::Paper {
    initial_damping: 1e-3,
    tolerance_objective: 1e-2,
    tolerance_gradient: 1e-2,
    tolerance_step: 1e-6,
};

/// Estimate the factors that the cases select, from the sensors and windows that they select, as one least-squares
/// problem. A factor that cases share is one variable. `log` keeps the minimisations.
///
/// # Errors
/// When a case selects no factor or no data, the cases are incompatible, or the device fails.
pub fn estimate(
    runs: &[(&Case, &Plan)],
    march: &mut dyn March,
    search: &SearchOptions,
    log: &mut dyn WorkLog,
) -> Result<ParameterEstimates, EstimateError> {
    let mut minimiser = MultiStart::new(runs, march, search)?;
    let profiled = profile_indices(&minimiser.factors, &search.profiles)?;
    let of_data = minimiser.minimise(None, log)?;
    let data = minimiser.likelihood(&of_data.fit)?;
    let (found, weight) = if minimiser.priors.is_empty() {
        (of_data, 1.0)
    } else {
        (minimiser.minimise(Some(data.weight()), log)?, data.weight())
    };
    let Minimisations { fit, lowest, ends } = found;
    let MultiStart { problem, factors, bounds, prior, priors, observed, samples: flat, .. } = minimiser;
    let RobustProblem { mut problem, loss } = problem;
    let nominal = problem.march_nominal()?;
    let last = problem.march_at(fit.point.as_slice())?;
    let minimised = Objective { loss, weight, priors: &priors };
    let step = search.options.difference_step;
    let landscape =
        if search.landscape { minimised.landscape(&mut problem, &bounds, &fit.jacobian, step)? } else { None };
    let fitted: Vec<CaseFit> = (runs.iter().zip(&observed).zip(nominal.iter().zip(&last)))
        .map(|((run, observed), traces)| CaseFit::of(*run, observed, traces))
        .collect();

    let residuals_k = fitted.iter().flat_map(|fit| &fit.residuals).flat_map(|(_, residuals_k)| residuals_k);
    let standardised = residuals_k.zip(&flat).map(|(residual_k, sample)| residual_k / sample.sigma_k);
    let goodness_of_fit = GoodnessOfFit::of(standardised, factors.len());
    let tangent = data.tangent(&fit, weight, flat.len());
    let mut weighted = tangent.residuals.iter().copied();
    let traces: Vec<Vec<f64>> =
        observed.iter().flatten().map(|trace| weighted.by_ref().take(trace.len()).collect()).collect();
    let local = Prior::linearized(&priors, &fit.point);
    let found = data.linearized(&tangent, &local);
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
        &with_priors(&tangent.jacobian, &local, data.scale_or_one()),
        &flat,
        data.scale_or_one(),
    );
    let independent_errors = covariance_summary(&with_priors(&tangent.jacobian, &local, independent), independent);
    let has_effect = has_effect(&tangent.jacobian, &flat, &bounds);
    let known = |(half, has_effect): (f64, &bool)| if *has_effect { half } else { f64::INFINITY };
    let halves: Vec<f64> = found.half_widths().into_iter().zip(&has_effect).map(known).collect();

    // Rise of the objective at the ends of the linear interval, if the problem were linear.
    let levels = halves.iter().zip(&judged.standard_errors).map(|(half, error)| (half / error).powi(2));
    let levels: Vec<f64> = levels.map(|level| if level.is_finite() { level } else { NORMAL_95.powi(2) }).collect();
    let noise_inflation = data.noise_inflation();
    // A fit with zero residuals or no spare samples has no scatter to weight the data by.
    let profiled = if noise_inflation.is_normal() { profiled } else { Vec::new() };
    let weighed = WeightedProblem { problem: RobustProblem { problem: &mut problem, loss }, weight: data.weight() };
    let about = LinearApproximation {
        values: &values,
        bounds: &bounds,
        errors: &judged.standard_errors,
        levels: &levels,
        correlation: &judged.correlation,
    };
    let profiles = profiles(&mut WithPriors { problem: weighed, priors }, &profiled, &about, &search.options)?;
    // A rise of S by one is one standard error with priors; without priors, by the square of the noise inflation.
    let unit = if prior.is_some() || !noise_inflation.is_finite() { 1.0 } else { noise_inflation.powi(2) };
    let indistinct = ends[lowest].tolerance;
    let ends = ends.into_iter().map(|end| StartResult {
        is_best: end.objective - fit.objective <= 0.01 * unit + indistinct,
        start: end.start,
        values: end.values,
        objective: end.objective,
        converged: end.converged,
    });
    Ok(ParameterEstimates {
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
        iterations: (fit.path.iter())
            .map(|turn| Iteration {
                values: turn.point.iter().copied().collect(),
                objective: turn.objective,
                damping: turn.damping,
            })
            .collect(),
        start_results: ends.collect(),
        marches: problem.marches,
        termination: fit.termination.to_string(),
        converged: fit.termination.converged(),
        advice: fit.termination.advice().to_owned(),
        fitted,
        autocorrelation: lag_one_autocorrelation(&traces),
        correlation_probability: data.correlation_probability(),
        correlation_time_s: data.noise_parameters().0,
        white_share: data.noise_parameters().1,
        noise_variance: data.variance,
        stated_deviation_k: (flat.iter().map(|sample| sample.sigma_k.powi(2)).sum::<f64>() / flat.len() as f64).sqrt(),
        effective_samples: data.effective_samples,
        samples: flat.len(),
        goodness_of_fit,
        noise_inflation,
        landscape,
        profiles,
        values,
        factors,
    })
}

/// Number of columns and of rows of the log of an estimate: one row for the end of each minimisation.
///
/// # Errors
/// When the cases are incompatible.
pub(crate) fn log_size(cases: &[&Case], search: &SearchOptions) -> Result<(usize, usize), EstimateError> {
    let rounds = if cases.iter().any(|case| case.estimate.prior.is_some()) { 2 } else { 1 };
    Ok((StartEnd::columns(estimands(cases)?.len()), rounds * search.starts))
}

/// Some rows of the log of an estimate, which depend on no others but for those with priors, which depend on all those
/// of the data alone. The log has these, or they are computed.
///
/// # Errors
/// As [`estimate`].
pub(crate) fn log_rows(
    runs: &[(&Case, &Plan)],
    march: &mut dyn March,
    search: &SearchOptions,
    rows: Range<usize>,
    log: &mut dyn WorkLog,
) -> Result<Vec<Vec<f64>>, EstimateError> {
    let (mut minimiser, starts) = (MultiStart::new(runs, march, search)?, search.starts);
    let mut found = minimiser.rows(rows.start.min(starts)..rows.end.min(starts), None)?;
    if rows.end > starts {
        let of_data = minimiser.minimise(None, log)?;
        let weight = minimiser.likelihood(&of_data.fit)?.weight();
        found.extend(minimiser.rows(rows.start.saturating_sub(starts)..rows.end - starts, Some(weight))?);
    }
    Ok(found)
}

impl From<LossFunction> for RobustLoss {
    fn from(loss: LossFunction) -> Self {
        match loss {
            LossFunction::LeastSquares => Self::Squares,
            LossFunction::SoftL1 { width } => Self::SoftL1 { width },
            LossFunction::Huber { width } => Self::Huber { width },
        }
    }
}

impl CaseFit {
    /// The fit of a case, from its march at the nominal factors and its march at the estimates.
    fn of((case, plan): (&Case, &Plan), observed: &[Vec<Sample>], (nominal, last): (&Traces, &Traces)) -> Self {
        let before = Prediction::of(case, plan, nominal, 0);
        let after = Prediction::of(case, plan, last, 0);
        let sensors: Vec<usize> = case.fitted_observations().map(|seen| seen.sensor).collect();
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
