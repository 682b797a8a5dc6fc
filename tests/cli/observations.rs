//! Measured data as they come: a messy workbook with a known truth, and a driver at 100 Hz with noise.

use super::run;
use crate::support::{Scratch, Uniform, root};
use rust_xlsxwriter::{DocProperties, ExcelDateTime, Format, Formula, Workbook};
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write as _;

/// A layup under lamps. Six thermocouples are in it, the last two of which fail in the test.
const LAYUP: &str = r#"name = "Run 17"
initial_temperature = "20 degC"
duration = "180 s"
ply = [
    { name = "CLOTH", material = "nextel440-bf20", thickness = "0.51 mm" },
    { name = "INS", group = "INS", material = "pyrogel3350", thickness = "6 mm" },
]
sensor = [
    { name = "TC1", below = "CLOTH" },
    { name = "TC2", depth = "1.5 mm" },
    { name = "TC3", depth = "2.5 mm" },
    { name = "TC4", depth = "3.5 mm" },
    { name = "TC5", depth = "4.5 mm" },
    { name = "BOND", below = "INS" },
]
factor = [
    { name = "f_k", group = "INS", property = "conductivity", small = [0.75, 1.25] },
    { name = "f_cp", group = "INS", property = "heat_capacity", small = [0.8, 1.2] },
]
[hot_face]
kind = "heated"
radiant_flux = { points = [["0 s", "0 W/cm^2"], ["1 s", "12 W/cm^2"], ["60 s", "12 W/cm^2"]], outside = "zero" }
[resolution]
output_interval = "0.2 s"
"#;

/// What the case reads of the workbook.
const OBSERVATIONS: &str = r#"[observations]
file = "run-17.xlsx"
sheet = "Logger"
time = { column = "Elapsed", offset = "-17.4 s" }
TC1 = { column = "CH 1" }
TC2 = { column = "CH 2" }
TC3 = { column = "CH 3" }
TC4 = { column = "CH 4" }
TC5 = { column = "CH 5" }
BOND = { column = "CH 6" }
sigma = "1 K"
"#;

const TRUTH: [(&str, f64); 2] = [("f_k", 1.1), ("f_cp", 0.95)];
const INTERVAL_S: f64 = 0.2;
const START_S: f64 = 17.4;
const SPIKES_S: [f64; 2] = [20.0, 41.0];

/// Standard normal numbers (Box and Muller).
fn normal(draw: &mut Uniform) -> f64 {
    (-2.0 * (1.0 - draw.next()).ln()).sqrt() * (TAU * draw.next()).cos()
}

