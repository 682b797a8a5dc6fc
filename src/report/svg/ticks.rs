//! Ticks of an axis and their labels.

use super::super::figure::{Axis, Scale, log_ticks};
use super::super::format;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use std::ops::Range;

/// A coordinate axis in plotted units (logarithms on a log axis). The ticks of plotters suit neither decades nor names.
pub(super) struct AxisCoordinate {
    axis: Axis,
    ends: Range<f64>,
}

impl AxisCoordinate {
    /// From `low` at the left or bottom to `high`; `low` may be the larger.
    pub(super) fn new(axis: &Axis, (low, high): (f64, f64)) -> Self {
        Self { axis: axis.clone(), ends: low..high }
    }

    /// Positions of the ticks.
    fn tick_positions(&self) -> Vec<f64> {
        let (low, high) = (self.ends.start.min(self.ends.end), self.ends.start.max(self.ends.end));
        match &self.axis.scale {
            Scale::Categories(names) => (0..names.len()).map(|index| index as f64).collect(),
            Scale::Log => log_ticks(low, high),
            Scale::Linear => linear_ticks(low, high, 0.0),
            Scale::Integer => linear_ticks(low, high, 1.0),
        }
    }
}

impl Ranged for AxisCoordinate {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (from, to): (i32, i32)) -> i32 {
        let along = (value - self.ends.start) / (self.ends.end - self.ends.start);
        from + (along * f64::from(to - from)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _hint: Hint) -> Vec<f64> {
        self.tick_positions()
    }

    fn range(&self) -> Range<f64> {
        self.ends.clone()
    }
}

impl ValueFormatter<f64> for AxisCoordinate {
    fn format_ext(&self, place: &f64) -> String {
        match &self.axis.scale {
            Scale::Categories(names) => names.get(place.round() as usize).cloned().unwrap_or_default(),
            Scale::Log => format::significant(10_f64.powf(*place), 1),
            // Rounding errors of zero are shown as zero.
            Scale::Linear | Scale::Integer => {
                format::trim_zeros(format!("{:.6}", if place.abs() < 1e-9 { 0.0 } else { *place })).replace('-', "−")
            }
        }
    }
}

/// At most ten multiples of a round step.
fn linear_ticks(low: f64, high: f64, smallest: f64) -> Vec<f64> {
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
        let ruler = AxisCoordinate::new(axis, (low, high));
        ruler.tick_positions().iter().map(|place| ruler.format_ext(place)).collect()
    }

    #[test]
    fn ticks_are_at_round_numbers() {
        assert_eq!(labels(&Axis::linear("K"), 287.0, 1610.0), ["400", "600", "800", "1000", "1200", "1400", "1600"]);
        assert_eq!(labels(&Axis::linear(""), -0.2, 0.4), ["−0.2", "−0.1", "0", "0.1", "0.2", "0.3", "0.4"]);
        assert_eq!(labels(&Axis::integer("Iteration"), -0.1, 4.1), ["0", "1", "2", "3", "4"]);
    }

    #[test]
    fn a_log_axis_has_ticks_at_one_two_and_five() {
        assert_eq!(labels(&Axis::log("S"), 2.9, 4.1), ["1,000", "2,000", "5,000", "10,000"]);
        assert_eq!(labels(&Axis::log("S"), -3.0, 2.0).len(), 6);
    }

    #[test]
    fn a_log_axis_over_the_whole_range_of_numbers_has_few_ticks_and_one_without_an_end_has_none() {
        assert!((5..=14).contains(&log_ticks(-323.0, 308.0).len()));
        assert_eq!(log_ticks(f64::NEG_INFINITY, 3.0), Vec::<f64>::new());
        assert_eq!(log_ticks(-3.0, f64::INFINITY), Vec::<f64>::new());
    }

    #[test]
    fn rows_of_a_matrix_run_downwards() {
        let ruler = AxisCoordinate::new(&Axis::categories("", vec!["a".to_owned(), "b".to_owned()]), (1.5, -0.5));
        assert!(ruler.map(&0.0, (400, 0)) < ruler.map(&1.0, (400, 0)));
        assert_eq!((ruler.map(&1.5, (400, 0)), ruler.map(&-0.5, (400, 0))), (400, 0));
    }

    #[test]
    fn an_axis_of_zero_length_has_one_tick() {
        assert_eq!(labels(&Axis::linear(""), 3.0, 3.0), ["3"]);
    }
}
