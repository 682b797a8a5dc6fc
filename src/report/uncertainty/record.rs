//! Keys of a Monte Carlo sweep in `summary.json`.

use super::sensitivity_indices::{pair_names, ranked_pairs};
use crate::case::Case;
use crate::fit::proportion::Proportion;
use crate::report::files::json::OrderedMap;
use crate::statistics::{ConfidenceInterval, PairIndex, SensitivityIndices};
use crate::study::uncertainty::Uncertainty;
use serde::Serialize;

/// Indices of a sensor's peak temperature and of the time of its peak.
#[derive(Serialize)]
pub(super) struct PeakIndices<'a> {
    peak: IndicesRecord<'a>,
    peak_time: IndicesRecord<'a>,
}

#[derive(Serialize)]
struct IndicesRecord<'a> {
    factors: OrderedMap<'a, FactorIndices>,
    /// Largest first; empty for correlated factors.
    second_order: Vec<PairRecord<'a>>,
    /// Share of the variance that the polynomials do not explain.
    unexplained: f64,
}

/// Second-order Sobol index of two factors.
#[derive(Serialize)]
struct PairRecord<'a> {
    factors: [&'a str; 2],
    value: f64,
    low: f64,
    high: f64,
}

/// Each with its 95 % interval.
#[derive(Serialize)]
struct FactorIndices {
    correlation: ConfidenceInterval,
    rank_correlation: ConfidenceInterval,
    partial_rank_correlation: ConfidenceInterval,
    /// First-order Sobol index.
    first_order: ConfidenceInterval,
    /// Total Sobol index.
    total: ConfidenceInterval,
}

/// Sensor → sensitivity indices.
pub(super) fn sensitivity_indices<'a>(case: &'a Case, outcome: &Uncertainty) -> OrderedMap<'a, PeakIndices<'a>> {
    let of = |index: usize| {
        let peak = &outcome.peaks[index];
        PeakIndices {
            peak: indices_record(case, &peak.temperature_indices),
            peak_time: indices_record(case, &peak.time_indices),
        }
    };
    OrderedMap(case.sensors.iter().enumerate().map(|(index, sensor)| (sensor.name.as_str(), of(index))).collect())
}

fn indices_record<'a>(case: &'a Case, indices: &SensitivityIndices) -> IndicesRecord<'a> {
    let each = |factor: usize| FactorIndices {
        correlation: indices.correlations[factor],
        rank_correlation: indices.rank_correlations[factor],
        partial_rank_correlation: indices.partial_rank_correlations[factor],
        first_order: indices.first[factor],
        total: indices.total[factor],
    };
    let named = case.factors.iter().enumerate().map(|(index, factor)| (factor.name.as_str(), each(index)));
    let pair = |pair: PairIndex| PairRecord {
        factors: pair_names(case, pair),
        value: pair.index.value,
        low: pair.index.low,
        high: pair.index.high,
    };
    IndicesRecord {
        factors: OrderedMap(named.collect()),
        second_order: ranked_pairs(indices).into_iter().map(pair).collect(),
        unexplained: indices.unexplained,
    }
}

/// Sensor → factor → share of the variance of the sensor's peak.
pub(super) fn variance_shares<'a>(case: &'a Case, outcome: &Uncertainty) -> OrderedMap<'a, OrderedMap<'a, f64>> {
    let of = |sensor: usize| {
        let named = super::ranked_shares(outcome, sensor).into_iter();
        OrderedMap(named.map(|(factor, share)| (case.factors[factor].name.as_str(), share)).collect())
    };
    OrderedMap(case.sensors.iter().enumerate().map(|(index, sensor)| (sensor.name.as_str(), of(index))).collect())
}

/// Coverage of the pointwise and the simultaneous 95 % band of a sensor.
#[derive(Serialize)]
pub(super) struct BandRecord {
    /// Stored traces from which the coverages are counted.
    traces: usize,
    /// Share of traces that stay between the percentiles 2.5 and 97.5 at all instants.
    pointwise_coverage: f64,
    /// Share of traces that stay in the simultaneous band at all instants.
    simultaneous_coverage: f64,
    /// Half-width of the simultaneous band in units of the envelope, the extremes of 200 preliminary members.
    envelope_scale: f64,
}

/// Sensor → coverage of its bands.
pub(super) fn simultaneous_bands<'a>(case: &'a Case, outcome: &Uncertainty) -> OrderedMap<'a, BandRecord> {
    let named = case.sensors.iter().zip(&outcome.spreads).map(|(sensor, spread)| {
        let Proportion { total: of, .. } = spread.simultaneous.in_pointwise;
        let record = BandRecord {
            traces: of,
            pointwise_coverage: spread.simultaneous.in_pointwise.fraction(),
            simultaneous_coverage: spread.simultaneous.in_simultaneous.fraction(),
            envelope_scale: spread.simultaneous.envelope_ratio,
        };
        (sensor.name.as_str(), record)
    });
    OrderedMap(named.collect())
}
