//! `bondline observations`: what was read of the measured data.

use crate::command::args::CaseArgs;
use crate::command::exit::{Failure, Output};
use crate::command::run::{Run, load};

pub(crate) fn run(args: &CaseArgs) -> Result<Output, Failure> {
    let mut run = Run::open("observations", args, load(&args.case, &args.march)?)?;
    run.session.observations()?;
    run.finish(None)
}
