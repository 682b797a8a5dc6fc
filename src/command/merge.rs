//! `bondline merge`: the report of a sweep from its parts.

use crate::command::args::MergeArgs;
use crate::command::exit::{Failure, Output};
use crate::command::run::{output_text, print_renamed_keys, too_many_failed};
use bondline::report::files::OutputFolder;
use bondline::session;
use std::path::PathBuf;

pub(crate) fn run(merge: &MergeArgs) -> Result<Output, Failure> {
    let answers = session::merge(&merge.parts, merge.case.as_deref())?;
    print_renamed_keys(answers.case.renamed_keys());
    let id = answers.case.id();
    let out = merge.out.clone().unwrap_or_else(|| PathBuf::from("out").join(id).join("merge"));
    let folder = OutputFolder::open(&out, id, merge.force)?;
    let text = output_text(&answers.report(&folder)?, merge.json, || Ok(answers.summary()))?;
    let failure = answers
        .uncertainty
        .as_ref()
        .and_then(|outcome| too_many_failed(&outcome.failures, outcome.members, merge.max_failed));
    Ok(Output { text, failure })
}
