//! Coverage of the intervals of an estimate: synthetic readings of drawn factors, each fitted.

use super::{Counted, covered_row};
use crate::adapt::adapt;
use crate::case::{Bounds, Case, Factor, Observation, Property, Sensor};
use crate::kept_work::work_log::NoLog;
use crate::march::cpu::Cpu;
use crate::march::richardson::RichardsonMarch;
use crate::march::{MarchError, Precision};
use crate::study::coverage_study::{CoverageDesign, coverage_study};
use crate::study::estimate::{EstimateError, SearchOptions};
use crate::study::twin::Noise;
use crate::verify::problem::{Problem, ProblemSetup, constant_properties, heated_face, insulated_face};
use crate::verify::{Group, VerificationRow};

const DATA_SETS: usize = 200;
const INTERVAL_S: f64 = 2.0;
const DURATION_S: f64 = 300.0;
/// Correlation time of correlated noise, s: five samples.
const CORRELATION_S: f64 = 10.0;
const ALLOWED: (f64, &str) = (3.3, "three standard errors of 400 intervals");

/// Conductivity and heat capacity of a slab under a flux, from two thermocouples.
fn slab() -> Case {
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
    case.factors = [("k", Property::Conductivity), ("cp", Property::HeatCapacity)].map(factor).to_vec();
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

/// Coverage under white and under correlated noise; the fit knows neither.
///
/// # Errors
/// As [`March::march`](crate::march::March::march); the processor does not fail.
pub(super) fn rows() -> Result<Vec<VerificationRow>, MarchError> {
    let case = slab();
    let plan = adapt(&case)?;
    let mut march = RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)));
    let mut row = |correlation_s: f64, noise: &str| {
        let search = SearchOptions { landscape: false, ..SearchOptions::for_precision(Precision::F64) };
        let design = CoverageDesign {
            data_sets: DATA_SETS,
            truth_bounds: Bounds::Small,
            noise_k: None,
            noise: Noise { correlation_s, seed: 1 },
            search,
        };
        let found = match coverage_study(&case, &plan, &mut march, &design, &mut NoLog) {
            Err(EstimateError::March(error)) => return Err(error),
            found => found.ok(),
        };
        let counted = match &found {
            Some(found) => Counted::intervals(found.covered),
            None => Counted { covered: 0.0, total: 0, of: "intervals" },
        };
        let samples = found.map_or(0, |found| found.samples);
        Ok(covered_row("estimate", samples, &format!("two factors, {noise}"), &counted, ALLOWED))
    };
    Ok(vec![
        row(0.0, "white noise")?,
        row(CORRELATION_S, &format!("noise that decorrelates over {:.0} samples", CORRELATION_S / INTERVAL_S))?,
    ])
}
