//! Does an estimate find the truth, and do its intervals hold it as often as they say?
//!
//! Data sets are made of truths drawn between the side constraints, with noise, and each is fitted as a measurement would be.
//! What they leave is judged by counting: this is the only test of an interval that takes nothing for granted but the noise.

use super::estimate::{EstimateError, Estimated, Search, estimate};
use super::nominal::trusted;
use super::proportion::Proportion;
use super::twin::Noise;
use crate::case::{Bounds, Case};
use crate::ensemble::{Ensemble, Sampling, SamplingKind};
use crate::march::together::together;
use crate::march::{March, MarchError, march_all};
use crate::plan::Plan;
use crate::traces::Arrival;

/// What many twins of a case say of its estimates. All of it is over the twins that were fitted, whether the fit converged or not.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Recovery {
    /// One a factor estimated.
    pub recovered: Vec<Recovered>,
    /// One a data set.
    pub twins: Vec<TwinFit>,
    /// The standard deviation of the noise, K; `None` where each sample had the one that the case states of it.
    pub noise_k: Option<f64>,
    /// Correlation time and seed of the noise.
    pub noise: Noise,
    /// Between which side constraints truths were drawn.
    pub drawn: Bounds,
    /// Of all factors of all twins fitted, those whose interval held the truth.
    pub covered: Proportion,
    /// Samples of each data set, and of how many independent ones they carry the information on average.
    pub samples: usize,
    /// How many independent samples carry the information of those of a data set, on average.
    pub effective_samples: f64,
}

/// How well one factor was found, over the twins fitted.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Recovered {
    /// The name of the factor.
    pub name: String,
    /// Its place among the factors of the case.
    pub factor: usize,
    /// Mean of estimate less truth, its standard error, and the root mean square.
    pub bias: f64,
    /// Standard error of the bias.
    pub bias_error: f64,
    /// Root mean square of estimate less truth.
    pub rms: f64,
    /// Mean half-width of the 95 % intervals.
    pub half_width: f64,
    /// Twins whose 95 % interval holds the truth.
    pub covered: Proportion,
    /// Twins whose estimate stands on a bound: these count too.
    pub at_bound: usize,
}

/// One twin.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct TwinFit {
    /// One a factor estimated.
    pub truth: Vec<f64>,
    /// How its fit ended.
    pub end: TwinEnd,
}

/// How the fit of a twin ended.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum TwinEnd {
    /// At a minimum.
    Converged(Found),
    /// It ended elsewhere: what it found, which counts as a user would read it, and why.
    NotConverged(Found, String),
    /// There are no data to fit: why.
    Failed(String),
}

/// What was found: one a factor estimated.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Found {
    /// The estimates.
    pub values: Vec<f64>,
    /// The 95 % intervals.
    pub intervals: Vec<(f64, f64)>,
    /// Whether each estimate stands on a bound.
    pub at_bound: Vec<bool>,
    effective_samples: f64,
    samples: usize,
}

/// How many data sets are made, of which truths and with which noise, and how each is fitted.
#[derive(Clone, Debug)]
pub struct Design {
    /// Data sets.
    pub twins: usize,
    /// The side constraints between which truths are drawn.
    pub drawn: Bounds,
    /// The standard deviation of the noise, K; `None` takes the one that the case states of each sample.
    pub noise_k: Option<f64>,
    /// Correlation time and seed of the noise.
    pub noise: Noise,
    /// How each data set is fitted.
    pub search: Search,
}

/// Make so many data sets at the times of the case's observations, and fit each with the same search. Truths are drawn of what
/// is estimated; every other factor is nominal, as the fit takes it to be: what an estimate makes of a wrong model is another
/// question. All fits go side by side. None depends on how many there are, nor on what marches beside it.
///
/// # Errors
/// When there is nothing to estimate, or to estimate it from, or the device fails. A fit that fails is counted.
pub fn recovery(case: &Case, plan: &Plan, march: &mut dyn March, design: &Design) -> Result<Recovery, EstimateError> {
    let Design { twins, drawn, noise_k, noise, ref search } = *design;
    let estimated = &case.estimate.factors;
    if estimated.is_empty() {
        return Err(EstimateError::no_factors(&[case]));
    }
    let sampling = Sampling { kind: SamplingKind::Normal, seed: noise.seed };
    let ensemble = Ensemble::sample(&case.factors, drawn, &sampling, twins);
    let truths: Vec<Vec<f64>> = (0..twins)
        .map(|twin| {
            let drawn = ensemble.member(twin);
            let of =
                |factor: usize| if estimated.contains(&factor) { drawn[factor] } else { case.factors[factor].nominal };
            (0..case.factors.len()).map(of).collect()
        })
        .collect();
    let data = observed(case, plan, march, &truths, noise_k, &noise)?;
    let fits = together(march, plan, twins, |twin, march| {
        data[twin].as_ref().map(|data| estimate(&[(data, plan)], march, search))
    })?;
    let mut found = Vec::with_capacity(twins);
    for (truth, fit) in truths.iter().zip(fits) {
        let end = match fit {
            None => TwinEnd::Failed("the truth cannot be marched".to_owned()),
            Some(fit) => ended(fit?),
        };
        found.push(TwinFit { truth: estimated.iter().map(|&factor| truth[factor]).collect(), end });
    }
    let fitted: Vec<(&[f64], &Found)> =
        found.iter().filter_map(|twin| Some((twin.truth.as_slice(), twin.end.found()?))).collect();
    let recovered: Vec<Recovered> = estimated
        .iter()
        .enumerate()
        .map(|(place, &factor)| recovered(case.factors[factor].name.clone(), factor, place, &fitted))
        .collect();
    let mean = |of: fn(&Found) -> f64| fitted.iter().map(|(_, found)| of(found)).sum::<f64>() / fitted.len() as f64;
    Ok(Recovery {
        covered: Proportion {
            count: recovered.iter().map(|factor| factor.covered.count).sum(),
            of: recovered.iter().map(|factor| factor.covered.of).sum(),
        },
        effective_samples: mean(|found| found.effective_samples),
        samples: fitted.first().map_or(0, |(_, found)| found.samples),
        recovered,
        noise_k,
        noise,
        drawn,
        twins: found,
    })
}

