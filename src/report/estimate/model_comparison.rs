//! Comparison with a second model fitted to the same observations.

mod figures;

pub(super) use figures::figures;

use crate::case::Case;
use crate::report::files::json::OrderedMap;
use crate::report::format;
use crate::report::html::table::{paragraph, table};
use crate::study::answers::Answers;
use crate::study::model_comparison::{ModelComparison, SensorResiduals};
use serde::Serialize;

/// Share of the cool-down misfit at the deepest observed thermocouple that the second model explains.
pub(super) fn explained_misfit(answers: &Answers, outcome: &ModelComparison) -> String {
    let Some(left) = outcome.residuals.last() else { return "The case has no observations.".to_owned() };
    let [first_k, other_k] = left.cooling_k.map(format::temperature_difference);
    let head = format!(
        "RMSE of {} after the heating ends at {}: {first_k} with {}, {other_k} with {}",
        answers.case.sensors[left.sensor].name,
        format::seconds(outcome.cooling_start_s),
        answers.case.id,
        outcome.id
    );
    let share = left.explained_fraction();
    if !share.is_finite() {
        return format!("{head}.");
    }
    if share > 0.0 {
        format!("{head}. The second model explains {:.0} % of the mean square misfit of the first.", 100.0 * share)
    } else {
        format!("{head}. The second model explains none of the misfit of the first.")
    }
}

pub(super) fn page(answers: &Answers, outcome: &ModelComparison) -> String {
    let kelvin = |rms_k: f64| if rms_k.is_nan() { "-".to_owned() } else { format::grouped(rms_k, 1) };
    let rows: Vec<Vec<String>> = (outcome.residuals.iter())
        .map(|left| {
            let mut row = vec![answers.case.sensors[left.sensor].name.clone()];
            row.extend(left.heating_k.into_iter().chain(left.cooling_k).map(kelvin));
            row.push(if left.explained_fraction().is_finite() {
                format!("{:.0}", 100.0 * left.explained_fraction())
            } else {
                "-".into()
            });
            row
        })
        .collect();
    let estimates = outcome.factors.iter().zip(&outcome.estimated.values).zip(&outcome.estimated.standard_errors);
    let estimates: Vec<Vec<String>> = estimates
        .map(|((name, value), error)| vec![name.clone(), format!("{value:.4}"), format::significant(*error, 2)])
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
    paragraph(&explained_misfit(answers, outcome))
        + &table(&title, &heads, &rows)
        + &table(&format!("Estimates of {other}"), &["Factor", "Estimate", "Standard error"], &estimates)
}

/// The key `model_comparison`; pairs are of the first and of the second case.
#[derive(Serialize)]
pub(super) struct ModelComparisonRecord<'a> {
    case: &'a str,
    heating_end_s: f64,
    factors: OrderedMap<'a, f64>,
    sensors: OrderedMap<'a, SensorMisfits>,
}

#[derive(Serialize)]
struct SensorMisfits {
    heating_rms_k: [f64; 2],
    cooling_rms_k: [f64; 2],
    explained_share: f64,
}

pub(super) fn record<'a>(case: &'a Case, outcome: &'a ModelComparison) -> ModelComparisonRecord<'a> {
    let estimates = outcome.factors.iter().map(String::as_str).zip(outcome.estimated.values.iter().copied());
    let left = outcome.residuals.iter().map(|left| {
        let SensorResiduals { heating_k, cooling_k, .. } = *left;
        let record = SensorMisfits {
            heating_rms_k: heating_k,
            cooling_rms_k: cooling_k,
            explained_share: left.explained_fraction(),
        };
        (case.sensors[left.sensor].name.as_str(), record)
    });
    ModelComparisonRecord {
        case: &outcome.id,
        heating_end_s: outcome.cooling_start_s,
        factors: OrderedMap(estimates.collect()),
        sensors: OrderedMap(left.collect()),
    }
}
