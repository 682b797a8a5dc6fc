//! Keys of a Monte Carlo sweep in `summary.json`.

use crate::case::Case;
use crate::report::files::json::Named;
use crate::study::proportion::Proportion;
use crate::study::statistics::{Causes, Likely};
use crate::study::uncertainty::Uncertainty;
use serde::Serialize;

/// Indices of a sensor's peak temperature and of the time of its peak.
#[derive(Serialize)]
pub(super) struct Due<'a> {
    peak: CausesRecord<'a>,
    peak_time: CausesRecord<'a>,
}

#[derive(Serialize)]
struct CausesRecord<'a> {
    factors: Named<'a, CauseRecord>,
    /// Share of the variance beyond pairwise interactions.
    unexplained: f64,
}

/// Each with its 95 % interval.
#[derive(Serialize)]
struct CauseRecord {
    correlation: Likely,
    rank_correlation: Likely,
    partial_rank_correlation: Likely,
    /// First-order Sobol index.
    first_order: Likely,
    /// Total Sobol index.
    total: Likely,
}

/// Sensor → sensitivity indices.
pub(super) fn causes<'a>(case: &'a Case, outcome: &Uncertainty) -> Named<'a, Due<'a>> {
    let of = |index: usize| {
        let peak = &outcome.peaks[index];
        Due { peak: record(case, &peak.causes), peak_time: record(case, &peak.causes_of_time) }
    };
    Named(case.sensors.iter().enumerate().map(|(index, sensor)| (sensor.name.as_str(), of(index))).collect())
}

fn record<'a>(case: &'a Case, causes: &Causes) -> CausesRecord<'a> {
    let each = |factor: usize| CauseRecord {
        correlation: causes.correlations[factor],
        rank_correlation: causes.rank_correlations[factor],
        partial_rank_correlation: causes.partial_rank_correlations[factor],
        first_order: causes.first[factor],
        total: causes.total[factor],
    };
    let named = case.factors.iter().enumerate().map(|(index, factor)| (factor.name.as_str(), each(index)));
    CausesRecord { factors: Named(named.collect()), unexplained: causes.rest }
}

/// Sensor → factor → variance share at the sensor's nominal peak.
pub(super) fn shares<'a>(case: &'a Case, outcome: &Uncertainty) -> Named<'a, Named<'a, f64>> {
    let of = |sensor: usize| {
        let ranked = super::ranked(case, outcome, sensor);
        let named = ranked.into_iter().flatten();
        Named(named.map(|(factor, share)| (case.factors[factor].name.as_str(), share)).collect())
    };
    Named(case.sensors.iter().enumerate().map(|(index, sensor)| (sensor.name.as_str(), of(index))).collect())
}

/// Coverage of the pointwise and the simultaneous 95 % band of a sensor.
#[derive(Serialize)]
pub(super) struct WholeRecord {
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
pub(super) fn whole_traces<'a>(case: &'a Case, outcome: &Uncertainty) -> Named<'a, WholeRecord> {
    let named = case.sensors.iter().zip(&outcome.spreads).map(|(sensor, spread)| {
        let Proportion { of, .. } = spread.whole.in_pointwise;
        let record = WholeRecord {
            traces: of,
            pointwise_coverage: spread.whole.in_pointwise.share(),
            simultaneous_coverage: spread.whole.in_simultaneous.share(),
            envelope_scale: spread.whole.stretch,
        };
        (sensor.name.as_str(), record)
    });
    Named(named.collect())
}
