//! Coverage study: do the 95 % intervals of an estimate contain the true factors in 95 % of repetitions?
//!
//! Synthetic data sets are generated from factors drawn between the side constraints, with noise, and each is fitted
//! like a measurement. Counting coverage tests the intervals without any assumption except the noise model.

mod fit_row;

use super::estimate::{EstimateError, ParameterEstimates, SearchOptions, estimate};
use super::nominal::samples_in_window;
use super::twin::Noise;
use crate::case::{Bounds, Case};
use crate::ensemble::{Ensemble, Sampling, SamplingKind};
use crate::fit::proportion::Proportion;
use crate::kept_work::work_log::{NoLog, WorkLog};
use crate::march::batching::{MAX_CONCURRENT_STUDIES, run_batched};
use crate::march::{March, MarchError, march_all};
use crate::plan::Plan;
use crate::traces::MemberStatus;
use std::ops::Range;

/// Results over all fitted data sets, converged or not.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct CoverageStudy {
    /// One per estimated factor.
    pub factors: Vec<FactorCoverage>,
    /// Data sets of the study.
    pub requested: usize,
    /// One per data set that was fitted: all of them unless the study was stopped.
    pub fits: Vec<DataSetFit>,
    /// Standard deviation of the noise, K; `None` where each sample has the one that the case states.
    pub noise_k: Option<f64>,
    /// Correlation time and seed of the noise.
    pub noise: Noise,
    /// The side constraints between which true factors were drawn.
    pub truth_bounds: Bounds,
    /// Coverage over all factors of all fitted data sets: intervals that contain the truth.
    pub covered: Proportion,
    /// Samples per data set.
    pub samples: usize,
    /// Mean effective sample size of a data set.
    pub effective_samples: f64,
}

/// Error and coverage of one factor over the fitted data sets.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct FactorCoverage {
    /// The name of the factor.
    pub name: String,
    /// Index of the factor in the case.
    pub factor: usize,
    /// Bias: mean of estimate minus truth.
    pub bias: f64,
    /// Standard error of the bias.
    pub bias_error: f64,
    /// Root mean square of estimate minus truth.
    pub rms: f64,
    /// Mean half-width of the 95 % intervals.
    pub half_width: f64,
    /// Data sets whose 95 % interval contains the truth.
    pub covered: Proportion,
    /// Data sets whose estimate is on a bound; they count in every other number.
    pub at_bound: usize,
}

/// The fit of one data set.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct DataSetFit {
    /// One per estimated factor.
    pub truth: Vec<f64>,
    /// Outcome of the fit.
    pub outcome: FitOutcome,
}

/// Outcome of the fit of a data set.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub enum FitOutcome {
    /// The fit converged to a minimum.
    Converged(FitResult),
    /// The fit did not converge: its result, which counts because a user would read it, and the reason.
    NotConverged(FitResult, String),
    /// No data set was generated; the reason.
    Failed(String),
}

/// The result of one fit: one entry per estimated factor.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct FitResult {
    /// The estimates.
    pub values: Vec<f64>,
    /// The 95 % intervals.
    pub intervals: Vec<(f64, f64)>,
    /// Whether each estimate is on a bound.
    pub at_bound: Vec<bool>,
    effective_samples: f64,
    samples: usize,
}

/// Settings of a coverage study.
#[derive(Clone, Debug)]
pub struct CoverageDesign {
    /// Number of data sets.
    pub data_sets: usize,
    /// The side constraints between which true factors are drawn.
    pub truth_bounds: Bounds,
    /// Standard deviation of the noise, K; `None` uses the one that the case states for each sample.
    pub noise_k: Option<f64>,
    /// Correlation time and seed of the noise.
    pub noise: Noise,
    /// Settings of each fit.
    pub search: SearchOptions,
}

