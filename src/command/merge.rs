//! `bondline merge`: pieces of a sweep put together.

use crate::command::args::Merge;
use crate::command::exit::{Ending, Failure};
use crate::command::run::{output_text, too_many_failed};
use bondline::report::files::OutputFolder;
use bondline::session;
use std::path::PathBuf;

pub(crate) fn run(merge: &Merge) -> Result<Ending, Failure> {
    let answers = session::merge(&merge.pieces, merge.case.as_deref())?;
    let id = answers.case.id();
    let out = merge.out.clone().unwrap_or_else(|| PathBuf::from("out").join(id).join("merge"));
    let folder = OutputFolder::open(&out, id, merge.force)?;
    let text = output_text(&answers.report(&folder)?, merge.json, || Ok(answers.summary()))?;
    let why = answers.uncertainty.as_ref().and_then(|outcome| too_many_failed(outcome, merge.max_failed));
    Ok(Ending { text, why })
}
