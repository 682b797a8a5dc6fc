//! The key `channels` of `summary.json`.

use crate::case::Case;
use crate::report::files::json::OrderedMap;
use crate::study::observation_check::{Channel, FlagKind, ObservationCheck};
use serde::Serialize;

/// Numbers that a channel of few samples does not have are `null`.
#[derive(Serialize)]
pub(super) struct ChannelRecord<'a> {
    column: Option<&'a str>,
    samples: usize,
    earlier: usize,
    later: usize,
    missing: usize,
    first_s: f64,
    last_s: f64,
    lowest_k: f64,
    highest_k: f64,
    interval_s: Option<f64>,
    interval_p5_p95_s: Option<(f64, f64)>,
    noise_k: Option<f64>,
    resolution_k: Option<f64>,
    drift_k_min: Option<f64>,
    drift_half_width_k_min: Option<f64>,
    drift_noise_k: Option<f64>,
    flags: OrderedMap<'static, usize>,
}

/// Sensor → channel.
pub(super) fn channels<'a>(case: &'a Case, outcome: &'a ObservationCheck) -> OrderedMap<'a, ChannelRecord<'a>> {
    let named = |channel: &'a Channel| (case.sensors[channel.sensor].name.as_str(), record(channel));
    OrderedMap(outcome.channels.iter().map(named).collect())
}

fn record(channel: &Channel) -> ChannelRecord<'_> {
    let count = |kind: FlagKind| channel.flags.iter().filter(|flag| flag.kind == kind).count();
    ChannelRecord {
        column: channel.heading.as_deref(),
        samples: channel.samples,
        earlier: channel.earlier,
        later: channel.later,
        missing: channel.missing,
        first_s: channel.span_s.0,
        last_s: channel.span_s.1,
        lowest_k: channel.range_k.0,
        highest_k: channel.range_k.1,
        interval_s: channel.interval_s.map(|[_, usual_s, _]| usual_s),
        interval_p5_p95_s: channel.interval_s.map(|[short_s, _, long_s]| (short_s, long_s)),
        noise_k: channel.noise_k,
        resolution_k: channel.resolution_k,
        drift_k_min: channel.drift.map(|drift| drift.slope_k_min),
        drift_half_width_k_min: channel.drift.map(|drift| drift.half_width_k_min),
        drift_noise_k: channel.drift.map(|drift| drift.noise_k),
        flags: OrderedMap(FlagKind::ALL.map(|kind| (kind.name(), count(kind))).to_vec()),
    }
}
