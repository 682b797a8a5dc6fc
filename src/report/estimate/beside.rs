//! Comparison with a second model fitted to the same observations.

mod figures;

pub(super) use figures::figures;

use crate::case::Case;
use crate::report::files::json::Named;
use crate::report::html::table::{paragraph, table};
use crate::report::words;
use crate::study::answers::Answers;
use crate::study::beside::{Beside, Left};
use serde::Serialize;

/// Share of the cool-down misfit at the deepest observed thermocouple that the second model explains.
pub(super) fn explained(answers: &Answers, outcome: &Beside) -> String {
    let Some(left) = outcome.left.last() else { return "The case has no observations.".to_owned() };
    let [first_k, other_k] = left.cooling_k.map(words::misfit);
    let head = format!(
        "RMSE of {} after the heating ends at {}: {first_k} with {}, {other_k} with {}",
        answers.case.sensors[left.sensor].name,
        words::seconds(outcome.cooling_s),
        answers.case.id,
        outcome.id
    );
    let share = left.explained();
    if !share.is_finite() {
        return format!("{head}.");
    }
    if share > 0.0 {
        format!("{head}. The second model explains {:.0} % of the mean square misfit of the first.", 100.0 * share)
    } else {
        format!("{head}. The second model explains none of the misfit of the first.")
    }
}

pub(super) fn page(answers: &Answers, outcome: &Beside) -> String {
    let kelvin = |rms_k: f64| if rms_k.is_nan() { "-".to_owned() } else { words::grouped(rms_k, 1) };
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
    let title = format!("RMSE of {first} and {other}, K");
    let heads = [
        "Sensor",
        &format!("Heating, {first}"),
        &format!("Heating, {other}"),
        &format!("Cool-down, {first}"),
        &format!("Cool-down, {other}"),
        "Explained, %",
    ];
    paragraph(&explained(answers, outcome))
        + &table(&title, &heads, &rows)
        + &table(&format!("Estimates of {other}"), &["Factor", "Estimate", "Standard error"], &estimates)
}

/// The key `model_comparison`; pairs are of the first and of the second case.
#[derive(Serialize)]
pub(super) struct BesideRecord<'a> {
    case: &'a str,
    heating_end_s: f64,
    factors: Named<'a, f64>,
    sensors: Named<'a, LeftRecord>,
}

#[derive(Serialize)]
struct LeftRecord {
    heating_rms_k: [f64; 2],
    cooling_rms_k: [f64; 2],
    explained_share: f64,
}

pub(super) fn record<'a>(case: &'a Case, outcome: &'a Beside) -> BesideRecord<'a> {
    let estimates = outcome.factors.iter().map(String::as_str).zip(outcome.estimated.values.iter().copied());
    let left = outcome.left.iter().map(|left| {
        let Left { heating_k, cooling_k, .. } = *left;
        let record =
            LeftRecord { heating_rms_k: heating_k, cooling_rms_k: cooling_k, explained_share: left.explained() };
        (case.sensors[left.sensor].name.as_str(), record)
    });
    BesideRecord {
        case: &outcome.id,
        heating_end_s: outcome.cooling_s,
        factors: Named(estimates.collect()),
        sensors: Named(left.collect()),
    }
}
