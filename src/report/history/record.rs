//! What `history` found, for a program. A deviation that is unbounded is `null`.

use crate::case::Case;
use crate::report::files::json::Named;
use crate::study::history::{Chosen, History, Sought};
use serde::Serialize;

#[derive(Serialize)]
pub(super) struct HistoryRecord<'a> {
    /// `flux`, `radiant-flux`, `gas`.
    sought: &'static str,
    times_s: &'a [f64],
    #[serde(flatten)]
    values: Values<'a>,
    /// Whether each knot is left undetermined; deviations of the integral take such a one as found.
    undetermined: &'a [bool],
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

/// What was found at the knots: with it one standard deviation of each by the noise alone, what smoothing takes off each to first
/// order, what the case has; and the integral of a flux, or the mean of a temperature.
#[derive(Serialize)]
#[serde(untagged)]
enum Values<'a> {
    Flux {
        flux_w_m2: &'a [f64],
        #[serde(flatten)]
        of: OfFlux<'a>,
    },
    RadiantFlux {
        radiant_flux_w_m2: &'a [f64],
        #[serde(flatten)]
        of: OfFlux<'a>,
    },
    Gas {
        gas_k: &'a [f64],
        deviations_k: &'a [f64],
        smoothed_k: &'a [f64],
        own_k: &'a [f64],
        mean_k: f64,
        mean_deviation_k: f64,
        mean_own_k: f64,
    },
}

#[derive(Serialize)]
struct OfFlux<'a> {
    deviations_w_m2: &'a [f64],
    smoothed_w_m2: &'a [f64],
    own_w_m2: &'a [f64],
    fluence_j_m2: f64,
    fluence_deviation_j_m2: f64,
    fluence_own_j_m2: f64,
}

impl<'a> Values<'a> {
    fn of(outcome: &'a History) -> Self {
        let of = || OfFlux {
            deviations_w_m2: &outcome.deviations,
            smoothed_w_m2: &outcome.smoothed,
            own_w_m2: &outcome.own,
            fluence_j_m2: outcome.integral,
            fluence_deviation_j_m2: outcome.integral_deviation,
            fluence_own_j_m2: outcome.integral_own,
        };
        match outcome.sought {
            Sought::Flux => Self::Flux { flux_w_m2: &outcome.values, of: of() },
            Sought::RadiantFlux => Self::RadiantFlux { radiant_flux_w_m2: &outcome.values, of: of() },
            Sought::Gas => Self::Gas {
                gas_k: &outcome.values,
                deviations_k: &outcome.deviations,
                smoothed_k: &outcome.smoothed,
                own_k: &outcome.own,
                mean_k: outcome.integral / outcome.end_s,
                mean_deviation_k: outcome.integral_deviation / outcome.end_s,
                mean_own_k: outcome.integral_own / outcome.end_s,
            },
        }
    }
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
            sought: outcome.sought.name(),
            times_s: &outcome.times_s,
            values: Values::of(outcome),
            undetermined: &outcome.undetermined,
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
