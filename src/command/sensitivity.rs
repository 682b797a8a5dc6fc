//! `bondline sensitivity`: derivatives by the factors, and which can be estimated together.

use crate::command::args::convert;
use crate::command::args::{Ask, Method, Trusted};
use crate::command::exit::{Ending, Failure};
use crate::command::run::{Run, load};

pub(crate) fn run(ask: &Ask, data: &Trusted, method: Option<Method>, step: Option<f64>) -> Result<Ending, Failure> {
    let options = convert::sensitivity(data, method, step)?;
    let case = load(&ask.case, &ask.on)?;
    options.check(&case)?;
    let mut run = Run::of("sensitivity", ask, case)?;
    run.session.sensitivity(&options)?;
    run.end(None)
}
