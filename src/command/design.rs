//! `bondline design`: the thermocouples, the exposure and the run length from which factors are estimated best.

use crate::case::Case;
use crate::command::args::convert;
use crate::command::args::{CaseArgs, DesignArgs};
use crate::command::exit::{Failure, Output, input};
use crate::command::run::{Run, load, load_all};
use crate::study::experiment_design::{ExperimentDesign, Scenario};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

pub(crate) fn run(args: &CaseArgs, others: &[PathBuf], design: &DesignArgs) -> Result<Output, Failure> {
    let case = load(&args.case, &args.march)?;
    let options = convert::design(design, load_all(others.iter(), &args.march)?)?;
    if let Some(other) = options.others.iter().find(|other| other.id() == case.id()) {
        return Err(input(format!("two cases are called {:?}: give each exposure once", other.id())));
    }
    options.check(&case)?;
    let mut run = Run::open("design", args, case)?;
    let found = run.session.design(&options)?;
    let best = &found.scenarios[0];
    let (case, path) = match best.case {
        0 => (run.session.case().clone(), &args.case),
        other => (options.others[other - 1].clone(), &others[other - 1]),
    };
    let file = if path.is_dir() { path.join("case.toml") } else { path.clone() };
    let text = std::fs::read_to_string(&file).map_err(|error| input(format!("reading {file:?} back: {error}")))?;
    let text = case_file(&text, &file, &case, &found, best);
    let written = run.folder.reserve("design.toml")?;
    std::fs::write(&written, text).map_err(|error| input(format!("writing {written:?}: {error}")))?;
    run.finish(None)
}

/// Tables of a case file that belong to the sensors of the case.
const REPLACED: [&str; 3] = ["sensor", "observations", "estimate"];

/// The case file with the thermocouples and factors of the design, and without observations.
fn case_file(text: &str, path: &Path, case: &Case, found: &ExperimentDesign, best: &Scenario) -> String {
    let mut out = format!(
        "# The design of `bondline design` for {}, without changes by --set.\n# Put it into the folder of {}, from \
         which tables and materials are read.\n",
        case.id(),
        path.display()
    );
    out.push_str(&without_tables(text, &REPLACED));
    for (place, &index) in best.designs[0].candidates.iter().enumerate() {
        let candidate = &best.candidates[index];
        let depth = match candidate.is_interface {
            true => format!("below = {:?}", case.layup().plies[candidate.ply].name),
            false => format!("depth = \"{:.4} mm\"", 1e3 * candidate.depth_m),
        };
        let _ = write!(out, "\n[[sensor]]\nname = \"TC{}\"\n{depth}\n", place + 1);
    }
    let _ = write!(out, "\n[estimate]\nfactors = {:?}\n", found.request.factors);
    out
}

/// A TOML text without the tables of these names and their sub-tables.
fn without_tables(text: &str, names: &[&str]) -> String {
    let (mut out, mut is_dropped, mut is_in_text) = (String::new(), false, false);
    for line in text.lines() {
        let header = line.trim().split('#').next().unwrap_or_default().trim();
        let is_header = !is_in_text && header.starts_with('[') && header.ends_with(']') && !header.contains([',', '=']);
        if is_header {
            let name = header.trim_matches(['[', ']']).split('.').next().unwrap_or_default().trim();
            is_dropped = names.contains(&name);
        }
        // A text of several lines begins and ends with three quotes.
        is_in_text ^= line.matches("\"\"\"").count() % 2 == 1;
        if !is_dropped {
            out.push_str(line);
            out.push('\n');
        }
    }
    out.trim_end().to_owned() + "\n"
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
}
