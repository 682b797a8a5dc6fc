//! Invalid input: exit code 2, errors with their position, and no output file.

use super::{CASE, CommandResult, OBSERVATIONS, run, run_args};
use crate::support::Scratch;

/// A replacement in the case, line and column of the error, and a part of its message.
const FAULTS: &[(&str, &str, &str, &str)] = &[
    ("thickness = \"3 mm\"", "thicknes = \"3 mm\"", ":16:1: ", "unknown key \"thicknes\": did you mean \"thickness\"?"),
    ("\"5 W/cm^2\"", "\"5\"", ":28:49: ", "missing unit: expected a heat flux"),
    ("\"5 W/cm^2\"", "\"5 mm\"", ":28:49: ", "wrong dimension: expected a heat flux"),
    ("\"3 mm\"", "\"-3 mm\"", ":16:13: ", "expected a value above 0, found \"-3 mm\""),
    ("\"1 s\"", "\"-1 s\"", ":28:42: ", "times must not decrease: -1 s follows 0 s"),
    ("\"pyrogel3350\"", "\"pyrogel335\"", ":15:12: ", "unknown material \"pyrogel335\""),
    ("\"2 mm\"", "\"4 mm\"", ":24:9: ", "depth 4 mm lies outside the layup, from 0 mm to 3.5 mm"),
    ("[0.8, 1.2]", "[1.2, 0.8]", ":34:9: ", "bounds reversed: 1.2 is not below 0.8"),
    ("\"300 K\"", "\"300 K", ":2:", "invalid basic string"),
];

/// Exit code 2, these messages on standard error, nothing on standard output, and no file besides the `given` ones.
#[track_caller]
pub(crate) fn refused(scratch: &Scratch, ran: CommandResult, given: usize, message: &[&str]) {
    let ran = ran.exited_with(2).with_stderr(message);
    assert_eq!(ran.stdout, "");
    assert_eq!(scratch.files().len(), given, "a file was written: {:?}", scratch.files());
}

#[test]
fn every_error_of_a_case_is_reported_with_file_line_and_column() {
    let scratch = Scratch::new("faults");
    for (from, to, position, message) in FAULTS {
        assert!(CASE.contains(from), "{from:?} is not in the case");
        scratch.write("c/case.toml", CASE.replacen(from, to, 1));
        refused(&scratch, run(&scratch, "predict c"), 1, &[&format!("c/case.toml{position}"), message]);
    }
}

#[test]
fn all_errors_of_a_case_are_reported_together() {
    let scratch = Scratch::new("faults-all");
    let broken = FAULTS[..8].iter().fold(CASE.to_owned(), |text, (from, to, ..)| text.replacen(from, to, 1));
    scratch.write("c/case.toml", broken);
    let message = ["thicknes", "missing unit", "-1 s follows", "pyrogel335", "bounds reversed"];
    refused(&scratch, run(&scratch, "study c"), 1, &message);
}

#[test]
fn invalid_observations_are_reported_with_line_and_column() {
    let scratch = Scratch::new("faults-observed");
    let line =
        1 + CASE.lines().count() + OBSERVATIONS.lines().position(|line| line.starts_with("TC2")).expect("a line");
    for (from, to, column, message) in
        [("TC2 = ", "TC3 = ", 7, "unknown sensor \"TC3\""), ("\"320 K\"", "\"NaN K\"", 35, "not a finite number")]
    {
        scratch.write("c/case.toml", CASE.to_owned() + &OBSERVATIONS.replacen(from, to, 1));
        refused(&scratch, run(&scratch, "estimate c"), 1, &[&format!("c/case.toml:{line}:{column}: {message}")]);
    }
}

#[test]
fn an_invalid_loss_or_prior_is_reported_with_line_and_column() {
    let scratch = Scratch::new("faults-objective");
    let line = 1 + CASE.lines().position(|line| line.starts_with("sensors = ")).expect("a line");
    for (key, column, message) in [
        ("loss_function = \"cauchy\"", 17, "expected squares, soft-l1 or huber"),
        ("loss_function = \"huber=-1\"", 17, "expected a width in standard deviations above zero"),
        ("prior = \"wide\"", 9, "expected \"small\" or \"large\", found \"wide\""),
    ] {
        scratch.write("c/case.toml", CASE.replacen("sensors = ", &format!("{key}\nsensors = "), 1) + OBSERVATIONS);
        refused(&scratch, run(&scratch, "estimate c"), 1, &[&format!("c/case.toml:{line}:{column}: {message}")]);
    }
}

