//! Tables as loggers write them: clock times in text, TOA5, codes of missing values, Latin-1, days.

use super::VALID_CASE;
use crate::case::{Case, CaseError};
use std::collections::BTreeMap;

const SAMPLES: &str = "TC2 = [[\"0 s\", \"300 K\"], [\"10 s\", \"320 K\"]]";

/// The valid case with a file of observations and these keys beside it.
fn logged(file: &[u8], keys: &str) -> Result<Case, CaseError> {
    let text = VALID_CASE.replacen(SAMPLES, &format!("file = \"log.csv\"\n{keys}"), 1);
    Case::from_toml(&text, "logged", &BTreeMap::from([("log.csv".to_owned(), file.to_vec())]))
}

/// Times, s, and temperatures, K, of the only sensor.
#[track_caller]
fn series(file: &[u8], keys: &str) -> (Vec<f64>, Vec<f64>) {
    let case = logged(file, keys).unwrap_or_else(|error| panic!("{error}"));
    let [seen] = case.observations() else { panic!("{} sensors", case.observations().len()) };
    (seen.times_s.clone(), seen.temperatures_k.clone())
}

/// The first message about a file.
#[track_caller]
fn first_message(file: &[u8], keys: &str) -> String {
    let error = logged(file, keys).expect_err("a refusal").to_string();
    error.lines().next().unwrap_or_default().to_owned()
}

#[test]
fn clock_times_in_text_are_seconds_since_the_first() {
    let dates = "Time,TC2 (K)\n2025-03-30 01:59:50,300\n2025-03-30 02:00:00,310\n2025-03-30 02:00:10.5,320\n";
    assert_eq!(series(dates.as_bytes(), "time = \"Time\""), (vec![0.0, 10.0, 20.5], vec![300.0, 310.0, 320.0]));
    let times = "Time;TC2 (K)\n23:59:50;300\n00:00:00;310\n00:00:10,5;320,5\n";
    assert_eq!(series(times.as_bytes(), "").0, [0.0, 10.0, 20.5]);
    let shifted = "time = { column = \"Time\", offset = \"-10 s\" }";
    assert_eq!(series(dates.as_bytes(), shifted).0, [0.0, 10.5]);
    let case = logged(dates.as_bytes(), "time = \"Time\"").unwrap_or_else(|error| panic!("{error}"));
    let note = "log.csv: times \"Time\" are dates or times of day, as seconds since the first, 2025-03-30 01:59:50";
    assert!(case.unread_data().iter().any(|found| found.to_string() == note), "{:?}", case.unread_data());
}

#[test]
fn times_that_are_not_understood_are_named_with_what_is_expected() {
    for time in ["30.03.2025 01:59:50", "3/30/2025 1:59:50", "1:59:50 PM", "01:59"] {
        let message = first_message(format!("Time,TC2 (K)\n{time},300\n{time},310\n").as_bytes(), "time = \"Time\"");
        let expected = format!(
            "log.csv:2:1: times \"Time\": expected numbers, or clock times such as \"2025-03-30 01:59:30\" or \
             \"01:59:30\", found {time:?}"
        );
        assert_eq!(message, expected);
    }
    let mixed = first_message(b"Time,TC2 (K)\n08:00:00,300\n10.5,310\n", "time = \"Time\"");
    assert_eq!(mixed, "log.csv:3:1: expected a time written as those before, found \"10.5\"");
    let back = first_message(b"Time,TC2 (K)\n08:00:10,300\n08:00:00,310\n", "time = \"Time\"");
    assert!(back.contains("times must increase: -10 s follows 0 s"), "{back}");
    // Numbers without a unit are still asked for one.
    let plain = first_message(b"Time,TC2 (K)\n0,300\n1,310\n", "time = \"Time\"");
    assert!(plain.contains("missing unit in heading \"Time\""), "{plain}");
}

/// The format of the loggers of Campbell Scientific, as their manuals state it.
const TOA5: &str = r#""TOA5","CR1000X","CR1000X","12345","CR1000X.Std.03.02","CPU:furnace.CR1X","12345","TC"
"TIMESTAMP","RECORD","TC_C(1)","TC_C(2)"
"TS","RN","Deg C","Deg C"
"","","Smp","Smp"
"2025-03-30 01:59:50",0,20.0,20.0
"2025-03-30 02:00:00",1,25.0,"NAN"
"2025-03-30 02:00:10",2,30.0,22.0
"#;

