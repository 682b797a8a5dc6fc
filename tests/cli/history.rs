//! Inverse heat conduction: output, numbers, and a schedule that a case can read.

use super::{CASE, OBSERVATIONS, run};
use crate::support::{FLUENCE_ERROR, Scratch};
use serde_json::Value;

const FLUX: &str = r#"flux = { points = [["0 s", "0 W/cm^2"], ["1 s", "5 W/cm^2"]], outside = "hold" }"#;
const MEASURED: &str = "\n[observations]\nfile = \"measured.csv\"\nsigma = \"1 K\"\n";

/// A case whose synthetic readings were made with 1.1 times its flux.
fn case_with_hotter_readings(name: &str) -> Scratch {
    let scratch = Scratch::new(name);
    scratch.write("c/case.toml", CASE);
    run(&scratch, "twin c --truth f_q=1.1 --noise 1K --seed 3 --out measured.csv --quiet").succeeded();
    scratch.write("c/measured.csv", scratch.read("measured.csv"));
    scratch.write("c/case.toml", CASE.to_owned() + MEASURED);
    scratch
}

#[test]
fn a_recovered_flux_is_on_screen_in_the_summary_and_in_a_file_that_a_case_reads() {
    let scratch = case_with_hotter_readings("history");
    let ran = run(&scratch, "history c --sensors TC1 --knots 6 --out out --quiet").succeeded();
    let lines: Vec<&str> = ran.stdout.lines().collect();
    assert!(lines.len() <= 26 && lines.iter().all(|line| line.chars().count() <= 80), "{}", ran.stdout);
    for said in ["From TC1: fluence", "± 95 %", "than the case states", "The 95 % band"] {
        assert!(ran.stdout.replace('\n', " ").contains(said), "no {said:?} in:\n{}", ran.stdout);
    }
    let summary: Value = serde_json::from_str(&scratch.read("out/summary.json")).expect("JSON");
    let found = &summary["history"];
    let number = |key: &str| found[key].as_f64().unwrap_or_else(|| panic!("no {key} in {found:#}"));
    let more = number("fluence_j_m2") / number("stated_fluence_j_m2");
    assert!((more / 1.1 - 1.0).abs() < FLUENCE_ERROR, "heated by {more} of what the case says");
    let rms_k = |key: &str| found["sensors"]["TC1"][key].as_f64().expect("a misfit");
    assert!(rms_k("estimated_rms_k") < 1.5 && rms_k("stated_rms_k") > 10.0, "{found:#}");
    assert_eq!(found["converged"], true);
    let page = scratch.read("out/report.html");
    assert!(
        page.contains("<section id=\"history\">") && page.contains("Cold-wall heat flux at the hot face at the knots")
    );

    // The recovered flux drives a second case. It covers the whole run, although the window ends earlier.
    let found = scratch.read("out/history.csv");
    assert!(found.lines().last().is_some_and(|row| row.starts_with("40,")), "{found}");
    scratch.write("again/history.csv", scratch.read("out/history.csv"));
    scratch.write("again/measured.csv", scratch.read("measured.csv"));
    let text = (CASE.to_owned() + MEASURED).replace(FLUX, r#"flux = { file = "history.csv" }"#);
    scratch.write("again/case.toml", text.replace(r#"sensors = ["TC2"]"#, r#"sensors = ["TC1"]"#));
    let again = run(&scratch, "history again --knots 0 --smoothing 0 --json --quiet").succeeded();
    let again: Value = serde_json::from_str(&again.stdout).expect("JSON");
    let own_k = again["history"]["sensors"]["TC1"]["stated_rms_k"].as_f64().expect("a misfit");
    assert!((own_k - rms_k("estimated_rms_k")).abs() < 0.05, "{own_k} K");
}

#[test]
fn a_recovered_gas_temperature_is_in_kelvin_and_can_be_read_by_a_case() {
    let scratch = Scratch::new("history-gas");
    let convective = |gas: &str| {
        CASE.replace("\"heated\"", "\"convective\"")
            .replace(FLUX, &format!("heat_transfer_coefficient = \"60 W/m^2/K\"\ngas = {gas}"))
    };
    let through = |points: &str| format!("{{ points = [{points}], outside = \"hold\" }}");
    let hotter = through(r#"["0 s", "300 K"], ["1 s", "1430 K"]"#);
    scratch.write("truth/case.toml", convective(&hotter));
    run(&scratch, "twin truth --noise 1K --seed 3 --out measured.csv --quiet").succeeded();
    scratch.write("c/measured.csv", scratch.read("measured.csv"));
    scratch.write("c/case.toml", convective(&through(r#"["0 s", "300 K"], ["1 s", "1300 K"]"#)) + MEASURED);
    let ran = run(&scratch, "history c --sensors TC1 --knots 4 --out out --quiet").succeeded();
    for said in ["Gas, K", "mean gas temperature"] {
        assert!(ran.stdout.contains(said), "no {said:?} in:\n{}", ran.stdout);
    }
    assert!(!ran.stdout.contains("MJ/m²") && !ran.stdout.contains("W/cm²"), "{}", ran.stdout);
    let summary: Value = serde_json::from_str(&scratch.read("out/summary.json")).expect("JSON");
    let found = &summary["history"];
    let more = found["mean_k"].as_f64().expect("a mean") / found["stated_mean_k"].as_f64().expect("a mean");
    assert!((more / 1.1 - 1.0).abs() < FLUENCE_ERROR && found["quantity"] == "gas", "{found:#}");
    assert!(scratch.read("out/history.csv").starts_with("time_s,gas_k"));
    scratch.write("again/history.csv", scratch.read("out/history.csv"));
    scratch.write("again/measured.csv", scratch.read("measured.csv"));
    scratch.write("again/case.toml", convective(r#"{ file = "history.csv" }"#) + MEASURED);
    let again = run(&scratch, "history again --sensors TC1 --knots 0 --smoothing 0 --json --quiet").succeeded();
    let again: Value = serde_json::from_str(&again.stdout).expect("JSON");
    let off_k = again["history"]["sensors"]["TC1"]["stated_rms_k"].as_f64().expect("a misfit");
    assert!(off_k < 1.5, "{off_k} K");
}

#[test]
fn a_case_without_the_quantity_or_with_too_few_samples_is_refused() {
    let scratch = Scratch::new("no-history");
    let case = CASE.to_owned() + OBSERVATIONS;
    scratch.write("c/case.toml", &case);
    let heating = "\n[[factor]]\nname = \"f_q\"\nproperty = \"heating\"\nsmall = [0.9, 1.1]\n";
    let unscaled = case.replace(heating, "");
    scratch
        .write("held/case.toml", unscaled.replace("\"heated\"", "\"held\"").replace(FLUX, "temperature = \"600 K\""));
    let refused = |line: &str, words: &[&str]| {
        run(&scratch, &format!("{line} --quiet")).exited_with(2).with_stderr(words);
    };
    refused("history held", &["held", "held at a temperature", "kind = \"heated\""]);
    refused("history c", &["knot values cannot be estimated from 4 samples"]);
    refused("history c --window 11:19", &["no samples between 11 s and 19 s"]);
    let no_film = "\"c\" has no quantity gas to estimate: the hot face has no film";
    refused("history c --knots 1 --quantity gas", &["--quantity: ", no_film]);
    refused("history c --knots 1 --quantity heat", &["'heat' for '--quantity <QUANTITY>'", "flux, radiant-flux, gas"]);
    scratch.write("two/case.toml", case.replace(FLUX, &format!("{FLUX}\nradiant_flux = \"1 W/cm^2\"")));
    refused(
        "history two --knots 1",
        &["two", "a flux and a radiant-flux", "--quantity: ", "choose the quantity flux or radiant-flux"],
    );
    refused("history c --knots 1 --smoothing soft", &["'soft' for '--smoothing <SMOOTHING>'", "invalid float"]);
    refused("history c --knots 1 --bounds small", &["--bounds", "no factor"]);
}
