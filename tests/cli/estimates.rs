//! Estimates: several cases at once, loss functions, priors, multi-start, profiles and posteriors.

use super::{CASE, command, run, wait_for};
use crate::support::Scratch;
use serde_json::Value;

/// Write the case of these tests with one text replaced, and synthetic observations with known factors and 2 K noise.
pub(super) fn write_synthetic_case(scratch: &Scratch, name: &str, (from, to): (&str, &str), seed: usize) {
    assert!(CASE.contains(from), "no {from:?} in the case");
    let file = format!("{name}/case.toml");
    scratch.write(&file, CASE.replacen(from, to, 1));
    let truth = format!("twin {name} --truth f_k=1.1,f_q=0.95 --noise 2K --seed {seed} --out {name}/measured.csv");
    run(scratch, &truth).succeeded();
    let text = scratch.read(&file) + "\n[observations]\nfile = \"measured.csv\"\nsigma = \"2 K\"\n";
    scratch.write(&file, text);
}

pub(super) const UNCHANGED: (&str, &str) = ("name = \"Two plies\"", "name = \"Two plies\"");
const THICKER: (&str, &str) = ("thickness = \"3 mm\"", "thickness = \"5 mm\"");
const OTHER_MATERIAL: (&str, &str) = ("material = \"pyrogel3350\"", "material = \"pyrogel2250\"");
const ALL: &str = "--factors f_k,f_q --sensors TC1,TC2 --window 0:40 --json --quiet --force";

fn estimated(scratch: &Scratch, cases: &str, options: &str) -> Value {
    run(scratch, &format!("estimate {cases} {ALL} {options}")).succeeded().json()
}

#[track_caller]
pub(super) fn number(found: &Value, path: &str) -> f64 {
    let value = path.split('.').fold(found, |value, key| &value[key]);
    value.as_f64().unwrap_or_else(|| panic!("no {path} in {found:#}"))
}

#[test]
fn a_joint_fit_of_two_layups_has_smaller_errors_of_shared_factors_than_either_alone() {
    let scratch = Scratch::new("together");
    write_synthetic_case(&scratch, "thin", UNCHANGED, 1);
    write_synthetic_case(&scratch, "thick", THICKER, 2);
    let [thin, thick, both] = ["thin", "thick", "thin thick"].map(|cases| estimated(&scratch, cases, ""));
    for (factor, truth) in [("f_k", 1.1), ("f_q", 0.95)] {
        // The error for white noise, as the data have it: the estimated correlation differs between data sets.
        let error = |found: &Value| number(found, &format!("factors.{factor}.independent_standard_error"));
        assert!(error(&both) < error(&thin).min(error(&thick)), "{factor}: joint error {}", error(&both));
        let value = number(&both, &format!("factors.{factor}.value"));
        assert!((value - truth).abs() < 4.0 * error(&both), "{factor} = {value}, true value {truth}");
        assert_eq!(both["factors"][factor]["cases"], serde_json::json!(["thin", "thick"]));
    }
    assert_eq!(both["samples"].as_u64(), Some(2 * thin["samples"].as_u64().expect("a number of samples")));
    assert_eq!(both["case"], "thin+thick");
    let near = |path: &str| (number(&both, path) - 2.0).abs() < 0.6;
    assert!(near("misfits.thin.TC2.estimated_rms_k") && near("misfits.thick.TC2.estimated_rms_k"), "{both:#}");
    let (fitted, page) = ("out/thin+thick/estimate/traces-thick.csv", "out/thin+thick/estimate/report.html");
    assert!(scratch.read(fitted).starts_with("time_s,TC1_k,TC2_k,TC1_fitted_k,TC2_fitted_k"));
    assert!(scratch.read(page).contains("thin and thick share all factors."));
}

/// Without noise the objective at the minimum is only the remainder of the last step, which differs between starts.
#[test]
fn starts_that_agree_count_as_one_minimum_for_data_without_noise() {
    let scratch = Scratch::new("agreeing");
    write_synthetic_case(&scratch, "noisy", UNCHANGED, 1);
    scratch.write("c/case.toml", CASE);
    run(&scratch, "twin c --truth f_k=1.1,f_q=0.95 --noise 0K --out c/measured.csv").succeeded();
    let text = scratch.read("c/case.toml") + "\n[observations]\nfile = \"measured.csv\"\nsigma = \"2 K\"\n";
    scratch.write("c/case.toml", text);
    for case in ["c", "noisy"] {
        let found = estimated(&scratch, case, "--starts 8 --bounds large");
        assert_eq!(found["starts"]["at_estimate"].as_u64(), Some(8), "{case}: {:#}", found["starts"]);
    }
}

