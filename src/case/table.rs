//! Piecewise-linear tables: a property over temperature, and a schedule over time.

use super::check::{Field, finite, positive};
use super::unit::Dimension;

/// What a table answers outside the range of its points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum OutOfRange {
    /// A member that leaves the range is counted as failed.
    Refuse,
    /// The end value is held.
    Clamp,
    /// The end segment is continued in a straight line, never below a tenth of the end value, so that
    /// a falling conductivity or emissivity cannot turn negative.
    Extrapolate,
}

/// A property over temperature: straight lines between points at strictly rising temperatures.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Table {
    pub(crate) temperatures_k: Vec<f64>,
    pub(crate) values: Vec<f64>,
    pub(crate) outside: OutOfRange,
}

impl Table {
    /// A table of one value a temperature (K), in SI.
    ///
    /// # Errors
    /// A message, where there is no point, the lengths differ, a number is not finite, or temperatures do not rise from
    /// above absolute zero.
    pub fn new(temperatures_k: Vec<f64>, values: Vec<f64>, outside: OutOfRange) -> Result<Self, String> {
        as_many(values.len(), temperatures_k.len(), "temperatures")?;
        let mut last_k = 0.0;
        for &temperature_k in &temperatures_k {
            last_k = Self::next_k(last_k, temperature_k)?;
        }
        values.iter().try_for_each(|&value| finite(value, value).map(drop))?;
        Ok(Self { temperatures_k, values, outside })
    }

    /// The temperature of a point, K, which lies above that of the point before, or above zero for the first.
    pub(super) fn next_k(last_k: f64, temperature_k: f64) -> Result<f64, String> {
        if finite(temperature_k, format_args!("temperature {temperature_k} K"))? > last_k {
            return Ok(temperature_k);
        }
        Err(format!("temperature {temperature_k} K does not rise above {last_k} K"))
    }

    /// A value of a property of this dimension: a fraction lies between 0 and 1, an enthalpy counts from any level, all
    /// else is positive.
    pub(super) fn property_value(value: f64, dimension: Dimension) -> Result<f64, String> {
        match dimension {
            Dimension::Fraction if !(0.0..=1.0).contains(&value) => Err(format!("{value} lies outside 0 to 1")),
            Dimension::Fraction => Ok(value),
            Dimension::SpecificEnthalpy => finite(value, value),
            _ => positive(value, value),
        }
    }

    /// Record the values that no property of this dimension can have.
    pub(super) fn check(&self, at: &Field<'_>, dimension: Dimension) {
        at.field("values").require_each(&self.values, |&value| Self::property_value(value, dimension));
    }

    /// The temperatures of the points, strictly rising, K.
    pub fn temperatures_k(&self) -> &[f64] {
        &self.temperatures_k
    }

    /// The values at these temperatures, in SI.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// What holds outside of the points.
    pub fn outside(&self) -> OutOfRange {
        self.outside
    }

    /// One value at every temperature.
    pub fn constant(value: f64) -> Self {
        Self { temperatures_k: vec![300.0], values: vec![value], outside: OutOfRange::Clamp }
    }

    /// The value at a temperature, the policy applied outside the range.
    pub fn at(&self, temperature_k: f64) -> f64 {
        let (temperatures, values) = (&self.temperatures_k, &self.values);
        let last = temperatures.len() - 1;
        if last == 0 {
            return values[0];
        }
        let inside = temperature_k.clamp(temperatures[0], temperatures[last]);
        let above = temperatures.partition_point(|&t| t <= inside).clamp(1, last);
        let reach = match self.outside {
            OutOfRange::Extrapolate => temperature_k,
            OutOfRange::Clamp | OutOfRange::Refuse => inside,
        };
        let slope = (values[above] - values[above - 1]) / (temperatures[above] - temperatures[above - 1]);
        let value = values[above - 1] + slope * (reach - temperatures[above - 1]);
        if reach < temperatures[0] {
            value.max(0.1 * values[0])
        } else if reach > temperatures[last] {
            value.max(0.1 * values[last])
        } else {
            value
        }
    }

