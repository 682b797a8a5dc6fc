//! `size`: how thick a ply must be.

use crate::command::args::convert;
use crate::command::args::{Limit, Sweep};
use crate::command::exit::{Failure, input};
use bondline::case::{Bounds, Case};
use bondline::march::March;
use bondline::study::proportion::fewest_draws;
use bondline::study::size::{SizeError, Sizing, size};

/// Size the ply, and say where more members failed than are put up with.
pub(crate) fn sized(
    case: &Case,
    march: &mut dyn March,
    limit: &Limit,
    sweep: &Sweep,
) -> Result<(Sizing, Option<String>), Failure> {
    let demand = convert::demand(case, limit)?;
    let fewest = fewest_draws(demand.probability);
    if sweep.members < fewest.max(2) {
        return Err(input(format!(
            "-n {}: a probability of {} takes at least {} members: of fewer the chance is above 2.5 % that none is among \
             those that need more",
            sweep.members,
            demand.probability,
            fewest.max(2)
        )));
    }
    let bounds = sweep.spread.map_or(Bounds::Small, convert::bounds);
    let sizing =
        size(case, march, &demand, bounds, &convert::sampling(sweep), sweep.members).map_err(|error| match error {
            SizeError::March(error) => error.into(),
            other => input(other),
        })?;
    let failed: usize = sizing.failures.iter().map(|failure| failure.members).sum();
    let most = sweep.max_failed.unwrap_or(sizing.members / 100);
    let why = (failed > most).then(|| format!("{failed} members failed, more than the {most} put up with"));
    Ok((sizing, why))
}