#[test]
fn cases_that_cannot_be_fitted_together_are_refused_with_the_reason() {
    let scratch = Scratch::new("faults-together");
    let text = CASE.to_owned() + OBSERVATIONS;
    scratch.write("a/case.toml", &text);
    scratch.write("b/case.toml", text.replacen("window = ", "loss_function = \"huber\"\nwindow = ", 1));
    scratch.write("c/case.toml", text.replacen("small = [0.8, 1.2]", "nominal = 1.5\nsmall = [1.4, 1.6]", 1));
    scratch.write("d/case.toml", text.replace("f_k", "f_other"));
    scratch.write("e/case.toml", CASE);
    for (line, message) in [
        ("estimate a b", "\"b\" has another loss or prior than \"a\"; state one loss and one prior for all cases"),
        ("estimate a c", "factor \"f_k\": the bounds of the cases do not overlap; the highest lower bound is 1.4"),
        (
            "estimate a d --factors f_k",
            "no factor to estimate in \"d\": it shares no estimated factor with the other cases",
        ),
        ("estimate a e", "the selected sensors of \"e\" have no samples between 0 s and 30 s"),
        ("estimate a b --sensors TC7", "--sensors: no sensor is called \"TC7\"; there are TC1, TC2"),
    ] {
        refused(&scratch, run(&scratch, line), 5, &[message]);
    }
}

#[test]
fn an_invalid_number_in_a_table_file_is_reported_with_line_and_column() {
    let scratch = Scratch::new("faults-table");
    let (_, after) = CASE.split_once("flux = ").expect("a flux");
    let flux = &after[..after.find('\n').expect("a line")];
    scratch.write("c/case.toml", CASE.replacen(flux, "{ file = \"flux.csv\" }", 1));
    scratch.write("c/flux.csv", "time_s,flux_w_cm2\n0,0\n1,inf\n");
    refused(&scratch, run(&scratch, "predict c"), 2, &["c/flux.csv:3:3: expected a finite number, found \"inf\""]);
    scratch.write("c/flux.csv", "time_s,flux\n0,0\n");
    refused(&scratch, run(&scratch, "predict c"), 2, &["c/flux.csv:1:8: missing unit", "such as \"flux_w_cm2\""]);
}

#[test]
fn files_that_are_not_a_case_and_missing_files_have_different_messages() {
    let scratch = Scratch::new("faults-file");
    scratch.write("empty.toml", "");
    scratch.write("binary.toml", [0x7f, b'E', b'L', b'F', 0xff, 0xfe, 0]);
    scratch.write("folder/notes.txt", "no case here");
    for (name, message) in [
        ("empty.toml", "empty.toml: the file is empty"),
        ("binary.toml", "binary.toml: not a text file"),
        ("missing.toml", "missing.toml: no such file"),
        ("folder", "folder: the folder contains no case.toml"),
    ] {
        refused(&scratch, run_args(&scratch, &["predict", name]), 3, &[message]);
    }
}