/// The residuals and the stated standard deviation of 2 K, by the formulas of lmfit.
#[test]
fn the_goodness_of_fit_follows_from_the_residuals_that_are_written() {
    let scratch = Scratch::new("goodness");
    write_synthetic_case(&scratch, "c", UNCHANGED, 1);
    let found = estimated(&scratch, "c", "");
    let residuals = scratch.read("out/c/estimate/residuals.csv");
    let kelvin = residuals.lines().skip(1).map(|line| line.rsplit(',').next().unwrap_or_default());
    let squares: Vec<f64> = kelvin.map(|text| (text.parse::<f64>().expect("a number") / 2.0).powi(2)).collect();
    let (n, chi_squared) = (squares.len() as f64, squares.iter().sum::<f64>());
    let near = |key: &str, expected: f64| {
        let value = number(&found, key);
        assert!((value - expected).abs() < 1e-6 * expected.abs(), "{key}: {value}, not {expected}");
    };
    near("chi_squared", chi_squared);
    near("degrees_of_freedom", n - 2.0);
    near("reduced_chi_squared", chi_squared / (n - 2.0));
    near("akaike_criterion", n * (chi_squared / n).ln() + 4.0);
    near("bayesian_criterion", n * (chi_squared / n).ln() + 2.0 * n.ln());
    // The data have the noise that is stated.
    assert!((number(&found, "reduced_chi_squared") - 1.0).abs() < 0.3, "{found:#}");
    let screen = run(&scratch, "estimate c --factors f_k,f_q --quiet --force").succeeded().stdout;
    assert!(screen.contains("\nχ² ") && screen.contains(", effective n "), "{screen}");
}

#[test]
fn factors_that_scale_different_materials_are_not_shared() {
    let scratch = Scratch::new("apart");
    write_synthetic_case(&scratch, "aerogel", UNCHANGED, 1);
    write_synthetic_case(&scratch, "blanket", OTHER_MATERIAL, 2);
    let found = estimated(&scratch, "aerogel blanket", "--start f_k@blanket=0.9 --profile f_k");
    let names: Vec<&String> = found["factors"].as_object().expect("factors").keys().collect();
    assert_eq!(names, ["f_k@aerogel", "f_k@blanket", "f_q"]);
    assert_eq!(found["profiles"].as_object().map(serde_json::Map::len), Some(2), "a profile of both");
    let path = scratch.read("out/aerogel+blanket/estimate/iterations.csv");
    assert!(path.lines().nth(1).is_some_and(|line| line.starts_with("0,1,") && line.contains(",0.9,")), "{path}");
}

#[test]
fn outliers_spoil_least_squares_and_not_a_robust_estimate() {
    let scratch = Scratch::new("robust");
    write_synthetic_case(&scratch, "c", UNCHANGED, 3);
    let spoiled = scratch.read("c/measured.csv");
    let lines = spoiled.lines().enumerate().map(|(row, line)| match line.rsplit_once(',') {
        Some((rest, kelvin)) if row % 8 == 7 => format!("{rest},{}", kelvin.parse::<f64>().expect("a number") + 60.0),
        _ => line.to_owned(),
    });
    scratch.write("c/measured.csv", lines.collect::<Vec<_>>().join("\n") + "\n");
    let error = |options: &str| (number(&estimated(&scratch, "c", options), "factors.f_k.value") - 1.1).abs();
    let squares = error("");
    for loss in ["huber", "soft-l1", "huber=2"] {
        assert!(error(&format!("--loss {loss}")) < 0.3 * squares, "{loss}: error of least squares {squares}");
    }
    assert_eq!(estimated(&scratch, "c", "--loss huber")["loss_function"], "huber=1.345");
}