/// Generate synthetic data sets at the times of the case's observations, and fit each with the same settings. The
/// estimated factors are drawn; the others are nominal, as in the fit, because the effect of a wrong model is a
/// separate question. All fits are marched as one batch, and their results do not depend on its size.
///
/// `log` keeps the fits. A march that is stopped ends the study with the fits so far, if there are two.
///
/// # Errors
/// When there are no factors or no data to estimate from, or the device fails. A fit that fails is counted.
pub fn coverage_study(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    design: &CoverageDesign,
    log: &mut dyn WorkLog,
) -> Result<CoverageStudy, EstimateError> {
    let CoverageDesign { data_sets, truth_bounds: drawn, noise_k, noise, .. } = *design;
    let estimated = estimated(case)?;
    let mut found: Vec<DataSetFit> = Vec::with_capacity(data_sets);
    while found.len() < data_sets
        && let Some(row) = log.next()
    {
        found.push(DataSetFit::from_row(row, estimated.len()));
    }
    while found.len() < data_sets {
        let first = found.len();
        let block = first..data_sets.min(first + MAX_CONCURRENT_STUDIES);
        let fits = match fits(case, plan, march, design, block) {
            Err(EstimateError::March(MarchError::Stopped)) if first >= 2 => break,
            fits => fits?,
        };
        fits.iter().for_each(|fit| log.add(&fit.row()));
        found.extend(fits);
    }
    let fitted: Vec<(&[f64], &FitResult)> =
        found.iter().filter_map(|fit| Some((fit.truth.as_slice(), fit.outcome.result()?))).collect();
    let recovered: Vec<FactorCoverage> = estimated
        .iter()
        .enumerate()
        .map(|(place, &factor)| factor_coverage(case.factors[factor].name.clone(), factor, place, &fitted))
        .collect();
    let mean = |of: fn(&FitResult) -> f64| fitted.iter().map(|(_, found)| of(found)).sum::<f64>() / fitted.len() as f64;
    Ok(CoverageStudy {
        covered: Proportion {
            count: recovered.iter().map(|factor| factor.covered.count).sum(),
            total: recovered.iter().map(|factor| factor.covered.total).sum(),
        },
        effective_samples: mean(|found| found.effective_samples),
        samples: fitted.first().map_or(0, |(_, found)| found.samples),
        factors: recovered,
        noise_k,
        noise,
        truth_bounds: drawn,
        requested: data_sets,
        fits: found,
    })
}

/// Numbers of a row in the log of a coverage study: the fit of a data set.
///
/// # Errors
/// When there are no factors to estimate.
pub(crate) fn log_columns(case: &Case) -> Result<usize, EstimateError> {
    Ok(DataSetFit::columns(estimated(case)?.len()))
}

/// The factors to estimate.
fn estimated(case: &Case) -> Result<&[usize], EstimateError> {
    let factors = &case.estimate.factors;
    if factors.is_empty() { Err(EstimateError::no_factors(&[case])) } else { Ok(factors) }
}

/// Some rows of the log of a coverage study, none of which depends on others.
///
/// # Errors
/// As [`coverage_study`].
pub(crate) fn log_rows(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    design: &CoverageDesign,
    rows: Range<usize>,
) -> Result<Vec<Vec<f64>>, EstimateError> {
    let mut found = Vec::with_capacity(rows.len());
    for first in rows.clone().step_by(MAX_CONCURRENT_STUDIES) {
        let block = first..rows.end.min(first + MAX_CONCURRENT_STUDIES);
        found.extend(fits(case, plan, march, design, block)?.iter().map(DataSetFit::row));
    }
    Ok(found)
}

impl CoverageStudy {
    /// Whether the study was stopped before its last data set.
    pub fn is_partial(&self) -> bool {
        self.fits.len() < self.requested
    }

    /// Number of data sets whose fit converged.
    pub fn converged(&self) -> usize {
        self.fits.iter().filter(|fit| matches!(fit.outcome, FitOutcome::Converged(_))).count()
    }

    /// Reasons of failed fits, with their counts.
    pub fn failures(&self) -> Vec<(&str, usize)> {
        let mut failures: Vec<(&str, usize)> = Vec::new();
        for fit in &self.fits {
            let (FitOutcome::Failed(reason) | FitOutcome::NotConverged(_, reason)) = &fit.outcome else { continue };
            match failures.iter_mut().find(|(known, _)| known == reason) {
                Some((_, count)) => *count += 1,
                None => failures.push((reason, 1)),
            }
        }
        failures
    }
}

impl FitOutcome {
    /// Result of the fit, converged or not.
    pub fn result(&self) -> Option<&FitResult> {
        match self {
            Self::Converged(found) | Self::NotConverged(found, _) => Some(found),
            Self::Failed(_) => None,
        }
    }
}

/// The fits of some data sets, which run together.
fn fits(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    design: &CoverageDesign,
    data_sets: Range<usize>,
) -> Result<Vec<DataSetFit>, EstimateError> {
    let estimated = estimated(case)?;
    let (truths, data): (Vec<Vec<f64>>, Vec<Option<Case>>) =
        self::data_sets(case, plan, march, design, data_sets)?.into_iter().unzip();
    let fits = run_batched(march, plan, data.len(), |number, march| {
        data[number].as_ref().map(|data| estimate(&[(data, plan)], march, &design.search, &mut NoLog))
    })?;
    let fit = |(truth, fit): (Vec<f64>, Option<Result<ParameterEstimates, EstimateError>>)| {
        let truth = estimated.iter().map(|&factor| truth[factor]).collect();
        let outcome = match fit {
            None => FitOutcome::Failed(NO_DATA.to_owned()),
            Some(fit) => fit_outcome(fit?),
        };
        Ok(DataSetFit { truth, outcome })
    };
    truths.into_iter().zip(fits).map(fit).collect()
}

