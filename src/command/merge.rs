//! `bondline merge`: the report of a sweep from its parts.

use crate::command::args::MergeArgs;
use crate::command::exit::{Failure, Output, input, unusable_folder};
use crate::command::run::{command_line, exit_reason, output_text, print_renamed_files, too_many_failed};
use crate::kept_work::sweep_piece::equal_piece;
use crate::report::files::{OutputFolder, check_writable};
use crate::session::{self, MissingMembers};
use std::fs::DirEntry;
use std::ops::Range;
use std::path::PathBuf;

pub(crate) fn run(merge: &MergeArgs) -> Result<Output, Failure> {
    if merge.missing {
        return missing(merge);
    }
    if let Some(out) = &merge.out {
        check_writable(out).map_err(unusable_folder)?;
    }
    let mut answers = session::merge(&files(&merge.parts)?, merge.case.as_deref())?;
    answers.run.command_line = Some(command_line());
    let id = answers.case.id();
    let out = merge.out.clone().unwrap_or_else(|| PathBuf::from("out").join(id).join("merge"));
    let folder = OutputFolder::open(&out, id, merge.force).map_err(unusable_folder)?;
    let files = answers.report(&folder)?;
    print_renamed_files(&folder);
    let text = output_text(&files, merge.json, || Ok(answers.summary()))?;
    let failure = answers
        .uncertainty
        .as_ref()
        .and_then(|outcome| too_many_failed(&outcome.failures, outcome.members, merge.max_failed))
        .or_else(|| exit_reason(&answers));
    Ok(Output { text, failure })
}

/// The files, and those of the folders, whose names end in `.json`.
fn files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut found = Vec::new();
    for path in paths {
        if !path.is_dir() {
            found.push(path.clone());
            continue;
        }
        let unreadable = |error| input(format!("{}: {error}", path.display()));
        let entries =
            std::fs::read_dir(path).map_err(unreadable)?.collect::<Result<Vec<_>, _>>().map_err(unreadable)?;
        let pieces =
            entries.iter().map(DirEntry::path).filter(|file| file.extension().is_some_and(|end| end == "json"));
        let before = found.len();
        found.extend(pieces);
        if found.len() == before {
            return Err(input(format!("{}: no files of pieces (.json) in this folder", path.display())));
        }
        found[before..].sort();
    }
    Ok(found)
}

/// List the members that no file has, as the options of the next commands: tasks of a job array where the files are
/// equal pieces. Exit code 1 if there are any.
fn missing(merge: &MergeArgs) -> Result<Output, Failure> {
    let MissingMembers { ranges, members, equal_pieces, .. } = session::missing_members(&files(&merge.parts)?)?;
    if ranges.is_empty() {
        return Ok(Output { text: format!("the files have all {members} members\n"), failure: None });
    }
    let text = match equal_pieces {
        Some(pieces) => format!("missing: --array={} of {pieces} pieces\n", tasks(&ranges, pieces, members)),
        None => ranges.iter().map(|range| format!("missing: --members {}..{}\n", range.start, range.end)).collect(),
    };
    let count: usize = ranges.iter().map(Range::len).sum();
    Ok(Output { text, failure: Some(format!("{count} of {members} members are in no file")) })
}

/// The numbers of the equal pieces that have members in these ranges, such as `3,7-9`.
fn tasks(ranges: &[Range<usize>], pieces: usize, members: usize) -> String {
    let lacks = |number: &usize| {
        equal_piece(*number, pieces, members).is_some_and(|piece| {
            let next = ranges.partition_point(|range| range.end <= piece.start);
            ranges.get(next).is_some_and(|range| range.start < piece.end)
        })
    };
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for number in (1..=pieces).filter(lacks) {
        match runs.last_mut() {
            Some((_, last)) if *last + 1 == number => *last = number,
            _ => runs.push((number, number)),
        }
    }
    let words =
        runs.iter().map(|(first, last)| if first == last { format!("{first}") } else { format!("{first}-{last}") });
    words.collect::<Vec<_>>().join(",")
}
