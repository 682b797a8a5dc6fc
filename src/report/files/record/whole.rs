//! What whole traces of members do: which share stays in a band at every instant.

use super::Named;
use crate::case::Case;
use crate::study::proportion::Proportion;
use crate::study::uncertainty::Uncertainty;
use serde::Serialize;

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

pub(super) fn whole<'a>(case: &'a Case, outcome: &Uncertainty) -> Named<'a, WholeRecord> {
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
