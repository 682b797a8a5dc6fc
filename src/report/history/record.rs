//! The key `history` of `summary.json`. An unbounded half-width is `null`.

use crate::case::Case;
use crate::report::files::json::OrderedMap;
use crate::study::flux_inversion::{FluxInversion, HeatingQuantity};
use serde::Serialize;

#[derive(Serialize)]
pub(super) struct HistoryRecord<'a> {
    /// `flux`, `radiant-flux`, `gas`.
    quantity: &'static str,
    times_s: &'a [f64],
    #[serde(flatten)]
    values: Values<'a>,
    /// Whether each knot is undetermined; the interval of the integral takes its value as exact.
    undetermined: &'a [bool],
    window_end_s: f64,
    samples: usize,
    effective_degrees_of_freedom: f64,
    /// `restricted-likelihood`, `stated`.
    regularisation_rule: &'static str,
    regularisation_weight: f64,
    /// Root mean square of the residuals in standard deviations.
    weighted_rms: f64,
    /// The most probable noise: correlation time, share of white noise, variance in squares of the stated deviations.
    correlation_time_s: f64,
    white_noise_share: f64,
    noise_variance: f64,
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

/// Values at the knots: the estimate, the half-width of its 95 % interval, and the stated value; then the integral of a
/// flux, or the mean of a temperature.
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
        half_widths_k: &'a [f64],
        stated_k: &'a [f64],
        mean_k: f64,
        mean_half_width_k: f64,
        stated_mean_k: f64,
    },
}

#[derive(Serialize)]
struct OfFlux<'a> {
    half_widths_w_m2: &'a [f64],
    stated_w_m2: &'a [f64],
    fluence_j_m2: f64,
    fluence_half_width_j_m2: f64,
    stated_fluence_j_m2: f64,
}

impl<'a> Values<'a> {
    fn of(outcome: &'a FluxInversion) -> Self {
        let of = || OfFlux {
            half_widths_w_m2: &outcome.half_widths,
            stated_w_m2: &outcome.case_values,
            fluence_j_m2: outcome.integral,
            fluence_half_width_j_m2: outcome.integral_half_width,
            stated_fluence_j_m2: outcome.case_integral,
        };
        match outcome.quantity {
            HeatingQuantity::Flux => Self::Flux { flux_w_m2: &outcome.values, of: of() },
            HeatingQuantity::RadiantFlux => Self::RadiantFlux { radiant_flux_w_m2: &outcome.values, of: of() },
            HeatingQuantity::Gas => Self::Gas {
                gas_k: &outcome.values,
                half_widths_k: &outcome.half_widths,
                stated_k: &outcome.case_values,
                mean_k: outcome.integral / outcome.end_s,
                mean_half_width_k: outcome.integral_half_width / outcome.end_s,
                stated_mean_k: outcome.case_integral / outcome.end_s,
            },
        }
    }
}

/// Misfit of a sensor with the stated and with the estimated heating.
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
            regularisation_rule: if outcome.weight_is_stated { "stated" } else { "restricted-likelihood" },
            regularisation_weight: outcome.weight,
            weighted_rms: outcome.weighted_rms,
            correlation_time_s: outcome.correlation_time_s,
            white_noise_share: outcome.white_share,
            noise_variance: outcome.noise_variance,
            discretisation_error_k: outcome.discretisation_error_k,
            knots_below_zero: outcome.knots_below_zero,
            sensors: OrderedMap(sensors.collect()),
            marches: outcome.marches,
            converged: outcome.converged,
            termination: &outcome.termination,
        }
    }
}
