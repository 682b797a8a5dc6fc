//! Readings of pyrometers: against Planck's law, their derivatives, and estimates from them.

use crate::support::{RECOVERED, modified};
use bondline::Case;
use bondline::adapt::adapt;
use bondline::case::{Correlation, Observation};
use bondline::ensemble::Ensemble;
use bondline::march::cpu::Cpu;
use bondline::march::richardson::RichardsonMarch;
use bondline::march::{March, Precision};
use bondline::plan::Plan;
use bondline::question::Uncertainty;
use bondline::session::{Options, Session};
use bondline::study::estimate::{SearchOptions, estimate};
use bondline::study::twin::{Noise, twin};
use bondline::work_log::NoLog;
use std::collections::BTreeMap;

/// Second radiation constant, m K (CODATA 2018).
const C2_M_K: f64 = 1.438776877e-2;

/// Cloth over felt under a heat flux, seen by two pyrometers and by a thermocouple on the hot face. The emissivity of
/// the cloth depends on temperature, and the surroundings are hot.
const CASE: &str = r#"
duration = "60 s"
initial_temperature = "400 K"
ply = [
    { name = "CLOTH", material = "nextel440_bf20", thickness = "0.6 mm" },
    { name = "FELT", material = "saffil_96", thickness = "8 mm" },
]
sensor = [
    { name = "TOP", depth = "0 mm" },
    { name = "ONE", kind = "pyrometer", wavelength = "1.6 um", emissivity = 0.9 },
    { name = "BAND", kind = "pyrometer", band = ["8 um", "14 um"], emissivity = 0.95 },
    { name = "TC1", below = "CLOTH" },
]
[hot_face]
kind = "heated"
flux = [["0 s", "0 W/cm^2"], ["2 s", "12 W/cm^2"], ["40 s", "12 W/cm^2"], ["42 s", "0 W/cm^2"], ["60 s", "0 W/cm^2"]]
surroundings = [["0 s", "400 K"], ["60 s", "700 K"]]
[[factor]]
name = "f_eps"
property = "emissivity"
group = "CLOTH"
small = [0.8, 1.2]
[[factor]]
name = "f_k"
property = "conductivity"
group = "FELT"
small = [0.8, 1.2]
[resolution]
tolerance = "0.02 K"
output_interval = "2 s"
"#;

fn case() -> Case {
    Case::from_toml(CASE, "pyrometers", &BTreeMap::<String, String>::new()).unwrap_or_else(|error| panic!("{error}"))
}

fn march() -> RichardsonMarch {
    RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)))
}

/// Planck's law at a wavelength, up to its constant.
fn planck(wavelength_m: f64, temperature_k: f64) -> f64 {
    1.0 / (C2_M_K / (wavelength_m * temperature_k)).exp_m1()
}

/// Simpson's rule over 8 to 14 µm.
fn band(temperature_k: f64) -> f64 {
    const PARTS: usize = 2000;
    let weight = |at: usize| {
        if at == 0 || at == PARTS {
            1.0
        } else if at % 2 == 1 {
            4.0
        } else {
            2.0
        }
    };
    let wavelength_m = |at: usize| 8e-6 + 6e-6 * at as f64 / PARTS as f64;
    let term = |at: usize| weight(at) * planck(wavelength_m(at), temperature_k) * wavelength_m(at).powi(-5);
    (0..=PARTS).map(term).sum()
}

/// Largest departure of the readings from their definition, as a share of the radiance, at factors on emissivity and
/// conductivity, if the emissivity were `times` as large.
fn departure(factors: [f64; 2], times: f64) -> f64 {
    let case = case();
    let plan = adapt(&case).expect("the processor does not fail");
    // One resolution: readings are extrapolated, not made of extrapolated temperatures.
    let mut march = Cpu::new(Precision::F64);
    let traces = march.march(&plan, &Ensemble::from_values(2, factors.to_vec()), 0..1).expect("it marches");
    let emissivity = &case.layup().plies[0].material.emissivity;
    let mut most: f64 = 0.0;
    for (instant, &time_s) in plan.instants_s().iter().enumerate() {
        let at = |sensor: usize| traces.trace(0, sensor)[instant];
        let (top_k, surroundings_k) = (at(0), 400.0 + 300.0 * time_s / 60.0);
        let epsilon = times * factors[0] * emissivity.at(top_k);
        let off = |radiance: &dyn Fn(f64) -> f64, reading_k: f64, setting: f64| {
            let seen = epsilon * radiance(top_k) + (1.0 - epsilon) * radiance(surroundings_k);
            (setting * radiance(reading_k) / seen - 1.0).abs()
        };
        most = most.max(off(&|temperature_k| planck(1.6e-6, temperature_k), at(1), 0.9)).max(off(&band, at(2), 0.95));
    }
    most
}

