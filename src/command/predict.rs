//! `bondline predict`: the case at its nominal factors.

use crate::command::args::Ask;
use crate::command::exit::{Ending, Failure};
use crate::command::run::{Run, load};

pub(crate) fn run(ask: &Ask) -> Result<Ending, Failure> {
    let mut run = Run::of("predict", ask, load(&ask.case, &ask.on)?)?;
    run.session.predict()?;
    run.end(None)
}
