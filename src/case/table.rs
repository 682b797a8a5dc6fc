//! Piecewise-linear tables: a property over temperature, and a schedule over time.

/// What a table answers outside the range of its points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
pub struct Table {
    pub temperatures_k: Vec<f64>,
    pub values: Vec<f64>,
    pub outside: OutOfRange,
}

impl Table {
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

/// Whether a number is so many times another, but for what rounding may have done to either.
pub(super) fn is_times(own: f64, other: f64, times: f64) -> bool {
    times.is_finite() && (own - times * other).abs() <= 1e-12 * own.abs()
}

/// A quantity through time: straight lines between corners, held constant before the first and after the
/// last. Two corners at one time are a jump, which counts from that time on.
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    pub times_s: Vec<f64>,
    pub values: Vec<f64>,
}

impl Schedule {
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
}
