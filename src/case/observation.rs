//! Measured temperatures of a sensor.

use super::table::checked_increasing;
use super::validation::{FieldPath, checked_index, checked_layup_temperature_k, not_negative, readable};
use crate::limits::LAYUP_TEMPERATURE_K;

/// A sensor's measured trace.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Observation {
    /// Index of the sensor.
    pub sensor: usize,
    /// Sample times, strictly increasing, within the exposure, s.
    pub times_s: Vec<f64>,
    /// Sample temperatures, K.
    pub temperatures_k: Vec<f64>,
    /// Standard deviation of each sample, above zero, K; the weight of a sample is 1/σ².
    pub sigma_k: Vec<f64>,
    /// Time window of this sensor, s, if it differs from the common one: for example until a thermocouple came loose.
    pub window_s: Option<(f64, f64)>,
}

/// A rule for a number in K.
type Rule = fn(f64) -> Result<f64, String>;

/// Standard deviations of readings, K: far finer than any instrument, and as wide as all temperatures. Squares of
/// residuals in units beyond them leave the range of numbers.
const SIGMAS_K: (f64, f64) = (1e-6, LAYUP_TEMPERATURE_K.max as f64);

/// A time window that starts before the end of the exposure, s.
pub(super) fn checked_window_s((start_s, end_s): (f64, f64), duration_s: f64) -> Result<(f64, f64), String> {
    not_negative(start_s, format_args!("a window from {start_s} s"))?;
    if not_negative(end_s, format_args!("a window to {end_s} s"))? <= start_s {
        return Err(format!("window reversed: {start_s} s is not before {end_s} s"));
    }
    if start_s >= duration_s {
        return Err(format!(
            "expected a window that begins before {duration_s} s, the end of the exposure, found {start_s} s"
        ));
    }
    Ok((start_s, end_s))
}

impl Observation {
    /// A window with at least one sample of the sensor of this name, s.
    pub(super) fn checked_window_with_samples_s(
        &self,
        window_s: (f64, f64),
        sensor: &str,
    ) -> Result<(f64, f64), String> {
        let ((start_s, end_s), times_s) = (window_s, &self.times_s);
        if times_s.iter().any(|time_s| (start_s..=end_s).contains(time_s)) {
            return Ok(window_s);
        }
        let span = match times_s.as_slice() {
            [] => String::new(),
            [first_s, ..] => format!(" from {first_s} s to {} s", times_s[times_s.len() - 1]),
        };
        let count = times_s.len();
        Err(format!("no sample of {sensor:?} between {start_s} s and {end_s} s: it has {count} samples{span}"))
    }

    /// The standard deviation of a reading, K.
    pub(crate) fn checked_sigma_k(sigma_k: f64) -> Result<f64, String> {
        let (least_k, most_k) = SIGMAS_K;
        if (least_k..=most_k).contains(&sigma_k) {
            return Ok(sigma_k);
        }
        let found = readable(sigma_k);
        Err(format!("expected a standard deviation from {least_k:e} K to {most_k} K, found {found} K"))
    }

    /// The time of the first sample, at least zero, s.
    pub(super) fn checked_first_s(first_s: f64) -> Result<f64, String> {
        if first_s >= 0.0 {
            Ok(first_s)
        } else {
            Err(format!("expected samples from 0 s on, found one at {first_s} s"))
        }
    }

    /// Record all errors of the samples and their window; `sensors` are the sensor names of the case.
    pub(super) fn check(&self, at: &FieldPath<'_>, sensors: &[&str], duration_s: f64) {
        let sensor = at.child("sensor").require(checked_index(self.sensor, sensors.len(), "sensor"));
        let times = at.child("times_s");
        let first_s = self.times_s.first().ok_or_else(|| "no sample: expected at least one".to_owned());
        times.require(first_s.and_then(|&first_s| Self::checked_first_s(first_s)));
        let mut last_s = f64::NEG_INFINITY;
        times.require_each(&self.times_s, |&time_s| {
            last_s = checked_increasing("time", last_s, time_s, false)?;
            if time_s > duration_s {
                return Err(format!(
                    "expected samples up to {duration_s} s, the end of the exposure, found one at {time_s} s"
                ));
            }
            Ok(())
        });
        let fields: [(_, _, Rule); 2] = [
            ("temperatures_k", &self.temperatures_k, checked_layup_temperature_k),
            ("sigma_k", &self.sigma_k, Self::checked_sigma_k),
        ];
        for (name, values, rule) in fields {
            let field = at.child(name);
            if values.len() != self.times_s.len() {
                let (found, requested) = (values.len(), self.times_s.len());
                field.error(format!("expected one value for each of {requested} times, found {found}"));
            }
            field.require_each(values, |&value| rule(value));
        }
        if let Some(window_s) = self.window_s {
            let window = at.child("window_s");
            let window_s = window.require(checked_window_s(window_s, duration_s));
            if let Some((window_s, sensor)) = window_s.zip(sensor) {
                window.require(self.checked_window_with_samples_s(window_s, sensors[sensor]));
            }
        }
    }
}