    /// How many times another table it is, where it is that at every temperature.
    pub fn times(&self, other: &Self) -> Option<f64> {
        let times = self.values[0] / other.values[0];
        let is_alike = self.temperatures_k == other.temperatures_k && self.outside == other.outside;
        let mut pairs = self.values.iter().zip(&other.values);
        (is_alike && pairs.all(|(&own, &value)| is_times(own, value, times))).then_some(times)
    }

    /// The temperatures between which the table was measured; a single point holds everywhere.
    pub fn range_k(&self) -> (f64, f64) {
        match self.temperatures_k.as_slice() {
            [] | [_] => (f64::NEG_INFINITY, f64::INFINITY),
            [first, .., last] => (*first, *last),
        }
    }
}

/// That there is a point, and one value for each.
fn as_many(values: usize, points: usize, noun: &str) -> Result<(), String> {
    match points {
        0 => Err(format!("no {noun}: expected one point at least")),
        _ if values != points => Err(format!("{values} values at {points} {noun}")),
        _ => Ok(()),
    }
}

/// Whether a time or a depth may follow the one before; `repeats` lets one stand twice in a row.
pub(super) fn rises(last: f64, next: f64, repeats: bool) -> bool {
    next > last || (repeats && next == last)
}

/// A time or a depth that may follow the one before.
pub(super) fn rising(noun: &str, last: f64, next: f64, repeats: bool) -> Result<f64, String> {
    if rises(last, finite(next, format_args!("{noun} {next}"))?, repeats) {
        return Ok(next);
    }
    Err(format!("{noun} {next} does not rise: the one before is {last}, in SI"))
}

/// Whether a number is so many times another, but for what rounding may have done to either.
pub(super) fn is_times(own: f64, other: f64, times: f64) -> bool {
    times.is_finite() && (own - times * other).abs() <= 1e-12 * own.abs()
}

/// A quantity through time: straight lines between corners, held constant before the first and after the
/// last. Two corners at one time are a jump, which counts from that time on.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Schedule {
    pub(crate) times_s: Vec<f64>,
    pub(crate) values: Vec<f64>,
}

impl Schedule {
    /// A schedule of one value (SI) a time (s). Two equal times in a row are a jump.
    ///
    /// # Errors
    /// A message, where there is no corner, the lengths differ, a number is not finite, or a time lies before the last.
    pub fn new(times_s: Vec<f64>, values: Vec<f64>) -> Result<Self, String> {
        as_many(values.len(), times_s.len(), "times")?;
        let mut last_s = f64::NEG_INFINITY;
        for (&time_s, &value) in times_s.iter().zip(&values) {
            last_s = rising("time", last_s, time_s, true)?;
            finite(value, value)?;
        }
        Ok(Self { times_s, values })
    }

    /// The times of the corners, none before the last, s.
    pub fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// The values at these corners, in SI.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// That it can be a pressure, Pa.
    pub(super) fn check_pressure(&self) -> Result<(), String> {
        match self.values.iter().find(|value| **value <= 0.0) {
            Some(value) => Err(format!("a pressure of {value} Pa is not positive")),
            None => Ok(()),
        }
    }

    /// Record the first value that no quantity of this dimension can have.
    pub(super) fn check(&self, at: &Field<'_>, dimension: Dimension) {
        if let Some(value) = self.values.iter().find(|value| !dimension.is_allowed(**value)) {
            at.fault(format!("{value} K is {}", dimension.limit()));
        }
    }

    /// The same value at all times.
    pub fn constant(value: f64) -> Self {
        Self { times_s: vec![0.0], values: vec![value] }
    }

    /// The value just after a time: at a jump, the value it jumps to.
    pub fn after(&self, time_s: f64) -> f64 {
        self.after_within(time_s, 0.0)
    }

    /// The value just after a time, where a corner no further than `close_s` from it counts as being at that time.
    pub fn after_within(&self, time_s: f64, close_s: f64) -> f64 {
        self.between(self.times_s.partition_point(|&t| t <= time_s + close_s), time_s)
    }

