//! `bondline repeat`: the question of a report, asked again.

use crate::command::args::{CaseArgs, MarchArgs, RepeatArgs};
use crate::command::ask::{self, Extras};
use crate::command::exit::{Failure, Output, input};
use crate::command::terminal::print_error;
use crate::question::QuestionRecord;
use std::path::{Path, PathBuf};

/// Ask the question again of the case as it was, and compare the tables and figures. Exit code 1 if one differs.
pub(crate) fn run(args: &RepeatArgs) -> Result<Output, Failure> {
    let file = args.folder.join("question.toml");
    let text = std::fs::read_to_string(&file).map_err(|error| input(format!("{}: {error}", file.display())))?;
    let record = QuestionRecord::from_toml(&text).map_err(|message| input(format!("{}: {message}", file.display())))?;
    let changed = record.changed_files();
    if !changed.is_empty() {
        return Err(input(format!("the case is not as it was: {}", changed.join("; "))));
    }
    if record.version != env!("CARGO_PKG_VERSION") && !args.quiet {
        print_error(&format!("note: the report is by version {} of bondline", record.version));
    }
    let out = args.out.clone().unwrap_or_else(|| {
        let name = args.folder.file_name().unwrap_or_default().to_string_lossy();
        args.folder.with_file_name(format!("{name}-repeated"))
    });
    let march = MarchArgs {
        backend: record.session.march.clone(),
        tolerance_k: record.session.tolerance_k,
        sets: record.set.iter().map(|(name, value)| format!("{name}={value}")).collect(),
        quiet: args.quiet,
    };
    let case = CaseArgs {
        case: record.case.clone(),
        out: Some(out.clone()),
        force: args.force,
        json: false,
        limit_time_s: None,
        march,
    };
    let Output { text, failure } = ask::run(&case, record.question, &Extras::default())?;
    let files = tables_and_figures(&out)?;
    let is_same = |name: &PathBuf| {
        let read = |folder: &Path| std::fs::read(folder.join(name)).ok();
        read(&args.folder) == read(&out)
    };
    let different: Vec<String> =
        files.iter().filter(|name| !is_same(name)).map(|name| name.display().to_string()).collect();
    if different.is_empty() {
        let text = format!("{text}the same as in {}: all {} tables and figures\n", args.folder.display(), files.len());
        return Ok(Output { text, failure });
    }
    let differs = format!(
        "{} of {} tables and figures differ from those in {}: {}",
        different.len(),
        files.len(),
        args.folder.display(),
        different.join(", ")
    );
    Ok(Output { text, failure: Some(differs) })
}

/// The files of a report whose bytes depend on the answer alone, relative to its folder.
fn tables_and_figures(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let mut found = Vec::new();
    for folder_of_files in [folder.to_owned(), folder.join("figures")] {
        let unreadable = |error| input(format!("{}: {error}", folder_of_files.display()));
        let entries = match std::fs::read_dir(&folder_of_files) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => continue,
            entries => entries.map_err(unreadable)?,
        };
        for entry in entries {
            let path = entry.map_err(unreadable)?.path();
            let is_compared = path.extension().is_some_and(|ending| ending == "csv" || ending == "svg");
            found.extend(path.strip_prefix(folder).ok().filter(|_| is_compared).map(Path::to_owned));
        }
    }
    found.sort();
    Ok(found)
}
