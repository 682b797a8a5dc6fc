//! The case file of `bondline design`: the case with the thermocouples of the best design.

use crate::case::{Case, toml_string};
use crate::command::exit::{Failure, input};
use crate::report::files::OutputFolder;
use crate::session::Answers;
use crate::study::experiment_design::{ExperimentDesign, Scenario};
use std::fmt::Write as _;
use std::path::Path;

/// Write the case file of the best exposure of a design into the folder of its report. `path` is that of the case.
pub(crate) fn write_design(answers: &Answers, path: &Path, folder: &mut OutputFolder) -> Result<(), Failure> {
    let Some(found) = &answers.experiment_design else { return Ok(()) };
    let best = &found.scenarios[0];
    let (case, path) = match best.case {
        0 => (&answers.case, path),
        other => (&answers.other_cases[other - 1], found.request.question.others[other - 1].path()),
    };
    let file = if path.is_dir() { path.join("case.toml") } else { path.to_owned() };
    let text = std::fs::read_to_string(&file).map_err(|error| input(format!("reading {file:?} back: {error}")))?;
    let text = case_file(&text, &file, case, found, best);
    let written = folder.reserve("design.toml")?;
    std::fs::write(&written, text).map_err(|error| input(format!("writing {written:?}: {error}")))
}

/// Tables of a case file that belong to the sensors of the case.
const REPLACED: [&str; 3] = ["sensor", "observations", "estimate"];

/// The case file with the thermocouples and factors of the design, and without observations.
fn case_file(text: &str, path: &Path, case: &Case, found: &ExperimentDesign, best: &Scenario) -> String {
    let mut out = format!(
        "# The design of `bondline design` for {}, without changes by --set.\n# Put it into the folder of {}, from \
         which tables and materials are read.\n",
        toml_string(case.id()),
        toml_string(&path.display().to_string())
    );
    out.push_str(&without_tables(text, &REPLACED));
    for (place, &index) in best.designs[0].candidates.iter().enumerate() {
        let candidate = &best.candidates[index];
        let depth = match candidate.is_interface {
            true => format!("below = {}", toml_string(&case.layup().plies[candidate.ply].name)),
            false => format!("depth = \"{:.4} mm\"", 1e3 * candidate.depth_m),
        };
        let _ = write!(out, "\n[[sensor]]\nname = \"TC{}\"\n{depth}\n", place + 1);
    }
    let _ = write!(out, "\n[estimate]\nfactors = {:?}\n", found.request.question.factors);
    out
}

/// A TOML text without the tables of these names and their sub-tables, under headers or inline.
fn without_tables(text: &str, names: &[&str]) -> String {
    let is_named = |path: &str| {
        let first = path.split('.').next().unwrap_or_default();
        names.contains(&first.trim().trim_matches(['"', '\'']))
    };
    let (mut out, mut is_dropped, mut has_header) = (String::new(), false, false);
    // An open value: brackets that are not closed, or a text between three quotes.
    let (mut depth, mut is_in_text) = (0, false);
    for line in text.lines() {
        let code = line.trim().split('#').next().unwrap_or_default().trim();
        if depth == 0 && !is_in_text {
            if code.starts_with('[') {
                has_header = true;
                is_dropped = is_named(code.trim_matches(['[', ']']));
            } else if !has_header {
                is_dropped = code.split_once('=').is_some_and(|(path, _)| is_named(path));
            }
        }
        let is_of_text = is_in_text || line.contains("\"\"\"") || line.contains("'''");
        is_in_text ^= (line.matches("\"\"\"").count() + line.matches("'''").count()) % 2 == 1;
        depth += if is_of_text { 0 } else { open_brackets(line) };
        if !is_dropped {
            out.push_str(line);
            out.push('\n');
        }
    }
    out.trim_end().to_owned() + "\n"
}

/// Brackets that a line opens, less those that it closes, outside texts and the comment.
fn open_brackets(line: &str) -> i32 {
    let (mut depth, mut quote, mut chars) = (0, None, line.chars());
    while let Some(c) = chars.next() {
        match (quote, c) {
            (Some('"'), '\\') => drop(chars.next()),
            (Some(open), _) if c == open => quote = None,
            (Some(_), _) => {}
            (None, '"' | '\'') => quote = Some(c),
            (None, '[' | '{') => depth += 1,
            (None, ']' | '}') => depth -= 1,
            (None, '#') => break,
            (None, _) => {}
        }
    }
    depth
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_of_sensors_and_observations_are_left_out_and_others_kept() {
        let text = "name = \"a\"\nnote = \"\"\"\n[sensor]\n\"\"\"\n[[sensor]]\nname = \"TC1\"\n\n[hot_face]\nflux = 1\n\
                    [observations.TC1]\nfile = \"x\"\n[estimate] # of\nfactors = [\n\"f\",\n]\n[back_face]\nkind = 1\n";
        let expected = "name = \"a\"\nnote = \"\"\"\n[sensor]\n\"\"\"\n[hot_face]\nflux = 1\n[back_face]\nkind = 1\n";
        assert_eq!(without_tables(text, &REPLACED), expected);
    }

    #[test]
    fn inline_tables_are_left_out_too() {
        let text = "name = \"a [b\" # [\nsensor = [\n  { name = \"TC1\", depth = \"0 mm\" }, # ]\n\n]\n\
                    estimate.factors = [\"f\"]\n\
                    \"observations\" = { TC1 = [[\"0 s\", \"300 K\"]] }\nply = [{ name = \"A\" }]\n\
                    duration = \"9 s\"\n[hot_face]\nflux = [\n[\"0 s\", \"1 W/m^2\"],\n]\n";
        let expected = "name = \"a [b\" # [\nply = [{ name = \"A\" }]\nduration = \"9 s\"\n[hot_face]\nflux = [\n\
                        [\"0 s\", \"1 W/m^2\"],\n]\n";
        assert_eq!(without_tables(text, &REPLACED), expected);
    }
}
