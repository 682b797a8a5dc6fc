//! Coverage of the intervals of an estimate: synthetic readings of drawn factors, each fitted.

use super::{Counted, covered_row};
use crate::adapt::adapt;
use crate::case::{Bounds, Case, Factor, Observation, Property, Sensor};
use crate::ensemble::Ensemble;
use crate::fit::interval::NORMAL_95;
use crate::fit::proportion::Proportion;
use crate::kept_work::work_log::NoLog;
use crate::march::cpu::Cpu;
use crate::march::richardson::RichardsonMarch;
use crate::march::{March, MarchError, Precision};
use crate::plan::Plan;
use crate::study::coverage_study::{CoverageDesign, coverage_study, data_sets};
use crate::study::estimate::{EstimateError, ParameterEstimates, SearchOptions, estimate};
use crate::study::experiment_design::{DesignError, DesignRequest, SampleNoise, design_experiment};
use crate::study::posterior::{PosteriorError, Walkers, posterior};
use crate::study::twin::Noise;
use crate::verify::problem::{Problem, ProblemSetup, constant_properties, heated_face, insulated_face};
use crate::verify::{Group, VerificationRow};
use rayon::prelude::*;

const DATA_SETS: usize = 200;
const INTERVAL_S: f64 = 2.0;
const DURATION_S: f64 = 300.0;
/// Correlation time of correlated noise, s: five samples.
const CORRELATION_S: f64 = 10.0;
const ALLOWED: (f64, &str) = (3.3, "three standard errors of 400 intervals");

/// Conductivity and heat capacity of a slab under a flux, from two thermocouples.
pub(super) fn slab() -> Case {
    let setting = ProblemSetup {
        plies: vec![(constant_properties(0.1, 1e5), 0.02)],
        start_k: 300.0,
        hot_face: heated_face(3e3),
        back_face: insulated_face(),
        cells: 16,
        first_step_s: 0.1,
        step_growth: 0.1,
    };
    let mut case = Problem::new(Group::Coverage, "slab under a flux", setting, Vec::new()).case;
    let sensor = case.sensors[0].clone();
    case.sensors = [0.005, 0.015].map(|depth_m| Sensor { depth_m, ..sensor.clone() }).to_vec();
    case.sensors[1].name = "deeper".to_owned();
    case.exposure.duration_s = DURATION_S;
    case.resolution.tolerance_k = Some(0.05);
    case.resolution.max_step_s = DURATION_S;
    case.resolution.output_interval_s = DURATION_S;
    case.layup.plies[0].group = "slab".to_owned();
    let factor = |(name, property): (&str, Property)| Factor {
        name: name.to_owned(),
        group: "slab".to_owned(),
        property,
        state: None,
        nominal: 1.0,
        small: (0.8, 1.2),
        large: (0.5, 2.0),
    };
    case.factors = [(FACTORS[0], Property::Conductivity), (FACTORS[1], Property::HeatCapacity)].map(factor).to_vec();
    let times_s: Vec<f64> = (1..=(DURATION_S / INTERVAL_S) as usize).map(|n| INTERVAL_S * n as f64).collect();
    let observation = |sensor| Observation {
        sensor,
        temperatures_k: vec![300.0; times_s.len()],
        sigma_k: vec![1.0; times_s.len()],
        times_s: times_s.clone(),
        window_s: None,
    };
    case.observations = vec![observation(0), observation(1)];
    case.estimate.factors = vec![0, 1];
    case.estimate.bounds = Bounds::Large;
    case
}

/// Names of the factors.
const FACTORS: [&str; 2] = ["k", "cp"];

fn march() -> RichardsonMarch {
    RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)))
}

fn search() -> SearchOptions {
    SearchOptions { landscape: false, ..SearchOptions::for_precision(Precision::F64) }
}

fn design(data_sets: usize, correlation_s: f64) -> CoverageDesign {
    CoverageDesign {
        data_sets,
        truth_bounds: Bounds::Small,
        noise_k: None,
        noise: Noise { correlation_s, seed: 1 },
        search: search(),
    }
}

fn noise_name(correlation_s: f64) -> String {
    match correlation_s {
        0.0 => "white noise".to_owned(),
        _ => format!("noise that decorrelates over {:.0} samples", correlation_s / INTERVAL_S),
    }
}

/// Cases with their plans.
type Runs<'a> = [(&'a Case, &'a Plan)];

