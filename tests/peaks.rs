//! Peaks come from the steps of the march and the curve between them: they do not depend on the output instants.

use crate::cli::run;
use crate::support::{Scratch, adapter, root};
use bondline::case::{Bounds, Case};
use bondline::ensemble::{Ensemble, Marginal, SamplingKind};
use bondline::march::cpu::Cpu;
use bondline::march::gpu::Gpu;
use bondline::march::gpu::device::Device;
use bondline::march::richardson::RichardsonMarch;
use bondline::march::{March, Precision};
use bondline::question::{Goal, Uncertainty};
use bondline::session::{BackendKind, Options, Session};
use bondline::study::nominal::Prediction;
use bondline::verify::exact::erfc;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::fs;

/// A slab that nothing cools, heated from 10 s to 10.5 s, between all output instants of 1 s, 7 s and 60 s.
const PULSE: &str = r#"
initial_temperature = "300 K"
duration = "60 s"
ply = [{ name = "S", material = "constant", thickness = "5 mm" }]
sensor = [
    { name = "F", depth = "0 mm" },
    { name = "LAG", depth = "0 mm", time_constant = "1.5 s" },
    { name = "IN", depth = "0.5 mm" },
]
[hot_face]
kind = "heated"
emissivity = 0
flux.points = [["10 s", "0 kW/m^2"], ["10 s", "5 kW/m^2"], ["10.5 s", "5 kW/m^2"], ["10.5 s", "0 kW/m^2"]]
flux.outside = "zero"
[[factor]]
name = "f"
property = "heating"
small = [0.9, 1.1]
"#;
/// Density, heat capacity and conductivity of the material, SI.
const CONSTANT: (f64, f64, f64) = (200.0, 1000.0, 0.05);
const FLUX_W_M2: f64 = 5e3;
/// Tolerance of cells and steps in the cases, K. A claim may be half of an error, and is mostly above it.
const TOLERANCE_K: f64 = 0.05;

/// Rise of a half-space at a depth under a constant flux, K (Carslaw & Jaeger, 1959, section 2.9).
fn flux_rise_k(depth_m: f64, time_s: f64) -> f64 {
    if time_s <= 0.0 {
        return 0.0;
    }
    let (rho, c, k) = CONSTANT;
    let reach_m = 2.0 * (k / (rho * c) * time_s).sqrt();
    let z = depth_m / reach_m;
    FLUX_W_M2 / k * reach_m * ((-z * z).exp() / PI.sqrt() - z * erfc(z))
}

/// The temperature of the slab while it is a half-space, which within 60 s no heat has crossed.
fn pulse_k(depth_m: f64, time_s: f64) -> f64 {
    300.0 + flux_rise_k(depth_m, time_s - 10.0) - flux_rise_k(depth_m, time_s - 10.5)
}

/// The highest value of a function of time, and its time.
fn highest(of_time: impl Fn(f64) -> f64) -> (f64, f64) {
    let points = (0..=100_000).map(|n| 10.0 + 2e-4 * f64::from(n)).map(|time_s| (of_time(time_s), time_s));
    points.fold((0.0, 0.0), |best, next| if next.0 > best.0 { next } else { best })
}

/// The highest reading of a thermocouple that follows a temperature with a lag, and its time.
fn highest_lagged(time_constant_s: f64, of_time_k: impl Fn(f64) -> f64) -> (f64, f64) {
    const STEP_S: f64 = 1e-4;
    let (mut bead_k, mut best) = (300.0, (0.0, 0.0));
    for n in 0..200_000 {
        let time_s = 10.0 + STEP_S * f64::from(n);
        bead_k += (of_time_k(time_s + 0.5 * STEP_S) - bead_k) * -(-STEP_S / time_constant_s).exp_m1();
        if bead_k > best.0 {
            best = (bead_k, time_s + STEP_S);
        }
    }
    best
}

fn load(text: &str) -> Case {
    let material = fs::read_to_string(root().join("cases/slab/materials/constant.toml")).expect("a shipped material");
    let files = BTreeMap::from([("materials/constant.toml".to_owned(), material)]);
    Case::from_toml(text, "own", &files).unwrap_or_else(|error| panic!("{error}"))
}

