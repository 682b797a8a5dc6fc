//! `bondline size`: how thick a ply must be.

use crate::command::args::convert;
use crate::command::args::{Ask, Limit, Sweep};
use crate::command::exit::{Ending, Failure};
use crate::command::run::{Run, load};

/// Size the ply, and say where more members failed than are put up with.
pub(crate) fn run(ask: &Ask, limit: &Limit, sweep: &Sweep) -> Result<Ending, Failure> {
    let options = convert::size(limit, sweep)?;
    let case = load(&ask.case, &ask.on)?;
    options.check(&case)?;
    let mut run = Run::of("size", ask, case)?;
    let sizing = run.session.size(&options)?;
    let failed: usize = sizing.failures.iter().map(|failure| failure.members).sum();
    let most = sweep.max_failed.unwrap_or(sizing.members / 100);
    run.end((failed > most).then(|| format!("{failed} members failed, more than the {most} put up with")))
}