#[test]
fn a_toa5_file_is_read_by_its_timestamps_and_units() {
    for keys in ["time = \"TIMESTAMP\"\nTC2 = { column = \"TC_C(2)\" }", "TC2 = { column = \"TC_C(2)\" }"] {
        assert_eq!(series(TOA5.as_bytes(), keys), (vec![0.0, 20.0], vec![293.15, 295.15]), "{keys}");
    }
    let record = "time = { column = \"RECORD\", unit = \"s\" }\nTC2 = { column = \"TC_C(1)\" }";
    assert_eq!(series(TOA5.as_bytes(), record).0, [0.0, 1.0, 2.0]);
}

#[test]
fn every_code_of_a_missing_value_can_be_stated_and_is_asked_for_otherwise() {
    for code in ["OPEN", "OL", "-OL-", "BURNOUT", "---", "Over range", "-9999", "9.9E37", "9.9e+37", "7999"] {
        let file = format!("time_s,TC2_K\n0,300\n1,{code}\n2,310\n");
        for stated in [format!("{code:?}"), format!("[\"ERR\", {code:?}]"), format!("[{:?}]", code.to_lowercase())] {
            let (times_s, _) = series(file.as_bytes(), &format!("missing = {stated}"));
            assert_eq!(times_s, [0.0, 2.0], "{code} as {stated}");
        }
        // A high temperature may be a measured one.
        if code != "7999" {
            let message = first_message(file.as_bytes(), "");
            assert!(message.starts_with("log.csv:3:3: ") && message.contains("missing"), "{code}: {message}");
        }
    }
    assert_eq!(series(b"time_s,TC2_K\n0,300\n1,-9999\n2,310\n", "missing = -9999").0, [0.0, 2.0]);
    assert_eq!(series(b"time_s,TC2_K\n0,300\n1,#N/A\n2,310\n", "").0, [0.0, 2.0]);
    let alone = VALID_CASE.replacen(SAMPLES, &format!("{SAMPLES}\nmissing = \"OPEN\""), 1);
    let error = Case::from_toml(&alone, "alone", &BTreeMap::<String, String>::new()).expect_err("no file");
    assert!(error.to_string().contains("`missing` needs a `file`: found none"), "{error}");
}

#[test]
fn a_file_in_latin_1_is_read_and_noted() {
    let bytes = b"Zeit (s);TC2 (\xb0C)\n0;20,5\n10;25\n";
    assert_eq!(series(bytes, "time = \"Zeit (s)\""), (vec![0.0, 10.0], vec![293.65, 298.15]));
    let case = logged(bytes, "time = \"Zeit (s)\"").unwrap_or_else(|error| panic!("{error}"));
    let note = "log.csv: read as Windows-1252 (Latin-1): byte 14 is not UTF-8";
    assert!(case.unread_data().iter().any(|found| found.to_string() == note), "{:?}", case.unread_data());
    // A case file must be UTF-8, as TOML is.
    let scratch = super::Scratch::new("latin-1");
    let path = scratch.write("case.toml", b"name = \"\xc4\"\n");
    let error = Case::load(&path).expect_err("not UTF-8").to_string();
    assert!(error.contains("byte 8 is not UTF-8: save it as UTF-8"), "{error}");
}

#[test]
fn times_may_be_in_days() {
    for unit in ["d", "day", "days"] {
        let file = format!("time ({unit}),TC2_K\n0,300\n0.001,310\n");
        assert_eq!(series(file.as_bytes(), "").0, [0.0, 86.4], "{unit}");
    }
}

#[test]
fn times_of_day_in_a_workbook_pass_midnight() {
    use rust_xlsxwriter::{Format, Workbook};
    let mut book = Workbook::new();
    let clock = Format::new().set_num_format("hh:mm:ss");
    let sheet = book.add_worksheet();
    sheet.write(0, 0, "Time").and_then(|sheet| sheet.write(0, 1, "TC2 (degC)")).expect("headings");
    for (row, second) in (1..).zip([86_380.0, 86_390.0, 0.0, 10.0, 20.0]) {
        sheet.write_with_format(row, 0, second / 86_400.0, &clock).expect("a time of day");
        sheet.write(row, 1, 20.0 + f64::from(row)).expect("a temperature");
    }
    let bytes = book.save_to_buffer().expect("a workbook");
    assert_eq!(series(&bytes, "time = \"Time\"").0, [0.0, 10.0, 20.0, 30.0, 40.0]);
}
