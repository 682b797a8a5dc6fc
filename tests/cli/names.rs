//! Names that users choose: each is a cell of a table and a word on the screen as it is written, or is refused.

use super::input_errors::refused;
use super::{CASE, run, run_args};
use crate::support::{Scratch, runs_all};
use parquet::file::reader::{FileReader, SerializedFileReader};
use rayon::prelude::*;
use serde_json::Value;
use std::fs::File;

/// What a key of a case file names, with the text in the case that its value takes the place of.
const NAMES: [(&str, &str); 6] = [
    ("name of a ply", "name = \"BASE\""),
    ("group of a ply", "group = \"OF\""),
    ("name of a sensor", "name = \"TC1\""),
    ("name of a factor", "name = \"f_q\""),
    ("material", "material = \"pyrogel3350\""),
    ("title", "name = \"Two plies\""),
];

/// The case with another value of a key.
fn named(replaced: &str, name: &str) -> String {
    let (key, _) = replaced.split_once(" = ").expect("a key");
    assert_eq!(CASE.matches(replaced).count(), 1, "{replaced}");
    let escaped = |c: char| match c {
        '"' | '\\' => format!("\\{c}"),
        c if c.is_control() => format!("\\u{:04x}", u32::from(c)),
        c => c.to_string(),
    };
    let text: String = name.chars().map(escaped).collect();
    CASE.replacen(replaced, &format!("{key} = \"{text}\""), 1)
}

const MATERIAL: &str = include_str!("../../data/materials/pyrogel3350.toml");

#[test]
fn a_name_that_a_spreadsheet_takes_for_a_formula_or_that_prints_a_line_of_its_own_is_refused() {
    let scratch = Scratch::new("names-refused");
    for (what, replaced) in NAMES {
        for name in
            ["=1+1", "+1", "-1", "@SUM(A1)", " =1+1", "OF\nbondline: all is well", "OF\rX", "OF\tX", "\u{1b}[2J"]
        {
            let begins_a_formula = name.trim_start().starts_with(['=', '+', '-', '@']);
            // A title is in no table.
            if what == "title" && begins_a_formula {
                continue;
            }
            if what == "material" && !name.contains(char::is_control) {
                scratch.write(&format!("c/materials/{name}.toml"), MATERIAL);
            }
            scratch.write("c/case.toml", named(replaced, name));
            let ran = run(&scratch, "predict c");
            let given = scratch.files().len();
            let message = match what {
                "material" if !begins_a_formula => "unknown material",
                _ if begins_a_formula => "expected a name that no spreadsheet takes for a formula",
                _ => "expected one line without control characters",
            };
            assert!(
                ran.stderr.lines().all(|line| !line.starts_with("bondline: all is well")),
                "{what}: {}",
                ran.stderr
            );
            refused(&scratch, ran, given, &[message]);
        }
    }
}

/// Names that are accepted, and hard to carry.
const CARRIED: [&str; 12] = [
    "Flanell größe 2",
    "felt.v2",
    "a,b",
    "日本",
    "a - b",
    "<script>alert(1)</script>",
    "a \"b\" 'c' \\d",
    "a;b|c&amp;%20",
    "\u{202e}abc",
    "..",
    "../../x",
    " padded ",
];

/// A text on a page.
fn escaped(text: &str) -> String {
    let replaced = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    replaced.replace('"', "&quot;").replace('\'', "&#39;")
}

/// Every file below a folder can be read back: tables have rows of one length, JSON and Parquet are valid, and a page
/// has no element of a name. Returns all texts of the tables and of the summaries.
fn read_back(scratch: &Scratch, folder: &str) -> Vec<String> {
    fn texts(value: &Value, found: &mut Vec<String>) {
        match value {
            Value::String(text) => found.push(text.clone()),
            Value::Array(values) => values.iter().for_each(|value| texts(value, found)),
            Value::Object(entries) => entries.iter().for_each(|(key, value)| {
                found.push(key.clone());
                texts(value, found);
            }),
            _ => {}
        }
    }
    let mut found = Vec::new();
    for path in scratch.files().into_iter().filter(|path| path.starts_with(folder)) {
        let name = path.display().to_string();
        let whole = scratch.path().join(&path);
        match path.extension().and_then(|ending| ending.to_str()) {
            Some("csv") => {
                let mut reader = csv::ReaderBuilder::new().has_headers(false).from_path(&whole).expect("a table");
                for row in reader.records() {
                    let row = row.unwrap_or_else(|error| panic!("{name}: {error}"));
                    found.extend(row.iter().map(str::to_owned));
                }
            }
            Some("json") => {
                let value =
                    serde_json::from_str(&scratch.read(&name)).unwrap_or_else(|error| panic!("{name}: {error}"));
                texts(&value, &mut found);
            }
            Some("parquet") => {
                let file = File::open(&whole).expect("a file");
                let reader = SerializedFileReader::new(file).unwrap_or_else(|error| panic!("{name}: {error}"));
                let schema = reader.metadata().file_metadata().schema_descr_ptr();
                found.extend(schema.columns().iter().map(|column| column.name().to_owned()));
            }
            Some("html" | "svg") => {
                assert!(!scratch.read(&name).contains("<script>alert"), "{name} has an element of a name");
            }
            _ => {}
        }
    }
    found
}

