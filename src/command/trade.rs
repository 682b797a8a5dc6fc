//! `bondline trade`: the layups of all choices of materials, each sized for a temperature limit, by mass.

use crate::command::args::convert;
use crate::command::args::{CaseArgs, ResumeArgs, SweepArgs, TradeArgs};
use crate::command::exit::{Failure, Output};
use crate::command::run::{Run, load, load_all, too_many_failed};
use std::path::PathBuf;

/// Run the study. Exit code 1 if more members of a layup failed than are allowed.
pub(crate) fn run(
    args: &CaseArgs,
    exposures: &[PathBuf],
    trade: &TradeArgs,
    sweep: &SweepArgs,
    resume: &ResumeArgs,
) -> Result<Output, Failure> {
    let case = load(&args.case, &args.march)?;
    let options = convert::trade(trade, sweep, &case, load_all(exposures.iter(), &args.march)?)?;
    options.check(&case)?;
    let mut run = Run::open_resumable("trade", args, case, resume)?;
    let found = run.session.trade(&options)?;
    let failure = found.layups.iter().find_map(|layup| {
        let reason = too_many_failed(&layup.failures, found.members, sweep.max_failed)?;
        Some(format!("{}: {reason}", found.materials_of(layup).join(", ")))
    });
    run.finish(failure)
}
