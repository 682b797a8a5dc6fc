//! The studies of a case: output, files and reproducibility.

use super::{CASE, OBSERVATIONS, decomposing_case, run};
use crate::support::{Scratch, without_run};
use parquet::file::reader::{FileReader, SerializedFileReader};
use serde_json::Value;

fn with_case(name: &str) -> Scratch {
    let scratch = Scratch::new(name);
    scratch.write("c/case.toml", CASE);
    scratch
}

/// Expect a value at every path, such as `backend.kind`.
#[track_caller]
fn expect_paths(summary: &Value, paths: &[&str]) {
    for path in paths {
        let found = path.split('.').fold(summary, |value, key| &value[key]);
        assert!(!found.is_null(), "no {path} in {summary:#}");
    }
}

#[test]
fn a_comparison_reports_the_misfit_explained_by_the_other_case_and_needs_the_same_observations() {
    let scratch = with_case("beside");
    scratch.write("c/case.toml", CASE.to_owned() + OBSERVATIONS);
    // Heating ends after ten seconds, so that there is a cool-down.
    let short = r#"flux = { points = [["0 s", "5 W/cm^2"], ["10 s", "5 W/cm^2"]], outside = "zero" }"#;
    let cooled = CASE
        .replace(r#"flux = { points = [["0 s", "0 W/cm^2"], ["1 s", "5 W/cm^2"]], outside = "hold" }"#, short)
        + OBSERVATIONS;
    assert!(cooled.contains(short));
    scratch.write("same/case.toml", &cooled);
    scratch.write("hotter/case.toml", cooled.replace("5 W/cm^2", "8 W/cm^2"));
    scratch.write("colder/case.toml", cooled.replace("5 W/cm^2", "4 W/cm^2"));
    scratch.write("other/case.toml", cooled.replace("500 K", "501 K"));
    let summary = |beside: &str| {
        let ran = run(&scratch, &format!("estimate same --compare {beside} --json --quiet --force")).succeeded();
        serde_json::from_str::<Value>(&ran.stdout).expect("JSON alone")["model_comparison"].clone()
    };
    let explained = |beside: &Value| beside["sensors"]["TC2"]["explained_share"].as_f64().expect("a share");
    let (same, hotter, colder) = (summary("same"), summary("hotter"), summary("colder"));
    assert_eq!(explained(&same), 0.0, "a case explains nothing beside itself");
    assert_eq!(same["heating_end_s"], 10.0);
    // It is predicted too hot as it is.
    assert!(explained(&colder) > 0.1, "less heating explains {}", explained(&colder));
    assert!(explained(&hotter) < -0.1, "more heating explains {}", explained(&hotter));
    run(&scratch, "estimate same --compare other --quiet").exited_with(2).with_stderr(&["TC2", "differ"]);
}

#[test]
fn every_command_prints_its_summary_as_json_with_the_documented_keys() {
    let scratch = Scratch::new("json");
    scratch.write("c/case.toml", CASE.to_owned() + OBSERVATIONS);
    let common = [
        "command",
        "case",
        "version",
        "backend.name",
        "backend.kind",
        "backend.precision",
        "members.requested",
        "members.ok",
        "members.failed",
        "steps",
        "cells",
        "seconds.plan",
        "seconds.march",
        "seconds.reduce",
        "seconds.report",
        "seconds.total",
        "sensors.TC2.peak_k",
        "sensors.TC2.peak_time_s",
        "balance.energy",
    ];
    let fitted = [
        "factors.f_k.value",
        "factors.f_k.standard_error",
        "factors.f_k.low",
        "factors.f_k.high",
        "objective.initial",
        "objective.final",
        "iterations",
        "marches",
        "termination",
        "condition_number",
        "correlation",
    ];
    let of = |command: &str| -> Vec<&str> {
        match command {
            "uncertainty" => vec!["seed", "variance_shares.TC2.f_k"],
            "sensitivity" => {
                vec![
                    "identifiability.factors",
                    "identifiability.influential",
                    "identifiability.variance_shares.f_k",
                    "identifiability.excluded",
                ]
            }
            "estimate" => fitted.to_vec(),
            "study" => [&["seed", "variance_shares.TC2.f_k", "identifiability.factors"], &fitted[..]].concat(),
            _ => Vec::new(),
        }
    };
    for line in ["predict c", "uncertainty c -n 50", "sensitivity c", "estimate c", "study c -n 50"] {
        let ran = run(&scratch, &format!("{line} --json --quiet")).succeeded();
        assert_eq!(ran.stderr, "", "{line} writes to standard error");
        let summary = ran.json();
        let command = line.split(' ').next().expect("a command");
        assert_eq!((&summary["command"], &summary["case"]), (&Value::from(command), &Value::from("c")));
        expect_paths(&summary, &common);
        expect_paths(&summary, &of(command));
        assert_eq!(ran.stdout, scratch.read(&format!("out/c/{command}/summary.json")), "file and output differ");
    }
}

#[test]
fn results_go_to_standard_output_and_a_quiet_command_leaves_standard_error_empty() {
    let scratch = with_case("quiet");
    for line in ["predict c", "uncertainty c -n 50", "sensitivity c", "study c -n 50"] {
        let ran = run(&scratch, &format!("{line} --quiet")).succeeded();
        assert_eq!(ran.stderr, "", "{line}");
        assert!(ran.stdout.contains("Two plies") && ran.stdout.contains("report.html"), "{line}: {}", ran.stdout);
        assert!(
            ran.stdout.lines().all(|line| line.chars().count() <= 80),
            "{line} is wider than 80 columns:\n{}",
            ran.stdout
        );
    }
    let ran = run(&scratch, "study c -n 50").succeeded();
    assert!(ran.stderr.contains("no estimation: the case has no observations"), "{}", ran.stderr);
}

#[test]
fn a_study_shows_the_peak_of_every_sensor_its_standard_deviation_and_the_largest_share() {
    let scratch = Scratch::new("screen");
    scratch.write("c/case.toml", CASE.to_owned() + OBSERVATIONS);
    let screen = run(&scratch, "study c -n 100").succeeded().stdout;
    for sensor in ["TC1", "TC2"] {
        let row = screen.lines().find(|line| line.starts_with(sensor)).unwrap_or_else(|| panic!("{sensor}:\n{screen}"));
        assert!(row.contains(" °C)") && row.contains(" % ") | row.ends_with(" %"), "{row}");
    }
    let told = screen.replace('\n', " ");
    assert!(told.contains("only f_q can be estimated (condition number 1.00; 8.6"), "{screen}");
    assert!(
        told.contains("The case estimates f_k. bondline recommends f_q: the estimate of f_k would have correlation"),
        "{screen}"
    );
    assert!(screen.contains(" nominal, "), "{screen}");
}

#[test]
fn a_sweep_depends_on_its_seed_and_not_on_the_number_of_threads() {
    let scratch = with_case("seed");
    let drawn = |threads: &str, seed: &str| {
        let mut command = super::command(&scratch);
        command.env("RAYON_NUM_THREADS", threads);
        let line = format!("uncertainty c -n 300 --json --quiet --seed {seed}");
        let ran = super::wait_for(command.args(line.split_whitespace())).succeeded();
        let mut summary = without_run(ran.json());
        summary["backend"] = Value::Null;
        (summary, scratch.read("out/c/uncertainty/percentiles.csv"))
    };
    let first = drawn("1", "7");
    assert_eq!(first, drawn("2", "7"));
    assert_ne!(first.1, drawn("2", "8").1);
}

#[test]
fn keep_writes_one_row_per_member() {
    let scratch = with_case("keep");
    run(&scratch, "uncertainty c -n 130 --keep members").succeeded();
    let file = std::fs::File::open(scratch.path().join("out/c/uncertainty/members.parquet")).expect("a file");
    let reader = SerializedFileReader::new(file).expect("Parquet");
    assert_eq!(reader.metadata().file_metadata().num_rows(), 130);
    let columns: Vec<&str> = reader.metadata().file_metadata().schema().get_fields().iter().map(|c| c.name()).collect();
    for column in ["member", "f_k", "f_q"] {
        assert!(columns.contains(&column), "no {column} among {columns:?}");
    }
    assert!(
        !scratch.files().iter().any(|path| path.ends_with("traces.parquet")),
        "traces were written without --keep traces"
    );
    for piece in ["0..9", "9..20"] {
        run(&scratch, &format!("uncertainty c -n 20 --keep members --members {piece} --out pieces")).succeeded();
    }
    for piece in ["0-9", "9-20"] {
        let file = format!("pieces/members-{piece}.parquet");
        assert!(scratch.path().join(&file).exists(), "no {file}");
    }
    run(&scratch, "uncertainty c -n 20 --keep traces").succeeded();
    assert!(scratch.files().iter().any(|path| path.ends_with("traces.parquet")));
}

/// Some members within the bounds are so hot that they fail. The others count.
#[test]
fn failed_members_are_counted_with_their_reason_and_the_others_are_used() {
    let scratch = Scratch::new("nonsense");
    scratch.write("c/case.toml", CASE.replacen("small = [0.9, 1.1]", "small = [0.5, 1e6]", 1));
    let some =
        |most: &str| run(&scratch, &format!("uncertainty c -n 100 --sampling uniform --json --max-failed {most}"));
    let all = some("100").succeeded().json();
    assert_eq!(all["members"]["requested"], 100);
    assert!(all["members"]["failed"].as_u64().is_some_and(|failed| failed > 95), "{all:#}");

    scratch.write("c/case.toml", CASE.replacen("small = [0.9, 1.1]", "small = [0.5, 400]", 1));
    let ran = some("90").succeeded().json();
    let (ok, failed) = (ran["members"]["ok"].as_u64(), ran["members"]["failed"].as_u64());
    assert!(ok.is_some_and(|ok| ok > 10) && failed.is_some_and(|failed| failed > 10), "{ran:#}");
    let beyond = some("5").exited_with(1).with_stderr(&["more than the allowed 5", "a temperature left 0 to 4,000 K"]);
    assert_eq!(beyond.json()["members"], ran["members"], "the report is written in spite of the failures");
    let page = scratch.read("out/c/uncertainty/report.html");
    assert!(page.contains("a temperature left 0 to 4,000"), "no reason on the page");
    run(&scratch, "uncertainty c -n 100 --sampling uniform").exited_with(1).with_stderr(&["more than the allowed 1"]);
}

#[test]
fn a_nominal_march_that_diverges_is_exit_1_with_its_reason() {
    let scratch = Scratch::new("runaway");
    scratch.write("c/case.toml", CASE.replacen("small = [0.9, 1.1]", "small = [0.5, 1e6]", 1));
    let ran = run(&scratch, "predict c --set f_q=1e6").exited_with(1);
    let ran = ran.with_stderr(&["the nominal march failed: a temperature left 0 to 4,000 K"]);
    assert!(ran.stdout.contains("diverged at"), "{}", ran.stdout);
}

#[test]
fn an_estimate_recovers_the_true_factors_of_synthetic_observations() {
    let scratch = with_case("twin");
    let ran = run(&scratch, "twin c --truth f_k=1.1,f_q=0.95 --out c/measured.csv").succeeded();
    assert!(ran.stdout.contains("41 samples of 2 sensors"), "{}", ran.stdout);
    run(&scratch, "twin c --out c/measured.csv").exited_with(2).with_stderr(&["exists already", "--force"]);
    scratch.write("c/case.toml", CASE.to_owned() + "\n[observations]\nfile = \"measured.csv\"\nsigma = \"1 K\"\n");
    let line = "estimate c --factors f_k,f_q --start f_k=0.9,f_q=1.05 --sensors TC1,TC2 --window 0:40 --json";
    let found = run(&scratch, line).succeeded().json();
    for (factor, truth) in [("f_k", 1.1), ("f_q", 0.95)] {
        let value = found["factors"][factor]["value"].as_f64().expect("a value");
        assert!((value - truth).abs() < 1e-4, "{factor} = {value}, true value {truth}");
    }
}

#[test]
fn noise_has_the_stated_standard_deviation_and_depends_on_the_seed() {
    let scratch = with_case("noise");
    for (name, line) in
        [("a", "--noise 3K --seed 5"), ("b", "--noise 3K --seed 5"), ("c", ""), ("d", "--noise 3K --seed 6")]
    {
        run(&scratch, &format!("twin c --out {name}.csv {line}")).succeeded();
    }
    assert_eq!(scratch.read("a.csv"), scratch.read("b.csv"));
    assert_ne!(scratch.read("a.csv"), scratch.read("d.csv"));
    let numbers = |file: &str| -> Vec<f64> {
        let text = scratch.read(file);
        text.lines().skip(1).flat_map(|line| line.split(',').skip(1).map(|n| n.parse().expect("a number"))).collect()
    };
    let squares: Vec<f64> = numbers("a.csv").iter().zip(numbers("c.csv")).map(|(a, b)| (a - b).powi(2)).collect();
    let deviation_k = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    assert!((deviation_k - 3.0).abs() < 1.0, "{deviation_k} K over {} readings", squares.len());
}

#[test]
fn set_overrides_the_case_file() {
    let scratch = with_case("set");
    let peak =
        |line: &str| run(&scratch, line).succeeded().json()["sensors"]["TC1"]["peak_k"].as_f64().expect("a peak");
    let (plain, more) = (peak("predict c --json"), peak("predict c --json --set f_q=1.1"));
    assert!(more > plain + 10.0, "{more} K after {plain} K");
    let shorter = run(&scratch, "predict c --json --set duration=20s").succeeded().json();
    assert_eq!(shorter["sensors"]["TC1"]["peak_time_s"], 20.0);
}

/// Screen, summary, and first and last row of the traces of a prediction.
fn predicted(scratch: &Scratch) -> (String, Value, String, String) {
    let screen = run(scratch, "predict c").succeeded().stdout;
    let summary = serde_json::from_str(&scratch.read("out/c/predict/summary.json")).expect("JSON");
    let traces = scratch.read("out/c/predict/traces.csv");
    let row = |line: Option<&str>| line.expect("a row").to_owned();
    (screen, summary, row(traces.lines().next()), row(traces.lines().last()))
}

#[test]
fn screen_summary_and_traces_agree_on_the_mass_lost_and_omit_it_without_decomposition() {
    let scratch = with_case("still");
    let (screen, summary, head, _) = predicted(&scratch);
    assert!(!screen.contains("Mass lost"), "{screen}");
    assert!(summary.get("gauges").is_none() && summary["balance"]["mass"].is_null(), "{summary:#}");
    assert_eq!(head, "time_s,TC1_k,TC2_k");

    scratch.write("c/case.toml", decomposing_case());
    let (screen, summary, head, end) = predicted(&scratch);
    let columns: Vec<&str> = head.split(',').collect();
    let values: Vec<f64> = end.split(',').map(|value| value.parse().expect("a number")).collect();
    let gauges = summary["gauges"].as_object().expect("gauges");
    assert_eq!((columns.len(), gauges.len()), (9, 6), "{head}");
    for (gauge, reading) in gauges {
        let column =
            columns.iter().position(|column| column == gauge).unwrap_or_else(|| panic!("no {gauge} in {head}"));
        let end = reading["final"].as_f64().expect("a final value");
        assert!((values[column] - end).abs() <= 1e-8 * end.abs(), "{gauge} ends at {end}, in {}", values[column]);
    }
    let lost_kg_m2 = gauges["mass_lost_kg_m2"]["final"].as_f64().expect("a loss");
    assert!(lost_kg_m2 > 0.01 && screen.contains(&format!("Mass lost {lost_kg_m2:.4}")), "{lost_kg_m2} in {screen}");
    assert!(summary["balance"]["mass"].as_f64().is_some_and(|off| off.abs() < 1e-9), "{summary:#}");
    let page = scratch.read("out/c/predict/report.html");
    assert!(page.contains("Decomposition and gas</h2>") && page.contains("<p>Mass balance: "));
}

/// Rows of a table: cells by column.
fn table(text: &str) -> Vec<Vec<String>> {
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

#[test]
fn profiles_pass_through_the_sensors_and_have_bands_around_the_nominal_temperature() {
    let scratch = with_case("profiles");
    run(&scratch, "uncertainty c -n 80 --depth-profiles 20s --quiet").succeeded();
    let profiles = table(&scratch.read("out/c/uncertainty/depth-profiles.csv"));
    let traces = table(&scratch.read("out/c/uncertainty/traces.csv"));
    let at_20_s = traces.iter().find(|row| row[0] == "20").expect("an instant");
    let number = |cell: &String| cell.parse::<f64>().expect("a number");
    let at = |kind: &str, depth_m: f64| -> Vec<&Vec<String>> {
        profiles.iter().filter(|row| row[0] == kind && (number(&row[2]) - depth_m).abs() < 1e-9).collect()
    };
    let [above, below] = at("instant", 0.5e-3)[..] else { panic!("two sides of the interface") };
    assert_eq!((above[3].as_str(), below[3].as_str()), ("TOP", "BASE"));
    // The sensor at the interface is the mean of its sides; a trace has nine digits.
    assert!((0.5 * (number(&above[4]) + number(&below[4])) - number(&at_20_s[1])).abs() < 1e-5);
    assert!(number(&above[4]) - number(&below[4]) > 1.0, "no jump at the contact");
    let [inside] = at("instant", 2e-3)[..] else { panic!("the depth of TC2") };
    assert!((number(&inside[4]) - number(&at_20_s[2])).abs() < 1e-5);
    let [highest] = at("maximum", 2e-3)[..] else { panic!("the maximum at the depth of TC2") };
    let peak = traces.iter().map(|row| number(&row[2])).fold(0.0, f64::max);
    assert!((number(&highest[4]) - peak).abs() < 1e-5);
    for row in &profiles {
        let [low, median, high] = [5, 6, 7].map(|column| number(&row[column]));
        assert!(low <= median && median <= high, "{row:?}");
    }
    assert!(number(&inside[5]) < number(&inside[4]) && number(&inside[4]) < number(&inside[7]), "{inside:?}");
}

#[test]
fn wrong_times_of_profiles_are_refused_and_nothing_is_written() {
    let scratch = with_case("profile-times");
    for (times, message) in [
        ("50s", "expected times from 0 s to 40 s, found 50 s"),
        ("0", "at least 1 instant"),
        ("1000", "at most 200 instants of profiles through the thickness, found 1,000"),
        ("10K", "'10K' for '--depth-profiles <TIMES>'"),
    ] {
        let ran = run(&scratch, &format!("predict c --depth-profiles {times}"));
        assert!(ran.code == 2 && ran.stderr.contains(message), "{times}: {}", ran.stderr);
    }
    let ran = run(&scratch, "uncertainty c -n 80 --members 0..40 --depth-profiles 5");
    assert!(ran.code == 2 && ran.stderr.contains("--depth-profiles"), "{}", ran.stderr);
    assert!(!scratch.path().join("out").exists());
}
