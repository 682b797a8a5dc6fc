//! `bondline size`: the thickness of a ply for a temperature limit.

use crate::command::args::convert;
use crate::command::args::{CaseArgs, ResumeArgs, SizeArgs, SweepArgs};
use crate::command::exit::{Failure, Output};
use crate::command::run::{Run, load, too_many_failed};

/// Run the study. Exit code 1 if more members failed than are allowed.
pub(crate) fn run(args: &CaseArgs, size: &SizeArgs, sweep: &SweepArgs, resume: &ResumeArgs) -> Result<Output, Failure> {
    let case = load(&args.case, &args.march)?;
    let options = convert::size(size, sweep, &case)?;
    options.check(&case)?;
    let mut run = Run::open_resumable("size", args, case, resume)?;
    let sizing = run.session.size(&options)?;
    run.finish(too_many_failed(&sizing.failures, sizing.members, sweep.max_failed))
}