#[test]
fn a_reading_is_the_temperature_whose_radiance_at_the_set_emissivity_the_face_emits_and_reflects() {
    assert!(departure([1.0, 1.0], 1.0) < 1e-8, "{}", departure([1.0, 1.0], 1.0));
    assert!(departure([0.85, 1.1], 1.0) < 1e-8, "{}", departure([0.85, 1.1], 1.0));
    assert!(departure([1.0, 1.0], 1.01) > 1e-4, "another emissivity is noticed");
}

#[test]
fn derivatives_of_a_reading_contain_those_by_the_emissivity_itself() {
    let plan = adapt(&case()).expect("the processor does not fail");
    let point = [0.93, 1.04];
    let tangents = march().tangents(&plan, &Ensemble::from_values(2, point.to_vec()), &[1, 0]);
    let tangents = tangents.expect("it marches").expect("it has tangents");
    for (row, factor) in [(1, 1), (2, 0)] {
        const STEP: f64 = 1e-5;
        let mut ends = [point; 2];
        (ends[0][factor], ends[1][factor]) = (point[factor] + STEP, point[factor] - STEP);
        let ends = march().march(&plan, &Ensemble::from_values(2, ends.concat()), 0..2).expect("it marches");
        for sensor in 0..4 {
            let largest = tangents.trace(row, sensor).iter().fold(0.0, |most: f64, slope| most.max(slope.abs()));
            for (instant, slope) in tangents.trace(row, sensor).iter().enumerate() {
                let difference = (ends.trace(0, sensor)[instant] - ends.trace(1, sensor)[instant]) / (2.0 * STEP);
                assert!((slope - difference).abs() < 1e-5 * largest, "sensor {sensor}: {slope} and {difference}");
            }
        }
        // At one wavelength the reading depends on the emissivity in another way than the face.
        let ratio = tangents.trace(row, 1)[20] / tangents.trace(row, 0)[20];
        assert!(if factor == 0 { ratio < 0.5 } else { ratio > 0.6 }, "{ratio}");
    }
}

/// The emissivity factor from noise-free data of a march with 0.9 of the emissivity, if the samples of `seen` are those
/// of `read`.
fn estimated(seen: usize, read: usize) -> f64 {
    const TRUTH: f64 = 0.9;
    let case = modified(&case(), |case| {
        case.factors.truncate(1);
        case.correlation = Correlation::default();
    });
    let plan = adapt(&case).expect("the processor does not fail");
    let exact = Noise { correlation_s: 0.0, seed: 1 };
    let made = twin(&case, &plan, &mut march(), vec![TRUTH], 0.0, &exact).expect("synthetic data");
    let observed = Observation {
        sensor: seen,
        times_s: made.instants_s.clone(),
        temperatures_k: made.measured_k[read].clone(),
        sigma_k: vec![1.0; made.instants_s.len()],
        window_s: None,
    };
    let case = modified(&case, |case| {
        case.observations = vec![observed];
        case.estimate.factors = vec![0];
    });
    let plan: Plan = adapt(&case).expect("the processor does not fail");
    let search = SearchOptions { landscape: false, ..SearchOptions::for_precision(Precision::F64) };
    estimate(&[(&case, &plan)], &mut march(), &search, &mut NoLog).expect("an estimate").values[0]
}

#[test]
fn an_estimate_from_a_pyrometer_recovers_the_emissivity_and_one_that_takes_it_for_a_thermocouple_does_not() {
    for pyrometer in [1, 2] {
        let found = estimated(pyrometer, pyrometer);
        assert!((found - 0.9).abs() < RECOVERED, "{found}");
        let mistaken = estimated(0, pyrometer);
        assert!((mistaken - 0.9).abs() > 0.02, "{mistaken}");
    }
    let thermocouple = estimated(0, 0);
    assert!((thermocouple - 0.9).abs() < RECOVERED, "{thermocouple}");
}

/// The property of the first factor, which a held face and one of constant emissivity do not have.
const EMISSIVITY: &str = "emissivity\"\ngroup";

/// The same layup with its hot face held by the readings of `ONE`, for an emissivity of the face.
fn held(readings: &[(f64, f64)], face_emissivity: f64, noise: &str) -> Case {
    held_with_deviation(readings, face_emissivity, 0.05, noise)
}