fn every(text: &str, seconds: f64) -> String {
    format!("{text}\n[resolution]\noutput_interval = \"{seconds} s\"\n")
}

fn open(text: &str) -> Session {
    Session::open(load(text), &Options::default().backend(BackendKind::Cpu)).expect("the CPU is always available")
}

fn predict(text: &str) -> Prediction {
    open(text).predict().expect("a prediction")
}

#[test]
fn a_pulse_between_two_instants_has_the_peak_of_the_exact_solution_whatever_the_instants() {
    let exact = [
        highest(|time_s| pulse_k(0.0, time_s)),
        highest_lagged(1.5, |time_s| pulse_k(0.0, time_s)),
        highest(|time_s| pulse_k(0.5e-3, time_s)),
    ];
    for seconds in [1.0, 7.0, 60.0] {
        let found = predict(&every(PULSE, seconds));
        let claim_k = found.error_estimate.as_ref().expect("an adapted plan").nominal_k;
        for (peak, (exact_k, exact_s)) in found.peaks.iter().zip(exact) {
            let off_k = (peak.temperature_k - exact_k).abs();
            assert!(
                off_k <= 2.0 * claim_k && off_k < TOLERANCE_K,
                "{seconds} s: {peak:?}, exact {exact_k}, claim {claim_k}"
            );
            assert!((peak.time_s - exact_s).abs() < 0.1, "{seconds} s: {peak:?}, exact {exact_s} s");
        }
        // Negative control: no reading at an instant is near the peak of the face.
        let readings = found.temperatures_k[0].iter().copied().fold(0.0, f64::max);
        assert!(readings < exact[0].0 - 10.0, "{seconds} s: {readings}");
    }
}

#[test]
fn specified_steps_have_the_same_peaks_at_all_instants_and_with_few_of_their_records() {
    let steps = |seconds: f64, max_step: &str| {
        let resolution = format!("cells = 200\nfirst_step = \"1 ms\"\nmax_step = \"{max_step}\"\n");
        predict(&(every(PULSE, seconds) + &resolution))
    };
    let (exact_k, _) = highest(|time_s| pulse_k(0.0, time_s));
    for max_step in ["50 ms", "1 ms"] {
        let [fine, rough] = [1.0, 60.0].map(|seconds| steps(seconds, max_step));
        assert!(fine.error_estimate.is_none() && (max_step == "50 ms" || fine.steps > 50_000));
        for (fine, rough) in fine.peaks.iter().zip(&rough.peaks) {
            assert!((fine.temperature_k - rough.temperature_k).abs() < 0.02, "{fine:?} {rough:?}");
            assert!((fine.time_s - rough.time_s).abs() < 0.01, "{fine:?} {rough:?}");
        }
        assert!((rough.peaks[0].temperature_k - exact_k).abs() < 0.2, "{:?}, exact {exact_k}", rough.peaks[0]);
    }
}

#[test]
fn a_probability_of_exceeding_a_peak_is_that_of_its_factor_with_and_without_a_limit() {
    let (exact_k, _) = highest(|time_s| pulse_k(0.0, time_s));
    let limit_k = 300.0 + 0.97 * (exact_k - 300.0);
    let probability = |text: &str| {
        let mut session = open(&every(text, 6.0));
        let goal = Goal::Until(format!("P(F > {limit_k} K) ± 0.01"));
        let question = Uncertainty { members: 2000, goal, ..Uncertainty::default() };
        let found = session.uncertainty_until(&question, &mut |_, _| {}).expect("an answer");
        let swept = session.uncertainty(&Uncertainty { goal: Goal::Whole, ..question }).expect("a sweep");
        (found.last().expect("a look").estimate, swept)
    };
    let (plain, swept) = probability(PULSE);
    let (limited, with_limit) =
        probability(&PULSE.replace("depth = \"0 mm\" }", &format!("depth = \"0 mm\", limit = \"{limit_k} K\" }}")));
    let factor = load(PULSE).factors()[0].clone();
    let marginal = Marginal::new(1.0, factor.bounds(Bounds::Small), SamplingKind::Normal);
    let exact = 1.0 - marginal.cumulative(0.97);
    assert!((plain - exact).abs() < 3.0 * (exact * (1.0 - exact) / 2000.0).sqrt(), "{plain}, exact {exact}");
    assert!((plain - limited).abs() < 5e-3, "{plain} without a limit, {limited} with it");
    let counted = &with_limit.margins.as_ref().expect("margins").limits[0].exceeding;
    assert_eq!(counted.count as f64 / 2000.0, limited);
    // The variance of the peak is that of the factor, and its percentiles are those of a line in it.
    let peak = &swept.peaks[0];
    assert!((peak.temperature_indices.first[0].value - 1.0).abs() < 1e-3, "{:?}", peak.temperature_indices);
    for (found_k, percent) in peak.percentiles_k.iter().zip([2.5, 25.0, 50.0, 75.0, 97.5]) {
        let expected_k = 300.0 + marginal.quantile(percent / 100.0) * (exact_k - 300.0);
        assert!((found_k - expected_k).abs() < 0.4, "{found_k}, exact {expected_k} at {percent} %");
    }
}

