//! Piecewise-linear functions: a property over temperature, and a schedule over time.

use super::unit::Dimension;
use super::validation::{FieldPath, finite, positive, readable};
use crate::limits::{PROPERTY_DECADES, TABLE_TEMPERATURE_DISTANCE_K};

/// Behaviour of a table outside the temperatures of its points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[derive(serde::Serialize)]
pub enum OutOfRange {
    /// A member that leaves the range fails.
    Error,
    /// The end value.
    Clamp,
    /// Linear extrapolation of the end segment, but at least a tenth of the end value, so that a decreasing
    /// conductivity or emissivity stays positive.
    Extrapolate,
}

/// The least value of an extrapolated table, as a share of its end value.
const EXTRAPOLATION_FLOOR: f64 = 0.1;

/// A property over temperature: piecewise linear between temperatures that do not decrease. Two points at the same
/// temperature are a jump; at that temperature the value after the jump holds.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Table {
    pub(crate) temperatures_k: Vec<f64>,
    pub(crate) values: Vec<f64>,
    pub(crate) outside: OutOfRange,
}

impl Table {
    /// A table of one value (SI) per temperature (K).
    ///
    /// # Errors
    /// A message, if there is no point, the lengths differ, a number is not finite, the temperatures decrease or are
    /// not above 0 K, more than two are equal, or two differ by less than 5 mK.
    pub fn new(temperatures_k: Vec<f64>, values: Vec<f64>, outside: OutOfRange) -> Result<Self, String> {
        check_lengths(values.len(), temperatures_k.len(), "temperatures")?;
        (0..temperatures_k.len()).try_for_each(|next| Self::check_temperature(&temperatures_k, next))?;
        values.iter().try_for_each(|&value| finite(value, value).map(drop))?;
        Ok(Self { temperatures_k, values, outside })
    }

