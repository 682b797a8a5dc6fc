//! Time window and standard deviation of single sensors.

use super::{Scratch, VALID_CASE, errors};
use crate::case::{Case, Observation};

const SAMPLES: &str = r#"TC2 = [["0 s", "300 K"], ["10 s", "320 K"]]"#;

/// The observations of the valid case with other `observations` and with `table` as file `m.csv`.
fn observed(name: &str, table: &str, observations: &str) -> Vec<Observation> {
    let scratch = Scratch::new(name);
    scratch.write("m.csv", table);
    let text = VALID_CASE.replacen(SAMPLES, observations, 1).replacen("sensors = [\"TC2\"]\n", "", 1);
    Case::load(&scratch.write("case.toml", text)).unwrap_or_else(|error| panic!("{error}")).observations
}

#[test]
fn a_sensor_may_have_its_own_window_and_standard_deviation() {
    let own = r#"TC2 = { samples = [["0 s", "300 K"], ["10 s", "320 K"]], window = ["5 s", "20 s"], sigma = "5 K" }
TC1 = [["0 s", "300 K"]]"#;
    let [tc2, tc1] = &observed("own", "", own)[..] else { panic!("two observations") };
    assert_eq!(
        (tc2.window_s, &tc2.sigma_k[..], &tc2.times_s[..]),
        (Some((5.0, 20.0)), &[5.0; 2][..], &[0.0, 10.0][..])
    );
    assert_eq!((tc1.window_s, &tc1.sigma_k[..]), (None, &[2.0][..]));
}

#[test]
fn the_standard_deviation_of_a_sensor_overrides_the_common_one_which_overrides_the_columns() {
    let table = "time_s,TC1_K,TC1_sigma_K,TC2_K,TC2_sigma_K\n0,300,1,300,3\n10,310,1,305,4\n";
    let of = |name: &str, more: &str| -> Vec<Vec<f64>> {
        let found = observed(name, table, &format!("file = \"m.csv\"\n{more}"));
        found.into_iter().map(|observation| observation.sigma_k).collect()
    };
    assert_eq!(of("of-all", ""), [[2.0; 2]; 2]);
    assert_eq!(of("of-one", "TC2.sigma = \"7 K\""), [[2.0; 2], [7.0; 2]]);
    let windowed = observed("of-file", table, "file = \"m.csv\"\nTC1.window = [\"0 s\", \"5 s\"]");
    assert_eq!([windowed[0].window_s, windowed[1].window_s], [Some((0.0, 5.0)), None]);
    let scratch = Scratch::new("columns");
    scratch.write("m.csv", table);
    let own =
        VALID_CASE.replacen(SAMPLES, "file = \"m.csv\"\nTC1.sigma = \"7 K\"", 1).replacen("sigma = \"2 K\"\n", "", 1);
    let case = Case::load(&scratch.write("case.toml", own)).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(
        (&case.observations[0].sigma_k[..], &case.observations[1].sigma_k[..]),
        (&[7.0; 2][..], &[3.0, 4.0][..])
    );
}

#[test]
fn the_window_of_a_sensor_overrides_the_common_one_and_the_span_covers_both() {
    let own = r#"TC2 = { samples = [["0 s", "300 K"], ["80 s", "320 K"]], window = ["20 s", "80 s"] }
TC1 = [["0 s", "300 K"]]"#;
    let scratch = Scratch::new("windows");
    let text = VALID_CASE.replacen(SAMPLES, own, 1).replacen("sensors = [\"TC2\"]\n", "", 1);
    let case = Case::load(&scratch.write("case.toml", text)).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!([case.window_s(0), case.window_s(1), case.fit_window_s()], [(0.0, 50.0), (20.0, 80.0), (0.0, 80.0)]);
}

/// Observations in position of the samples; line and column of the error; a part of its message.
const BROKEN: &[(&str, &str, &str)] = &[
    (r#"TC2 = { window = ["0 s", "5 s"] }"#, ":38:7:", "sensor \"TC2\" has no samples: expected `samples = [["),
    (r#"TC2 = { samples = [["0 s", "300 K"]], windw = ["0 s", "5 s"] }"#, ":38:39:", "did you mean \"window\"?"),
    (
        r#"TC2 = { samples = [["0 s", "300 K"]], sigma = "0 K" }"#,
        ":38:47:",
        "expected a standard deviation from 1e-6 K to 4000 K, found 0 K",
    ),
    (r#"TC2 = { samples = [["0 s", "300 K"]], sigma = "2 s" }"#, ":38:47:", "expected a temperature difference"),
    (r#"TC2 = { samples = [["0 s", "300 K"]], window = ["9 s", "5 s"] }"#, ":38:48:", "9 s is not before 5 s"),
    (
        r#"TC2 = { samples = [["0 s", "300 K"]], window = ["200 s", "300 s"] }"#,
        ":38:48:",
        "expected a window that begins before 100 s, the end",
    ),
    (
        r#"TC2 = { samples = [["0 s", "300 K"], ["9 s", "310 K"]], window = ["20 s", "30 s"] }"#,
        ":38:66:",
        "no sample of \"TC2\" between 20 s and 30 s: it has 2 samples from 0 s to 9 s",
    ),
    (r#"TC3 = { sigma = "2 K" }"#, ":38:7:", "unknown sensor \"TC3\""),
];

#[test]
fn errors_of_a_single_sensor_are_reported_with_line_column_and_expected_value() {
    for (index, &(to, position, fragment)) in BROKEN.iter().enumerate() {
        let found = errors(&format!("own-{index}"), SAMPLES, to);
        assert!(
            found.len() == 1 && found[0].contains(position) && found[0].contains(fragment),
            "{fragment}: {found:#?}"
        );
    }
    let scratch = Scratch::new("own-file");
    scratch.write("m.csv", "time_s,TC2_K\n0,300\n");
    for (own, fragment) in [
        (
            r#"TC1 = { sigma = "5 K" }"#,
            ":39:7: sensor \"TC1\" has no samples: expected a column \"TC1_K\" in the file or `samp",
        ),
        (r#"TC2 = { samples = [["0 s", "300 K"]] }"#, ":39:19: duplicate samples of \"TC2\""),
    ] {
        let text = VALID_CASE.replacen(SAMPLES, &format!("file = \"m.csv\"\n{own}"), 1);
        let message = Case::load(&scratch.write("case.toml", text)).expect_err(own).to_string();
        assert!(message.contains(fragment), "{fragment}: {message}");
    }
}