/// Write the case and the workbook of a logger with twelve channels: lines above the table, units of its own, a clock
/// that starts before the test, a drift before the start, a gap, errors of formulas, two spikes, a thermocouple that
/// opens and one that freezes, and channels that are no thermocouples.
fn messy_run(scratch: &Scratch) {
    scratch.write("truth/case.toml", LAYUP);
    let truth = TRUTH.map(|(name, value)| format!("{name}={value}")).join(",");
    run(scratch, &format!("twin truth --truth {truth} --noise 1K --seed 7 --out truth.csv")).succeeded();
    let readings = scratch.read("truth.csv");
    let rows = readings.lines().skip(1).map(|line| line.split(',').map(|cell| cell.parse().expect("a number")));
    let rows: Vec<Vec<f64>> = rows.map(Iterator::collect).collect();
    let mut book = Workbook::new();
    let created = ExcelDateTime::from_ymd(2026, 11, 24).expect("a date");
    book.set_properties(&DocProperties::new().set_creation_datetime(&created));
    book.add_worksheet().set_name("Notes").and_then(|sheet| sheet.write(0, 0, "Run 17, panel B")).expect("a sheet");
    let sheet = book.add_worksheet().set_name("Logger").expect("a sheet");
    sheet.write(0, 0, "Run 17").expect("a cell");
    sheet.merge_range(1, 1, 1, 6, "Thermocouples", &Format::new()).expect("a heading");
    let headings =
        ["Elapsed", "CH 1", "CH 2", "CH 3", "CH 4", "CH 5", "CH 6", "Ambient", "P", "P2", "Lamp", "Spare", "Alarm"];
    let units = ["s", "degC", "degF", "degC", "degC", "degC", "degC", "degC", "kPa", "kPa", "V", "", ""];
    for (column, (heading, unit)) in (0..).zip(headings.into_iter().zip(units)) {
        sheet.write(3, column, heading).and_then(|sheet| sheet.write(4, column, unit)).expect("a heading");
    }
    let mut draw = Uniform(23);
    let earlier = (START_S / INTERVAL_S).round() as usize;
    let mut frozen = 0.0;
    for (row, index) in (5..).zip(0..earlier + rows.len()) {
        let time_s = INTERVAL_S * index as f64 - START_S;
        let mut celsius = [0.0; 6];
        for (channel, value) in celsius.iter_mut().enumerate() {
            *value = match index.checked_sub(earlier) {
                Some(index) => rows[index][channel + 1] - 273.15,
                None => 20.0 + normal(&mut draw),
            };
        }
        // CH 2 drifts by 9 K/min before the start.
        celsius[1] += if time_s < 0.0 { 0.15 * time_s } else { 0.0 };
        if SPIKES_S.iter().any(|spike_s| (spike_s - time_s).abs() < 0.5 * INTERVAL_S) {
            celsius[3] += 60.0;
        }
        // The junction opens and closes again: the logger shows its full scale. The other one freezes for good.
        if (33.0..39.0).contains(&time_s) {
            celsius[4] = 1372.0;
        }
        frozen = if time_s < 25.0 { celsius[5] } else { frozen };
        celsius[5] = frozen;
        sheet.write(row, 0, time_s + START_S).expect("a time");
        for (channel, value) in (1..).zip(celsius) {
            let value = if channel == 2 { 1.8 * value + 32.0 } else { value };
            let written = match channel {
                3 if (12.0..15.0).contains(&time_s) => continue,
                1 if index % 97 == 50 => sheet.write(row, channel, Formula::new("=NA()").set_result("#N/A")),
                _ => sheet.write(row, channel, (1000.0 * value).round() / 1000.0),
            };
            written.expect("a temperature");
        }
        for (channel, value) in [(7, 19.8 + 0.1 * normal(&mut draw)), (8, 101.3), (9, 8.0), (10, 230.0)] {
            sheet.write(row, channel, value).expect("a number");
        }
        sheet.write(row, 12, if time_s > 40.0 { "HIGH" } else { "ok" }).expect("a text");
    }
    std::fs::create_dir_all(scratch.path().join("run17")).expect("a folder");
    book.save(scratch.path().join("run17/run-17.xlsx")).expect("a workbook");
    scratch.write("run17/case.toml", format!("{LAYUP}{OBSERVATIONS}"));
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("a number, found {value}"))
}

/// Factors whose 95 % interval does not hold the truth.
fn missed(summary: &Value) -> Vec<&'static str> {
    let is_missed = |(name, truth): &(&'static str, f64)| {
        let factor = &summary["factors"][*name];
        !(number(&factor["low"])..=number(&factor["high"])).contains(truth)
    };
    TRUTH.into_iter().filter(is_missed).map(|(name, _)| name).collect()
}

/// `BONDLINE_BLESS` renews the workbook.
#[test]
fn the_workbook_of_the_tutorial_is_the_messy_one_with_the_known_truth() {
    let scratch = Scratch::new("messy-workbook");
    messy_run(&scratch);
    let (made, shipped) = (scratch.path().join("run17/run-17.xlsx"), root().join("data/import/run-17.xlsx"));
    if std::env::var_os("BONDLINE_BLESS").is_some() {
        std::fs::copy(&made, &shipped).expect("the shipped workbook");
    }
    let bytes = |path: &std::path::Path| std::fs::read(path).unwrap_or_else(|error| panic!("{path:?}: {error}"));
    assert!(bytes(&made) == bytes(&shipped), "data/import/run-17.xlsx is not what this test makes");
}

