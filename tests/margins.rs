//! Margins to temperature limits, against exact solutions, exact distributions, and the command.

use crate::cli::run;
use crate::support::{Scratch, root};
use bondline::case::{Bounds, Case};
use bondline::ensemble::SamplingKind;
use bondline::question::{Draw, Uncertainty};
use bondline::session::{BackendKind, Options, Session};
use bondline::study::margins::{Margin, MarginSpread};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use serde_json::Value;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::fs;

/// Density, heat capacity and conductivity of the material of every case here, SI.
const CONSTANT: (f64, f64, f64) = (200.0, 1000.0, 0.05);
/// Tolerance of cells and steps in the cases, K.
const TOLERANCE_K: f64 = 0.05;

fn load(text: &str) -> Case {
    let material = fs::read_to_string(root().join("cases/slab/materials/constant.toml")).expect("a shipped material");
    let files = BTreeMap::from([("materials/constant.toml".to_owned(), material)]);
    Case::from_toml(text, "own", &files).unwrap_or_else(|error| panic!("{error}"))
}

fn open(case: Case) -> Session {
    Session::open(case, &Options::default().backend(BackendKind::Cpu)).expect("the CPU is always available")
}

fn margins(text: &str) -> Vec<Margin> {
    open(load(text)).predict().expect("a prediction").margins
}

/// A ply of 10 mm between faces held at 300 K, warmed inside by its holder, which is cold again after 37.3 s: the ply
/// is hottest in its middle, between two instants.
const WARMED_INSIDE: &str = r#"
initial_temperature = "300 K"
duration = "80 s"
ply = [{ name = "P", material = "constant", thickness = "10 mm", limit = "340 K" }]
sensor = [{ name = "Q", depth = "2 mm", limit = "330 K" }]
[hot_face]
kind = "held"
temperature = "300 K"
[back_face]
kind = "held"
temperature = "300 K"
[holder]
conductance = "5 kW/m^3/K"
temperature.points = [["0 s", "600 K"], ["37.3 s", "600 K"], ["37.3 s", "300 K"]]
temperature.outside = "hold"
"#;

/// Temperature of that ply: a series of sines with loss to the holder (Carslaw & Jaeger, 1959, section 4.7).
fn warmed_inside_k(depth_m: f64, time_s: f64) -> f64 {
    let ((rho, c, k), (length_m, warmed_s)) = (CONSTANT, (0.01, 37.3));
    let (loss_1_s, source_k_s) = (5e3 / (rho * c), 5e3 * 300.0 / (rho * c));
    let mode = |n: f64| {
        let rate_1_s = k / (rho * c) * (n * PI / length_m).powi(2) + loss_1_s;
        let during_s = time_s.min(warmed_s);
        let after_s = (time_s - warmed_s).max(0.0);
        let steady_k = 4.0 / (n * PI) * source_k_s / rate_1_s;
        steady_k
            * (1.0 - (-rate_1_s * during_s).exp())
            * (-rate_1_s * after_s).exp()
            * (n * PI * depth_m / length_m).sin()
    };
    300.0 + (0..200).map(|n| mode(f64::from(2 * n + 1))).sum::<f64>()
}

/// Time for which a temperature is above a limit, s: by many small intervals.
fn time_above_s(limit_k: f64, duration_s: f64, of_time_k: impl Fn(f64) -> f64) -> f64 {
    const INTERVALS: u32 = 40_000;
    let step_s = duration_s / f64::from(INTERVALS);
    let above = (0..INTERVALS).filter(|&n| of_time_k((f64::from(n) + 0.5) * step_s) > limit_k).count();
    above as f64 * step_s
}

