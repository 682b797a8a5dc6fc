//! Data window and standard deviation of each thermocouple.

use super::format;
use crate::case::Observation;
use crate::study::answers::Answers;
use crate::study::nominal::Prediction;

/// Windows and standard deviations of the sensors that are fitted, where they differ from sensor to sensor.
pub(super) fn data_used(answers: &Answers) -> Option<String> {
    let judges = || answers.cases().flat_map(|case| case.fitted_observations().map(move |seen| (case, seen)));
    // Deviations that differ from sample to sample are in the table of the page; only constant ones are listed here.
    let stated_k = |seen: &Observation| Some(sigma_range_k(seen)).filter(|(least, most)| least == most).map(|(k, _)| k);
    let mut all_k = judges().filter_map(|(_, seen)| stated_k(seen));
    let first_k = all_k.next();
    let is_weighed = all_k.any(|sigma_k| Some(sigma_k) != first_k);
    let text = judges().filter_map(|(case, seen)| {
        let window = seen.window_s.map(window_text);
        let sigma = stated_k(seen)
            .filter(|_| is_weighed)
            .map(|sigma_k| format!("± {}", format::temperature_difference(sigma_k)));
        let text: Vec<String> = window.into_iter().chain(sigma).collect();
        (!text.is_empty()).then(|| format!("{} {}", answers.sensor_name(case, seen.sensor), text.join(", ")))
    });
    let text: Vec<String> = text.collect();
    (!text.is_empty()).then(|| format!("Data used: {}.", text.join("; ")))
}

/// `from 0 s to 80 s`.
pub(super) fn window_text((from_s, to_s): (f64, f64)) -> String {
    format!("from {} to {}", format::seconds(from_s), format::seconds(to_s))
}

/// Minimum and maximum standard deviation of the samples of a sensor, K.
pub(super) fn sigma_range_k(seen: &Observation) -> (f64, f64) {
    let each = || seen.sigma_k.iter().copied();
    (each().fold(f64::INFINITY, f64::min), each().fold(0.0, f64::max))
}

/// Root mean square and mean of prediction less measurement at a sensor; dashes if it was not measured.
pub(super) fn misfit_text(answers: &Answers, outcome: &Prediction, sensor: usize) -> (String, String) {
    let seen = answers.case.observations.iter().zip(&outcome.misfits).find(|(seen, _)| seen.sensor == sensor);
    seen.map_or(("-".to_owned(), "-".to_owned()), |(_, misfit)| {
        (format::temperature_difference(misfit.rms_k), format!("{} K", format::signed(misfit.bias_k, 1)))
    })
}