#[test]
fn a_messy_workbook_is_shown_as_it_is_and_its_good_channels_give_the_truth() {
    let scratch = Scratch::new("messy");
    messy_run(&scratch);
    let shown = run(&scratch, "observations run17 --json").succeeded();
    assert!(shown.stderr.contains("column \"Ambient\" and 5 more not read: no sensor of the case"), "{}", shown.stderr);
    assert!(shown.stderr.contains("87 samples of a sensor before 0 s not read"), "{}", shown.stderr);
    let summary = shown.json();
    let channels = &summary["channels"];
    let flags = ["TC1", "TC2", "TC3", "TC4", "TC5", "BOND"].map(|sensor| {
        let counts = channels[sensor]["flags"].as_object().expect("flags");
        let counts = counts.iter().filter(|(_, count)| **count != 0).map(|(flag, count)| format!("{flag} {count}"));
        counts.collect::<Vec<_>>().join(", ")
    });
    assert_eq!(flags, ["", "drift 1", "gap 1", "spike 2", "open 1", "stuck 1"]);
    for sensor in ["TC1", "TC2", "TC3", "TC4"] {
        let channel = &channels[sensor];
        assert!((number(&channel["noise_k"]) - 1.0).abs() < 0.2, "{sensor}: {channel}");
        assert_eq!(channel["earlier"].as_u64(), Some(87 - u64::from(sensor == "TC1")));
        // The sum of clock and offset of the last sample may round beyond the end.
        assert!(channel["later"].as_u64().is_some_and(|later| later <= 1), "{channel}");
        assert!((number(&channel["interval_s"]) - INTERVAL_S).abs() < 1e-9);
    }
    assert_eq!(channels["TC1"]["missing"].as_u64(), Some(10));
    let drift = &channels["TC2"];
    assert!((number(&drift["drift_k_min"]) - 9.0).abs() < number(&drift["drift_half_width_k_min"]), "{drift}");

    let fit = "estimate run17 --factors f_k,f_cp --loss huber --json --sensors";
    let good = run(&scratch, &format!("{fit} TC1,TC2,TC3,TC4")).succeeded().json();
    assert_eq!(missed(&good), [""; 0], "{:#}", good["factors"]);
    // The frozen thermocouple moves the estimate out of that interval, and its own interval is several times as wide.
    let spoiled = run(&scratch, &format!("{fit} TC1,TC2,TC3,TC4,BOND --out spoiled")).json();
    // The ply is sized with the estimates and their intervals, and then holds the limit of the bond.
    let estimated = TRUTH.map(|(name, _)| {
        let [value, low, high] = ["value", "low", "high"].map(|key| number(&good["factors"][name][key]));
        format!("--set {name}={value} --set {name}.small=[{low},{high}]")
    });
    let options = format!("{} --set sensor.BOND.limit=523K --set duration=400s -n 1000 --json", estimated.join(" "));
    let sized = run(&scratch, &format!("size run17 --ply INS {options}")).succeeded().json();
    let thickness_m = number(&sized["sizing"]["required"]["thickness_m"]);
    let above = |thickness: &str| {
        let line = format!("uncertainty run17 {options} --seed 2 --set ply.INS.thickness={thickness}");
        let margins = run(&scratch, &line).succeeded().json()["margins"].clone();
        assert_eq!(margins[0]["limit_k"].as_f64(), Some(523.0), "{margins:#}");
        number(&margins[0]["members"]["above"]["count"])
    };
    assert!(above(&format!("{thickness_m}m")) <= 25.0, "{thickness_m} m");
    assert!(above("6mm") > 990.0);
    let table = scratch.read("out/run17/uncertainty/margins.csv");
    assert!(table.lines().nth(1).is_some_and(|row| row.starts_with("BOND,sensor,523,")), "{table}");
    let (good, spoiled) = (&good["factors"]["f_k"], &spoiled["factors"]["f_k"]);
    assert!(!(number(&good["low"])..=number(&good["high"])).contains(&number(&spoiled["value"])), "{good} {spoiled}");
    assert!(number(&spoiled["standard_error"]) > 3.0 * number(&good["standard_error"]), "{good} {spoiled}");
}

#[test]
fn without_observations_there_is_nothing_to_show() {
    let scratch = Scratch::new("unobserved");
    scratch.write("c/case.toml", LAYUP);
    let refused = run(&scratch, "observations c");
    assert_eq!((refused.code, refused.stderr.contains("the case has no observations")), (2, true));
}

/// Temperatures of the first sensor, K, of a prediction, which ends with exit code 1 where its discretisation error is
/// above ten times the tolerance.
fn trace(scratch: &Scratch, case: &str) -> Vec<f64> {
    let ended = run(scratch, &format!("predict {case} --out out-{case}"));
    let summary: Value = serde_json::from_str(&scratch.read(&format!("out-{case}/summary.json"))).expect("JSON");
    let error_k = number(&summary["discretisation_error"]["nominal_k"]);
    ended.exited_with(i32::from(error_k > 0.5));
    let table = scratch.read(&format!("out-{case}/traces.csv"));
    let cells = table.lines().skip(1).map(|line| line.split(',').nth(1).expect("a sensor").parse().expect("a number"));
    cells.collect()
}