#[test]
fn the_hottest_point_inside_a_ply_is_that_of_the_exact_solution() {
    let found = margins(WARMED_INSIDE);
    let exact_k = warmed_inside_k(0.005, 37.3);
    let [ply, sensor] = found[..] else { panic!("{found:?}") };
    assert!((ply.peak.temperature_k - exact_k).abs() < TOLERANCE_K, "{ply:?}, exact {exact_k}");
    assert!((ply.peak.time_s - 37.3).abs() < 1e-6 && (ply.margin_k - (340.0 - ply.peak.temperature_k)).abs() < 1e-9);
    let above_s = time_above_s(340.0, 80.0, |time_s| warmed_inside_k(0.005, time_s));
    assert!((ply.time_above_s - above_s).abs() < 0.05, "{} s, exact {above_s}", ply.time_above_s);
    let exact_k = warmed_inside_k(0.002, 37.3);
    assert!((sensor.peak.temperature_k - exact_k).abs() < TOLERANCE_K, "{sensor:?}, exact {exact_k}");
    // Negative control: the limit of the ply is not for the sensor, nor for the mean.
    assert!(ply.peak.temperature_k > sensor.peak.temperature_k + 1.0);
}

/// A ply whose first temperatures rise and fall over its depth as half a sine, between cold faces: at every instant the
/// hottest point is inside. Off the middle the second mode moves it.
fn decaying(skew_k: f64) -> (String, impl Fn(f64, f64) -> f64) {
    let (rho, c, k) = CONSTANT;
    let temperature_k = move |depth_m: f64, time_s: f64| {
        let mode = |n: f64, height_k: f64| {
            let rate_1_s = k / (rho * c) * (n * PI / 0.01).powi(2);
            height_k * (-rate_1_s * time_s).exp() * (n * PI * depth_m / 0.01).sin()
        };
        300.0 + mode(1.0, 400.0) + mode(2.0, skew_k)
    };
    let points = (0..=400).map(|n| {
        let depth_m = 0.01 * f64::from(n) / 400.0;
        format!("[\"{:.6} mm\", \"{:.9} K\"]", 1e3 * depth_m, temperature_k(depth_m, 0.0))
    });
    let points: Vec<String> = points.collect();
    let text = format!(
        r#"
initial_temperature = [{}]
duration = "60 s"
ply = [{{ name = "P", material = "constant", thickness = "10 mm", limit = "450 K" }}]
sensor = [{{ name = "Q", depth = "5 mm" }}]
hot_face = {{ kind = "held", temperature = "300 K" }}
back_face = {{ kind = "held", temperature = "300 K" }}
"#,
        points.join(", ")
    );
    (text, temperature_k)
}

#[test]
fn the_hottest_temperature_follows_a_maximum_that_moves_through_a_ply() {
    for skew_k in [0.0, 150.0] {
        let (text, exact_k) = decaying(skew_k);
        let mut session = open(load(&text));
        let found = session.predict().expect("a prediction");
        let hottest_k = |time_s: f64| {
            let depths_m = (0..=2000).map(|n| 0.01 * f64::from(n) / 2000.0);
            depths_m.map(|depth_m| exact_k(depth_m, time_s)).fold(0.0, f64::max)
        };
        for (instant, &time_s) in found.instants_s.iter().enumerate().skip(1) {
            let (read_k, exact_k) = (found.limited_k[0][instant], hottest_k(time_s));
            assert!((read_k - exact_k).abs() < TOLERANCE_K, "{read_k} K at {time_s} s, exact {exact_k}, skew {skew_k}");
        }
        let above_s = time_above_s(450.0, 60.0, hottest_k);
        assert!((found.margins[0].time_above_s - above_s).abs() < 0.05, "{:?}, exact {above_s} s", found.margins);
    }
}

/// A deep slab under a triangle of flux: its face is hottest after the peak of the flux, between two instants.
const TRIANGLE: &str = r#"
initial_temperature = "300 K"
duration = "60 s"
ply = [
    { name = "TOP", material = "constant", thickness = "1 mm", limit = "500 K", limit_below = "480 K" },
    { name = "REST", material = "constant", thickness = "40 mm", limit = "480 K" },
]
sensor = [{ name = "FACE", depth = "0 mm" }]
[hot_face]
kind = "heated"
emissivity = 0
flux.points = [["0 s", "0 W/m^2"], ["10.4 s", "6 kW/m^2"], ["25.7 s", "0 W/m^2"]]
flux.outside = "zero"
"#;

