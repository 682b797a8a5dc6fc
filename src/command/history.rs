//! `history`: how the hot face was heated.

use crate::command::args::{Trace, Trusted};
use crate::command::exit::{Failure, input};
use bondline::case::Case;
use bondline::march::March;
use bondline::study::history::{History, HistoryError, Smoothing, Sought, Wanted, history};

/// Find what heated a case from the data that it trusts, and say where it is not the one that meets them best.
pub(crate) fn found(
    case: &Case,
    march: &mut dyn March,
    data: &Trusted,
    trace: &Trace,
) -> Result<(History, Option<String>), Failure> {
    if data.bounds.is_some() {
        return Err(input("--bounds: a history estimates no factor; what is sought is kept from falling below zero"));
    }
    let sought = trace.seek.as_deref().map(sought).transpose()?;
    let wanted = Wanted { sought, knots: trace.knots, smoothing: smoothing(&trace.smoothing)? };
    let found = history(case, march, &wanted).map_err(|error| match error {
        HistoryError::March(error) => error.into(),
        other => input(other),
    })?;
    let failed = (!found.converged).then(|| format!("no convergence: {}", found.termination));
    Ok((found, failed))
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
