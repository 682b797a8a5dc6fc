//! Piecewise-linear functions: a property over temperature, and a schedule over time.

use super::unit::Dimension;
use super::validation::{FieldPath, finite, positive};
use crate::limits::PROPERTY_DECADES;

/// Behaviour of a table outside the temperatures of its points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum OutOfRange {
    /// A member that leaves the range fails.
    Error,
    /// The end value.
    Clamp,
    /// Linear extrapolation of the end segment, but at least a tenth of the end value, so that a decreasing
    /// conductivity or emissivity stays positive.
    Extrapolate,
}

/// A property over temperature: piecewise linear between strictly increasing temperatures.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Table {
    pub(crate) temperatures_k: Vec<f64>,
    pub(crate) values: Vec<f64>,
    pub(crate) outside: OutOfRange,
}

impl Table {
    /// A table of one value (SI) per temperature (K).
    ///
    /// # Errors
    /// A message, if there is no point, the lengths differ, a number is not finite, or the temperatures do not increase
    /// from above 0 K.
    pub fn new(temperatures_k: Vec<f64>, values: Vec<f64>, outside: OutOfRange) -> Result<Self, String> {
        check_lengths(values.len(), temperatures_k.len(), "temperatures")?;
        let mut last_k = 0.0;
        for &temperature_k in &temperatures_k {
            last_k = Self::checked_next_temperature_k(last_k, temperature_k)?;
        }
        values.iter().try_for_each(|&value| finite(value, value).map(drop))?;
        Ok(Self { temperatures_k, values, outside })
    }

    /// The temperature of the next point, above the previous one and above zero, K.
    pub(super) fn checked_next_temperature_k(last_k: f64, temperature_k: f64) -> Result<f64, String> {
        if finite(temperature_k, format_args!("a temperature of {temperature_k} K"))? > last_k {
            return Ok(temperature_k);
        }
        Err(format!("expected a temperature above {last_k} K, found {temperature_k} K"))
    }

    /// A value of a property of this dimension: a fraction from 0 to 1, any finite enthalpy, else a positive number.
    pub(super) fn checked_value(value: f64, dimension: Dimension) -> Result<f64, String> {
        match dimension {
            Dimension::Fraction if !(0.0..=1.0).contains(&value) => {
                Err(format!("expected a value from 0 to 1, found {value}"))
            }
            Dimension::Fraction => Ok(value),
            Dimension::SpecificEnthalpy => finite(value, value),
            _ => {
                let decades = positive(value, value)?.log10().abs();
                let check = PROPERTY_DECADES.check(decades);
                check.map(|()| value).map_err(|message| format!("{message} in the value {value:e}"))
            }
        }
    }

    /// Record the values that a property of this dimension cannot have.
    pub(super) fn check(&self, at: &FieldPath<'_>, dimension: Dimension) {
        at.child("values").require_each(&self.values, |&value| Self::checked_value(value, dimension));
    }

    /// The temperatures of the points, strictly increasing, K.
    pub fn temperatures_k(&self) -> &[f64] {
        &self.temperatures_k
    }

    /// The values at these temperatures, in SI.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Behaviour outside the points.
    pub fn outside(&self) -> OutOfRange {
        self.outside
    }

    /// The same value at all temperatures.
    pub fn constant(value: f64) -> Self {
        Self { temperatures_k: vec![300.0], values: vec![value], outside: OutOfRange::Clamp }
    }

    /// The value at a temperature.
    pub fn at(&self, temperature_k: f64) -> f64 {
        let (temperatures, values) = (&self.temperatures_k, &self.values);
        let last = temperatures.len() - 1;
        if last == 0 {
            return values[0];
        }
        let inside = temperature_k.clamp(temperatures[0], temperatures[last]);
        let above = temperatures.partition_point(|&t| t <= inside).clamp(1, last);
        let argument_k = match self.outside {
            OutOfRange::Extrapolate => temperature_k,
            OutOfRange::Clamp | OutOfRange::Error => inside,
        };
        let slope = (values[above] - values[above - 1]) / (temperatures[above] - temperatures[above - 1]);
        let value = values[above - 1] + slope * (argument_k - temperatures[above - 1]);
        if argument_k < temperatures[0] {
            value.max(0.1 * values[0])
        } else if argument_k > temperatures[last] {
            value.max(0.1 * values[last])
        } else {
            value
        }
    }

    /// The ratio to another table, if it is the same at all temperatures.
    pub fn constant_ratio_to(&self, other: &Self) -> Option<f64> {
        let times = self.values[0] / other.values[0];
        let is_alike = self.temperatures_k == other.temperatures_k && self.outside == other.outside;
        let mut pairs = self.values.iter().zip(&other.values);
        (is_alike && pairs.all(|(&own, &value)| is_multiple(own, value, times))).then_some(times)
    }

