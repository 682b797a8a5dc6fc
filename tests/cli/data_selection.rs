//! Time window and standard deviation of single thermocouples.

use super::estimates::{UNCHANGED, number, write_synthetic_case};
use super::run;
use crate::support::Scratch;
use serde_json::{Value, json};

/// Time after which the readings of TC2 are wrong, s.
const LOOSE_S: f64 = 20.0;

/// Add 80 K to TC2 after [`LOOSE_S`].
fn come_loose(table: &str) -> String {
    let row = |line: &str| match (line.split_once(','), line.rsplit_once(',')) {
        (Some((time, _)), Some((rest, kelvin))) if time.parse().is_ok_and(|time_s: f64| time_s > LOOSE_S) => {
            format!("{rest},{}", kelvin.parse::<f64>().expect("a number") + 80.0)
        }
        _ => line.to_owned(),
    };
    table.lines().map(row).collect::<Vec<_>>().join("\n") + "\n"
}

fn estimated(scratch: &Scratch, line: &str) -> Value {
    run(scratch, &format!("estimate {line} --json --quiet --force")).succeeded().json()
}

const ALL: &str = r#"--factors f_k,f_q --set estimate.window=["0s","40s"]"#;
const OWN: &str = r#"--set observations.TC2.window=["0s","20s"]"#;

#[test]
fn readings_after_the_window_of_a_thermocouple_do_not_count() {
    let scratch = Scratch::new("loose");
    write_synthetic_case(&scratch, "sound", UNCHANGED, 1);
    scratch.write("loose/case.toml", scratch.read("sound/case.toml"));
    scratch.write("loose/measured.csv", come_loose(&scratch.read("sound/measured.csv")));

    // With TC2 only, its window has the same effect as --window, to the last digit.
    let own = estimated(&scratch, &format!("loose {ALL} --sensors TC2 {OWN}"));
    let cut = estimated(&scratch, &format!("sound {ALL} --sensors TC2 --window 0:20"));
    assert_eq!((&own["factors"], &own["samples"]), (&cut["factors"], &cut["samples"]));

    // With TC1, which stays correct, the true factor is found; without the window, or with --window, it is not.
    let both = estimated(&scratch, &format!("loose {ALL} --sensors TC1,TC2 {OWN}"));
    let spoiled = estimated(&scratch, &format!("loose {ALL} --sensors TC1,TC2"));
    let typed = estimated(&scratch, &format!("loose {ALL} --sensors TC1,TC2 {OWN} --window 0:40"));
    // The noise is white; the standard error with autocorrelation differs between the data sets.
    let error = number(&both, "factors.f_k.independent_standard_error");
    let off = |found: &Value| (number(found, "factors.f_k.value") - 1.1).abs() / error;
    assert!(off(&both) < 4.0 && off(&spoiled) > 20.0, "{} and {} of {error}", off(&both), off(&spoiled));
    assert_eq!(typed["factors"], spoiled["factors"]);

    // JSON, text and report show the window.
    let counted = |found: &Value| found["observed"]["loose"]["TC2"]["samples"].as_u64().expect("a number of samples");
    assert_eq!(both["observed"]["loose"]["TC2"]["window_s"], json!([0.0, LOOSE_S]));
    assert_eq!(both["observed"]["loose"]["TC1"]["window_s"], json!([0.0, 40.0]));
    assert!(counted(&both) < counted(&typed));
    let text =
        run(&scratch, &format!("estimate loose {ALL} --sensors TC1,TC2 {OWN} --quiet --force")).succeeded().stdout;
    assert!(text.contains("Data used: TC2 from 0 s to 20 s."), "{text}");
    let page = scratch.read("out/loose/estimate/report.html");
    assert!(page.contains("Observations</h3>") && page.contains("0.0 to 20.0"));
    assert!(page.contains("RMSE from 0\u{a0}s to 20\u{a0}s: "));
    let set = r#"--set observations.TC2.window=["50s","60s"]"#;
    run(&scratch, &format!("estimate loose {set}"))
        .exited_with(2)
        .with_stderr(&["begins before 40 s, the end of the exposure, found 50 s"]);
}

#[test]
fn the_standard_deviation_of_a_sensor_equals_its_column_and_weights_the_sensor() {
    let scratch = Scratch::new("firm");
    write_synthetic_case(&scratch, "c", UNCHANGED, 2);
    let line = "c --factors f_k --sensors TC1,TC2 --window 0:40";
    let of = |sigma: &str| estimated(&scratch, &format!("{line} --set observations.TC2.sigma={sigma}"));
    let found = of("8K");
    assert_eq!(found["observed"]["c"]["TC2"]["sigma_k"], json!([8.0, 8.0]));
    assert_eq!(found["observed"]["c"]["TC1"]["sigma_k"], json!([2.0, 2.0]));

    let columns = scratch.read("c/measured.csv");
    let columns = columns.lines().enumerate().map(|(row, line)| {
        let more = if row == 0 { "TC1_sigma_K,TC2_sigma_K" } else { "2,8" };
        format!("{line},{more}")
    });
    scratch.write("d/measured.csv", columns.collect::<Vec<_>>().join("\n") + "\n");
    scratch.write("d/case.toml", scratch.read("c/case.toml").replacen("sigma = \"2 K\"\n", "", 1));
    let by_columns = estimated(&scratch, "d --factors f_k --sensors TC1,TC2 --window 0:40");
    assert_eq!(found["factors"], by_columns["factors"]);

    let value = |found: &Value| number(found, "factors.f_k.value");
    let alone =
        |sensor: &str| value(&estimated(&scratch, &format!("c --factors f_k --sensors {sensor} --window 0:40")));
    let (first, second) = (alone("TC1"), alone("TC2"));
    let nearer = |sigma: &str| (value(&of(sigma)) - first) / (second - first);
    assert!(nearer("0.02K") > 0.95 && nearer("2000K") < 0.05, "{} and {}", nearer("0.02K"), nearer("2000K"));
    assert!(nearer("0.5K") > nearer("8K"));
}