#[test]
fn a_peak_between_two_instants_is_that_of_the_exact_solution() {
    let (rho, c, k) = CONSTANT;
    let found = margins(TRIANGLE);
    // Slopes of the flux change at the corners; each change warms the face of a half-space by (4/3) t^(3/2)/√(πkρc).
    let slopes = [(0.0, 6000.0 / 10.4), (10.4, -6000.0 / 10.4 - 6000.0 / 15.3), (25.7, 6000.0 / 15.3)];
    let face_k = |time_s: f64| {
        let warmed = slopes.map(|(start_s, change)| change * f64::max(time_s - start_s, 0.0).powf(1.5));
        300.0 + 4.0 / 3.0 / (PI * k * rho * c).sqrt() * warmed.iter().sum::<f64>()
    };
    let times_s = (0..60_000).map(|n| 1e-3 * f64::from(n));
    let (peak_s, peak_k) = times_s
        .map(|time_s| (time_s, face_k(time_s)))
        .fold((0.0, 0.0), |best, next| if next.1 > best.1 { next } else { best });
    let [top, interface, rest] = found[..] else { panic!("{found:?}") };
    assert!((top.peak.temperature_k - peak_k).abs() < TOLERANCE_K, "{top:?}, exact {peak_k}");
    assert!((top.peak.time_s - peak_s).abs() < 0.1, "{top:?}, exact {peak_s} s");
    // The lower ply is hottest at the interface.
    assert!((rest.peak.temperature_k - interface.peak.temperature_k).abs() < 1e-3, "{rest:?} {interface:?}");
    assert!(rest.peak.temperature_k < peak_k - 10.0);
}

#[test]
fn a_jump_of_a_held_face_between_instants_is_not_missed() {
    let text = r#"
initial_temperature = "300 K"
duration = "30 s"
ply = [{ name = "P", material = "constant", thickness = "10 mm", limit = "900 K" }]
sensor = [{ name = "Q", depth = "0 mm", limit = "800 K" }, { name = "R", depth = "5 mm" }]
[hot_face]
kind = "held"
temperature.points = [["0 s", "300 K"], ["12.5 s", "1000 K"], ["12.5 s", "400 K"]]
temperature.outside = "hold"
"#;
    let found = margins(text);
    assert_eq!((found[0].peak.temperature_k, found[0].margin_k), (1000.0, -100.0));
    assert_eq!((found[1].peak.temperature_k, found[1].margin_k), (1000.0, -200.0));
}

/// After a quench the hottest point is inside, at the first temperature; no curve rises above it. The scheme does, by
/// less than a microkelvin.
#[test]
fn the_peak_of_a_quenched_ply_is_its_first_temperature() {
    let text = r#"
initial_temperature = "500 K"
duration = "30 s"
ply = [{ name = "P", material = "constant", thickness = "10 mm", limit = "490 K" }]
sensor = [{ name = "Q", depth = "5 mm" }]
hot_face = { kind = "held", temperature = "300 K" }
back_face = { kind = "held", temperature = "300 K" }
"#;
    let found = margins(text);
    assert!((found[0].peak.temperature_k - 500.0).abs() < 1e-6, "{found:?}");
}

/// A slab without radiation is linear in the flux, so its peak is a line in the factor of the flux.
const LINEAR: &str = r#"
initial_temperature = "300 K"
duration = "40 s"
ply = [{ name = "P", material = "constant", thickness = "10 mm", limit = "399 K" }]
sensor = [{ name = "BACK", below = "P" }]
hot_face = { kind = "heated", emissivity = 0, flux = "1.5 kW/m^2" }
factor = [{ name = "f_q", property = "heating", small = [0.8, 1.2] }]
"#;

