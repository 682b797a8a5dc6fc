//! The keys `margins` and `heat_load` of `summary.json`.

use super::{Row, heat_load, rows};
use crate::report::ReportError;
use crate::report::files::json::{JsonObject, ProportionRecord};
use crate::study::answers::Answers;
use crate::study::margins::{MarginSpread, PeakPercentile};
use crate::study::nominal::Prediction;
use serde::Serialize;

#[derive(Serialize)]
struct MarginRecord<'a> {
    part: &'a str,
    kind: &'static str,
    limit_k: f64,
    nominal: NominalRecord,
    #[serde(skip_serializing_if = "Option::is_none")]
    members: Option<MembersRecord>,
}

#[derive(Serialize)]
struct NominalRecord {
    peak_k: f64,
    peak_time_s: f64,
    margin_k: f64,
    time_above_s: f64,
    still_warming: bool,
}

#[derive(Serialize)]
struct MembersRecord {
    above: ProportionRecord,
    mean_k: f64,
    standard_deviation_k: f64,
    mean_plus_3_sigma_k: f64,
    maximum_k: f64,
    percentiles: [PercentileRecord; 3],
    tolerance_95_99_k: Option<f64>,
    time_above_p95_s: f64,
    time_above_maximum_s: f64,
}

#[derive(Serialize)]
struct PercentileRecord {
    probability: f64,
    value_k: f64,
    low_k: Option<f64>,
    high_k: Option<f64>,
}

#[derive(Serialize)]
struct HeatLoadRecord {
    nominal_j_m2: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    members: Option<HeatSpreadRecord>,
}

#[derive(Serialize)]
struct HeatSpreadRecord {
    mean_j_m2: f64,
    standard_deviation_j_m2: f64,
    maximum_j_m2: f64,
}

impl MembersRecord {
    fn of(spread: &MarginSpread) -> Self {
        let percentile = |&PeakPercentile { probability, value_k, low_k, high_k }: &PeakPercentile| PercentileRecord {
            probability,
            value_k,
            low_k,
            high_k,
        };
        Self {
            above: ProportionRecord::with_interval(spread.exceeding, spread.exceeding_interval),
            mean_k: spread.mean_k,
            standard_deviation_k: spread.deviation_k,
            mean_plus_3_sigma_k: spread.mean_k + 3.0 * spread.deviation_k,
            maximum_k: spread.max_k,
            percentiles: spread.percentiles.each_ref().map(percentile),
            tolerance_95_99_k: spread.tolerance_bound_k,
            time_above_p95_s: spread.time_above_p95_s,
            time_above_maximum_s: spread.time_above_max_s,
        }
    }
}

/// Write the keys; none without limits.
pub(in crate::report) fn write_summary(
    answers: &Answers,
    outcome: &Prediction,
    record: &mut JsonObject<'_>,
) -> Result<(), ReportError> {
    let rows = rows(answers, outcome);
    if rows.is_empty() {
        return Ok(());
    }
    let margin = |row: &Row<'_>| NominalRecord {
        peak_k: row.nominal.peak.temperature_k,
        peak_time_s: row.nominal.peak.time_s,
        margin_k: row.nominal.margin_k,
        time_above_s: row.nominal.time_above_s,
        still_warming: row.nominal.still_warming,
    };
    let records = rows.iter().map(|row| MarginRecord {
        part: &row.part,
        kind: row.limit.part.kind(),
        limit_k: row.limit.limit_k,
        nominal: margin(row),
        members: row.spread.map(MembersRecord::of),
    });
    record.put("margins", &records.collect::<Vec<_>>())?;
    let members = heat_load(answers).map(|load| HeatSpreadRecord {
        mean_j_m2: load.mean_j_m2,
        standard_deviation_j_m2: load.deviation_j_m2,
        maximum_j_m2: load.max_j_m2,
    });
    record.put("heat_load", &HeatLoadRecord { nominal_j_m2: outcome.balance.hot_in_j_m2, members })
}
