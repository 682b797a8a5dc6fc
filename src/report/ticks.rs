//! Ticks of an axis, of static and of interactive figures.

use super::figure::{Axis, Scale};
use super::format;

/// Most decades of a log axis with a tick at every power of ten.
const MAX_DECADES: f64 = 12.0;

/// At most `most` ticks between the ends of an axis, in plotted units (logarithms on a log axis), with their labels.
/// Every name of an axis of names has its tick.
pub(super) fn ticks(axis: &Axis, (low, high): (f64, f64), most: usize) -> Vec<(f64, String)> {
    match &axis.scale {
        Scale::Categories(names) => names.iter().enumerate().map(|(at, name)| (at as f64, name.clone())).collect(),
        Scale::Log => log_ticks(low, high).into_iter().map(|tick| (tick, log_label(tick))).collect(),
        Scale::Linear | Scale::Integer => {
            let step = step(axis, (low, high), most);
            multiples(low, high, step).into_iter().map(|tick| (tick, label(tick, step))).collect()
        }
    }
}

/// The round distance of ticks, 1, 2 or 5 times a power of ten; at least 1 on an axis of integers.
pub(super) fn step(axis: &Axis, (low, high): (f64, f64), most: usize) -> f64 {
    let rough = (high - low).abs() / most as f64;
    let smallest = if axis.scale == Scale::Integer { 1.0 } else { 0.0 };
    if !(rough.is_finite() && rough > 0.0) {
        return 1.0;
    }
    let decade = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0].map(|multiple| multiple * decade).into_iter().find(|step| *step >= rough);
    step.unwrap_or(10.0 * decade).max(smallest)
}

fn multiples(low: f64, high: f64, step: f64) -> Vec<f64> {
    let slack = 1e-9 * (high - low).abs();
    let (first, last) = (((low - slack) / step).ceil(), ((high + slack) / step).floor());
    // Ends that are not finite have no ticks.
    let count = if last - first < 1e3 { (last - first + 1.0).max(0.0) as usize } else { 0 };
    (0..count).map(|place| (first + place as f64) * step).collect()
}

/// A multiple of a step without the digits of rounding errors: `−0.2`, `1,400`, `2e-7`.
fn label(tick: f64, step: f64) -> String {
    let multiple = (tick / step).round();
    let digits = multiple.abs().max(1.0).log10().floor() as usize + 2;
    let text = if multiple == 0.0 {
        "0".to_owned()
    } else if step < 1e-5 {
        let rounded: f64 = format!("{tick:.*e}", digits - 1).parse().unwrap_or(tick);
        format!("{rounded:e}")
    } else {
        format::trim_zeros(format::grouped(tick, (-step.log10().floor()).max(0.0) as usize))
    };
    text.replace('-', "−")
}

/// The label of a tick of a log axis, from its logarithm: `200,000`, `1e−7`.
pub(super) fn log_label(tick: f64) -> String {
    format::significant(10_f64.powf(tick), 1).replace('-', "−")
}

/// Decimal logarithms of the ticks of a log axis: 1, 2 and 5 of each decade over fewer than four decades, else powers
/// of ten, over many decades some of them; none where an end is not finite.
pub(super) fn log_ticks(low: f64, high: f64) -> Vec<f64> {
    // The range of numbers has 617 decades.
    if !(low.abs() < 1e3 && high.abs() < 1e3) {
        return Vec::new();
    }
    let digits: &[f64] = if high - low < 4.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let spacing = ((high - low) / MAX_DECADES).ceil().max(1.0) as usize;
    let powers = low.floor() as i32..=high.ceil() as i32;
    powers
        .step_by(spacing)
        .flat_map(|power| digits.iter().map(move |digit| f64::from(power) + digit.log10()))
        .filter(|place| (low..=high).contains(place))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis, low: f64, high: f64) -> Vec<String> {
        ticks(axis, (low, high), 9).into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn ticks_are_at_round_numbers() {
        let kelvin = labels(&Axis::linear("K"), 287.0, 1610.0);
        assert_eq!(kelvin, ["400", "600", "800", "1,000", "1,200", "1,400", "1,600"]);
        assert_eq!(labels(&Axis::linear(""), -0.2, 0.4), ["−0.2", "−0.1", "0", "0.1", "0.2", "0.3", "0.4"]);
        assert_eq!(labels(&Axis::linear(""), 0.999, 1.0011), ["0.999", "0.9995", "1", "1.0005", "1.001"]);
    }

    #[test]
    fn ticks_of_a_count_are_integers_however_few_there_are() {
        let iteration = Axis::integer("Iteration");
        assert_eq!(labels(&iteration, -0.1, 4.1), ["0", "1", "2", "3", "4"]);
        assert_eq!(labels(&iteration, 0.9, 2.1), ["1", "2"]);
        assert_eq!(labels(&Axis::linear("Iteration"), 0.9, 2.1).len(), 6);
    }

    #[test]
    fn ticks_of_a_tiny_range_have_labels_of_their_own() {
        let found = labels(&Axis::linear(""), 0.0, 2e-8);
        assert_eq!(found, ["0", "5e−9", "1e−8", "1.5e−8", "2e−8"]);
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
    fn an_axis_without_an_end_has_no_ticks_and_one_of_zero_length_has_one() {
        assert_eq!(labels(&Axis::linear(""), 3.0, 3.0), ["3"]);
        assert!(labels(&Axis::linear(""), f64::NEG_INFINITY, 3.0).is_empty());
        assert!(labels(&Axis::linear(""), 0.0, f64::NAN).is_empty());
    }
}
