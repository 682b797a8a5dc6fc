//! Coverage study: do the 95 % intervals of an estimate contain the true factors in 95 % of repetitions?
//!
//! Synthetic data sets are generated from factors drawn between the side constraints, with noise, and each is fitted
//! like a measurement. Counting coverage tests the intervals without any assumption except the noise model.

#[cfg(feature = "serde")]
pub(crate) mod kept_fits;

use super::estimate::{EstimateError, ParameterEstimates, SearchOptions, estimate};
use super::nominal::samples_in_window;
use super::proportion::Proportion;
use super::twin::Noise;
use crate::case::{Bounds, Case};
use crate::ensemble::{Ensemble, Sampling, SamplingKind};
use crate::march::batching::{MAX_CONCURRENT_STUDIES, run_batched};
use crate::march::{March, MarchError, march_all};
use crate::plan::Plan;
use crate::traces::MemberStatus;

/// Results over all fitted data sets, converged or not.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
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
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
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
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct DataSetFit {
    /// One per estimated factor.
    pub truth: Vec<f64>,
    /// Outcome of the fit.
    pub outcome: FitOutcome,
}

/// Outcome of the fit of a data set.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
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
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
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
/// # Errors
/// When there are no factors or no data to estimate from, or the device fails. A fit that fails is counted.
pub fn coverage_study(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    design: &CoverageDesign,
) -> Result<CoverageStudy, EstimateError> {
    coverage_study_from(case, plan, march, design, Vec::new(), &mut |_| {})
}

/// [`coverage_study`], going on from the first fits of an earlier run. `watch` receives the fits so far after every
/// block of concurrent fits. A march that is stopped ends the study with the fits so far, if there are two.
///
/// # Errors
/// As [`coverage_study`].
pub fn coverage_study_from(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    design: &CoverageDesign,
    first_fits: Vec<DataSetFit>,
    watch: &mut dyn FnMut(&[DataSetFit]),
) -> Result<CoverageStudy, EstimateError> {
    let CoverageDesign { data_sets, truth_bounds: drawn, noise_k, noise, ref search } = *design;
    let estimated = &case.estimate.factors;
    if estimated.is_empty() {
        return Err(EstimateError::no_factors(&[case]));
    }
    let sampling = Sampling { kind: SamplingKind::Normal, seed: noise.seed };
    let ensemble = Ensemble::sample(&case.factors, drawn, &sampling, data_sets);
    let truths: Vec<Vec<f64>> = (0..data_sets)
        .map(|data_set| {
            let drawn = ensemble.member(data_set);
            let of =
                |factor: usize| if estimated.contains(&factor) { drawn[factor] } else { case.factors[factor].nominal };
            (0..case.factors.len()).map(of).collect()
        })
        .collect();
    let data = synthetic_cases(case, plan, march, &truths, noise_k, &noise)?;
    let mut found = first_fits;
    while found.len() < data_sets {
        let first = found.len();
        let block = MAX_CONCURRENT_STUDIES.min(data_sets - first);
        let fits = run_batched(march, plan, block, |number, march| {
            data[first + number].as_ref().map(|data| estimate(&[(data, plan)], march, search))
        });
        let fits = match fits {
            Err(MarchError::Stopped) if first >= 2 => break,
            fits => fits?,
        };
        for (truth, fit) in truths[first..].iter().zip(fits) {
            let outcome = match fit {
                None => FitOutcome::Failed("the march at the true factors failed".to_owned()),
                Some(fit) => fit_outcome(fit?),
            };
            found.push(DataSetFit { truth: estimated.iter().map(|&factor| truth[factor]).collect(), outcome });
        }
        watch(&found);
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

/// The case with synthetic observations for each set of true factors; `None` where the march failed.
fn synthetic_cases(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    truths: &[Vec<f64>],
    noise_k: Option<f64>,
    noise: &Noise,
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
                let noise = noise.sample(&seen.times_s, traces.first + member + 1, seen.sensor);
                let trace_k = traces.trace(member, seen.sensor);
                for (sample, instant) in samples_in_window(case, seen, &plan.instants_s) {
                    let deviation_k = noise_k.unwrap_or(seen.sigma_k[sample]);
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
