//! What `history` found, for a program. A deviation that is unbounded is `null`.

use super::Named;
use crate::case::Case;
use crate::study::history::{Chosen, History};
use serde::Serialize;

#[derive(Serialize)]
pub(super) struct HistoryRecord<'a> {
    times_s: &'a [f64],
    flux_w_m2: &'a [f64],
    /// One standard deviation of each by the noise alone.
    deviations_w_m2: &'a [f64],
    /// What smoothing takes off each to first order.
    smoothed_w_m2: &'a [f64],
    own_w_m2: &'a [f64],
    fluence_j_m2: f64,
    fluence_deviation_j_m2: f64,
    fluence_own_j_m2: f64,
    end_s: f64,
    samples: usize,
    determined: f64,
    /// `discrepancy`, `straight`, `unmet`, `l-curve`, `stated`.
    chosen: &'static str,
    smoothing: f64,
    /// Weighted root mean square of the residuals: one is as the noise says.
    weighted_rms: f64,
    /// Sensor → root mean square of measured less predicted, K.
    sensors: Named<'a, Off>,
    marches: usize,
    converged: bool,
    termination: &'a str,
}

#[derive(Serialize)]
struct Off {
    own_rms_k: f64,
    found_rms_k: f64,
}

impl<'a> HistoryRecord<'a> {
    pub(super) fn of(case: &'a Case, outcome: &'a History) -> Self {
        let sensors = outcome.seen.iter().map(|seen| {
            (case.sensors[seen.sensor].name.as_str(), Off { own_rms_k: seen.rms_k.0, found_rms_k: seen.rms_k.1 })
        });
        Self {
            times_s: &outcome.times_s,
            flux_w_m2: &outcome.flux_w_m2,
            deviations_w_m2: &outcome.deviations_w_m2,
            smoothed_w_m2: &outcome.smoothed_w_m2,
            own_w_m2: &outcome.own_w_m2,
            fluence_j_m2: outcome.fluence_j_m2,
            fluence_deviation_j_m2: outcome.fluence_deviation_j_m2,
            fluence_own_j_m2: outcome.fluence_own_j_m2,
            end_s: outcome.end_s,
            samples: outcome.samples,
            determined: outcome.determined,
            chosen: match outcome.chosen {
                Chosen::Discrepancy => "discrepancy",
                Chosen::Straight => "straight",
                Chosen::Unmet => "unmet",
                Chosen::LCurve => "l-curve",
                Chosen::Stated => "stated",
            },
            smoothing: outcome.rung.weight,
            weighted_rms: outcome.rung.rms,
            sensors: Named(sensors.collect()),
            marches: outcome.marches,
            converged: outcome.converged,
            termination: &outcome.termination,
        }
    }
}
