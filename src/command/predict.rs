//! `bondline predict`: the case at its nominal factors.

use crate::command::args::CaseArgs;
use crate::command::exit::{Failure, Output};
use crate::command::run::{Run, load};

pub(crate) fn run(args: &CaseArgs) -> Result<Output, Failure> {
    let mut run = Run::open("predict", args, load(&args.case, &args.march)?)?;
    run.session.predict()?;
    run.finish(None)
}