#[test]
fn a_name_that_is_accepted_is_carried_to_every_file_as_it_is_written() {
    let names = if runs_all() { &CARRIED[..] } else { &CARRIED[4..9] };
    names.par_iter().enumerate().for_each(|(index, name)| {
        let scratch = Scratch::new(&format!("names-carried-{index}"));
        for (what, replaced) in [NAMES[0], NAMES[1], NAMES[4], NAMES[5]] {
            // A path is no name of a file.
            let is_path = name.contains('/') || *name == "..";
            if what == "material" && is_path {
                scratch.write("c/case.toml", named(replaced, name));
                run(&scratch, "predict c").exited_with(2).with_stderr(&["unknown material"]);
                continue;
            }
            if what == "material" {
                scratch.write(&format!("c/materials/{name}.toml"), MATERIAL);
            }
            scratch.write("c/case.toml", named(replaced, name));
            run(&scratch, "uncertainty c -n 8 --keep members --depth-profiles 10s --force --out out").succeeded();
            let page = scratch.read("out/report.html");
            assert!(page.contains(&escaped(name.trim())), "{what} {name:?}");
            read_back(&scratch, "out");
            let design = "design c --estimate f_q --sensors 2 -n 4 --noise 1K --force --out out";
            run(&scratch, design).succeeded();
            read_back(&scratch, "out");
            // The case of a design is read with the names of the case.
            scratch.write("c/design.toml", scratch.read("out/design.toml"));
            run(&scratch, "predict c/design.toml --force --out out").succeeded();
            assert!(scratch.read("out/report.html").contains(&escaped(name.trim())), "{what} {name:?}");
        }
        // The folder of a case is its name in the report, in names of files, and in the file of a design.
        if !name.contains('/') && *name != ".." {
            scratch.write(&format!("{name}/case.toml"), CASE);
            let ran = |line: &str| {
                let words = line.split(' ').map(|word| if word == "CASE" { *name } else { word });
                run_args(&scratch, &words.collect::<Vec<_>>()).succeeded()
            };
            ran("uncertainty CASE -n 8 --members 0..4 --out parts");
            ran("uncertainty CASE -n 8 --members 4..8 --out parts");
            ran("merge parts --out merged");
            ran("design CASE --estimate f_q --sensors 1 -n 4 --noise 1K --out designed");
            assert!(read_back(&scratch, "merged").contains(&(*name).to_owned()), "{name:?}");
            scratch.write(&format!("{name}/design.toml"), scratch.read("designed/design.toml"));
            run_args(&scratch, &["predict", &format!("{name}/design.toml"), "--out", "again"]).succeeded();
        }
    });
}

#[test]
fn a_name_that_is_empty_too_long_or_no_name_of_a_column_is_refused() {
    let scratch = Scratch::new("names-wrong");
    for (what, replaced) in NAMES {
        for (name, message) in [
            ("", "expected text, found none"),
            (" ", "expected text, found none"),
            ("\0", "expected one line without control characters"),
            (&*"é".repeat(51), "expected at most 100 bytes of a name that a case chooses, found 102"),
        ] {
            if what == "title" && name.len() > 2 {
                continue;
            }
            let message = if what == "material" && !name.trim().is_empty() { "unknown material" } else { message };
            scratch.write("c/case.toml", named(replaced, name));
            refused(&scratch, run(&scratch, "predict c"), 1, &[message]);
        }
    }
    for (what, replaced) in [NAMES[2], NAMES[3]] {
        for name in
            CARRIED.iter().filter(|name| name.contains(|c: char| !c.is_ascii_alphanumeric() && !"._-".contains(c)))
        {
            scratch.write("c/case.toml", named(replaced, name));
            let ran = run(&scratch, "predict c");
            refused(&scratch, ran, 1, &["expected letters, digits"]);
            assert!(!what.is_empty());
        }
    }
}