fn held_with_deviation(readings: &[(f64, f64)], face_emissivity: f64, deviation: f64, noise: &str) -> Case {
    let points: Vec<String> =
        readings.iter().map(|(time_s, reading_k)| format!("[\"{time_s} s\", \"{reading_k} K\"]")).collect();
    let face = format!(
        "kind = \"held\"\ntemperature = {{ points = [{}], {noise}pyrometer = {{ wavelength = \"1.6 um\", emissivity = \
         0.9, face_emissivity = {face_emissivity}, face_emissivity_deviation = {deviation}, surroundings = \"0 K\" }} \
         }}\n",
        points.join(", ")
    );
    let (before, after) = CASE.split_once("kind = \"heated\"\n").expect("a hot face");
    let (_, after) = after.split_once("[[factor]]").expect("factors");
    let text = format!("{before}{face}[[factor]]{after}").replacen(EMISSIVITY, "heat_capacity\"\ngroup", 1);
    let pyrometers = text.lines().filter(|line| !line.contains("\"pyrometer\"")).collect::<Vec<_>>().join("\n");
    Case::from_toml(&pyrometers, "held", &BTreeMap::<String, String>::new()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_face_held_by_a_pyrometer_has_the_temperatures_of_the_test_that_it_looked_at() {
    let text = CASE
        .replacen(EMISSIVITY, "heat_capacity\"\ngroup", 1)
        .replacen(
            "surroundings = [[\"0 s\", \"400 K\"], [\"60 s\", \"700 K\"]]",
            "surroundings = \"0 K\"\nemissivity = 0.7",
            1,
        )
        .replacen("output_interval = \"2 s\"", "output_interval = \"0.1 s\"", 1);
    let truth =
        Case::from_toml(&text, "truth", &BTreeMap::<String, String>::new()).unwrap_or_else(|error| panic!("{error}"));
    let traces = |case: &Case| {
        let plan = adapt(case).expect("the processor does not fail");
        let traces = march().march(&plan, &Ensemble::from_values(2, vec![1.0, 1.0]), 0..1).expect("it marches");
        let of = |sensor: usize| traces.trace(0, sensor).to_vec();
        (plan.instants_s().to_vec(), (0..case.sensors().len()).map(of).collect::<Vec<_>>())
    };
    let (instants_s, expected) = traces(&truth);
    let readings: Vec<(f64, f64)> = instants_s.iter().copied().zip(expected[1].iter().copied()).collect();
    // TC1 is the last sensor of both cases; every 20th instant of the truth is one of the held case.
    let off_k = |case: &Case| {
        let (held_s, found) = traces(case);
        let pairs = held_s.iter().zip(&found[1]).filter_map(|(time_s, found_k)| {
            let at = instants_s.iter().position(|instant_s| (instant_s - time_s).abs() < 1e-9)?;
            Some((found_k - expected[3][at]).abs())
        });
        pairs.fold(0.0, f64::max)
    };
    let (right_k, wrong_k) = (off_k(&held(&readings, 0.7, "")), off_k(&held(&readings, 0.6, "")));
    assert!(right_k < 0.3, "off by {right_k} K");
    assert!(wrong_k > 10.0, "another emissivity of the face changes the prediction: {wrong_k} K");
    let smoothed_k = off_k(&held(&readings, 0.7, "noise = \"0.05 K\", "));
    assert!(smoothed_k < 0.5, "off by {smoothed_k} K");

    let mut session = Session::open(held(&readings, 0.7, ""), &Options::default()).expect("a processor");
    let answers = session.predict().expect("a prediction");
    let effect =
        session.answers().and_then(|answers| answers.driver_emissivity.clone()).expect("the effect of the emissivity");
    let (_, of_lower) = traces(&held(&readings, 0.65, ""));
    let lower = answers.temperatures_k[1].iter().zip(&of_lower[1]).map(|(a, b)| b - a);
    let lower_k = lower.fold(0.0, |most: f64, change: f64| if change.abs() > most.abs() { change } else { most });
    let [(found_k, _), (higher_k, _)] = effect.changes[1];
    assert!(
        (found_k - lower_k).abs() < 0.2 && found_k > 5.0 && higher_k < -5.0,
        "{found_k} K, {lower_k} K, {higher_k} K"
    );
}

/// With the same seed the factors of the members are the same, so that the emissivity alone adds variance.
#[test]
fn percentiles_of_a_sweep_contain_the_uncertainty_of_the_emissivity_of_a_held_face() {
    const MEMBERS: usize = 2000;
    let readings = [(0.0, 400.0), (5.0, 1000.0), (60.0, 1200.0)];
    let sweep = |deviation: f64| {
        let case = held_with_deviation(&readings, 0.7, deviation, "");
        let mut session = Session::open(case, &Options::default()).expect("a processor");
        let options = Uncertainty { members: MEMBERS, ..Default::default() };
        let found = session.uncertainty(&options).expect("a sweep");
        let effect = session.answers().and_then(|answers| answers.driver_emissivity.clone()).expect("an effect");
        let last = |values: &[f64]| *values.last().expect("an instant");
        let spread = &found.spreads[1];
        let [(lower_k, _), (higher_k, _)] = effect.changes[1];
        (last(&spread.mean_k), last(&spread.deviation_k), 0.5 * (lower_k - higher_k))
    };
    let (mean_k, without_k, none_k) = sweep(1e-9);
    let (shifted_k, with_k, change_k) = sweep(0.05);
    assert!(change_k > 5.0 && none_k < 1e-3, "{change_k} K, {none_k} K");
    // A standard deviation from 2,000 members is known to 1.6 %.
    let added_k = (with_k.powi(2) - without_k.powi(2)).sqrt();
    assert!((added_k / change_k - 1.0).abs() < 0.08, "{added_k} K, not {change_k} K");
    assert!((shifted_k - mean_k).abs() < 4.0 * change_k / (MEMBERS as f64).sqrt(), "{mean_k} K, {shifted_k} K");
}
