//! `bondline history`: the heating of the hot face over time (inverse heat conduction).

use crate::command::args::convert;
use crate::command::args::{CaseArgs, HistoryArgs, ObservationArgs};
use crate::command::exit::{Failure, Output, input};
use crate::command::run::{Run, load};
use bondline::session::HistoryOptions;
use bondline::study::flux_inversion::{HeatingQuantity, Smoothing};

/// Run the study. Exit code 1 if the minimisation did not converge.
pub(crate) fn run(args: &CaseArgs, data: &ObservationArgs, history: &HistoryArgs) -> Result<Output, Failure> {
    let options = HistoryOptions {
        observations: convert::observations(data)?,
        quantity: history.quantity.as_deref().map(quantity).transpose()?,
        knots: history.knots,
        smoothing: smoothing(&history.smoothing)?,
    };
    let case = load(&args.case, &args.march)?;
    options.check(&case)?;
    let mut run = Run::open("history", args, case)?;
    let found = run.session.history(&options)?;
    run.finish((!found.converged).then(|| format!("no convergence: {}", found.termination)))
}

fn smoothing(text: &str) -> Result<Smoothing, Failure> {
    match (text, text.parse::<f64>()) {
        ("discrepancy", _) => Ok(Smoothing::Discrepancy),
        ("l-curve", _) => Ok(Smoothing::LCurve),
        (_, Ok(weight)) if weight.is_finite() && weight >= 0.0 => Ok(Smoothing::Stated(weight)),
        _ => Err(input(format!("--smoothing {text:?}: expected discrepancy, l-curve, or a weight of 0 or more"))),
    }
}

fn quantity(text: &str) -> Result<HeatingQuantity, Failure> {
    let named = HeatingQuantity::ALL.into_iter().find(|sought| sought.name() == text);
    named.ok_or_else(|| input(format!("--quantity {text:?}: expected flux, radiant-flux or gas")))
}