impl Recovery {
    /// Twins whose fit converged.
    pub fn converged(&self) -> usize {
        self.twins.iter().filter(|twin| matches!(twin.end, TwinEnd::Converged(_))).count()
    }

    /// Why fits failed, and how many each.
    pub fn failures(&self) -> Vec<(&str, usize)> {
        let mut failures: Vec<(&str, usize)> = Vec::new();
        for twin in &self.twins {
            let (TwinEnd::Failed(reason) | TwinEnd::NotConverged(_, reason)) = &twin.end else { continue };
            match failures.iter_mut().find(|(known, _)| known == reason) {
                Some((_, count)) => *count += 1,
                None => failures.push((reason, 1)),
            }
        }
        failures
    }
}

impl TwinEnd {
    /// What the fit found, converged or not.
    pub fn found(&self) -> Option<&Found> {
        match self {
            Self::Converged(found) | Self::NotConverged(found, _) => Some(found),
            Self::Failed(_) => None,
        }
    }
}

/// The case with the observations of each truth; none where a truth cannot be marched.
fn observed(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    truths: &[Vec<f64>],
    noise_k: Option<f64>,
    noise: &Noise,
) -> Result<Vec<Option<Case>>, MarchError> {
    let ensemble = Ensemble::at(case.factors.len(), truths.concat());
    let mut data = Vec::with_capacity(truths.len());
    march_all(march, &plan.clone().without_gauges(), &ensemble, &mut |traces| {
        for member in 0..traces.members() {
            if traces.arrivals[member] != Arrival::Done {
                data.push(None);
                continue;
            }
            let mut twin = case.clone();
            for (seen, made) in case.observations.iter().zip(&mut twin.observations) {
                // From one on: of nought the numbers that make noise are those that draw truths.
                let noise = noise.at(&seen.times_s, traces.first + member + 1, seen.sensor);
                let trace_k = traces.trace(member, seen.sensor);
                for (sample, instant) in trusted(case, seen, &plan.instants_s) {
                    let deviation_k = noise_k.unwrap_or(seen.sigma_k[sample]);
                    made.temperatures_k[sample] = trace_k[instant] + deviation_k * noise[sample];
                }
            }
            data.push(Some(twin));
        }
    })?;
    Ok(data)
}

fn ended(fit: Estimated) -> TwinEnd {
    let found = Found {
        values: fit.values,
        intervals: fit.intervals,
        at_bound: fit.at_bound,
        effective_samples: fit.effective_samples,
        samples: fit.samples,
    };
    if fit.converged { TwinEnd::Converged(found) } else { TwinEnd::NotConverged(found, fit.termination) }
}

fn recovered(name: String, factor: usize, place: usize, fitted: &[(&[f64], &Found)]) -> Recovered {
    let of = fitted.len();
    let count = of as f64;
    let off: Vec<f64> = fitted.iter().map(|(truth, found)| found.values[place] - truth[place]).collect();
    let bias = off.iter().sum::<f64>() / count;
    let variance = off.iter().map(|off| (off - bias).powi(2)).sum::<f64>() / (count - 1.0);
    let holds = |(truth, found): &&(&[f64], &Found)| {
        let (low, high) = found.intervals[place];
        (low..=high).contains(&truth[place])
    };
    let half_width = |(_, found): &(&[f64], &Found)| (found.intervals[place].1 - found.intervals[place].0) / 2.0;
    Recovered {
        name,
        factor,
        bias,
        bias_error: (variance / count).sqrt(),
        rms: (off.iter().map(|off| off * off).sum::<f64>() / count).sqrt(),
        half_width: fitted.iter().map(half_width).sum::<f64>() / count,
        covered: Proportion { count: fitted.iter().filter(holds).count(), of },
        at_bound: fitted.iter().filter(|(_, found)| found.at_bound[place]).count(),
    }
}
