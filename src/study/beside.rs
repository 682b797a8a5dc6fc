//! How much of a misfit does other physics explain? A second case fitted to the same observations.

use super::estimate::{EstimateError, Estimated, Fitted, Search, estimate};
use super::nominal::Nominal;
use crate::case::{Case, Face, Observation};
use crate::march::March;
use crate::plan::Plan;

/// A second case fitted beside a first, and what each leaves at every thermocouple that was observed.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Beside {
    /// The second case's.
    pub id: String,
    /// The name of the other case.
    pub name: String,
    /// Names of the factors estimated in the other case.
    pub factors: Vec<String>,
    /// The estimate of the other case.
    pub estimated: Estimated,
    /// From then on the hot face is heated no more, s; the end where it is never left alone.
    pub cooling_s: f64,
    /// One an observation of the first case, in their order.
    pub left: Vec<Left>,
}

/// Root mean squares of predicted less measured at the estimates, of the first and of the second case, K. Where there are
/// no samples they are no number.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Left {
    /// Index into the sensors of the first case.
    pub sensor: usize,
    /// While the hot face is heated.
    pub heating_k: [f64; 2],
    /// After.
    pub cooling_k: [f64; 2],
}

impl Left {
    /// Share of the first case's mean square misfit in cool-down that is gone in the second; below zero where it grew.
    pub fn explained(&self) -> f64 {
        1.0 - (self.cooling_k[1] / self.cooling_k[0]).powi(2)
    }
}

/// Why two cases cannot be held against each other.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BesideError {
    /// The other case has not the observations of the first.
    #[error("{other:?} has not the observations of {case:?}: {why}")]
    OtherObservations {
        /// The case.
        case: String,
        /// The other case.
        other: String,
        /// How they differ.
        why: String,
    },
    /// The other case cannot be fitted.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
}

/// Fit `other` as it says itself, and compare what it leaves with what `first` left of `case`.
///
/// # Errors
/// When the observations differ, or what [`estimate`] fails of.
pub fn beside(
    (case, first): (&Case, &Fitted),
    (other, plan): (&Case, &Plan),
    march: &mut dyn March,
    search: &Search,
) -> Result<Beside, BesideError> {
    if let Some(why) = different(case, other) {
        return Err(BesideError::OtherObservations { case: case.id.clone(), other: other.id.clone(), why });
    }
    let estimated = estimate(&[(other, plan)], march, search)?;
    let cooling_s = cooling_s(case);
    let left = |(seen, twin): (&Observation, &Observation)| {
        let rms_k = |from_s: f64, to_s: f64| {
            [
                rms_k(seen, &first.after, seen.sensor, from_s, to_s),
                rms_k(seen, &estimated.fitted[0].after, twin.sensor, from_s, to_s),
            ]
        };
        Left { sensor: seen.sensor, heating_k: rms_k(0.0, cooling_s), cooling_k: rms_k(cooling_s, f64::INFINITY) }
    };
    let twins = case.observations.iter().map(|seen| twin(case, seen, other));
    Ok(Beside {
        id: other.id.clone(),
        name: other.name.clone(),
        factors: estimated.factors.iter().map(|factor| factor.factor.name.clone()).collect(),
        left: case.observations.iter().zip(twins.flatten()).map(left).collect(),
        cooling_s,
        estimated,
    })
}

/// The observation of the other case at the sensor of the same name.
fn twin<'a>(case: &Case, seen: &Observation, other: &'a Case) -> Option<&'a Observation> {
    let name = &case.sensors[seen.sensor].name;
    other.observations.iter().find(|twin| other.sensors[twin.sensor].name == *name)
}

/// In what the observations of two cases differ, if they do.
fn different(case: &Case, other: &Case) -> Option<String> {
    case.observations.iter().find_map(|seen| {
        let name = &case.sensors[seen.sensor].name;
        match twin(case, seen, other) {
            None => Some(format!("it has none at {name}")),
            Some(twin) if twin.times_s != seen.times_s || twin.temperatures_k != seen.temperatures_k => {
                Some(format!("those at {name} are others"))
            }
            Some(_) => None,
        }
    })
}

/// When the hot face is heated for the last time; a face that is held has no such time.
fn cooling_s(case: &Case) -> f64 {
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

/// Root mean square of predicted less measured after `from_s`, up to `to_s`. The window of all says what is fitted and leaves
/// nothing out here; that of a sensor says what of its readings is believed.
fn rms_k(seen: &Observation, predicted: &Nominal, sensor: usize, from_s: f64, to_s: f64) -> f64 {
    let samples = seen.times_s.iter().zip(&seen.temperatures_k);
    let is_believed = |time_s: f64| seen.window_s.is_none_or(|(first_s, last_s)| (first_s..=last_s).contains(&time_s));
    let (count, squares_k2) = samples
        .filter(|(time_s, _)| is_believed(**time_s) && **time_s <= to_s && (**time_s > from_s || from_s == 0.0))
        .fold((0.0, 0.0), |(count, sum), (&time_s, &measured_k)| {
            let off_k = predicted.at(sensor, time_s) - measured_k;
            (count + 1.0, sum + off_k * off_k)
        });
    (squares_k2 / count).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_the_misfit_is_a_quarter_of_its_square() {
        let left = Left { sensor: 0, heating_k: [1.0, 1.0], cooling_k: [8.0, 4.0] };
        assert_eq!(left.explained(), 0.75);
        assert!(Left { cooling_k: [4.0, 8.0], ..left }.explained() < 0.0, "a misfit that grew explains nothing");
    }
}