/// The true factors of a data set, and the case with its synthetic observations; `None` where the march failed.
type DataSet = (Vec<f64>, Option<Case>);

/// Some data sets of a design.
///
/// # Errors
/// As [`coverage_study`].
pub(crate) fn data_sets(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    design: &CoverageDesign,
    numbers: Range<usize>,
) -> Result<Vec<DataSet>, EstimateError> {
    let estimated = estimated(case)?;
    let sampling = Sampling { kind: SamplingKind::Normal, seed: design.noise.seed };
    let ensemble = Ensemble::sample(&case.factors, design.truth_bounds, &sampling, design.data_sets);
    let truth = |data_set: usize| -> Vec<f64> {
        let drawn = ensemble.member(data_set);
        let of = |factor: usize| if estimated.contains(&factor) { drawn[factor] } else { case.factors[factor].nominal };
        (0..case.factors.len()).map(of).collect()
    };
    let truths: Vec<Vec<f64>> = numbers.clone().map(truth).collect();
    let data = synthetic_cases(case, plan, march, &truths, design, numbers.start)?;
    Ok(truths.into_iter().zip(data).collect())
}

/// Why a data set has no fit.
const NO_DATA: &str = "the march at the true factors failed";

/// The case with synthetic observations for each set of true factors, from that of data set `first` on; `None` where
/// the march failed.
fn synthetic_cases(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    truths: &[Vec<f64>],
    design: &CoverageDesign,
    first: usize,
) -> Result<Vec<Option<Case>>, MarchError> {
    let ensemble = Ensemble::from_values(case.factors.len(), truths.concat());
    let mut data = Vec::with_capacity(truths.len());
    march_all(march, &plan.clone().without_gauges(), &ensemble, &mut |traces| {
        for member in 0..traces.members() {
            if traces.statuses[member] != MemberStatus::Completed {
                data.push(None);
                continue;
            }
            let mut synthetic = case.clone();
            for (seen, made) in case.observations.iter().zip(&mut synthetic.observations) {
                // Data sets are numbered from one, because the random stream of number zero draws the true factors.
                let noise = design.noise.sample(&seen.times_s, first + traces.first + member + 1, seen.sensor);
                let trace_k = traces.trace(member, seen.sensor);
                for (sample, instant) in samples_in_window(case, seen, &plan.instants_s) {
                    let deviation_k = design.noise_k.unwrap_or(seen.sigma_k[sample]);
                    made.temperatures_k[sample] = trace_k[instant] + deviation_k * noise[sample];
                }
            }
            data.push(Some(synthetic));
        }
    })?;
    Ok(data)
}

fn fit_outcome(fit: ParameterEstimates) -> FitOutcome {
    let found = FitResult {
        values: fit.values,
        intervals: fit.intervals,
        at_bound: fit.at_bound,
        effective_samples: fit.effective_samples,
        samples: fit.samples,
    };
    if fit.converged { FitOutcome::Converged(found) } else { FitOutcome::NotConverged(found, fit.termination) }
}

fn factor_coverage(name: String, factor: usize, place: usize, fitted: &[(&[f64], &FitResult)]) -> FactorCoverage {
    let of = fitted.len();
    let count = of as f64;
    let off: Vec<f64> = fitted.iter().map(|(truth, found)| found.values[place] - truth[place]).collect();
    let bias = off.iter().sum::<f64>() / count;
    let variance = off.iter().map(|off| (off - bias).powi(2)).sum::<f64>() / (count - 1.0);
    let holds = |(truth, found): &&(&[f64], &FitResult)| {
        let (low, high) = found.intervals[place];
        (low..=high).contains(&truth[place])
    };
    let half_width = |(_, found): &(&[f64], &FitResult)| (found.intervals[place].1 - found.intervals[place].0) / 2.0;
    FactorCoverage {
        name,
        factor,
        bias,
        bias_error: (variance / count).sqrt(),
        rms: (off.iter().map(|off| off * off).sum::<f64>() / count).sqrt(),
        half_width: fitted.iter().map(half_width).sum::<f64>() / count,
        covered: Proportion { count: fitted.iter().filter(holds).count(), total: of },
        at_bound: fitted.iter().filter(|(_, found)| found.at_bound[place]).count(),
    }
}