#[test]
fn probabilities_and_percentiles_of_a_linear_case_are_those_of_its_factor() {
    let case = load(LINEAR);
    let factor = case.factors()[0].clone();
    let mut session = open(case);
    let rise_k = session.predict().expect("a prediction").margins[0].peak.temperature_k - 300.0;
    let limit_k = 300.0 + 1.11 * rise_k;
    let case = load(&LINEAR.replace("399 K", &format!("{limit_k} K")));
    let mut session = open(case);
    let marginal = bondline::ensemble::Marginal::new(1.0, factor.bounds(Bounds::Small), SamplingKind::Normal);
    let exact = 1.0 - marginal.cumulative(1.11);
    let (mut held, mut held_p99, mut bounded) = (0, 0, 0);
    const SWEEPS: u64 = 60;
    for seed in 1..=SWEEPS {
        let options = Uncertainty { members: 400, draw: Draw { seed, ..Draw::default() }, ..Uncertainty::default() };
        let swept = session.uncertainty(&options).expect("a sweep");
        let statistics = swept.margins.expect("margins");
        let MarginSpread { exceeding_interval, percentiles, tolerance_bound_k, .. } = &statistics.limits[0];
        let (low, high) = exceeding_interval.expect("members are independent");
        held += usize::from((low..=high).contains(&exact));
        let p95_k = 300.0 + rise_k * marginal.quantile(0.95);
        let (low_k, high_k) = (percentiles[0].low_k.expect("enough members"), percentiles[0].high_k.expect("enough"));
        held_p99 += usize::from((low_k..=high_k).contains(&p95_k));
        bounded += usize::from(tolerance_bound_k.expect("enough members") > 300.0 + rise_k * marginal.quantile(0.99));
        assert!(percentiles[2].high_k.is_none(), "400 members bound the 99.87th percentile");
    }
    assert!(held >= 53 && held_p99 >= 53 && bounded >= 53, "{held}, {held_p99}, {bounded} of {SWEEPS}");
}

/// The case of this page with a limit of each kind.
fn limited(scratch: &Scratch) -> String {
    let limits = crate::cli::CASE
        .replacen("thickness = \"3 mm\"", "thickness = \"3 mm\"\nlimit = \"640 K\"", 1)
        .replacen("thickness = \"0.5 mm\"", "thickness = \"0.5 mm\"\nlimit_below = \"500 K\"", 1)
        .replacen("depth = \"2 mm\"", "depth = \"2 mm\"\nlimit = \"420 K\"", 1);
    scratch.write("c/case.toml", &limits);
    limits
}

fn summary(scratch: &Scratch, folder: &str) -> Value {
    let text = fs::read_to_string(scratch.path().join(folder).join("summary.json")).expect("a summary");
    serde_json::from_str(&text).expect("JSON")
}

#[test]
fn session_command_and_merged_parts_have_the_same_margins() {
    let scratch = Scratch::new("margins");
    limited(&scratch);
    run(&scratch, "uncertainty c -n 90 --backend cpu --out whole").succeeded();
    for part in ["0..30", "30..90"] {
        run(&scratch, &format!("uncertainty c -n 90 --members {part} --backend cpu --out parts")).succeeded();
    }
    run(&scratch, "merge parts/c-30-90.json parts/c-0-30.json --out merged").succeeded();
    let whole = summary(&scratch, "whole");
    assert!(whole["margins"].as_array().is_some_and(|margins| margins.len() == 3), "{whole:#}");
    assert_eq!(whole["margins"], summary(&scratch, "merged")["margins"]);
    let table = |folder: &str| fs::read(scratch.path().join(folder).join("margins.csv")).expect("a table");
    assert!(table("whole") == table("merged"));
    let mut session = open(Case::load(&scratch.path().join("c")).expect("a case"));
    let options = Uncertainty { members: 90, ..Uncertainty::default() };
    let swept = session.uncertainty(&options).expect("a sweep");
    let statistics = swept.margins.expect("margins");
    for (spread, written) in statistics.limits.iter().zip(whole["margins"].as_array().expect("a list")) {
        assert_eq!(written["members"]["mean_k"].as_f64(), Some(spread.mean_k));
        assert_eq!(written["members"]["above"]["count"].as_u64(), Some(spread.exceeding.count as u64));
        assert!(written["members"]["tolerance_95_99_k"].is_null(), "90 members are too few");
    }
}

