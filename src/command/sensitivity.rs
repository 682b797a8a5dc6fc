//! `bondline sensitivity`: derivatives with respect to the factors, and which factors can be estimated together.

use crate::command::args::convert;
use crate::command::args::{CaseArgs, DerivativeArg, ObservationArgs};
use crate::command::exit::{Failure, Output};
use crate::command::run::{Run, load};

pub(crate) fn run(
    args: &CaseArgs,
    data: &ObservationArgs,
    method: Option<DerivativeArg>,
    step: Option<f64>,
) -> Result<Output, Failure> {
    let options = convert::sensitivity(data, method, step)?;
    let case = load(&args.case, &args.march)?;
    options.check(&case)?;
    let mut run = Run::open("sensitivity", args, case)?;
    run.session.sensitivity(&options)?;
    run.finish(None)
}