    /// Lowest and highest temperature of the points, K; infinite for a single point.
    pub fn range_k(&self) -> (f64, f64) {
        match self.temperatures_k.as_slice() {
            [] | [_] => (f64::NEG_INFINITY, f64::INFINITY),
            [first, .., last] => (*first, *last),
        }
    }
}

/// Require at least one point and one value per point.
fn check_lengths(values: usize, points: usize, noun: &str) -> Result<(), String> {
    match points {
        0 => Err(format!("no {noun}: expected at least one")),
        _ if values != points => Err(format!("expected one value for each of {points} {noun}, found {values}")),
        _ => Ok(()),
    }
}

/// Whether a time or depth may follow the previous one; `repeats` allows equal ones.
pub(super) fn is_increasing(last: f64, next: f64, repeats: bool) -> bool {
    next > last || (repeats && next == last)
}

/// A time (s) or depth (m) that may follow the previous one.
pub(super) fn checked_increasing(noun: &str, last: f64, next: f64, repeats: bool) -> Result<f64, String> {
    let unit = if noun == "time" { "s" } else { "m" };
    if is_increasing(last, finite(next, format_args!("a {noun} of {next} {unit}"))?, repeats) {
        return Ok(next);
    }
    let rule = if repeats { "must not decrease" } else { "must increase" };
    Err(format!("{noun}s {rule}: {next} {unit} follows {last} {unit}"))
}

/// Whether `own` equals `times × other` up to rounding.
pub(super) fn is_multiple(own: f64, other: f64, times: f64) -> bool {
    times.is_finite() && (own - times * other).abs() <= 1e-12 * own.abs()
}

/// A quantity over time: piecewise linear between corners, constant before the first and after the last. Two corners at
/// the same time are a jump; at that time the value after the jump holds.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Schedule {
    pub(crate) times_s: Vec<f64>,
    pub(crate) values: Vec<f64>,
}

impl Schedule {
    /// A schedule of one value (SI) per time (s). Two equal times in a row are a jump.
    ///
    /// # Errors
    /// A message, if there is no corner, the lengths differ, a number is not finite, or the times decrease.
    pub fn new(times_s: Vec<f64>, values: Vec<f64>) -> Result<Self, String> {
        check_lengths(values.len(), times_s.len(), "times")?;
        let mut last_s = f64::NEG_INFINITY;
        for (&time_s, &value) in times_s.iter().zip(&values) {
            last_s = checked_increasing("time", last_s, time_s, true)?;
            finite(value, value)?;
        }
        Ok(Self { times_s, values })
    }

    /// The times of the corners, not decreasing, s.
    pub fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// The values at these corners, in SI.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Require positive values of a pressure, Pa.
    pub(super) fn check_pressure(&self) -> Result<(), String> {
        match self.values.iter().find(|value| **value <= 0.0) {
            Some(value) => Err(format!("expected a pressure above 0 Pa, found {value} Pa")),
            None => Ok(()),
        }
    }

    /// Require values that are not negative.
    pub(super) fn check_not_negative(&self) -> Result<(), String> {
        match self.values.iter().find(|value| **value < 0.0) {
            Some(value) => Err(format!("expected 0 or more, found {value}")),
            None => Ok(()),
        }
    }

    /// Whether a value is not zero.
    pub fn acts(&self) -> bool {
        self.values.iter().any(|value| *value != 0.0)
    }

