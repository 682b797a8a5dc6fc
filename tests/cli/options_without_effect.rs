//! Options without effect are refused, with the missing condition.

use super::input_errors::refused;
use super::{CASE, OBSERVATIONS, run};
use crate::support::Scratch;

/// The factors to estimate in the case.
const STATED: &str = "factors = [\"f_k\"]\n";

#[test]
fn an_option_without_effect_is_refused() {
    let scratch = Scratch::new("unused");
    let observed = CASE.to_owned() + OBSERVATIONS;
    scratch.write("c/case.toml", &observed);
    scratch.write("unseen/case.toml", CASE);
    scratch.write("unasked/case.toml", observed.replacen(STATED, "", 1));
    scratch.write("unasked-too/case.toml", scratch.read("unasked/case.toml"));
    let begun = observed.replacen("small = [0.8, 1.2]", "small = [0.8, 1.2]\nlarge = [0.5, 1.5]", 1);
    scratch.write(
        "begun/case.toml",
        begun.replacen(STATED, "factors = [\"f_k\"]\nbounds = \"large\"\nstart = { f_k = 1.4 }\n", 1),
    );
    let no_samples = "c: sensor \"TC1\" has no samples between 0 s and 30 s; leave it out";
    for (line, message) in [
        ("predict c --backend cpu --device H200", "--device \"H200\": the backend is the CPU; expected no device"),
        ("predict c --set f_k=1.1 --set f_k=0.9", "--set names \"f_k\" twice"),
        ("uncertainty c -n 20 --members 0..10 --max-failed 3", "cannot be used with"),
        ("study unseen --posterior", "--posterior: nothing is estimated: the case has no observations"),
        ("study unseen --loss huber", "--loss: nothing is estimated: the case has no observations"),
        (
            "study unasked --profile f_k",
            "--profile: nothing is estimated: select some of the factors f_k, f_q with the option factors or in",
        ),
        (
            "estimate unasked",
            "no factor to estimate: select some of the factors f_k, f_q with the option factors or in [estimate]",
        ),
        ("estimate unasked unasked-too", "no factor to estimate: select some of the factors f_k, f_q with"),
        ("estimate c --sensors TC1,TC2", no_samples),
        ("history c --sensors TC2,TC1", no_samples),
        ("sensitivity c --sensors TC2,TC1", no_samples),
        (
            "estimate begun --bounds small",
            "--start: begun: the start 1.4 of \"f_k\" in the case lies outside its small bounds 0.8 to 1.2",
        ),
        (
            "twin c --starts 3",
            "--starts: without a coverage study nothing is fitted, and observations are written for every sensor",
        ),
        ("twin c --max-iterations 3", "--max-iterations: without a coverage study nothing is fitted"),
        ("twin c --minimiser paper", "--minimiser: without a coverage study nothing is fitted"),
        ("twin c --seed 3", "--seed without noise has no effect: state its standard deviation"),
        ("twin c --noise 0K --correlation-time 5s", "--correlation-time without noise has no effect"),
        ("verify --group exact --device H200", "--device \"H200\": these groups run on the CPU"),
    ] {
        refused(&scratch, run(&scratch, line), 5, &[message]);
    }
}

#[test]
fn an_unknown_device_in_verify_gives_exit_code_3() {
    let scratch = Scratch::new("verify-device");
    run(&scratch, "verify --group cross-backend --device Voodoo2")
        .exited_with(3)
        .with_stderr(&["no device is called \"Voodoo2\""]);
}

#[test]
fn a_table_of_observations_without_a_sensor_column_gives_exit_code_2() {
    let scratch = Scratch::new("unread");
    scratch.write("c/case.toml", CASE.to_owned() + "\n[observations]\nfile = \"m.csv\"\nsigma = \"2 K\"\n");
    for (table, message) in [
        ("time_s|TC2_K\n0|300\n10|320\n", "c/m.csv:1:1: no sensor column after the time column"),
        ("junk\n", "c/m.csv:1:1: no rows under this heading"),
        ("time_s,TC2_K\n", "c/m.csv:1:1: no rows under this heading"),
    ] {
        scratch.write("c/m.csv", table);
        for command in ["predict", "study"] {
            refused(&scratch, run(&scratch, &format!("{command} c")), 2, &[message]);
        }
    }
    scratch.write("c/m.csv", "time_s\tTC2_K\n0,0\t300\n10,5\t320,5\n");
    let found = run(&scratch, "predict c --json --quiet").succeeded().json();
    assert_eq!(found["observed"]["c"]["TC2"]["samples"], 2, "{found:#}");
}
