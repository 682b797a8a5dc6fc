//! `bondline history`: how the hot face was heated.

use crate::command::args::convert;
use crate::command::args::{Ask, Trace, Trusted};
use crate::command::exit::{Ending, Failure, input};
use crate::command::run::{Run, load};
use bondline::session::HistoryOptions;
use bondline::study::history::{Smoothing, Sought};

/// Find what heated a case, and say where the minimisation did not converge.
pub(crate) fn run(ask: &Ask, data: &Trusted, trace: &Trace) -> Result<Ending, Failure> {
    let options = HistoryOptions {
        observations: convert::observations(data)?,
        sought: trace.seek.as_deref().map(sought).transpose()?,
        knots: trace.knots,
        smoothing: smoothing(&trace.smoothing)?,
    };
    let case = load(&ask.case, &ask.on)?;
    options.check(&case)?;
    let mut run = Run::of("history", ask, case)?;
    let found = run.session.history(&options)?;
    run.end((!found.converged).then(|| format!("no convergence: {}", found.termination)))
}

fn smoothing(text: &str) -> Result<Smoothing, Failure> {
    match (text, text.parse::<f64>()) {
        ("discrepancy", _) => Ok(Smoothing::Discrepancy),
        ("l-curve", _) => Ok(Smoothing::LCurve),
        (_, Ok(weight)) if weight.is_finite() && weight >= 0.0 => Ok(Smoothing::Stated(weight)),
        _ => Err(input(format!("--smoothing {text:?}: expected discrepancy, l-curve, or a weight of 0 or more"))),
    }
}

fn sought(text: &str) -> Result<Sought, Failure> {
    let named = Sought::ALL.into_iter().find(|sought| sought.name() == text);
    named.ok_or_else(|| input(format!("--seek {text:?}: expected flux, radiant-flux or gas")))
}