    /// The lowest value.
    pub fn lowest(&self) -> f64 {
        self.values.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// Record the first value that a quantity of this dimension cannot have.
    pub(super) fn check(&self, at: &FieldPath<'_>, dimension: Dimension) {
        if let Some(value) = self.values.iter().find(|value| !dimension.is_allowed(**value)) {
            at.error(format!("{value} K is {}", dimension.violation()));
        }
    }

    /// The same value at all times.
    pub fn constant(value: f64) -> Self {
        Self { times_s: vec![0.0], values: vec![value] }
    }

    /// The value just after a time: at a jump the value after it.
    pub fn after(&self, time_s: f64) -> f64 {
        self.after_within(time_s, 0.0)
    }

    /// As [`after`](Self::after); a corner within `close_s` counts as being at that time.
    pub fn after_within(&self, time_s: f64, close_s: f64) -> f64 {
        self.interpolate_segment(self.times_s.partition_point(|&t| t <= time_s + close_s), time_s)
    }

    /// The value just before a time: at a jump the value before it.
    pub fn before(&self, time_s: f64) -> f64 {
        self.before_within(time_s, 0.0)
    }

    /// As [`before`](Self::before); a corner within `close_s` counts as being at that time.
    pub fn before_within(&self, time_s: f64, close_s: f64) -> f64 {
        self.interpolate_segment(self.times_s.partition_point(|&t| t < time_s - close_s), time_s)
    }

    /// The value on the segment that ends at corner `next`; the time is clamped to the segment.
    fn interpolate_segment(&self, next: usize, time_s: f64) -> f64 {
        let last = self.times_s.len() - 1;
        if next == 0 {
            return self.values[0];
        }
        if next > last {
            return self.values[last];
        }
        let (t0, t1) = (self.times_s[next - 1], self.times_s[next]);
        let (v0, v1) = (self.values[next - 1], self.values[next]);
        v0 + (v1 - v0) * (time_s.clamp(t0, t1) - t0) / (t1 - t0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_a_jump_of_a_schedule_the_later_value_holds() {
        let flux = Schedule { times_s: vec![0.0, 41.0, 41.0], values: vec![5.0, 5.0, 0.0] };
        assert_eq!(flux.before(41.0), 5.0);
        assert_eq!(flux.after(41.0), 0.0);
        assert_eq!(flux.after(100.0), 0.0);
        assert_eq!(flux.before(20.0), 5.0);
    }

    #[test]
    fn a_table_is_a_multiple_of_another_if_all_its_values_are() {
        let table = |values| Table { temperatures_k: vec![300.0, 400.0], values, outside: OutOfRange::Clamp };
        let virgin = table(vec![0.1, 0.3]);
        assert_eq!(table(vec![0.12, 0.36]).constant_ratio_to(&virgin).map(|times| (times * 1e9).round()), Some(1.2e9));
        assert_eq!(table(vec![0.12, 0.3601]).constant_ratio_to(&virgin), None);
        assert_eq!(table(vec![0.0, 0.3]).constant_ratio_to(&table(vec![0.0, 0.1])), None, "0/0 is not a ratio");
        let refused = Table { outside: OutOfRange::Error, ..virgin.clone() };
        assert_eq!(refused.constant_ratio_to(&virgin), None);
    }

    #[test]
    fn an_extrapolated_decreasing_table_stays_positive() {
        let table =
            Table { temperatures_k: vec![300.0, 400.0], values: vec![1.0, 0.5], outside: OutOfRange::Extrapolate };
        assert_eq!(table.at(350.0), 0.75);
        assert_eq!(table.at(420.0), 0.4);
        assert_eq!(table.at(5000.0), 0.05);
        assert_eq!(table.at(200.0), 1.5);
    }

    #[test]
    fn tables_and_schedules_that_are_unordered_or_not_finite_are_refused() {
        let table = |temperatures_k: &[f64], values: &[f64]| {
            Table::new(temperatures_k.to_vec(), values.to_vec(), OutOfRange::Clamp).map(|_| ())
        };
        assert_eq!(table(&[300.0, 400.0], &[1.0, 2.0]), Ok(()));
        for (temperatures_k, values, message) in [
            (&[][..], &[][..], "no temperatures: expected at least one"),
            (&[300.0], &[1.0, 2.0], "expected one value for each of 1 temperatures, found 2"),
            (&[300.0, 300.0], &[1.0, 2.0], "expected a temperature above 300 K, found 300 K"),
            (&[0.0], &[1.0], "expected a temperature above 0 K, found 0 K"),
            (&[f64::NAN], &[1.0], "expected a finite number, found a temperature of NaN K"),
            (&[300.0], &[f64::INFINITY], "expected a finite number, found inf"),
        ] {
            assert_eq!(table(temperatures_k, values), Err(message.to_owned()));
        }
        let schedule = |times_s: &[f64], values: &[f64]| Schedule::new(times_s.to_vec(), values.to_vec()).map(|_| ());
        assert_eq!(schedule(&[0.0, 41.0, 41.0], &[5.0, 5.0, 0.0]), Ok(()));
        for (times_s, values, message) in [
            (&[][..], &[][..], "no times: expected at least one"),
            (&[0.0], &[], "expected one value for each of 1 times, found 0"),
            (&[1.0, 0.5], &[1.0, 2.0], "times must not decrease: 0.5 s follows 1 s"),
            (&[f64::NAN], &[1.0], "expected a finite number, found a time of NaN s"),
            (&[0.0], &[f64::NAN], "expected a finite number, found NaN"),
        ] {
            assert_eq!(schedule(times_s, values), Err(message.to_owned()));
        }
    }
}