#[test]
fn the_derivative_of_a_peak_is_that_at_its_time() {
    let mut session = open(&every(PULSE, 7.0));
    let traces = session.tangents(&Ensemble::from_values(1, vec![1.0, 1.1]), &[0]).expect("a march").expect("tangents");
    for (sensor, exact_k) in [(0, highest(|time_s| pulse_k(0.0, time_s)).0), (2, highest(|t| pulse_k(0.5e-3, t)).0)] {
        for member in [0, 2] {
            let slope_k = traces.peak(member + 1, sensor).temperature_k;
            assert!(
                (slope_k / (exact_k - 300.0) - 1.0).abs() < 5e-3,
                "sensor {sensor}: {slope_k} K, exact {exact_k} K"
            );
        }
    }
    // Negative control: no derivative at an instant is half of it.
    let at_instants = traces.trace(1, 0).iter().copied().fold(0.0, f64::max);
    assert!(at_instants < 0.5 * traces.peak(1, 0).temperature_k);
}

#[test]
fn the_time_above_a_limit_is_that_of_the_exact_solution_whatever_the_instants() {
    let limit_k = 330.0;
    let text = PULSE.replace("depth = \"0 mm\" }", &format!("depth = \"0 mm\", limit = \"{limit_k} K\" }}"));
    let above = (0..600_000).filter(|&n| pulse_k(0.0, 1e-4 * (f64::from(n) + 0.5)) > limit_k).count();
    let exact_s = 1e-4 * above as f64;
    for seconds in [1.0, 60.0] {
        let margin = predict(&every(&text, seconds)).margins[0];
        assert!((margin.time_above_s - exact_s).abs() < 0.005, "{seconds} s: {margin:?}, exact {exact_s} s");
        assert!(margin.margin_k < 0.0 && !margin.still_warming, "{margin:?}");
    }
}

/// A face that is held at 900 K for a second and a half.
const HELD: &str = r#"
initial_temperature = "300 K"
duration = "60 s"
ply = [{ name = "P", material = "constant", thickness = "10 mm" }]
sensor = [{ name = "Q", depth = "0 mm" }, { name = "R", depth = "0.3 mm" }, { name = "BACK", below = "P" }]
[hot_face]
kind = "held"
temperature.points = [["12.5 s", "300 K"], ["12.5 s", "900 K"], ["14 s", "900 K"], ["14 s", "300 K"]]
temperature.outside = "hold"
[back_face]
kind = "held"
temperature.points = [["0 s", "300 K"], ["31.25 s", "700 K"], ["40 s", "300 K"]]
temperature.outside = "hold"
"#;