#[test]
fn a_noisy_driver_smoothed_within_its_noise_gives_the_prediction_of_the_true_one() {
    const NOISE_K: f64 = 3.0;
    let scratch = Scratch::new("driver");
    let mut draw = Uniform(5);
    let (mut truth, mut noisy) = ("time_s,TC1_K\n".to_owned(), "time_s,TC1_K\n".to_owned());
    for index in 0..=6000 {
        let time_s = 0.01 * f64::from(index);
        let true_k = 300.0 + 700.0 * (1.0 - (-time_s / 6.0).exp()) + 15.0 * (time_s / 4.0).sin();
        writeln!(truth, "{time_s},{true_k}").expect("a text");
        writeln!(noisy, "{time_s},{}", true_k + NOISE_K * normal(&mut draw)).expect("a text");
    }
    let case = |file: &str, noise: &str| {
        let face = format!("kind = \"held\"\ntemperature = {{ file = \"../{file}.csv\"{noise} }}");
        let (before, after) = LAYUP.split_once("kind = \"heated\"\n").expect("a hot face");
        let (_, after) = after.split_once('\n').expect("a flux");
        let case = format!("{before}{face}\n{after}").replacen("below = \"CLOTH\"", "depth = \"0.1 mm\"", 1);
        case.replacen("180 s", "60 s", 1)
    };
    scratch.write("true.csv", truth);
    scratch.write("noisy.csv", noisy);
    for (name, file, noise) in [
        ("true", "true", ""),
        ("raw", "noisy", ""),
        ("smooth", "noisy", ", noise = \"3 K\""),
        ("flat", "noisy", ", noise = \"90 K\""),
    ] {
        scratch.write(&format!("{name}/case.toml"), case(file, noise));
    }
    let true_k = trace(&scratch, "true");
    let off_k = |name: &str| {
        let squares = trace(&scratch, name).iter().zip(&true_k).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        (squares / true_k.len() as f64).sqrt()
    };
    let (raw_k, smooth_k, flat_k) = (off_k("raw"), off_k("smooth"), off_k("flat"));
    assert!(smooth_k < 0.5 * raw_k, "off by {smooth_k} K smoothed, by {raw_k} K as measured");
    assert!(flat_k > 10.0 * smooth_k, "a noise of 90 K smooths the signal away: {flat_k} K");
    let warned = run(&scratch, "predict flat --out again").succeeded().stdout;
    assert!(warned.contains("has a stated noise of 90.0 K, its samples have"), "{warned}");
    let summary = run(&scratch, "predict smooth --json").succeeded().json();
    let smoothing = &summary["driver_smoothing"];
    let driver = &smoothing["drivers"][0];
    assert_eq!((driver["samples"].as_u64(), driver["face"].as_str()), (Some(6001), Some("hot face")));
    assert!(driver["corners"].as_u64().is_some_and(|corners| corners < 300), "{driver}");
    assert!((number(&driver["residual_k"]) / NOISE_K - 1.0).abs() < 1e-3, "{driver}");
    assert_eq!(driver["steps_s"].as_array().map(Vec::len), Some(0), "{driver}");
    let change_k = number(&smoothing["largest_changes"]["TC1"]["change_k"]).abs();
    assert!(change_k > smooth_k && change_k < 5.0 * NOISE_K, "{change_k} K");
    let raw: Value = serde_json::from_str(&scratch.read("out-raw/summary.json")).expect("JSON");
    assert!(
        number(&summary["steps"]) <= 1.2 * number(&raw["steps"]),
        "{} and {} steps",
        summary["steps"],
        raw["steps"]
    );
}

#[test]
fn a_noise_is_a_key_of_the_temperature_of_a_held_face() {
    let scratch = Scratch::new("noise-key");
    let flux = "radiant_flux = { points = [[\"0 s\", \"0 W/cm^2\"], [\"60 s\", \"1 W/cm^2\"]], noise = \"1 K\" }";
    let (before, after) = LAYUP.split_once("radiant_flux").expect("a flux");
    let (_, after) = after.split_once('\n').expect("its end");
    scratch.write("c/case.toml", format!("{before}{flux}\n{after}"));
    let refused = run(&scratch, "predict c");
    assert!(refused.code == 2 && refused.stderr.contains("unknown key \"noise\""), "{}", refused.stderr);
}
