//! `bondline observations`: what was read of the measured data.

use crate::command::args::CaseArgs;
use crate::command::exit::{Failure, Output, input};
use crate::command::run::{Run, load};

pub(crate) fn run(args: &CaseArgs) -> Result<Output, Failure> {
    if let Some(time) = &args.limit_time {
        return Err(input(format!(
            "--limit-time {time:?} has no effect: observations are read, and nothing is marched"
        )));
    }
    let mut run = Run::open("observations", args, load(&args.case, &args.march)?)?;
    run.session.observations()?;
    run.finish(None)
}
