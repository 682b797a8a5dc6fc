//! What a sweep adds to `summary.json`.

use crate::case::Case;
use crate::report::files::json::Named;
use crate::study::proportion::Proportion;
use crate::study::statistics::{Causes, Likely};
use crate::study::uncertainty::Uncertainty;
use serde::Serialize;

/// Of a sensor's peak temperature and of the time of its peak.
#[derive(Serialize)]
pub(super) struct Due<'a> {
    peak: CausesRecord<'a>,
    peak_time: CausesRecord<'a>,
}

#[derive(Serialize)]
struct CausesRecord<'a> {
    factors: Named<'a, CauseRecord>,
    /// The share of the variance that no functions of two factors explain.
    unexplained: f64,
}

/// Each with its 95 % interval.
#[derive(Serialize)]
struct CauseRecord {
    correlation: Likely,
    rank_correlation: Likely,
    partial_rank_correlation: Likely,
    /// First-order Sobol index.
    index: Likely,
    /// Total Sobol index.
    total: Likely,
}

/// Sensor → what its peak and the time of that are due to.
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
        index: causes.first[factor],
        total: causes.total[factor],
    };
    let named = case.factors.iter().enumerate().map(|(index, factor)| (factor.name.as_str(), each(index)));
    CausesRecord { factors: Named(named.collect()), unexplained: causes.rest }
}

/// Sensor → factor → share of the spread at the sensor's nominal peak.
pub(super) fn shares<'a>(case: &'a Case, outcome: &Uncertainty) -> Named<'a, Named<'a, f64>> {
    let of = |sensor: usize| {
        let ranked = super::ranked(case, outcome, sensor);
        let named = ranked.into_iter().flatten();
        Named(named.map(|(factor, share)| (case.factors[factor].name.as_str(), share)).collect())
    };
    Named(case.sensors.iter().enumerate().map(|(index, sensor)| (sensor.name.as_str(), of(index))).collect())
}

/// Of the members whose whole traces were kept.
#[derive(Serialize)]
pub(super) struct WholeRecord {
    kept: usize,
    /// The share that stays between the percentiles 2.5 and 97.5 at every instant.
    in_pointwise_band: f64,
    /// The share that stays in the simultaneous band.
    in_simultaneous_band: f64,
    /// How many times as far as 200 members marched beforehand the simultaneous band reaches from the nominal trace.
    envelope_stretch: f64,
}

/// Sensor → how whole traces lie.
pub(super) fn whole_traces<'a>(case: &'a Case, outcome: &Uncertainty) -> Named<'a, WholeRecord> {
    let named = case.sensors.iter().zip(&outcome.spreads).map(|(sensor, spread)| {
        let Proportion { of, .. } = spread.whole.in_pointwise;
        let record = WholeRecord {
            kept: of,
            in_pointwise_band: spread.whole.in_pointwise.share(),
            in_simultaneous_band: spread.whole.in_simultaneous.share(),
            envelope_stretch: spread.whole.stretch,
        };
        (sensor.name.as_str(), record)
    });
    Named(named.collect())
}
