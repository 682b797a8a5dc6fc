//! What every thermocouple counts for, in the summary.

use super::Named;
use crate::case::{Case, Observation};
use crate::report::{Story, observed};
use serde::Serialize;

/// The window that is trusted, samples within it, and the least and the largest standard deviation of all.
#[derive(Serialize)]
pub(super) struct ObservedRecord {
    window_s: (f64, f64),
    samples: usize,
    sigma_k: (f64, f64),
}

/// Case → sensor → what its observation counts for.
pub(super) fn observed<'a>(story: &Story<'a>) -> Named<'a, Named<'a, ObservedRecord>> {
    Named(story.cases().map(|case| (case.id.as_str(), of(case))).collect())
}

fn of(case: &Case) -> Named<'_, ObservedRecord> {
    let record = |seen: &Observation| {
        let window_s = case.window_s(seen.sensor);
        let is_trusted = |time_s: &&f64| (window_s.0..=window_s.1).contains(*time_s);
        let samples = seen.times_s.iter().filter(is_trusted).count();
        ObservedRecord { window_s, samples, sigma_k: observed::deviations_k(seen) }
    };
    Named(case.observations.iter().map(|seen| (case.sensors[seen.sensor].name.as_str(), record(seen))).collect())
}
