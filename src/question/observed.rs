//! The observations that a question uses in place of those that the case states.

use super::error::{InputError, index_of};
use super::quantity;
use crate::case::{Bounds, Case, EstimationSettings};
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;

/// The observations to use. The case states what is not given.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default)]
pub struct ObservationSelection {
    /// Sensors, as TC3,TC4
    #[cfg_attr(feature = "command", arg(long, value_delimiter = ',', value_parser = quantity::name))]
    #[serde(with = "quantity::list")]
    pub sensors: Vec<String>,
    /// Time window START:END in seconds, as 0:80, for all sensors; replaces windows of the case file
    #[cfg_attr(feature = "command", arg(
        id = "window", long = "window", value_name = "START:END", value_parser = quantity::seconds::range
    ))]
    #[serde(rename = "window", with = "quantity::seconds")]
    pub window_s: Option<(f64, f64)>,
    /// Bounds of the factors
    #[cfg_attr(feature = "command", arg(long, value_enum))]
    pub bounds: Option<Bounds>,
}

impl ObservationSelection {
    /// The cases with these sensors, this window and these bounds in place of their own.
    pub(super) fn apply(&self, cases: Vec<Case>) -> Result<Vec<Case>, InputError> {
        let mut estimates = estimates(&cases);
        if !self.sensors.is_empty() {
            let names = |case: &Case| case.sensors.iter().map(|sensor| sensor.name.clone()).collect();
            let chosen = chosen_indices(&cases, &self.sensors, "sensors", "sensor", names)?;
            for ((case, estimate), chosen) in cases.iter().zip(&mut estimates).zip(chosen) {
                if chosen.is_empty() {
                    let message = format!(": the case {:?} has none of {}", case.id, self.sensors.join(", "));
                    return Err(InputError::for_option("sensors", message));
                }
                estimate.sensors = chosen;
            }
        }
        let reversed_s = self.window_s.filter(|(start_s, end_s)| start_s.partial_cmp(end_s) != Some(Ordering::Less));
        if let Some((start_s, end_s)) = reversed_s {
            let message = format!(": expected a start before the end, found {start_s} s and {end_s} s");
            return Err(InputError::for_option("window", message));
        }
        let apply = |(case, mut estimate): (Case, EstimationSettings)| {
            estimate.bounds = self.bounds.unwrap_or(estimate.bounds);
            let case = case.with_estimate(estimate);
            let case = match self.window_s {
                Some(window_s) => case.with_window_s(window_s),
                None => case,
            };
            check_samples(&case).map(|()| case)
        };
        cases.into_iter().zip(estimates).map(apply).collect()
    }

    /// [`apply`](Self::apply) to one case.
    pub(super) fn applied(&self, case: &Case) -> Result<Case, InputError> {
        Ok(self.apply(vec![case.clone()])?.remove(0))
    }
}

/// The estimate that each case states.
pub(super) fn estimates(cases: &[Case]) -> Vec<EstimationSettings> {
    cases.iter().map(|case| case.estimate.clone()).collect()
}

/// Check that every chosen sensor has samples in its window, or none has: without any samples, all instants are used.
fn check_samples(case: &Case) -> Result<(), InputError> {
    let has_samples = |sensor: usize| {
        let (from_s, to_s) = case.window_s(sensor);
        let mut times_s = case.observations.iter().filter(|seen| seen.sensor == sensor).flat_map(|seen| &seen.times_s);
        times_s.any(|time_s| (from_s..=to_s).contains(time_s))
    };
    let (with_samples, without_samples): (Vec<usize>, Vec<usize>) =
        case.estimate.sensors.iter().partition(|&&sensor| has_samples(sensor));
    match (with_samples.is_empty(), without_samples.first()) {
        (false, Some(&sensor)) => {
            let ((from_s, to_s), name) = (case.window_s(sensor), &case.sensors[sensor].name);
            let id = &case.id;
            Err(InputError::general(format!(
                "{id}: sensor {name:?} has no samples between {from_s} s and {to_s} s; leave it out"
            )))
        }
        _ => Ok(()),
    }
}

/// The indices of the chosen names in each case. Every name must occur in a case.
pub(super) fn chosen_indices(
    cases: &[Case],
    chosen: &[String],
    option: &'static str,
    noun: &str,
    names: impl Fn(&Case) -> Vec<String>,
) -> Result<Vec<Vec<usize>>, InputError> {
    let names: Vec<Vec<String>> = cases.iter().map(names).collect();
    let mut all: Vec<&str> = Vec::new();
    for name in names.iter().flatten() {
        if !all.contains(&name.as_str()) {
            all.push(name);
        }
    }
    for (index, name) in chosen.iter().enumerate() {
        index_of(all.iter().copied(), name, option, noun)?;
        if chosen[..index].contains(name) {
            return Err(InputError::for_option(option, format!(" names {name:?} twice")));
        }
    }
    let indices =
        |names: &Vec<String>| chosen.iter().filter_map(|name| names.iter().position(|other| other == name)).collect();
    Ok(names.iter().map(indices).collect())
}
