//! The key `history` of `summary.json`. An unbounded deviation is `null`.

use crate::case::Case;
use crate::report::files::json::OrderedMap;
use crate::study::flux_inversion::{FluxInversion, HeatingQuantity, SmoothingCriterion};
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
    /// Largest discretisation error of a reading with the estimated heating, K; `null` where the case states its cells
    /// and steps.
    discretisation_error_k: Option<f64>,
    /// Knots at zero where a negative value would fit the data better.
    knots_below_zero: usize,
    /// Sensor → root mean square of measurement less prediction, K.
    sensors: OrderedMap<'a, SensorMisfit>,
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
    fn of(outcome: &'a FluxInversion) -> Self {
        let of = || OfFlux {
            standard_deviations_w_m2: &outcome.standard_deviations,
            removed_by_smoothing_w_m2: &outcome.smoothing_bias,
            stated_w_m2: &outcome.case_values,
            fluence_j_m2: outcome.integral,
            fluence_standard_deviation_j_m2: outcome.integral_deviation,
            stated_fluence_j_m2: outcome.case_integral,
        };
        match outcome.quantity {
            HeatingQuantity::Flux => Self::Flux { flux_w_m2: &outcome.values, of: of() },
            HeatingQuantity::RadiantFlux => Self::RadiantFlux { radiant_flux_w_m2: &outcome.values, of: of() },
            HeatingQuantity::Gas => Self::Gas {
                gas_k: &outcome.values,
                standard_deviations_k: &outcome.standard_deviations,
                removed_by_smoothing_k: &outcome.smoothing_bias,
                stated_k: &outcome.case_values,
                mean_k: outcome.integral / outcome.end_s,
                mean_standard_deviation_k: outcome.integral_deviation / outcome.end_s,
                stated_mean_k: outcome.case_integral / outcome.end_s,
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
    pub(super) fn of(case: &'a Case, outcome: &'a FluxInversion) -> Self {
        let sensors = outcome.sensor_fits.iter().map(|seen| {
            let (stated_rms_k, estimated_rms_k) = seen.rms_k;
            (case.sensors[seen.sensor].name.as_str(), SensorMisfit { stated_rms_k, estimated_rms_k })
        });
        Self {
            quantity: outcome.quantity.name(),
            times_s: &outcome.times_s,
            values: Values::of(outcome),
            undetermined: &outcome.undetermined,
            window_end_s: outcome.end_s,
            samples: outcome.samples,
            effective_degrees_of_freedom: outcome.degrees_of_freedom,
            regularisation_rule: match outcome.criterion {
                SmoothingCriterion::Discrepancy => "discrepancy",
                SmoothingCriterion::Straight => "piecewise-linear",
                SmoothingCriterion::Unmet => "noise-exceeded",
                SmoothingCriterion::LCurve => "l-curve",
                SmoothingCriterion::Stated => "stated",
            },
            regularisation_weight: outcome.selected.weight,
            weighted_rms: outcome.selected.rms,
            discretisation_error_k: outcome.discretisation_error_k,
            knots_below_zero: outcome.knots_below_zero,
            sensors: OrderedMap(sensors.collect()),
            marches: outcome.marches,
            converged: outcome.converged,
            termination: &outcome.termination,
        }
    }
}