#[test]
fn a_prior_of_the_command_line_or_the_case_file_draws_the_estimate_to_it_and_narrows_it() {
    let scratch = Scratch::new("prior");
    write_synthetic_case(&scratch, "c", UNCHANGED, 6);
    let text = scratch.read("c/case.toml").replacen("[estimate]", "[estimate]\nprior = \"small\"", 1);
    scratch.write("d/case.toml", text);
    scratch.write("d/measured.csv", scratch.read("c/measured.csv"));
    // The first seconds contain little information.
    let found = |line: &str| {
        run(&scratch, &format!("estimate {line} --sensors TC2 --window 0:4 --json --quiet")).succeeded().json()
    };
    let (data, drawn) = (found("c"), found("c --prior small"));
    assert_eq!((&data["prior"], &drawn["prior"]), (&Value::Null, &"small".into()));
    let off = |found: &Value| (number(found, "factors.f_k.value") - 1.0).abs();
    let error = |found: &Value| number(found, "factors.f_k.standard_error");
    assert!(off(&drawn) < off(&data) && error(&drawn) < error(&data), "{drawn:#}");
    assert!(error(&drawn) < 0.1, "standard error {} with a prior of 0.1", error(&drawn));
    assert_eq!(found("d")["factors"], drawn["factors"]);
    assert_eq!(found("d --prior none")["factors"], data["factors"]);
}

#[test]
fn multi_start_and_the_step_control_of_the_paper_find_the_same_minimum() {
    let scratch = Scratch::new("starts");
    write_synthetic_case(&scratch, "c", UNCHANGED, 4);
    let one = estimated(&scratch, "c", "");
    let many = estimated(&scratch, "c", "--starts 6");
    assert_eq!(many["starts"], serde_json::json!({"requested": 6, "converged": 6, "at_estimate": 6}));
    let paper = estimated(&scratch, "c", "--minimiser paper");
    for factor in ["f_k", "f_q"] {
        let value = |found: &Value| number(found, &format!("factors.{factor}.value"));
        let error = number(&one, &format!("factors.{factor}.standard_error"));
        assert!((value(&many) - value(&one)).abs() < 0.01 * error, "{factor}: {} by multi-start", value(&many));
        assert!(
            (value(&paper) - value(&one)).abs() < 0.1 * error,
            "{factor}: {} by the control of the paper",
            value(&paper)
        );
    }
    assert!(number(&many, "marches") > number(&one, "marches"));
}

/// Two factors of a short run with 2 K noise are nearly linear: profile and linear interval differ by at most a tenth.
#[test]
fn the_profile_interval_of_a_nearly_linear_problem_is_the_linear_one() {
    let scratch = Scratch::new("profile");
    write_synthetic_case(&scratch, "c", UNCHANGED, 5);
    let found = estimated(&scratch, "c", "--profile f_k,f_q");
    for factor in ["f_k", "f_q"] {
        let linear = |end: &str| number(&found, &format!("factors.{factor}.{end}"));
        let half = 0.5 * (linear("high") - linear("low"));
        for end in ["low", "high"] {
            let profiled = number(&found, &format!("profiles.{factor}.{end}"));
            assert!((profiled - linear(end)).abs() < 0.1 * half, "{factor} {end}: {profiled}, linear {}", linear(end));
        }
        assert!(scratch.read(&format!("out/c/estimate/figures/profile-{factor}.svg")).contains("linear approximation"));
    }
    let table = scratch.read("out/c/estimate/profiles.csv");
    assert!(table.starts_with("profiled_factor,f_k,f_q,objective_rise\nf_k,") && table.contains("\nf_q,"), "{table}");
    assert!(found["profiles"].is_object() && estimated(&scratch, "c", "").get("profiles").is_none());
}

