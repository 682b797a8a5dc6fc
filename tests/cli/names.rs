//! Names that users choose: each is a cell of a table and a word on the screen as it is written, or is refused.

use super::input_errors::refused;
use super::{CASE, run};
use crate::support::Scratch;

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
    let escaped = |c: char| if c.is_control() { format!("\\u{:04x}", u32::from(c)) } else { c.to_string() };
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

#[test]
fn a_name_with_accents_dots_and_spaces_is_in_the_tables_and_on_the_page_as_it_is_written() {
    let scratch = Scratch::new("names-shown");
    for name in ["Flanell größe 2", "felt.v2", "a,b", "日本", "a - b"] {
        for (what, replaced) in [("ply", NAMES[0].1), ("group", NAMES[1].1), ("material", NAMES[4].1)] {
            scratch.write(&format!("c/materials/{name}.toml"), MATERIAL);
            scratch.write("c/case.toml", named(replaced, name));
            run(&scratch, "predict c --out out").succeeded();
            assert!(scratch.read("out/report.html").contains(name), "{what} {name:?}");
        }
    }
}