/// Members of a run, from its `members.parquet`: completed ones with the peak of TC2 above a temperature, all completed
/// ones, and failed ones.
fn kept_members(scratch: &Scratch, folder: &str, above_k: f64) -> [usize; 3] {
    let file = fs::File::open(scratch.path().join(folder).join("members.parquet")).expect("a file");
    let reader = SerializedFileReader::new(file).expect("Parquet");
    let mut counted = [0; 3];
    for row in reader.get_row_iter(None).expect("rows") {
        let row = row.expect("a row");
        let field = |name: &str| row.get_column_iter().find(|(column, _)| *column == name).map(|(_, field)| field);
        match (field("status"), field("TC2_peak_k")) {
            (Some(Field::Int(0)), Some(&Field::Double(peak_k))) => {
                counted[0] += usize::from(peak_k > above_k);
                counted[1] += 1;
            }
            (Some(Field::Int(1)), Some(Field::Double(peak_k))) if peak_k.is_nan() => counted[2] += 1,
            other => panic!("{other:?}"),
        }
    }
    counted
}

/// The peak of a sensor with a limit is one number, and a failed member is above every limit, in all of them.
#[test]
fn margins_kept_members_and_a_sampled_probability_count_the_same_members() {
    let scratch = Scratch::new("margins-counts");
    for (range, limit, failures) in [("[0.9, 1.1]", "950 K", false), ("[0.5, 400]", "2000 K", true)] {
        let case = crate::cli::CASE.replacen("depth = \"2 mm\"", &format!("depth = \"2 mm\"\nlimit = \"{limit}\""), 1);
        scratch.write("c/case.toml", case.replacen("small = [0.9, 1.1]", &format!("small = {range}"), 1));
        let sweep = "uncertainty c -n 500 --sampling uniform --max-failed 500 --backend cpu --force";
        run(&scratch, &format!("{sweep} --keep members --out swept")).succeeded();
        let until = format!("P(TC2>{limit}) ± 0.5").replace(' ', "");
        run(&scratch, &format!("{sweep} --until {until} --out until")).succeeded();
        let limit_k = limit.trim_end_matches(" K").parse().expect("a number");
        let [above, completed, failed] = kept_members(&scratch, "swept", limit_k);
        assert_eq!((completed + failed, failed > 100), (500, failures), "{above} of {completed}, {failed} failed");
        assert!(above < completed && (failures || above > 0), "the limit separates no members");
        let members = &summary(&scratch, "swept")["margins"][0]["members"];
        let count = (above + failed) as u64;
        assert_eq!((members["above"]["count"].as_u64(), members["above"]["of"].as_u64()), (Some(count), Some(500)));
        let sampled = &summary(&scratch, "until")["precision_reached"];
        assert_eq!(sampled["estimate"], members["above"]["share"]);
        assert_eq!(sampled["failed"].as_u64(), Some(failed as u64));
        // As many failed that the 95th percentile is among them.
        assert_eq!(members["percentiles"][0]["value_k"].is_null(), failures, "{members:#}");
    }
}

#[test]
fn members_of_latin_hypercubes_and_sobol_sequences_have_no_intervals_and_no_tolerance_bound() {
    let scratch = Scratch::new("margins-dependent");
    limited(&scratch);
    for (sampling, is_independent) in [("normal", true), ("uniform", true), ("lhs", false), ("sobol", false)] {
        let ran = run(&scratch, &format!("uncertainty c -n 400 --sampling {sampling} --backend cpu --force --out out"));
        let screen = ran.succeeded().stdout.split_whitespace().collect::<Vec<_>>().join(" ");
        let reason = format!("members of {sampling} sampling are not independent");
        let page = scratch.read("out/report.html");
        assert_eq!((screen.contains(&reason), page.contains(&reason)), (!is_independent, !is_independent), "{screen}");
        for margin in summary(&scratch, "out")["margins"].as_array().expect("a list") {
            let members = &margin["members"];
            let stated = [
                &members["above"]["interval"],
                &members["tolerance_95_99_k"],
                &members["percentiles"][0]["low_k"],
                &members["percentiles"][0]["high_k"],
            ];
            assert!(stated.iter().all(|value| value.is_null() != is_independent), "{sampling}: {members:#}");
            assert!(members["above"]["share"].is_f64() && members["percentiles"][0]["value_k"].is_f64());
        }
    }
}

