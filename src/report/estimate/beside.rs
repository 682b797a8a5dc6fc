//! Another case fitted to the same observations.

mod figures;

pub(super) use figures::figures;

use crate::case::Case;
use crate::report::files::json::Named;
use crate::report::html::table::{paragraph, table};
use crate::report::words;
use crate::study::answers::Answers;
use crate::study::beside::{Beside, Left};
use serde::Serialize;

/// What the physics of the case beside explains of the misfit in cool-down, at the deepest thermocouple observed.
pub(super) fn explained(answers: &Answers, outcome: &Beside) -> String {
    let Some(left) = outcome.left.last() else { return "Nothing is observed.".to_owned() };
    let [first_k, other_k] = left.cooling_k.map(words::misfit);
    let head = format!(
        "From {} on, when the hot face is heated no more, {} is off by {first_k} (root mean square) as {} fits and by \
         {other_k} as {} does",
        words::seconds(outcome.cooling_s),
        answers.case.sensors[left.sensor].name,
        answers.case.id,
        outcome.id
    );
    let share = left.explained();
    if !share.is_finite() {
        return format!("{head}.");
    }
    if share > 0.0 {
        format!(
            "{head}: what the latter has and the former has not explains {:.0} % of the mean square misfit.",
            100.0 * share
        )
    } else {
        format!("{head}: what the latter has explains none of the misfit.")
    }
}

pub(super) fn page(answers: &Answers, outcome: &Beside) -> String {
    let kelvin = |off_k: f64| if off_k.is_nan() { "-".to_owned() } else { words::grouped(off_k, 1) };
    let rows: Vec<Vec<String>> = (outcome.left.iter())
        .map(|left| {
            let mut row = vec![answers.case.sensors[left.sensor].name.clone()];
            row.extend(left.heating_k.into_iter().chain(left.cooling_k).map(kelvin));
            row.push(if left.explained().is_finite() {
                format!("{:.0}", 100.0 * left.explained())
            } else {
                "-".into()
            });
            row
        })
        .collect();
    let estimates = outcome.factors.iter().zip(&outcome.estimated.values).zip(&outcome.estimated.standard_errors);
    let estimates: Vec<Vec<String>> = estimates
        .map(|((name, value), error)| vec![name.clone(), format!("{value:.4}"), words::significant(*error, 2)])
        .collect();
    let (first, other) = (&answers.case.id, &outcome.id);
    let title = format!("Root mean square of prediction less measurement, K: {first}, and {other} beside it");
    let heads = ["Sensor", "Heating", "beside", "Cool-down", "beside", "Explained, %"];
    paragraph(&explained(answers, outcome))
        + &table(&title, &heads, &rows)
        + &table(&format!("Estimates of {other}"), &["Factor", "Estimate", "± (1 σ)"], &estimates)
}

/// A second case fitted to the same observations: root mean squares of the first and of it, K.
#[derive(Serialize)]
pub(super) struct BesideRecord<'a> {
    case: &'a str,
    cooling_s: f64,
    factors: Named<'a, f64>,
    sensors: Named<'a, LeftRecord>,
}

#[derive(Serialize)]
struct LeftRecord {
    heating_k: [f64; 2],
    cooling_k: [f64; 2],
    explained: f64,
}

pub(super) fn record<'a>(case: &'a Case, outcome: &'a Beside) -> BesideRecord<'a> {
    let estimates = outcome.factors.iter().map(String::as_str).zip(outcome.estimated.values.iter().copied());
    let left = outcome.left.iter().map(|left| {
        let Left { heating_k, cooling_k, .. } = *left;
        let record = LeftRecord { heating_k, cooling_k, explained: left.explained() };
        (case.sensors[left.sensor].name.as_str(), record)
    });
    BesideRecord {
        case: &outcome.id,
        cooling_s: outcome.cooling_s,
        factors: Named(estimates.collect()),
        sensors: Named(left.collect()),
    }
}
