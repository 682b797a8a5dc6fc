//! What peaks are due to, factor by factor.

use super::Named;
use crate::case::Case;
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
    correlation: LikelyRecord,
    rank_correlation: LikelyRecord,
    partial_rank_correlation: LikelyRecord,
    /// First-order Sobol index.
    index: LikelyRecord,
    /// Total Sobol index.
    total: LikelyRecord,
}

#[derive(Serialize)]
struct LikelyRecord {
    value: f64,
    low: f64,
    high: f64,
}

pub(super) fn causes<'a>(case: &'a Case, outcome: &Uncertainty) -> Named<'a, Due<'a>> {
    let of = |index: usize| {
        let peak = &outcome.peaks[index];
        Due { peak: record(case, &peak.causes), peak_time: record(case, &peak.causes_of_time) }
    };
    Named(case.sensors.iter().enumerate().map(|(index, sensor)| (sensor.name.as_str(), of(index))).collect())
}

fn record<'a>(case: &'a Case, causes: &Causes) -> CausesRecord<'a> {
    let likely = |of: &[Likely], factor: usize| {
        let Likely { value, low, high } = of[factor];
        LikelyRecord { value, low, high }
    };
    let each = |factor: usize| CauseRecord {
        correlation: likely(&causes.correlations, factor),
        rank_correlation: likely(&causes.rank_correlations, factor),
        partial_rank_correlation: likely(&causes.partial_rank_correlations, factor),
        index: likely(&causes.first, factor),
        total: likely(&causes.total, factor),
    };
    let named = case.factors.iter().enumerate().map(|(index, factor)| (factor.name.as_str(), each(index)));
    CausesRecord { factors: Named(named.collect()), unexplained: causes.rest }
}
