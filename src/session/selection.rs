//! Observations and factors that a study uses in place of those that the case states.

use super::error::{InputError, SessionError, index_of};
use super::options::{FitOptions, ObservationSelection, Start, check_limit};
use crate::case::{Case, EstimationSettings};
use crate::limits::STARTS;
use std::cmp::Ordering;

impl ObservationSelection {
    /// The cases with these sensors, this window and these bounds in place of their own.
    pub(super) fn apply(&self, cases: Vec<Case>) -> Result<Vec<Case>, SessionError> {
        let mut estimates = estimates(&cases);
        if !self.sensors.is_empty() {
            let names = |case: &Case| case.sensors.iter().map(|sensor| sensor.name.clone()).collect();
            let chosen = chosen_indices(&cases, &self.sensors, "sensors", "sensor", names)?;
            for ((case, estimate), chosen) in cases.iter().zip(&mut estimates).zip(chosen) {
                if chosen.is_empty() {
                    let message = format!(": the case {:?} has none of {}", case.id, self.sensors.join(", "));
                    return Err(InputError::for_option("sensors", message).into());
                }
                estimate.sensors = chosen;
            }
        }
        let reversed_s = self.window_s.filter(|(start_s, end_s)| start_s.partial_cmp(end_s) != Some(Ordering::Less));
        if let Some((start_s, end_s)) = reversed_s {
            let message = format!(": expected a start before the end, found {start_s} s and {end_s} s");
            return Err(InputError::for_option("window", message).into());
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
}

impl FitOptions {
    /// The cases with these factors, starts, loss and prior in place of their own.
    pub(super) fn apply(&self, cases: Vec<Case>) -> Result<Vec<Case>, SessionError> {
        if self.starts == 0 {
            return Err(InputError::for_option("starts", " 0: expected at least 1").into());
        }
        check_limit(&STARTS, self.starts as f64, "starts")?;
        let mut estimates = estimates(&cases);
        if !self.factors.is_empty() {
            let names = |case: &Case| case.factors.iter().map(|factor| factor.name.clone()).collect();
            let chosen = chosen_indices(&cases, &self.factors, "factors", "factor", names)?;
            for (estimate, chosen) in estimates.iter_mut().zip(chosen) {
                estimate.factors = chosen;
                estimate.start.clear();
            }
        }
        set_starts(&cases, &mut estimates, &self.start)?;
        for estimate in &mut estimates {
            estimate.loss_function = self.loss.unwrap_or(estimate.loss_function);
            estimate.prior = self.prior.unwrap_or(estimate.prior);
        }
        let cases = cases.into_iter().zip(estimates).map(|(case, estimate)| case.with_estimate(estimate)).collect();
        check_starts(cases)
    }
}

/// The estimate that each case states.
fn estimates(cases: &[Case]) -> Vec<EstimationSettings> {
    cases.iter().map(|case| case.estimate.clone()).collect()
}

/// Check that every chosen sensor has samples in its window, or none has: without any samples, all instants are used.
fn check_samples(case: &Case) -> Result<(), SessionError> {
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
            ))
            .into())
        }
        _ => Ok(()),
    }
}

/// The indices of the chosen names in each case. Every name must occur in a case.
fn chosen_indices(
    cases: &[Case],
    chosen: &[String],
    option: &'static str,
    noun: &str,
    names: impl Fn(&Case) -> Vec<String>,
) -> Result<Vec<Vec<usize>>, SessionError> {
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
            return Err(InputError::for_option(option, format!(" names {name:?} twice")).into());
        }
    }
    let indices =
        |names: &Vec<String>| chosen.iter().filter_map(|name| names.iter().position(|other| other == name)).collect();
    Ok(names.iter().map(indices).collect())
}

/// Set the start values of every case that estimates the factor, or of the one case that the start names.
fn set_starts(cases: &[Case], estimates: &mut [EstimationSettings], starts: &[Start]) -> Result<(), SessionError> {
    if starts.is_empty() {
        return Ok(());
    }
    for (case, estimate) in cases.iter().zip(estimates.iter_mut()) {
        estimate.start = estimate.factors.iter().map(|&factor| case.factors[factor].nominal).collect();
    }
    for Start { factor: name, case: only, value } in starts {
        let mut is_estimated = false;
        let pairs = cases.iter().zip(estimates.iter_mut());
        for (case, estimate) in pairs.filter(|(case, _)| only.as_ref().is_none_or(|id| *id == case.id)) {
            let index = estimate.factors.iter().position(|&chosen| case.factors[chosen].name == *name);
            let Some(index) = index else { continue };
            let (low, high) = case.factors[estimate.factors[index]].bounds(estimate.bounds);
            if !(low..=high).contains(value) {
                let message = format!(" {name}={value}: outside its bounds {low} to {high}");
                return Err(InputError::for_option("start", message).into());
            }
            estimate.start[index] = *value;
            is_estimated = true;
        }
        if !is_estimated {
            return Err(InputError::for_option("start", format!(" {name}: that factor is not estimated")).into());
        }
    }
    Ok(())
}

fn check_starts(cases: Vec<Case>) -> Result<Vec<Case>, SessionError> {
    for case in &cases {
        for (&factor, &start) in case.estimate.factors.iter().zip(&case.estimate.start) {
            let (factor, bounds) = (&case.factors[factor], case.estimate.bounds);
            let (low, high) = factor.bounds(bounds);
            if !(low..=high).contains(&start) {
                let (id, name, bounds) = (&case.id, &factor.name, bounds.name());
                return Err(InputError::general(format!(
                    "{id}: the start {start} of {name:?} lies outside its {bounds} bounds {low} to {high}; give --start"
                ))
                .into());
            }
        }
    }
    Ok(cases)
}