#[test]
fn a_posterior_is_the_same_on_any_number_of_threads_and_predicts_every_sensor() {
    let scratch = Scratch::new("posterior");
    write_synthetic_case(&scratch, "thin", UNCHANGED, 1);
    write_synthetic_case(&scratch, "thick", THICKER, 2);
    let options =
        "estimate thin thick --factors f_k,f_q --sensors TC2 --window 0:40 --prior small --loss huber --json --quiet";
    let options = format!("{options} --force --posterior --walkers 40 --mcmc-iterations 300");
    let sampled = |more: &str, threads: &str| {
        let words = format!("{options} {more}");
        let mut command = command(&scratch);
        let found =
            wait_for(command.args(words.split_whitespace()).env("RAYON_NUM_THREADS", threads)).succeeded().json();
        (found, scratch.read("out/thin+thick/estimate/posterior.csv"))
    };
    let ((found, one), (_, two), (_, other)) = (sampled("", "1"), sampled("", "2"), sampled("--seed 2", "2"));
    assert!(one.starts_with("f_k,f_q\n") && one.lines().count() > 1000, "{}", one.len());
    assert!(one == two && one != other);

    let posterior = &found["posterior"];
    for (factor, truth) in [("f_k", 1.1), ("f_q", 0.95)] {
        let [low, median, high] =
            ["low", "median", "high"].map(|key| number(posterior, &format!("factors.{factor}.{key}")));
        assert!(low < median && median < high && low - 0.02 < truth && truth < high + 0.02, "{factor}: {posterior:#}");
        assert!(number(posterior, &format!("factors.{factor}.r_hat")) < 1.02, "{posterior:#}");
    }
    assert!(number(posterior, "acceptance") > 0.15 && number(posterior, "burn_in") > 4.0);
    for case in ["thin", "thick"] {
        // TC1 was not fitted, and is observed.
        let held = number(posterior, &format!("predicted.{case}.TC1.with_discrepancy.coverage"));
        assert!(held > 0.85, "{case}: {held}");
    }
    let table = scratch.read("out/thin+thick/estimate/predictive-thick.csv");
    assert!(table.starts_with("sensor,time_s,p2.5_k,p50_k,p97.5_k,with_discrepancy_p2.5_k"), "{table}");
    let page = scratch.read("out/thin+thick/estimate/report.html");
    assert!(page.contains("id=\"posterior\"") && page.contains("Posterior prediction of TC1 of thick"));
    assert!(estimated(&scratch, "thin", "").get("posterior").is_none());
    run(&scratch, "estimate thin --walkers 50").exited_with(2).with_stderr(&["--posterior"]);
    run(&scratch, "estimate thin --posterior --walkers 3 --quiet")
        .exited_with(2)
        .with_stderr(&["3 walkers", "at least 16"]);
    run(&scratch, "estimate thin --posterior --mcmc-iterations 3")
        .exited_with(2)
        .with_stderr(&["--mcmc-iterations 3", "expected at least 10"]);
}

/// A slab in gas on both faces: a thermocouple at 3 mm reads what one at 7 mm would.
const SYMMETRIC: &str = r#"name = "Slab in gas"
initial_temperature = "300 K"
duration = "60 s"

[[ply]]
name = "SLAB"
material = "pyrogel3350"
thickness = "10 mm"

[[sensor]]
name = "TC"
depth = "3 mm"

[hot_face]
kind = "convective"
heat_transfer_coefficient = "200 W/m^2/K"
gas = "600 K"
emissivity = 0

[back_face]
kind = "cooled"
heat_transfer_coefficient = "200 W/m^2/K"
ambient = "600 K"
emissivity = 0

[[factor]]
name = "f_depth"
property = "sensor_depth"
group = "TC"
small = [0.4, 2.9]

[estimate]
factors = ["f_depth"]

[resolution]
cells = 40
output_interval = "2 s"
"#;

/// The modes are hundreds of standard deviations apart, and the estimate is one of them.
#[test]
fn a_posterior_finds_the_other_depth_at_which_a_thermocouple_would_read_the_same() {
    let scratch = Scratch::new("two-depths");
    scratch.write("c/case.toml", SYMMETRIC);
    run(&scratch, "twin c --noise 2K --out c/measured.csv --quiet").succeeded();
    scratch.write("c/case.toml", SYMMETRIC.to_owned() + "\n[observations]\nfile = \"measured.csv\"\nsigma = \"2 K\"\n");
    let found = run(&scratch, "estimate c --posterior --walkers 200 --mcmc-iterations 200 --json --quiet").succeeded();
    let estimate = number(&found.json(), "factors.f_depth.value");
    let table = scratch.read("out/c/estimate/posterior.csv");
    let draws: Vec<f64> = table.lines().skip(1).map(|line| line.parse().expect("a number")).collect();
    let middle = 5.0 / 3.0;
    let (upper, lower): (Vec<f64>, Vec<f64>) = draws.iter().copied().partition(|draw| *draw < middle);
    let share = upper.len() as f64 / draws.len() as f64;
    assert!((0.3..0.7).contains(&share), "{share} in the mode of {estimate}");
    let width =
        |draws: &[f64]| draws.iter().copied().fold(0.0, f64::max) - draws.iter().copied().fold(f64::INFINITY, f64::min);
    // Sixteen standard deviations are more than twice the range of thousands of draws.
    assert!(width(&upper) < 0.15 && width(&lower) < 0.15, "{} and {}", width(&upper), width(&lower));
}