#[test]
fn a_limit_changes_no_number_of_a_prediction_at_stated_cells_and_steps_without_corners() {
    let scratch = Scratch::new("margins-same");
    let stated = "resolution.cells=40";
    let with = limited(&scratch);
    scratch.write("d/case.toml", crate::cli::CASE);
    assert_ne!(with, crate::cli::CASE);
    for case in ["c", "d"] {
        run(&scratch, &format!("predict {case} --set {stated} --backend cpu --out {case}-out")).succeeded();
    }
    let (with, without) = (summary(&scratch, "c-out"), summary(&scratch, "d-out"));
    assert_eq!(with["sensors"], without["sensors"]);
    assert!(without.get("margins").is_none() && with.get("margins").is_some());
}

#[test]
fn limits_that_cannot_be_checked_are_refused_at_their_line() {
    let scratch = Scratch::new("margins-refused");
    let refused = |change: (&str, &str), expected: &str| {
        scratch.write("e/case.toml", crate::cli::CASE.replacen(change.0, &format!("{}\n{}", change.0, change.1), 1));
        run(&scratch, "predict e --out refused").exited_with(2).with_stderr(&[expected]);
    };
    refused(("thickness = \"3 mm\"", "limit = \"600 W\""), "expected a temperature");
    refused(("thickness = \"3 mm\"", "limit = 600"), "case.toml:");
    refused(
        ("thickness = \"3 mm\"", "limit_below = \"600 K\""),
        "`limit_below` needs a ply below: this is the last one",
    );
    refused(("depth = \"2 mm\"", "limit_below = \"600 K\""), "unknown key \"limit_below\"");
    let text = limited(&scratch);
    run(&scratch, "predict c --set ply.GAP.limit=600K --out refused")
        .exited_with(2)
        .with_stderr(&["no entry is named \"GAP\""]);
    let from = text.find("[hot_face]").expect("a hot face");
    let end = from + text[from..].find("\n\n").expect("another section");
    let held = "[hot_face]\nkind = \"held\"\nat = \"TC1\"\ntemperature = \"500 K\"";
    scratch.write("f/case.toml", format!("{}{held}{}", &text[..from], &text[end..]));
    run(&scratch, "predict f --out refused").exited_with(2).with_stderr(&["this ply lies above the held face"]);
}

#[test]
fn a_limit_below_the_initial_temperature_is_a_warning() {
    let scratch = Scratch::new("margins-warning");
    limited(&scratch);
    let ran = run(&scratch, "predict c --set ply.BASE.limit=290K --out out").succeeded();
    let screen = ran.stdout.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(screen.contains("The limit of BASE, 290 K (17 °C), is below its initial temperature of 300 K"), "{screen}");
}

#[test]
fn sizing_takes_the_limit_of_the_case_unless_the_command_has_one() {
    let scratch = Scratch::new("margins-size");
    limited(&scratch);
    let size = |limit: &str| {
        let words = format!("size c --ply BASE {limit} --probability 0.8 -n 30 --backend cpu --force --out sized");
        run(&scratch, &words).succeeded();
        summary(&scratch, "sized")["sizing"].clone()
    };
    let (stated, same, named) = (size(""), size("--limit TC2<420K"), size("--limit TC2"));
    assert_eq!((&stated["part"], &stated["limit_k"]), (&"TC2".into(), &420.0.into()));
    assert_eq!(stated, same);
    assert_eq!(stated, named);
    assert_ne!(stated, size("--limit TC2<430K"));
    run(&scratch, "size c --ply BASE --limit TC1 -n 400").exited_with(2).with_stderr(&["expected PART < TEMPERATURE"]);
    scratch.write("d/case.toml", crate::cli::CASE);
    run(&scratch, "size d --ply BASE -n 400").exited_with(2).with_stderr(&["no part has a limit in the case"]);
}
