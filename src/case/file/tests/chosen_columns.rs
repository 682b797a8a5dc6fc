//! Columns of a data file that the case chooses.

use super::{Scratch, VALID_CASE};
use crate::case::{Case, CaseError, Schedule};

const SAMPLES: &str = "TC2 = [[\"0 s\", \"300 K\"], [\"10 s\", \"320 K\"]]";
const FLUX: &str = r#"{ points = [["0 s", "0 W/cm^2"], ["1 s", "5 W/cm^2"]], outside = "hold" }"#;

/// A data file as a logger writes it: lines above the headings, a line of units, columns without a heading or with the
/// same one, text, and samples before the test begins.
const LOGGER: &str = "Run 17;panel B\nDate;24.11.2026\n\nTime (ms);CH 11;CH 12;Alarm;Alarm;;TC1\n\
                      (ms);degC;[degF];;;;K\n\
                      15500;20,5;68,9;ok;ok;1;293,65\n17500;21,5;70,7;ok;ok;1;294,65\n\
                      18500;;72,5;HIGH;ok;1;295,65\n217500;23,5;74,3;ok;ok;1;296,65\n";

/// The valid case with other `observations`, and with a table as file `run.csv`.
fn observed(name: &str, table: &str, observations: &str) -> Result<Case, CaseError> {
    let scratch = Scratch::new(name);
    scratch.write("run.csv", table);
    Case::load(
        &scratch
            .write("case.toml", VALID_CASE.replacen(SAMPLES, observations, 1).replacen("sensors = [\"TC2\"]\n", "", 1)),
    )
}

#[test]
fn columns_of_a_logger_are_read_with_their_units_from_the_start_of_the_exposure() {
    let observations = "file = \"run.csv\"\ntime = { column = \"Time (ms)\", offset = \"-17.5 s\" }\n\
                        TC2 = { column = \"CH 12\", window = [\"0 s\", \"9 s\"] }";
    let case = observed("logger", LOGGER, observations).unwrap_or_else(|error| panic!("{error}"));
    let [tc2, tc1] = case.observations() else { panic!("two observations") };
    assert_eq!((tc2.sensor, tc1.sensor), (1, 0));
    assert_eq!((&tc2.times_s[..], tc2.window_s), (&[0.0, 1.0][..], Some((0.0, 9.0))));
    // 70.7 °F and 72.5 °F are 21.5 °C and 22.5 °C.
    let exact_k = [294.65, 295.65];
    assert!(tc2.temperatures_k.iter().zip(exact_k).all(|(read_k, exact_k)| (read_k - exact_k).abs() < 1e-9));
    assert_eq!((&tc1.times_s[..], &tc1.temperatures_k[..]), (&[0.0, 1.0][..], &exact_k[..]));
    let notes: Vec<String> = case.unread_data().iter().map(ToString::to_string).collect();
    for (note, expected) in notes.iter().zip([
        "run.csv: 1 sample of a sensor after 100 s, the end of the exposure, not read",
        "run.csv: 1 sample of a sensor before 0 s not read",
        "run.csv: column \"CH 11\" and 2 more not read: no sensor of the case",
    ]) {
        assert!(notes.len() == 3 && note.ends_with(expected), "{notes:?}");
    }
}

#[test]
fn a_stated_unit_overrides_that_of_the_file() {
    let table = "t,CH 12 (K)\n0,20\n1,30\n";
    let stated = "file = \"run.csv\"\ntime = { column = \"t\", unit = \"min\" }\n\
                  TC2 = { column = \"CH 12\", unit = \"degC\" }";
    let case = observed("stated", table, stated).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(case.observations()[0].times_s, [0.0, 60.0]);
    assert_eq!(case.observations()[0].temperatures_k, [293.15, 303.15]);
    let message =
        observed("unit", table, "file = \"run.csv\"\nTC2 = { column = \"CH 12\" }").expect_err("no unit of t");
    assert!(message.to_string().contains("missing unit in heading \"t\""), "{message}");
}

#[test]
fn a_schedule_may_come_from_a_chosen_column_with_an_offset() {
    let scratch = Scratch::new("driver");
    scratch.write("run.csv", "Run 17\nt,x,Q\ns,,kW/m^2\n8,1,0\n10,1,50\n12,1,50\n");
    let flux =
        "{ file = \"run.csv\", column = \"Q\", time = { column = \"t\", offset = \"-10 s\" }, outside = \"hold\" }";
    let text = VALID_CASE.replacen(FLUX, flux, 1);
    let case = Case::load(&scratch.write("case.toml", text)).unwrap_or_else(|error| panic!("{error}"));
    let expected = Schedule::new(vec![-2.0, 0.0, 2.0], vec![0.0, 50e3, 50e3]).expect("a schedule");
    assert!(case.exposure().schedules().any(|schedule| *schedule == expected), "{:?}", case.exposure());
}

#[test]
fn a_choice_that_cannot_be_read_is_an_error_at_its_position() {
    let table = "t (s),CH 12 (K),CH 13 (K)\n-5,300,300\n-1,301,301\n";
    for (index, (observations, fragment)) in [
        ("file = \"run.csv\"\nTC2 = { column = \"CH 21\" }", ":39:18: "),
        ("file = \"run.csv\"\nTC2 = { column = \"CH 21\" }", "has no column \"CH 21\": known: CH 12 (K), CH 13 (K)"),
        ("file = \"run.csv\"\nTC2 = { unit = \"K\" }", ":39:16: `unit` needs a `column`: found none"),
        ("TC2 = { column = \"CH 12\" }", ":38:18: `column` needs a `file`: found none"),
        ("time = \"t\"\nTC2 = [[\"0 s\", \"300 K\"]]", ":38:8: `time` needs a `file`: found none"),
        ("file = \"run.csv\"\nTC2 = { column = \"t (s)\" }", ":39:18: \"t (s)\" is the column of times"),
        ("file = \"run.csv\"\nTC2 = { column = \"CH 12\", unit = \"s\" }", ":39:34: wrong dimension"),
        (
            "file = \"run.csv\"\nTC2 = { column = \"CH 12\", samples = [[\"0 s\", \"300 K\"]] }",
            ":39:18: expected `samples` or a `column`, not both",
        ),
        ("file = \"run.csv\"\ntime = { column = \"t\", shift = \"1 s\" }", ":39:24: unknown key \"shift\""),
        ("file = \"run.csv\"\ntime = { column = \"t\", offset = \"1 K\" }", ":39:33: wrong dimension"),
        (
            "file = \"run.csv\"\ntime = \"t\"\nTC2 = { column = \"CH 12\" }",
            "expected samples from 0 s on, found the last at -1 s",
        ),
        ("file = \"run.csv\"\ntime = \"t\"", "run.csv:1:1: no sensor column after the time column"),
    ]
    .into_iter()
    .enumerate()
    {
        let error = observed(&format!("choice-{index}"), table, observations).expect_err(observations).to_string();
        assert!(error.contains(fragment), "{observations}\n{fragment}\n{error}");
    }
}

#[test]
fn without_a_choice_an_unknown_column_stays_an_error() {
    let error = observed("strict", "time_s,TC2_K,CH 11_K\n0,300,300\n", "file = \"run.csv\"").expect_err("CH 11");
    assert!(error.to_string().contains("unknown sensor \"CH 11\""), "{error}");
}