#[test]
fn invalid_arguments_are_reported_with_the_expected_value() {
    let scratch = Scratch::new("typed");
    scratch.write("c/case.toml", CASE.to_owned() + OBSERVATIONS);
    for (line, message) in [
        ("estimate c --factors f_z", "--factors: no factor is called \"f_z\"; there are f_k, f_q"),
        ("estimate c --factors f_k,f_k", "--factors names \"f_k\" twice"),
        ("estimate c --sensors TC9", "--sensors: no sensor is called \"TC9\"; there are TC1, TC2"),
        ("estimate c --sensors TC1", "no samples between 0 s and 30 s"),
        ("estimate c --start f_q=1", "--start f_q: that factor is not estimated"),
        ("estimate c --start f_k=3", "--start f_k=3: outside its bounds 0.8 to 1.2"),
        ("estimate c --start f_k", "invalid value 'f_k' for '--start <START>': expected NAME=VALUE"),
        ("estimate c --loss cauchy", "invalid value 'cauchy' for '--loss <LOSS>': expected squares, soft-l1 or huber"),
        (
            "estimate c --loss huber=0",
            "'huber=0' for '--loss <LOSS>': expected a width in standard deviations above zero",
        ),
        ("estimate c --prior wide", "invalid value 'wide'"),
        ("estimate c --starts 0", "--starts 0: expected at least 1"),
        ("estimate c --profile f_q", "no profile of \"f_q\": it is not estimated; the estimated factors are f_k"),
        ("estimate c c", "two cases have the id \"c\": give each case once"),
        ("estimate c missing.toml", "missing.toml: no such file"),
        ("estimate c c --compare c", "cannot be used with"),
        ("estimate c --window 30:0", "expected a start before the end, found 30 s and 0 s"),
        ("estimate c --window soon", "expected START:END in seconds, such as 0:80"),
        ("estimate c --window 100:200", "no samples between 100 s and 200 s"),
        ("sensitivity c --step 7", "--step 7: expected a relative step from 1e-9 to 0.2"),
        ("sensitivity c --step NaN", "--step NaN: expected a relative step"),
        ("sensitivity c --method tangent --step 1e-4", "--step 0.0001: exact derivatives have no step"),
        ("uncertainty c -n 1", "-n 1: expected at least 2 members"),
        ("uncertainty c --sampling dice", "invalid value 'dice'"),
        ("twin c --noise 2", "'2' for '--noise <DIFFERENCE>': missing unit: expected a temperature difference"),
        ("twin c --noise=-2K", "--noise -2 K: expected no less than 0 K"),
        ("twin c --truth f_z=1", "--truth: no factor is called \"f_z\""),
        ("twin c --truth f_k=-1", "'f_k=-1' for '--truth <TRUTH>': expected a number above zero"),
        ("twin c --correlation-time=-1s", "--correlation-time -1 s: expected no less than 0 s"),
        ("twin c --factors f_k", "--factors: without a coverage study nothing is fitted"),
        ("twin c --study 1", "--study 1: expected at least 2 data sets"),
        ("twin c --study 5 --truth f_k=1", "cannot be used with"),
        ("size c --ply BASE --limit TC2", "--limit \"TC2\": expected PART < TEMPERATURE"),
        (
            "size c --ply BASE --limit TC9<400K",
            "--limit: no sensor, ply or interface is called \"TC9\"; there are TC1, TC2, TOP",
        ),
        ("size c --ply FELT --limit TC2<400K", "--ply \"FELT\": no ply or group has this name; there are"),
        (
            "size c --ply BASE --limit TC2<400K --probability 1",
            "--probability 1: expected a probability between 0 and 1",
        ),
        ("size c --ply BASE --limit TC2<400K -n 300", "-n 300: a probability of 0.99 needs at least 368 members"),
        (
            "size c --ply BASE --limit TC2<400K --thickness-range 9mm:3mm",
            "--thickness-range 9.000 mm to 3.000 mm: expected 0 < smallest < largest thickness",
        ),
        ("trade c --ply BASE=akk --limit TC2<400K", "--size"),
        (
            "trade c --ply BASE --size BASE --limit TC2<400K",
            "'BASE' for '--ply <PLY=MATERIALS>': expected PLY=MATERIALS, such as INS=",
        ),
        ("trade c --ply BASE=akk, --size BASE --limit TC2<400K", "found an empty name of a material"),
        (
            "trade c --ply FELT=akk --size BASE --limit TC2<400K",
            "--ply \"FELT\": no ply or group has this name; there are BASE, INS, OF, TOP",
        ),
        (
            "trade c --ply BASE=pyrogel335 --size BASE --limit TC2<400K",
            "--ply \"BASE\": pyrogel335: unknown material \"pyrogel335\": did you mean \"pyrogel3350\"?",
        ),
        (
            "trade c --ply BASE=akk,kkl,akk --size BASE --limit TC2<400K",
            "--ply \"BASE\": the material \"akk\" is named twice",
        ),
        (
            "trade c --ply BASE=akk --ply INS=kkl --size BASE --limit TC2<400K",
            "--ply \"INS\": \"BASE\" chooses the material of the same ply",
        ),
        (
            "trade c --ply BASE=akk --size FELT --limit TC2<400K",
            "--size \"FELT\": no ply or group has this name; there are BASE, INS, OF, TOP",
        ),
        ("trade c --ply BASE=akk --size BASE", "--limit: no part has a limit in the case: state one"),
        (
            "trade c c --ply BASE=akk --size BASE --limit TC2<400K",
            "two cases are called \"c\": give each exposure once",
        ),
        (
            "trade c --ply BASE=akk --size BASE --limit TC2<400K -n 300",
            "-n 300: a probability of 0.99 needs at least 368 members",
        ),
        ("predict c --set f_q=1e6", "--set f_q=1e6: nominal 1000000 lies outside the small bounds 0.9 to 1.1"),
        ("predict c --set presure=1kPa", "unknown key \"presure\": did you mean \"pressure\"?"),
        ("predict c --set f_k", "--set \"f_k\": expected NAME=VALUE"),
        ("predict c --out c/case.toml", "\"c/case.toml\" is not a folder"),
        (
            "verify --group nope",
            "--group \"nope\": no such group; there are exact, orders, codes, adapted, balance, fit, coverage, \
             cross-backend",
        ),
        ("materials show nope", "unknown material \"nope\""),
        ("materials check c/case.toml", "c/case.toml: missing key \"density\""),
        ("frobnicate c", "unrecognized subcommand 'frobnicate'"),
    ] {
        refused(&scratch, run(&scratch, line), 1, &[message]);
    }
}

#[test]
fn a_case_without_observations_cannot_be_estimated() {
    let scratch = Scratch::new("unobserved");
    scratch.write("c/case.toml", CASE);
    refused(&scratch, run(&scratch, "estimate c"), 1, &["no data to estimate from"]);
}

#[test]
fn the_report_of_another_case_is_overwritten_only_with_force() {
    let scratch = Scratch::new("another");
    scratch.write("mine/case.toml", CASE);
    scratch.write("yours/case.toml", CASE);
    run(&scratch, "predict mine --out there").succeeded();
    let (before, files) = (scratch.read("there/summary.json"), scratch.files().len());
    let refusal = run(&scratch, "predict yours --out there");
    refused(&scratch, refusal, files, &["\"there\" holds the case \"mine\", not \"yours\"", "--force"]);
    assert_eq!(scratch.read("there/summary.json"), before);
    run(&scratch, "predict yours --out there --force").succeeded();
    assert!(scratch.read("there/summary.json").contains("\"case\": \"yours\""));
}