#[test]
fn a_pulse_of_a_held_face_between_two_instants_is_the_peak_of_a_sensor_on_it() {
    let rise_k = |depth_m: f64, time_s: f64| {
        let (rho, c, k) = CONSTANT;
        let z = depth_m / (4.0 * k / (rho * c) * time_s.max(1e-12)).sqrt();
        600.0 * erfc(z)
    };
    let inside_k = |time_s: f64| 300.0 + rise_k(0.3e-3, time_s - 12.5) - rise_k(0.3e-3, time_s - 14.0);
    let (exact_k, exact_s) = highest(inside_k);
    for seconds in [1.0, 7.0, 60.0] {
        let found = predict(&every(HELD, seconds));
        let claim_k = found.error_estimate.as_ref().expect("an adapted plan").nominal_k;
        let [face, inside, back] = found.peaks[..] else { panic!("{found:?}") };
        assert_eq!((face.temperature_k, face.time_s), (900.0, 12.5));
        let off_k = (inside.temperature_k - exact_k).abs();
        assert!(off_k <= 2.0 * claim_k && off_k < TOLERANCE_K, "{inside:?}, exact {exact_k}, claim {claim_k}");
        assert!((inside.time_s - exact_s).abs() < 0.02, "{inside:?}, exact {exact_s} s");
        assert!((back.temperature_k - 700.0).abs() < 1e-9 && (back.time_s - 31.25).abs() < 1e-9, "{back:?}");
    }
}

/// Hot surroundings for a moment: the readings of a pyrometer jump, the temperature of the face does not.
#[test]
fn a_pyrometer_peaks_with_its_surroundings_between_two_instants() {
    let text = |seconds: f64| {
        let sensors = "{ name = \"SEEN\", kind = \"pyrometer\", band = [\"8 um\", \"14 um\"], emissivity = 0.9 },";
        let hot = "surroundings.points = [[\"30 s\", \"300 K\"], [\"30 s\", \"900 K\"], [\"32 s\", \"900 K\"], \
                   [\"32 s\", \"300 K\"]]\nsurroundings.outside = \"hold\"\n";
        let text = PULSE.replace("sensor = [", &format!("sensor = [{sensors}"));
        every(&text.replace("emissivity = 0\n", &format!("emissivity = 0.8\n{hot}")), seconds)
    };
    // The readings rise by 50 K/s until the surroundings are cold again.
    let [often, seldom] = [0.01, 60.0].map(|seconds| predict(&text(seconds)));
    let readings = often.temperatures_k[0].iter().copied().fold(0.0, f64::max);
    let (often, seldom) = (often.peaks[0], seldom.peaks[0]);
    assert!(
        (30.0..=32.0).contains(&often.time_s) && (often.time_s - seldom.time_s).abs() < 0.01,
        "{often:?} {seldom:?}"
    );
    assert!((often.temperature_k - seldom.temperature_k).abs() < 0.2, "{often:?} {seldom:?}");
    assert!(often.temperature_k >= readings - 1e-6 && often.temperature_k < readings + 1.0, "{often:?}, {readings} K");
}

#[test]
fn pieces_of_a_sweep_have_the_peaks_of_the_whole() {
    let scratch = Scratch::new("peaks-pieces");
    let material = fs::read_to_string(root().join("cases/slab/materials/constant.toml")).expect("a shipped material");
    scratch.write("c/materials/constant.toml", material);
    scratch.write("c/case.toml", every(PULSE, 60.0));
    for part in ["0..20", "20..50"] {
        run(&scratch, &format!("uncertainty c -n 50 --members {part} --out p --quiet")).succeeded();
    }
    run(&scratch, "uncertainty c -n 50 --out whole --quiet").succeeded();
    run(&scratch, "merge p/c-0-20.json p/c-20-50.json --out merged").succeeded();
    let indices = |folder: &str| {
        let summary: serde_json::Value =
            serde_json::from_str(&scratch.read(&format!("{folder}/summary.json"))).expect("JSON");
        (summary["sensitivity_indices"].clone(), summary["sensors"].clone())
    };
    assert_eq!(indices("whole"), indices("merged"));
    assert!(indices("merged").1["F"]["peak_k"].as_f64().is_some_and(|peak_k| peak_k > 330.0));
}

