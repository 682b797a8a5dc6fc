//! The key `history` of `summary.json`. An unbounded deviation is `null`.

use crate::case::Case;
use crate::report::files::json::Named;
use crate::study::history::{Chosen, History, Sought};
use serde::Serialize;

#[derive(Serialize)]
pub(super) struct HistoryRecord<'a> {
    /// `flux`, `radiant-flux`, `gas`.
    quantity: &'static str,
    times_s: &'a [f64],
    #[serde(flatten)]
    values: Values<'a>,
    /// Whether each knot is undetermined; the deviation of the integral takes its value as exact.
    undetermined: &'a [bool],
    window_end_s: f64,
    samples: usize,
    effective_degrees_of_freedom: f64,
    /// `discrepancy`, `piecewise-linear`, `noise-exceeded`, `l-curve`, `stated`.
    regularisation_rule: &'static str,
    regularisation_weight: f64,
    /// Root mean square of the residuals in standard deviations.
    weighted_rms: f64,
    /// Sensor → root mean square of measurement less prediction, K.
    sensors: Named<'a, SensorMisfit>,
    marches: usize,
    converged: bool,
    termination: &'a str,
}

/// Values at the knots: the estimate, its standard deviation by noise, the amount that smoothing removes to first
/// order, and the stated value; then the integral of a flux, or the mean of a temperature.
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
        standard_deviations_k: &'a [f64],
        removed_by_smoothing_k: &'a [f64],
        stated_k: &'a [f64],
        mean_k: f64,
        mean_standard_deviation_k: f64,
        stated_mean_k: f64,
    },
}

#[derive(Serialize)]
struct OfFlux<'a> {
    standard_deviations_w_m2: &'a [f64],
    removed_by_smoothing_w_m2: &'a [f64],
    stated_w_m2: &'a [f64],
    fluence_j_m2: f64,
    fluence_standard_deviation_j_m2: f64,
    stated_fluence_j_m2: f64,
}

impl<'a> Values<'a> {
    fn of(outcome: &'a History) -> Self {
        let of = || OfFlux {
            standard_deviations_w_m2: &outcome.deviations,
            removed_by_smoothing_w_m2: &outcome.smoothed,
            stated_w_m2: &outcome.own,
            fluence_j_m2: outcome.integral,
            fluence_standard_deviation_j_m2: outcome.integral_deviation,
            stated_fluence_j_m2: outcome.integral_own,
        };
        match outcome.sought {
            Sought::Flux => Self::Flux { flux_w_m2: &outcome.values, of: of() },
            Sought::RadiantFlux => Self::RadiantFlux { radiant_flux_w_m2: &outcome.values, of: of() },
            Sought::Gas => Self::Gas {
                gas_k: &outcome.values,
                standard_deviations_k: &outcome.deviations,
                removed_by_smoothing_k: &outcome.smoothed,
                stated_k: &outcome.own,
                mean_k: outcome.integral / outcome.end_s,
                mean_standard_deviation_k: outcome.integral_deviation / outcome.end_s,
                stated_mean_k: outcome.integral_own / outcome.end_s,
            },
        }
    }
}

/// With the stated and with the estimated heating.
#[derive(Serialize)]
struct SensorMisfit {
    stated_rms_k: f64,
    estimated_rms_k: f64,
}

impl<'a> HistoryRecord<'a> {
    pub(super) fn of(case: &'a Case, outcome: &'a History) -> Self {
        let sensors = outcome.seen.iter().map(|seen| {
            let (stated_rms_k, estimated_rms_k) = seen.rms_k;
            (case.sensors[seen.sensor].name.as_str(), SensorMisfit { stated_rms_k, estimated_rms_k })
        });
        Self {
            quantity: outcome.sought.name(),
            times_s: &outcome.times_s,
            values: Values::of(outcome),
            undetermined: &outcome.undetermined,
            window_end_s: outcome.end_s,
            samples: outcome.samples,
            effective_degrees_of_freedom: outcome.determined,
            regularisation_rule: match outcome.chosen {
                Chosen::Discrepancy => "discrepancy",
                Chosen::Straight => "piecewise-linear",
                Chosen::Unmet => "noise-exceeded",
                Chosen::LCurve => "l-curve",
                Chosen::Stated => "stated",
            },
            regularisation_weight: outcome.rung.weight,
            weighted_rms: outcome.rung.rms,
            sensors: Named(sensors.collect()),
            marches: outcome.marches,
            converged: outcome.converged,
            termination: &outcome.termination,
        }
    }
}
