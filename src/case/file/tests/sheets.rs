//! Table files: dialects, missing values and error messages.

use super::{Scratch, VALID_CASE};
use crate::case::Case;

const SAMPLES: &str = "TC2 = [[\"0 s\", \"300 K\"], [\"10 s\", \"320 K\"]]";

#[test]
fn errors_of_a_table_file_have_its_line_and_column() {
    let broken = [
        ("time_s,TC2_K\n0,300\n1,inf\n", "m.csv:3:3: expected a finite number, found \"inf\""),
        ("time_s;TC2_K\n0;300\n1;1.234,5\n", "m.csv:3:3: expected a finite number, found \"1.234,5\""),
        ("time_s,TC2_K\n\n# note\n\"0\",\"3x0\"\n", "m.csv:4:5: expected a finite number, found \"3x0\""),
        ("time_s\n0\n", "m.csv:1:1: no sensor column after the time column: expected some of TC1_K, TC2_K"),
        ("junk that is no table\nmore\n", "m.csv:1:1: no sensor column"),
        ("time_s,TC2_K\n0,\"300\n1,301\n", "m.csv:2:3: a quoted value is not closed on its line"),
        ("time_s,TC2_K\n0,300\n1,\"301", "m.csv:3:3: a quoted value is not closed on its line"),
        ("time_s,TC2_K\n0,\"30\"0\n", "m.csv:2:3: a quote inside a value"),
        ("time_s,TC2_K\n0,30\"\"0\n", "m.csv:2:3: a quote inside a value"),
        ("time_s,TC2_K\n,300\n", "m.csv:2:1: missing time: expected a number, found \"\""),
        ("time_s,TC2_K\nNA,300\n", "m.csv:2:1: missing time: expected a number, found \"NA\""),
        ("time_s,TC2_K\n0,1e999\n", "m.csv:2:3: expected a finite number, found \"1e999\""),
        // Decimal commas where commas separate values, bare and quoted; thousands separators; two decimal marks.
        (
            "time_s,TC2_K\n0,5,300,5\n",
            "m.csv:2:1: found 4 values under 2 headings; decimal commas need semicolons or tabs",
        ),
        ("time_s,TC2_K\n0,\"300,5\"\n", "m.csv:2:3: expected a finite number, found \"300,5\": with commas between"),
        ("time_s;TC2_K\n0;1.234.567\n", "found \"1.234.567\": numbers must have no thousands separators"),
        ("time_s,TC2_K\n0,1 234\n", "found \"1 234\": numbers must have no thousands separators"),
        (
            "time_s\tTC2_K\n0.5\t300\n1.0\t1,234\n",
            "m.csv:3:5: expected a finite number, found \"1,234\": the numbers before",
        ),
        ("time_s,TC2_K\n0\n", "m.csv:2:1: found 1 values under 2 headings"),
        ("time_s,,TC2_K\n0,1,300\n", "m.csv:1:8: column 2 has no heading"),
        ("time_s,TC2_K,\n0,300,7\n", "m.csv:2:1: found 3 values under 2 headings"),
        ("time_s,TC2_K,TC2_degC\n0,300,20\n", "m.csv:1:14: duplicate column of sensor \"TC2\""),
        ("time_s,TC2_K,notes_K\n0,300,20\n", "m.csv:1:14: unknown sensor \"notes\""),
        ("time_s,TC2_K\n0,300\n5,301\n 4,302\n", "m.csv:4:2: times must increase: 4 s follows 5 s"),
        ("time_s,TC9_K\n0,300\n", "m.csv:1:8: unknown sensor \"TC9\": did you mean"),
        ("time_s,TC2\n0,300\n", "m.csv:1:8: missing unit in heading \"TC2\""),
        ("time_K,TC2_K\n0,300\n", "m.csv:1:1: wrong dimension: expected a time"),
        ("time_s,TC2_K\n0,300,1\n", "m.csv:2:1: found 3 values under 2 headings"),
        ("time_s,TC2_K\n0,-300\n", "m.csv:2:3: -300 K is not above absolute zero"),
        ("time_s,TC2_K,TC2_K\n0,300,300\n", "m.csv:1:14: duplicate column \"TC2_K\""),
        ("time_s,TC2_K\n", "m.csv:1:1: no rows under this heading"),
        ("time_s,TC2_K\n0,\n", "m.csv:1:8: column \"TC2_K\" has no value"),
        ("# by hand\n\ntime_s,TC2_K\n\n# none\n", "m.csv:3:1: no rows under this heading"),
        ("time_s,TC2_K\n0,NaN\n1,na\n", "m.csv:1:8: column \"TC2_K\" has no value"),
        (
            "time_s,TC2_K,TC1_sigma_K\n0,300,2\n",
            "m.csv:1:14: standard deviation without samples: expected a column \"TC1_K\"",
        ),
    ];
    let scratch = Scratch::new("csv");
    let case = VALID_CASE.replace(SAMPLES, "file = \"m.csv\"");
    let path = scratch.write("case.toml", &case);
    for (text, expected) in broken {
        scratch.write("m.csv", text);
        let message = Case::load(&path).expect_err(text).to_string();
        assert!(message.contains(expected), "{expected}: {message}");
    }
    let bare = scratch.write("case.toml", case.replace("sigma = \"2 K\"\n", ""));
    scratch.write("m.csv", "time_s,TC2_K\n0,300\n");
    let message = Case::load(&bare).expect_err("no standard deviation").to_string();
    assert!(message.contains("m.csv:1:8: missing standard deviation: expected a column \"TC2_sigma_K\""), "{message}");
}