/// Bends of the profile lie at a sensor, between nodes and on the interface; heat flows everywhere at the start.
#[test]
fn at_the_start_every_thermocouple_reads_the_stated_profile() {
    let text = r#"
duration = "60 s"
initial_temperature = [["0 mm", "300 K"], ["1.7 mm", "420 K"], ["5 mm", "350 K"], ["12 mm", "600 K"]]
ply = [
    { name = "S", material = "constant", thickness = "5 mm" },
    { name = "T", material = "constant", thickness = "7 mm" },
]
contact_conductance = "200 W/m^2/K"
sensor = [
    { name = "F", depth = "0 mm" },
    { name = "BEND", depth = "1.7 mm" },
    { name = "IN", depth = "3.3 mm", time_constant = "0.5 s" },
    { name = "UP", below = "S", side = "above" },
    { name = "DOWN", below = "S", side = "below" },
    { name = "B", depth = "12 mm" },
]
[hot_face]
kind = "heated"
flux = "40 kW/m^2"
[[factor]]
name = "f"
property = "heating"
small = [0.9, 1.1]
"#;
    let case = load(text);
    let plan = bondline::adapt::adapt(&case).expect("the processor does not fail");
    let ensemble = Ensemble::from_values(1, vec![0.9, 1.1]);
    let mut march = RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)));
    let traces = march.march(&plan, &ensemble, 0..2).expect("the processor does not fail");
    let expected_k = [300.0, 420.0, 420.0 - 70.0 * 1.6 / 3.3, 350.0, 350.0, 600.0];
    for member in 0..2 {
        for (sensor, expected_k) in expected_k.iter().enumerate() {
            let found_k = traces.trace(member, sensor)[0];
            assert!((found_k - expected_k).abs() < 1e-9, "sensor {sensor}: {found_k} K for {expected_k} K");
        }
    }
    let tangents =
        march.tangents(&plan, &Ensemble::from_values(1, vec![1.0]), &[0]).expect("the processor does not fail");
    let tangents = tangents.expect("the processor differentiates");
    assert!((0..6).all(|sensor| tangents.trace(1, sensor)[0] == 0.0), "no factor changes the initial profile");
    assert!(tangents.trace(1, 0)[1] > 0.0);
}

/// Displaced thermocouples pass bends of the profile and an interface, in plies that are stretched, on every processor.
#[test]
fn at_the_start_a_thermocouple_of_uncertain_depth_reads_the_stated_profile_at_its_own_depth() {
    let text = r#"
duration = "60 s"
initial_temperature = [
    ["0 mm", "300 K"], ["1.7 mm", "420 K"], ["3.4 mm", "430 K"], ["5 mm", "350 K"], ["12 mm", "600 K"]
]
ply = [
    { name = "S", material = "constant", thickness = "5 mm" },
    { name = "T", material = "constant", thickness = "7 mm" },
]
contact_conductance = "200 W/m^2/K"
sensor = [
    { name = "BEND", depth = "1.7 mm" },
    { name = "IN", depth = "3.3 mm", time_constant = "0.5 s" },
    { name = "STILL", depth = "3.3 mm" },
    { name = "DOWN", below = "S", side = "below" },
]
factor = [
    { name = "d_bend", group = "BEND", property = "sensor_depth", small = [0.4, 1.6] },
    { name = "d_in", group = "IN", property = "sensor_depth", small = [0.4, 1.4] },
    { name = "d_down", group = "DOWN", property = "sensor_depth", small = [0.5, 1.5] },
    { name = "t", property = "thickness", group = "T", small = [0.8, 1.25] },
]
[hot_face]
kind = "heated"
flux = "40 kW/m^2"
"#;
    let case = load(text);
    let plan = bondline::adapt::adapt(&case).expect("the processor does not fail");
    let factors = [[1.0, 1.0, 1.0, 1.0], [0.5, 1.2, 1.4, 1.0], [1.5, 0.45, 0.7, 1.25], [1.3, 0.9, 0.9, 0.8]];
    let ensemble = Ensemble::from_values(4, factors.concat());
    let device = Device::open(adapter(), false).expect("the device opens");
    let processors: [(Box<dyn March>, f64); 3] = [
        (Box::new(Cpu::new(Precision::F64)), 1e-9),
        (Box::new(Cpu::new(Precision::F32)), 1e-4),
        (Box::new(Gpu::new(device, Precision::F32).expect("the device passes its self-tests")), 1e-4),
    ];
    let mut in_single = Vec::new();
    let profile_k = |depth_m: f64| case.exposure().initial_temperature_k(depth_m);
    for (processor, tolerance_k) in processors {
        let mut march = RichardsonMarch::new(processor);
        let traces = march.march(&plan, &ensemble, 0..4).expect("the processor does not fail");
        for (member, [bend, inside, below, _]) in factors.into_iter().enumerate() {
            // A thicker ply stretches the profile and carries its thermocouples along.
            let expected_k = [1.7e-3 * bend, 3.3e-3 * inside, 3.3e-3, 5e-3 * below].map(profile_k);
            for (sensor, expected_k) in expected_k.iter().enumerate() {
                let found_k = traces.trace(member, sensor)[0];
                let message = format!("member {member}, sensor {sensor}: {found_k} K for {expected_k} K");
                assert!((found_k - expected_k).abs() < tolerance_k, "{message}");
            }
        }
        in_single.push(traces.temperatures_k);
    }
    assert_eq!(in_single[1], in_single[2], "the device and the processor in single precision");
    let mut march = RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)));
    let moved = Ensemble::from_values(4, vec![1.3, 1.0, 1.0, 1.0]);
    let tangents = march.tangents(&plan, &moved, &[0]).expect("the processor does not fail");
    let slope_k = 1.7e-3 * 10.0 / 1.7e-3;
    let found_k = tangents.expect("the processor differentiates").trace(1, 0)[0];
    assert!((found_k - slope_k).abs() < 1e-9, "{found_k} K for {slope_k} K per unit of the factor");
}

