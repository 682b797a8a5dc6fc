//! Comparison of two physical models: how much of the misfit does a second case explain, fitted to the same
//! observations?

use super::estimate::{CaseFit, EstimateError, ParameterEstimates};
use super::nominal::Prediction;
use crate::case::{Case, Face, Observation};

/// A second case, fitted to the observations of the first, and the residuals of both at every observed thermocouple.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct ModelComparison {
    /// Id of the second case.
    pub id: String,
    /// Name of the second case.
    pub name: String,
    /// Names of the factors estimated in the second case.
    pub factors: Vec<String>,
    /// Estimate of the second case.
    pub estimated: ParameterEstimates,
    /// Start of cool-down, s: the hot face is not heated after it. The end of the run where heating never stops.
    pub cooling_start_s: f64,
    /// One entry per observation of the first case, in their order.
    pub residuals: Vec<SensorResiduals>,
}

/// Root mean square of predicted minus measured temperature at the estimates, of the first and of the second case, K.
/// NaN where there are no samples.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct SensorResiduals {
    /// Index into the sensors of the first case.
    pub sensor: usize,
    /// While the hot face is heated, K.
    pub heating_k: [f64; 2],
    /// During cool-down, K.
    pub cooling_k: [f64; 2],
}

impl SensorResiduals {
    /// Share of the first case's mean square misfit in cool-down that the second case removes; negative where the
    /// misfit grew.
    pub fn explained_fraction(&self) -> f64 {
        1.0 - (self.cooling_k[1] / self.cooling_k[0]).powi(2)
    }
}

/// Why two cases cannot be compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ComparisonError {
    /// The observations of the two cases differ.
    #[error("{other:?} must have the observations of {case:?}: {why}")]
    ObservationsDiffer {
        /// The case.
        case: String,
        /// The other case.
        other: String,
        /// The difference.
        why: String,
    },
    /// The second case cannot be fitted.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
}

/// Fit `other` with its own settings by `fit`, and compare its residuals with those of `first`, a fit of `case`.
///
/// # Errors
/// When the observations differ, or when the fit fails.
pub fn compare_models(
    (case, first): (&Case, &CaseFit),
    other: &Case,
    fit: &mut dyn FnMut() -> Result<ParameterEstimates, EstimateError>,
) -> Result<ModelComparison, ComparisonError> {
    if let Some(why) = observation_mismatch(case, other) {
        return Err(ComparisonError::ObservationsDiffer { case: case.id.clone(), other: other.id.clone(), why });
    }
    let estimated = fit()?;
    let cooling_s = cooling_start_s(case);
    let left = |(seen, counterpart): (&Observation, &Observation)| {
        let rms_k = |from_s: f64, to_s: f64| {
            [
                rms_k(seen, &first.after, seen.sensor, from_s, to_s),
                rms_k(seen, &estimated.fitted[0].after, counterpart.sensor, from_s, to_s),
            ]
        };
        SensorResiduals {
            sensor: seen.sensor,
            heating_k: rms_k(0.0, cooling_s),
            cooling_k: rms_k(cooling_s, f64::INFINITY),
        }
    };
    let counterparts = case.observations.iter().map(|seen| matching_observation(case, seen, other));
    Ok(ModelComparison {
        id: other.id.clone(),
        name: other.name.clone(),
        factors: estimated.factors.iter().map(|factor| factor.factor.name.clone()).collect(),
        residuals: case.observations.iter().zip(counterparts.flatten()).map(left).collect(),
        cooling_start_s: cooling_s,
        estimated,
    })
}

/// The observation of the other case at the sensor of the same name.
fn matching_observation<'a>(case: &Case, seen: &Observation, other: &'a Case) -> Option<&'a Observation> {
    let name = &case.sensors[seen.sensor].name;
    other.observations.iter().find(|counterpart| other.sensors[counterpart.sensor].name == *name)
}

/// The first difference between the observations of two cases.
fn observation_mismatch(case: &Case, other: &Case) -> Option<String> {
    case.observations.iter().find_map(|seen| {
        let name = &case.sensors[seen.sensor].name;
        match matching_observation(case, seen, other) {
            None => Some(format!("it has no observation at {name}")),
            Some(found) if found.times_s != seen.times_s || found.temperatures_k != seen.temperatures_k => {
                Some(format!("the samples at {name} differ"))
            }
            Some(_) => None,
        }
    })
}

/// End of heating, s. A held hot face has no such time: the end of the run.
fn cooling_start_s(case: &Case) -> f64 {
    let Face::Open(face) = &case.exposure.hot_face else { return case.exposure.duration_s };
    let last = |times_s: &[f64], values: &[f64]| {
        let heated = values.iter().rposition(|&value| value > 0.0)?;
        Some(times_s.get(heated + 1).copied().unwrap_or(case.exposure.duration_s))
    };
    [&face.flux_w_m2, &face.radiant_w_m2]
        .into_iter()
        .filter_map(|schedule| last(&schedule.times_s, &schedule.values))
        .fold(0.0, f64::max)
        .min(case.exposure.duration_s)
}

/// Root mean square of predicted minus measured temperature after `from_s`, up to `to_s`, K. The sensor's own window
/// applies, because it excludes invalid readings; the fit window of the case does not.
fn rms_k(seen: &Observation, predicted: &Prediction, sensor: usize, from_s: f64, to_s: f64) -> f64 {
    let samples = seen.times_s.iter().zip(&seen.temperatures_k);
    let is_valid = |time_s: f64| seen.window_s.is_none_or(|(first_s, last_s)| (first_s..=last_s).contains(&time_s));
    let (count, squares_k2) = samples
        .filter(|(time_s, _)| is_valid(**time_s) && **time_s <= to_s && (**time_s > from_s || from_s == 0.0))
        .fold((0.0, 0.0), |(count, sum), (&time_s, &measured_k)| {
            let off_k = predicted.temperature_at(sensor, time_s) - measured_k;
            (count + 1.0, sum + off_k * off_k)
        });
    (squares_k2 / count).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_the_misfit_is_a_quarter_of_its_square() {
        let left = SensorResiduals { sensor: 0, heating_k: [1.0, 1.0], cooling_k: [8.0, 4.0] };
        assert_eq!(left.explained_fraction(), 0.75);
        assert!(
            SensorResiduals { cooling_k: [4.0, 8.0], ..left }.explained_fraction() < 0.0,
            "a misfit that grew explains nothing"
        );
    }
}