#[test]
fn rows_with_a_missing_value_are_skipped_and_carriage_returns_ignored() {
    let scratch = Scratch::new("gaps");
    let case = VALID_CASE.replace(SAMPLES, "file = \"m.csv\"");
    scratch.write("m.csv", "\u{feff}# measured\r\ntime_min,TC2_degC,TC1_K\r\n0,26.85,\r\n1,,305\r\n1.5,36.85,310\r\n");
    let case = Case::load(&scratch.write("case.toml", case)).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(case.observations[0].times_s, [0.0, 90.0]);
    assert_eq!(case.observations[0].temperatures_k, [300.0, 310.0]);
    assert_eq!(case.observations[1].times_s, [60.0, 90.0]);
}

#[test]
fn all_dialects_of_a_table_file_read_the_same() {
    let scratch = Scratch::new("dialects");
    let case = VALID_CASE.replace(SAMPLES, "file = \"m.csv\"");
    let path = scratch.write("case.toml", case);
    let plain = "time_s,TC2_K\n0,300.5\n1,\n2,302.25\n";
    let read = |bytes: &[u8]| {
        std::fs::write(scratch.0.join("m.csv"), bytes).expect("a file is written");
        let case = Case::load(&path).unwrap_or_else(|error| panic!("{error}"));
        (case.observations[0].times_s.clone(), case.observations[0].temperatures_k.clone())
    };
    let expected = (vec![0.0, 2.0], vec![300.5, 302.25]);
    let wide = |order: fn(u16) -> [u8; 2], mark: u16| {
        [mark].into_iter().chain(plain.encode_utf16()).flat_map(order).collect::<Vec<u8>>()
    };
    let dialects: [Vec<u8>; 14] = [
        plain.into(),
        plain.replace(',', "\t").into(),
        plain.replace(',', ";").into(),
        plain.replace(',', ";").replace('.', ",").into(),
        plain.replace('\n', "\r\n").replace("1,", "1,NaN").into(),
        "\u{feff}\"time_s\",\"TC2_K\"\n\"0\",\"300.5\"\n\n1,NA\n2,302.25".into(),
        plain.replace('\n', "\r").replace("0,300.5", "# a remark\r0,300.5").into(),
        "\"time_s\",\"TC2_K\",\n0,300.5,\n,,\n1,n/a,\n2,302.25,,\n".into(),
        "time_s;TC2_K\n0;3005e-1\n+2,0E+00;3,0225e2".into(),
        " time_s ,\tTC2_K\n 0 , 300.5\n2, 302.25 \n".replace('\t', " ").into(),
        "time_s,TC2_K\n0,300.5\n\n   \n2,302.25".into(),
        "\u{feff}time_s;\"TC2_K\"\r\n0;300,5\r\n2;302,25".into(),
        wide(u16::to_le_bytes, 0xfeff),
        wide(u16::to_be_bytes, 0xfeff),
    ];
    for dialect in dialects {
        assert_eq!(read(&dialect), expected, "{}", String::from_utf8_lossy(&dialect));
    }
}

#[test]
fn a_separator_inside_a_quoted_heading_is_part_of_it() {
    let scratch = Scratch::new("quoted-headings");
    scratch.write("q.csv", "time_s,\"gauge; left, old\",\"q, new_w_cm2\"\n0,none,1\n100,\"7;8\",2\n");
    let case = |column: &str| {
        let flux = format!("{{ file = \"q.csv\", column = {column:?} }}");
        let start = VALID_CASE.find("flux = ").expect("a flux") + "flux = ".len();
        let end = start + VALID_CASE[start..].find('\n').expect("a line");
        Case::load(&scratch.write("case.toml", format!("{}{flux}{}", &VALID_CASE[..start], &VALID_CASE[end..])))
    };
    let read = case("q, new_w_cm2").unwrap_or_else(|error| panic!("{error}"));
    let crate::case::Face::Open(face) = &read.exposure.hot_face else { panic!("an open face") };
    assert_eq!((&face.flux_w_m2.times_s[..], &face.flux_w_m2.values[..]), (&[0.0, 100.0][..], &[1e4, 2e4][..]));
    let message = case("q").expect_err("no such column").to_string();
    assert!(
        message.contains("has no column \"q\"") && message.contains("known: q, new_w_cm2, gauge; left, old"),
        "{message}"
    );
    scratch.write("q.csv", "time_s,q_w_m2,q_w_cm2\n0,1,1\n100,1,2\n");
    let message = case("q").expect_err("two columns").to_string();
    assert!(message.contains("has several columns \"q\": choose one of q_w_m2, q_w_cm2"), "{message}");
}

#[test]
fn at_most_ten_errors_of_a_column_are_reported_each_at_its_line() {
    let scratch = Scratch::new("many-errors");
    let case = scratch.write("case.toml", VALID_CASE.replace(SAMPLES, "file = \"m.csv\""));
    let rows: String = (0..1000).map(|row| format!("{row},{}\n", if row < 20 { "300" } else { "x" })).collect();
    scratch.write("m.csv", format!("# a remark\ntime_s,TC2_K\n{rows}"));
    let errors = Case::load(&case).expect_err("cells that are not numbers").diagnostics;
    let lines: Vec<usize> = errors.iter().filter_map(|fault| Some(fault.location.line_column?.0)).collect();
    assert_eq!(lines, (23..33).collect::<Vec<usize>>());
}
