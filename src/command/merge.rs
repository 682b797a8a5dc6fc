//! `bondline merge`: the report of a sweep from its parts.

use crate::command::args::{MergeArgs, convert};
use crate::command::exit::{Failure, Output, unusable_folder};
use crate::command::run::{check_writable, output_text, print_renamed_keys, too_many_failed};
use bondline::report::files::OutputFolder;
use bondline::session::{self, MissingMembers};
use std::ops::Range;
use std::path::PathBuf;

pub(crate) fn run(merge: &MergeArgs) -> Result<Output, Failure> {
    if merge.missing {
        return missing(merge);
    }
    if let Some(out) = &merge.out {
        check_writable(out)?;
    }
    let mut answers = session::merge(&merge.parts, merge.case.as_deref())?;
    answers.run.command_line = Some(convert::command_line());
    print_renamed_keys(answers.case.renamed_keys());
    let id = answers.case.id();
    let out = merge.out.clone().unwrap_or_else(|| PathBuf::from("out").join(id).join("merge"));
    let folder = OutputFolder::open(&out, id, merge.force).map_err(unusable_folder)?;
    let text = output_text(&answers.report(&folder)?, merge.json, || Ok(answers.summary()))?;
    let failure = answers
        .uncertainty
        .as_ref()
        .and_then(|outcome| too_many_failed(&outcome.failures, outcome.members, merge.max_failed));
    Ok(Output { text, failure })
}

/// List the members that no file has. Exit code 1 if there are any.
fn missing(merge: &MergeArgs) -> Result<Output, Failure> {
    let MissingMembers { ranges, members, .. } = session::missing_members(&merge.parts)?;
    if ranges.is_empty() {
        return Ok(Output { text: format!("the files have all {members} members\n"), failure: None });
    }
    let lines = ranges.iter().map(|range| format!("missing: --members {}..{}\n", range.start, range.end)).collect();
    let count: usize = ranges.iter().map(Range::len).sum();
    Ok(Output { text: lines, failure: Some(format!("{count} of {members} members are in no file")) })
}
