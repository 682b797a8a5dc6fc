//! Ticks of an axis and their labels.

use super::super::figure::{Axis, Scale, decades};
use super::super::words;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use std::ops::Range;

/// A coordinate axis in plotted units (logarithms on a log axis). The ticks of plotters suit neither decades nor names.
pub(super) struct Ruler {
    axis: Axis,
    ends: Range<f64>,
}

impl Ruler {
    /// From `low` at the left or bottom to `high`; `low` may be the larger.
    pub(super) fn new(axis: &Axis, (low, high): (f64, f64)) -> Self {
        Self { axis: axis.clone(), ends: low..high }
    }

    /// Positions of the ticks.
    fn places(&self) -> Vec<f64> {
        let (low, high) = (self.ends.start.min(self.ends.end), self.ends.start.max(self.ends.end));
        match &self.axis.scale {
            Scale::Names(names) => (0..names.len()).map(|index| index as f64).collect(),
            Scale::Log => decades(low, high),
            Scale::Linear => round_steps(low, high, 0.0),
            Scale::Whole => round_steps(low, high, 1.0),
        }
    }
}

impl Ranged for Ruler {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (from, to): (i32, i32)) -> i32 {
        let along = (value - self.ends.start) / (self.ends.end - self.ends.start);
        from + (along * f64::from(to - from)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _hint: Hint) -> Vec<f64> {
        self.places()
    }

    fn range(&self) -> Range<f64> {
        self.ends.clone()
    }
}

impl ValueFormatter<f64> for Ruler {
    fn format_ext(&self, place: &f64) -> String {
        match &self.axis.scale {
            Scale::Names(names) => names.get(place.round() as usize).cloned().unwrap_or_default(),
            Scale::Log => words::significant(10_f64.powf(*place), 1),
            // Rounding errors of zero are shown as zero.
            Scale::Linear | Scale::Whole => {
                words::trimmed(format!("{:.6}", if place.abs() < 1e-9 { 0.0 } else { *place })).replace('-', "−")
            }
        }
    }
}

/// At most ten multiples of a round step.
fn round_steps(low: f64, high: f64, smallest: f64) -> Vec<f64> {
    let rough = (high - low) / 9.0;
    if !(rough.is_finite() && rough > 0.0) {
        return vec![low];
    }
    let decade = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0].map(|multiple| multiple * decade).into_iter().find(|step| *step >= rough);
    let step = step.unwrap_or(10.0 * decade).max(smallest);
    let slack = 1e-9 * (high - low);
    let (first, last) = (((low - slack) / step).ceil() as i64, ((high + slack) / step).floor() as i64);
    (first..=last).map(|multiple| multiple as f64 * step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis, low: f64, high: f64) -> Vec<String> {
        let ruler = Ruler::new(axis, (low, high));
        ruler.places().iter().map(|place| ruler.format_ext(place)).collect()
    }

    #[test]
    fn ticks_are_at_round_numbers() {
        assert_eq!(labels(&Axis::linear("K"), 287.0, 1610.0), ["400", "600", "800", "1000", "1200", "1400", "1600"]);
        assert_eq!(labels(&Axis::linear(""), -0.2, 0.4), ["−0.2", "−0.1", "0", "0.1", "0.2", "0.3", "0.4"]);
        assert_eq!(labels(&Axis::whole("Iteration"), -0.1, 4.1), ["0", "1", "2", "3", "4"]);
    }

    #[test]
    fn a_log_axis_has_ticks_at_one_two_and_five() {
        assert_eq!(labels(&Axis::log("S"), 2.9, 4.1), ["1,000", "2,000", "5,000", "10,000"]);
        assert_eq!(labels(&Axis::log("S"), -3.0, 2.0).len(), 6);
    }

    #[test]
    fn rows_of_a_matrix_run_downwards() {
        let ruler = Ruler::new(&Axis::names("", vec!["a".to_owned(), "b".to_owned()]), (1.5, -0.5));
        assert!(ruler.map(&0.0, (400, 0)) < ruler.map(&1.0, (400, 0)));
        assert_eq!((ruler.map(&1.5, (400, 0)), ruler.map(&-0.5, (400, 0))), (400, 0));
    }

    #[test]
    fn an_axis_of_zero_length_has_one_tick() {
        assert_eq!(labels(&Axis::linear(""), 3.0, 3.0), ["3"]);
    }
}