    /// The value just before a time: at a jump, the value it jumps from.
    pub fn before(&self, time_s: f64) -> f64 {
        self.before_within(time_s, 0.0)
    }

    /// The value just before a time, where a corner no further than `close_s` from it counts as being at that time.
    pub fn before_within(&self, time_s: f64, close_s: f64) -> f64 {
        self.between(self.times_s.partition_point(|&t| t < time_s - close_s), time_s)
    }

    /// The value on the segment that ends at corner `next`, at the end of it where the time lies beyond.
    fn between(&self, next: usize, time_s: f64) -> f64 {
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
    fn a_jump_in_a_schedule_counts_from_its_time_on() {
        let flux = Schedule { times_s: vec![0.0, 41.0, 41.0], values: vec![5.0, 5.0, 0.0] };
        assert_eq!(flux.before(41.0), 5.0);
        assert_eq!(flux.after(41.0), 0.0);
        assert_eq!(flux.after(100.0), 0.0);
        assert_eq!(flux.before(20.0), 5.0);
    }

    #[test]
    fn a_table_is_a_multiple_of_another_where_all_its_values_are() {
        let table = |values| Table { temperatures_k: vec![300.0, 400.0], values, outside: OutOfRange::Clamp };
        let virgin = table(vec![0.1, 0.3]);
        assert_eq!(table(vec![0.12, 0.36]).times(&virgin).map(|times| (times * 1e9).round()), Some(1.2e9));
        assert_eq!(table(vec![0.12, 0.3601]).times(&virgin), None);
        assert_eq!(table(vec![0.0, 0.3]).times(&table(vec![0.0, 0.1])), None, "nothing is any number of times nothing");
        let refused = Table { outside: OutOfRange::Refuse, ..virgin.clone() };
        assert_eq!(refused.times(&virgin), None);
    }

    #[test]
    fn a_falling_table_continued_in_a_line_never_turns_negative() {
        let table =
            Table { temperatures_k: vec![300.0, 400.0], values: vec![1.0, 0.5], outside: OutOfRange::Extrapolate };
        assert_eq!(table.at(350.0), 0.75);
        assert_eq!(table.at(420.0), 0.4);
        assert_eq!(table.at(5000.0), 0.05);
        assert_eq!(table.at(200.0), 1.5);
    }
    #[test]
    fn tables_and_schedules_without_an_order_or_with_numbers_that_are_none_are_refused() {
        let table = |temperatures_k: &[f64], values: &[f64]| {
            Table::new(temperatures_k.to_vec(), values.to_vec(), OutOfRange::Clamp).map(|_| ())
        };
        assert_eq!(table(&[300.0, 400.0], &[1.0, 2.0]), Ok(()));
        for (temperatures_k, values, message) in [
            (&[][..], &[][..], "no temperatures: expected one point at least"),
            (&[300.0], &[1.0, 2.0], "2 values at 1 temperatures"),
            (&[300.0, 300.0], &[1.0, 2.0], "temperature 300 K does not rise above 300 K"),
            (&[0.0], &[1.0], "temperature 0 K does not rise above 0 K"),
            (&[f64::NAN], &[1.0], "temperature NaN K is not a finite number"),
            (&[300.0], &[f64::INFINITY], "inf is not a finite number"),
        ] {
            assert_eq!(table(temperatures_k, values), Err(message.to_owned()));
        }
        let schedule = |times_s: &[f64], values: &[f64]| Schedule::new(times_s.to_vec(), values.to_vec()).map(|_| ());
        assert_eq!(schedule(&[0.0, 41.0, 41.0], &[5.0, 5.0, 0.0]), Ok(()));
        for (times_s, values, message) in [
            (&[][..], &[][..], "no times: expected one point at least"),
            (&[0.0], &[], "0 values at 1 times"),
            (&[1.0, 0.5], &[1.0, 2.0], "time 0.5 does not rise: the one before is 1, in SI"),
            (&[f64::NAN], &[1.0], "time NaN is not a finite number"),
            (&[0.0], &[f64::NAN], "NaN is not a finite number"),
        ] {
            assert_eq!(schedule(times_s, values), Err(message.to_owned()));
        }
    }
}