/// The profile bends between nodes and is hottest at the contact of a ply that cools from the start.
#[test]
fn at_the_start_the_hottest_point_of_a_part_is_that_of_the_stated_profile() {
    let text = r#"
duration = "60 s"
initial_temperature = [["0 mm", "300 K"], ["2.1 mm", "480 K"], ["12 mm", "310 K"]]
ply = [
    { name = "S", material = "constant", thickness = "5 mm", limit = "700 K", limit_below = "650 K" },
    { name = "T", material = "constant", thickness = "7 mm", limit = "600 K" },
]
contact_conductance = "200 W/m^2/K"
sensor = [{ name = "F", depth = "0 mm" }]
hot_face = { kind = "held", temperature = "500 K" }
"#;
    let case = load(text);
    let mut session = Session::open(case, &Options::default()).expect("the processor marches");
    let found = session.predict().expect("the processor marches");
    let between_k = 480.0 - 170.0 * 2.9 / 9.9;
    for (limit, expected_k) in [500.0, between_k, between_k].into_iter().enumerate() {
        let found_k = found.limited_k[limit][0];
        assert!((found_k - expected_k).abs() < 1e-9, "limit {limit}: {found_k} K for {expected_k} K");
    }
    for (margin, expected_k) in found.margins.iter().zip([500.0, between_k, between_k]) {
        assert!(margin.peak.temperature_k >= expected_k - 1e-9, "{:?}, at least {expected_k} K", margin.peak);
    }
}

/// A bead starts at the initial temperature of its depth, also on a face that is held at another one, and then follows
/// the face: 400 K + 50 K exp(−t/20 s).
#[test]
fn a_bead_with_lag_on_a_held_face_starts_at_the_initial_profile_and_follows_the_face() {
    let text = r#"
duration = "60 s"
initial_temperature = [["0 mm", "450 K"], ["5 mm", "350 K"]]
ply = [{ name = "S", material = "constant", thickness = "5 mm" }]
sensor = [{ name = "LAG", depth = "0 mm", time_constant = "20 s" }, { name = "F", depth = "0 mm" }]
hot_face = { kind = "held", temperature = "400 K" }
"#;
    let prediction = predict(text);
    let [lag_k, face_k] = [0, 1].map(|sensor: usize| &prediction.temperatures_k[sensor]);
    for (instant, time_s) in prediction.instants_s.iter().enumerate() {
        let expected_k = 400.0 + 50.0 * (-time_s / 20.0).exp();
        assert!((lag_k[instant] - expected_k).abs() < TOLERANCE_K, "{} K for {expected_k} K", lag_k[instant]);
        assert!((face_k[instant] - 400.0).abs() < 1e-9);
    }
}