    /// Check one of the temperatures of the points against those before it: above zero and not decreasing, and at
    /// most two are equal.
    pub(super) fn check_temperature(temperatures_k: &[f64], point: usize) -> Result<(), String> {
        let temperature_k = temperatures_k[point];
        finite(temperature_k, format_args!("a temperature of {temperature_k} K"))?;
        let last_k = if point == 0 { 0.0 } else { temperatures_k[point - 1] };
        if temperature_k < last_k || temperature_k <= 0.0 {
            return Err(format!("expected a temperature above {last_k} K, found {temperature_k} K"));
        }
        if temperature_k != last_k && temperature_k - last_k < TABLE_TEMPERATURE_DISTANCE_K {
            return Err(format!(
                "{temperature_k} K is within {TABLE_TEMPERATURE_DISTANCE_K} K of {last_k} K: expected a larger \
                 distance, or the same temperature twice for a jump"
            ));
        }
        if point > 1 && temperature_k == temperatures_k[point - 2] {
            return Err(format!("{temperature_k} K three times: expected at most twice, before and after a jump"));
        }
        Ok(())
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

    /// The value at a temperature; at a jump the value after it.
    pub fn at(&self, temperature_k: f64) -> f64 {
        self.beside(self.temperatures_k.partition_point(|&t| t <= temperature_k), temperature_k)
    }

    /// The limit of the value from lower temperatures: at a jump the value before it.
    pub(crate) fn just_below(&self, temperature_k: f64) -> f64 {
        self.beside(self.temperatures_k.partition_point(|&t| t < temperature_k), temperature_k)
    }

    /// The value at a temperature between the points `next - 1` and `next`, or beyond the first or the last.
    fn beside(&self, next: usize, temperature_k: f64) -> f64 {
        let (temperatures, values) = (&self.temperatures_k, &self.values);
        if next > 0 && next < temperatures.len() {
            let slope = (values[next] - values[next - 1]) / (temperatures[next] - temperatures[next - 1]);
            return values[next - 1] + slope * (temperature_k - temperatures[next - 1]);
        }
        let (end, _) = self.end(next == 0);
        match self.outside {
            OutOfRange::Extrapolate => self.extrapolated(next == 0, temperature_k),
            OutOfRange::Clamp | OutOfRange::Error => values[end],
        }
    }

    /// The number of the first or of the last point, and the slope of its segment.
    fn end(&self, is_first: bool) -> (usize, f64) {
        let last = self.temperatures_k.len() - 1;
        let (end, next) = if is_first { (0, last.min(1)) } else { (last, last.saturating_sub(1)) };
        let rise_k = self.temperatures_k[next] - self.temperatures_k[end];
        let slope = if rise_k == 0.0 { 0.0 } else { (self.values[next] - self.values[end]) / rise_k };
        (end, slope)
    }

    fn extrapolated(&self, is_first: bool, temperature_k: f64) -> f64 {
        let (end, slope) = self.end(is_first);
        let value = self.values[end];
        (value + slope * (temperature_k - self.temperatures_k[end])).max(EXTRAPOLATION_FLOOR * value)
    }

    /// The temperatures at which the slope or the value of the function changes, in order, K.
    pub(crate) fn corners_k(&self) -> Vec<f64> {
        if self.temperatures_k.len() == 1 {
            return vec![];
        }
        let floor_k = |is_first: bool| {
            let (end, slope) = self.end(is_first);
            let rise_k = (EXTRAPOLATION_FLOOR - 1.0) * self.values[end] / slope;
            let is_outside = self.outside == OutOfRange::Extrapolate && (rise_k < 0.0) == is_first;
            (is_outside && rise_k.is_finite()).then_some(self.temperatures_k[end] + rise_k)
        };
        let points_k = self.temperatures_k.iter().copied();
        floor_k(true).into_iter().chain(points_k).chain(floor_k(false)).collect()
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
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
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
            at.error(format!("{} K is {}", readable(*value), dimension.violation(*value)));
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
    fn a_temperature_stated_twice_is_a_jump_with_the_later_value_at_it() {
        for outside in [OutOfRange::Clamp, OutOfRange::Extrapolate] {
            let table = Table::new(vec![300.0, 400.0, 400.0, 500.0], vec![1.0, 2.0, 4.0, 6.0], outside)
                .expect("a table with a jump");
            assert_eq!((table.just_below(400.0), table.at(400.0)), (2.0, 4.0));
            assert_eq!((table.just_below(350.0), table.at(350.0), table.at(450.0)), (1.5, 1.5, 5.0));
            let ends = Table::new(vec![300.0, 300.0, 400.0, 400.0], vec![1.0, 2.0, 2.0, 4.0], outside)
                .expect("a table with jumps at its ends");
            assert_eq!([299.0, 300.0, 399.0, 400.0, 500.0].map(|t| ends.at(t)), [1.0, 2.0, 2.0, 4.0, 4.0]);
            assert_eq!((ends.just_below(300.0), ends.just_below(400.0)), (1.0, 2.0));
        }
    }

    #[test]
    fn an_extrapolated_table_has_a_corner_where_it_meets_its_floor() {
        let table = Table::new(vec![300.0, 400.0], vec![1.0, 0.5], OutOfRange::Extrapolate).expect("a table");
        assert_eq!(table.corners_k(), [300.0, 400.0, 490.0]);
        assert!((table.at(490.0) - 0.05).abs() < 1e-12 && (table.at(489.0) - 0.055).abs() < 1e-12);
        let clamped = Table { outside: OutOfRange::Clamp, ..table };
        assert_eq!(clamped.corners_k(), [300.0, 400.0]);
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
            (&[300.0, 299.0], &[1.0, 2.0], "expected a temperature above 300 K, found 299 K"),
            (
                &[300.0, 300.0, 300.0],
                &[1.0, 2.0, 3.0],
                "300 K three times: expected at most twice, before and after a jump",
            ),
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
