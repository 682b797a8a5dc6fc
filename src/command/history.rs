//! `bondline history`: the heating of the hot face over time (inverse heat conduction).

use crate::command::args::convert;
use crate::command::args::{CaseArgs, HistoryArgs, ObservationArgs};
use crate::command::exit::{Failure, Output};
use crate::command::run::{Run, load};

/// Run the study. Exit code 1 if the minimisation did not converge.
pub(crate) fn run(args: &CaseArgs, data: &ObservationArgs, history: &HistoryArgs) -> Result<Output, Failure> {
    let options = convert::history(data, history)?;
    let case = load(&args.case, &args.march)?;
    options.check(&case)?;
    let mut run = Run::open("history", args, case)?;
    let found = run.session.history(&options)?;
    run.finish((!found.converged).then(|| format!("no convergence: {}", found.termination)))
}