/// What holds of the answers to each data set, which a study computes from its estimate; `None` where that fails. Each
/// data set has a march of its own, as a posterior marches other plans than its estimate.
fn held<T: Send>(
    (case, plan): (&Case, &Plan),
    (number, correlation_s): (usize, f64),
    search: &SearchOptions,
    study: impl Fn(&Runs<'_>, &mut dyn March, &ParameterEstimates, &[f64]) -> Result<Option<T>, MarchError> + Sync,
) -> Result<Vec<Option<T>>, MarchError> {
    let data = match data_sets(case, plan, &mut march(), &design(number, correlation_s), 0..number) {
        Err(EstimateError::March(error)) => return Err(error),
        data => data.unwrap_or_default(),
    };
    let answer = |(truth, data): &(Vec<f64>, Option<Case>)| {
        let Some(data) = data else { return Ok(None) };
        let (runs, mut march) = ([(data, plan)], march());
        match estimate(&runs, &mut march, search, &mut NoLog) {
            Err(EstimateError::March(error)) => Err(error),
            Err(_) => Ok(None),
            Ok(found) => study(&runs, &mut march, &found, truth),
        }
    };
    data.par_iter().map(answer).collect()
}

fn proportion(held: impl Iterator<Item = bool> + Clone) -> Counted {
    Counted::intervals(Proportion { count: held.clone().filter(|held| *held).count(), total: held.count() })
}

/// Coverage under white and under correlated noise; the fit knows neither.
///
/// # Errors
/// As [`March::march`](crate::march::March::march); the processor does not fail.
pub(super) fn rows() -> Result<Vec<VerificationRow>, MarchError> {
    let case = slab();
    let plan = adapt(&case)?;
    let row = |correlation_s: f64| {
        let found = match coverage_study(&case, &plan, &mut march(), &design(DATA_SETS, correlation_s), &mut NoLog) {
            Err(EstimateError::March(error)) => return Err(error),
            found => found.ok(),
        };
        let counted = match &found {
            Some(found) => Counted::intervals(found.covered),
            None => Counted { covered: 0.0, total: 0, of: "intervals" },
        };
        let samples = found.map_or(0, |found| found.samples);
        Ok(covered_row("estimate", samples, &format!("two factors, {}", noise_name(correlation_s)), &counted, ALLOWED))
    };
    let mut rows = vec![row(0.0)?, row(CORRELATION_S)?];
    for correlation_s in [0.0, CORRELATION_S] {
        rows.push(profile_row((&case, &plan), correlation_s)?);
    }
    rows.extend(posterior_rows((&case, &plan), CORRELATION_S)?);
    rows.push(design_row(&case)?);
    Ok(rows)
}

fn samples(case: &Case) -> usize {
    case.observations.iter().map(|observation| observation.times_s.len()).sum()
}

/// Coverage of profile-likelihood intervals.
fn profile_row(run: (&Case, &Plan), correlation_s: f64) -> Result<VerificationRow, MarchError> {
    let search = SearchOptions { profiles: FACTORS.map(str::to_owned).to_vec(), ..search() };
    let held = held(run, (DATA_SETS, correlation_s), &search, |_, _, found, truth| {
        let is_held = |place: usize| {
            let (low, high) = found.profiles[place].interval;
            (low.unwrap_or(f64::MIN)..=high.unwrap_or(f64::MAX)).contains(&truth[found.profiles[place].factor])
        };
        Ok(Some([0, 1].map(is_held)))
    })?;
    let counted = proportion(held.iter().flat_map(|held| held.unwrap_or([false; 2])));
    let quantity = format!("two factors, {}", noise_name(correlation_s));
    Ok(covered_row("profile", samples(run.0), &quantity, &counted, ALLOWED))
}

/// Data sets of which a posterior is sampled.
const POSTERIORS: usize = 40;
const POSTERIORS_ALLOWED: (f64, &str) = (7.3, "three standard errors of 80 intervals");
const PREDICTIVE_ALLOWED: (f64, &str) = (8.1, "three standard errors of 40 shares, which scatter by 17 %");
/// The sampler at its default settings has more walkers, for smoother histograms.
const WALKERS: usize = 32;
const ITERATIONS: usize = 250;
/// Before a thermocouple responds, predictions differ by rounding alone, K.
const NO_RESPONSE_K: f64 = 0.01;

/// What holds of a posterior.
#[derive(Clone, Copy, Debug)]
struct HeldPosterior {
    factors: [bool; 2],
    /// Share of the instants at which the predictive band contains the true temperature.
    band: f64,
    peaks: [bool; 2],
}

impl HeldPosterior {
    const NOTHING: Self = Self { factors: [false; 2], band: 0.0, peaks: [false; 2] };
}

/// Coverage of the marginal intervals of a posterior and of its predictive bands.
fn posterior_rows((case, plan): (&Case, &Plan), correlation_s: f64) -> Result<Vec<VerificationRow>, MarchError> {
    let held = held((case, plan), (POSTERIORS, correlation_s), &search(), |runs, march, found, truth| {
        let walkers = Walkers { number: WALKERS, iterations: ITERATIONS, seed: 1 };
        let sampled = match posterior(runs, march, found, &walkers, &mut NoLog) {
            Err(PosteriorError::March(error)) => return Err(error),
            Err(_) => return Ok(None),
            Ok(sampled) => sampled,
        };
        let truths = Ensemble::from_values(truth.len(), truth.to_vec());
        let traces = march.march(plan, &truths, 0..1)?;
        let is_held = |place: usize| {
            let (low, high) = sampled.marginals[place].interval;
            (low..=high).contains(&truth[place])
        };
        let bands = [0, 1].map(|sensor| &sampled.predicted[0].sensors[sensor].parameters);
        let inside = bands.iter().enumerate().flat_map(|(sensor, band)| {
            let ends = band.low_k.iter().zip(&band.high_k).zip(traces.trace(0, sensor));
            ends.filter(|((low_k, high_k), _)| *high_k - *low_k > NO_RESPONSE_K)
                .map(|((low_k, high_k), at_k)| (low_k..=high_k).contains(&at_k))
        });
        let inside: Vec<bool> = inside.collect();
        let peak = |sensor: usize| {
            let [low_k, _, high_k] = bands[sensor].peak_k;
            (low_k..=high_k).contains(&traces.peak(0, sensor).temperature_k)
        };
        Ok(Some(HeldPosterior {
            factors: [0, 1].map(is_held),
            band: inside.iter().filter(|inside| **inside).count() as f64 / inside.len().max(1) as f64,
            peaks: [0, 1].map(peak),
        }))
    })?;
    let held: Vec<HeldPosterior> = held.into_iter().map(|held| held.unwrap_or(HeldPosterior::NOTHING)).collect();
    let (samples, noise) = (samples(case), noise_name(correlation_s));
    let factors = proportion(held.iter().flat_map(|held| held.factors));
    let peaks = proportion(held.iter().flat_map(|held| held.peaks));
    let covered = held.iter().map(|held| held.band).sum::<f64>() / held.len().max(1) as f64;
    let bands = Counted { covered, total: held.len(), of: "estimates" };
    let quantity = format!("two factors, {noise}");
    Ok(vec![
        covered_row("posterior", samples, &quantity, &factors, POSTERIORS_ALLOWED),
        covered_row("predictive band", samples, &format!("instants, {noise}"), &bands, PREDICTIVE_ALLOWED),
        covered_row("predicted peak", samples, &format!("two thermocouples, {noise}"), &peaks, POSTERIORS_ALLOWED),
    ])
}

/// Members of a design: its standard errors are those of its default number to a few per cent.
const DESIGN_MEMBERS: usize = 200;

/// How many estimates from the readings of a design lie within the error that it predicts.
fn design_row(slab: &Case) -> Result<VerificationRow, MarchError> {
    let question = crate::question::Design {
        members: DESIGN_MEMBERS,
        sampling_s: Some(INTERVAL_S),
        noise_k: Some(1.0),
        correlation_time_s: Some(CORRELATION_S),
        ..crate::question::Design::new(FACTORS, 2)
    };
    let noise = SampleNoise::stated(question.noise_k, question.correlation_time_s);
    let question = question.resolved(slab).unwrap_or(question);
    let request = DesignRequest { question, noise, target: 1 };
    let found = design_experiment(std::slice::from_ref(slab), &mut march(), &request, &mut adapt);
    let found = match found {
        Err(DesignError::March(error)) => return Err(error),
        found => found.ok(),
    };
    let none = Counted { covered: 0.0, total: 0, of: "intervals" };
    let quantity = format!("predicted for two thermocouples, {}", noise_name(CORRELATION_S));
    let Some(found) = found else { return Ok(covered_row("design", 0, &quantity, &none, ALLOWED)) };
    let (scenario, best) = (&found.scenarios[0], &found.scenarios[0].designs[0]);
    let mut case = slab.clone();
    for (sensor, &candidate) in case.sensors.iter_mut().zip(&best.candidates) {
        sensor.depth_m = scenario.candidates[candidate].depth_m;
        sensor.side = scenario.candidates[candidate].side;
    }
    let plan = adapt(&case)?;
    let held = held((&case, &plan), (DATA_SETS, CORRELATION_S), &search(), |_, _, found, truth| {
        let is_near =
            |place: usize| (found.values[place] - truth[place]).abs() <= NORMAL_95 * best.standard_errors[place];
        Ok(Some([0, 1].map(is_near)))
    })?;
    let counted = proportion(held.iter().flat_map(|held| held.unwrap_or([false; 2])));
    Ok(covered_row("design", samples(&case), &quantity, &counted, ALLOWED))
}
