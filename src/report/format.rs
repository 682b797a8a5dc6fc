//! Formats of numbers, units and names.

use crate::case::{Factor, Property};
use crate::fit::proportion::Proportion;
use crate::study::nominal::ErrorEstimate;
use crate::traces::Gauge;

/// 0 °C, K.
const ZERO_CELSIUS_K: f64 = 273.15;

/// A temperature in both scales: `873 K (600 °C)`.
pub(super) fn kelvin(temperature_k: f64) -> String {
    if temperature_k.is_finite() {
        format!("{} K ({} °C)", grouped(temperature_k, 0), grouped(temperature_k - ZERO_CELSIUS_K, 0))
    } else {
        "unknown".to_owned()
    }
}

/// A time: `78 s`, `78.5 s`, `0.0048 s`.
pub(super) fn seconds(time_s: f64) -> String {
    if time_s.is_nan() {
        return "unknown".to_owned();
    }
    let is_short = time_s.abs() < 0.05;
    format!("{} s", if is_short { significant(time_s, 2) } else { trim_zeros(grouped(time_s, 1)) })
}

/// A change of temperature to two digits: `13 K`, `0.95 K`.
pub(super) fn temperature_change(change_k: f64) -> String {
    if change_k.is_finite() { format!("{} K", significant(change_k, 2)) } else { "unknown".to_owned() }
}

/// A number to this many significant digits, thousands grouped: `2,160`, `0.993`, `1.2e-6`.
pub(super) fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return if value.is_nan() { "unknown".to_owned() } else { "unbounded".to_owned() };
    }
    let magnitude = value.abs().log10().floor();
    if !(-4.0..7.0).contains(&magnitude) {
        return format!("{value:.*e}", digits.saturating_sub(1));
    }
    // The range above makes the magnitude a small integer.
    let decimals = (digits as f64 - 1.0 - magnitude).max(0.0) as usize;
    let unit = 10_f64.powf(magnitude + 1.0 - digits as f64);
    grouped((value / unit).round() * unit, decimals)
}

/// A length: `12.41 mm`, `0.0251 mm`; two decimals at least, and three digits.
pub(super) fn millimetres(length_m: f64) -> String {
    let length_mm = 1e3 * length_m;
    let magnitude = if length_mm == 0.0 { 0.0 } else { length_mm.abs().log10().floor() };
    let decimals = (2.0 - magnitude).clamp(2.0, 12.0) as usize;
    format!("{} mm", grouped(length_mm, decimals))
}

/// A number with its sign: `+12.0`, `-0.3`.
pub(super) fn signed(value: f64, decimals: usize) -> String {
    let text = grouped(value, decimals);
    if value > 0.0 && text.contains(|c: char| ('1'..='9').contains(&c)) { format!("+{text}") } else { text }
}

/// A fraction in per cent: `62 %`.
pub(super) fn percent(share: f64) -> String {
    if share.is_finite() { format!("{} %", grouped(100.0 * share, 0)) } else { "unknown".to_owned() }
}

/// A fraction that may be close to zero or one: `99 %`, `99.1 %`, `99.95 %`, to two digits of its distance from the
/// nearer of the two.
pub(super) fn percent_near_limits(share: f64) -> String {
    let left = 100.0 * share.min(1.0 - share);
    let decimals = if left >= 10.0 || left <= 0.0 { 0.0 } else { (1.0 - left.log10().floor()).min(6.0) };
    format!("{} %", trim_zeros(grouped(100.0 * share, decimals as usize)))
}

/// A temperature difference: `0.031 K`, `14.3 K`; below a millikelvin `<0.001 K`.
pub(super) fn temperature_difference(off_k: f64) -> String {
    match off_k.abs() {
        unknown if unknown.is_nan() => "unknown".to_owned(),
        infinite if infinite.is_infinite() => "unbounded".to_owned(),
        tiny if tiny < 1e-3 => "<0.001 K".to_owned(),
        small if small < 1.0 => format!("{} K", significant(off_k, 2)),
        _ => format!("{} K", grouped(off_k, 1)),
    }
}

/// A condition number; beyond 1e12, where rounding decides, `infinite`.
pub(super) fn condition_number(number: f64) -> String {
    if number < 1e12 { significant(number, 3) } else { "infinite".to_owned() }
}

/// A confidence interval; `not determined` if it is wider than twice the bounds.
pub(super) fn interval((low, high): (f64, f64), (least, most): (f64, f64)) -> String {
    let is_known = high - low <= 2.0 * (most - least);
    if is_known { format!("{low:.3} to {high:.3}") } else { "not determined".to_owned() }
}

/// An interval by profile likelihood; a side of `None` extends beyond the bound.
pub(super) fn profile_interval((low, high): (Option<f64>, Option<f64>), (least, most): (f64, f64)) -> String {
    match (low, high) {
        (None, None) => "not determined".to_owned(),
        (Some(low), None) => format!("from {low:.3} to beyond its bound {most:.2}"),
        (None, Some(high)) => format!("from below its bound {least:.2} to {high:.3}"),
        (Some(low), Some(high)) => format!("{low:.3} to {high:.3}"),
    }
}

/// Estimated discretisation errors of a march, as a clause.
pub(super) fn discretisation_error(reached: &ErrorEstimate) -> String {
    let corners = match reached.corners {
        0 => String::new(),
        corners => {
            let error = members_error(reached.corners_k, reached.failed_corners);
            format!(", {error} at {} corners of the {} bounds", count(corners), reached.bounds.name())
        }
    };
    let gauges: Vec<String> = reached
        .gauges
        .iter()
        .map(|gauge| format!("{} {}", gauge_name(gauge.gauge), gauge_error(gauge.gauge, gauge.error)))
        .collect();
    let gauges = if gauges.is_empty() { String::new() } else { format!("; {}", list(&gauges)) };
    let rounding = reached.rounding.as_ref().map_or(String::new(), |rounding| {
        format!(", {} of it by rounding in f32", temperature_difference(rounding.nominal_k))
    });
    format!("discretisation error: {} nominal{rounding}{corners}{gauges}", temperature_difference(reached.nominal_k))
}

/// The largest error of some members that completed, with the number of those that did not.
pub(super) fn members_error(error_k: Option<f64>, failed: usize) -> String {
    let error = error_k.map_or("unknown".to_owned(), temperature_difference);
    if failed == 0 { error } else { format!("{error} ({} failed)", count(failed)) }
}

/// An error of a gauge in its unit, or in per cent of its peak.
pub(super) fn gauge_error(gauge: Gauge, error: f64) -> String {
    match gauge {
        Gauge::VirginFront | Gauge::CharFront => format!("{} mm", significant(1e3 * error, 2)),
        _ => format!("{} % of its peak", significant(1e2 * error, 2)),
    }
}

/// Name of a gauge in a sentence.
pub(super) fn gauge_name(gauge: Gauge) -> &'static str {
    match gauge {
        Gauge::GasFlux => "gas flux",
        Gauge::MassLost => "mass lost",
        Gauge::VirginFront => "virgin front",
        Gauge::CharFront => "char front",
        Gauge::PeakPressure => "peak pressure",
        Gauge::BackPressure => "back pressure",
    }
}

/// An integer, thousands grouped: `5,000`.
pub(super) fn count(number: usize) -> String {
    group_digits(&number.to_string())
}

/// A number and its noun: `1 member`, `5,000 members`.
pub(super) fn counted(number: usize, noun: &str) -> String {
    format!("{} {noun}{}", count(number), if number == 1 { "" } else { "s" })
}

/// A number and a noun with an irregular plural: `2 minima`.
pub(super) fn counted_irregular(number: usize, one: &str, many: &str) -> String {
    format!("{} {}", count(number), if number == 1 { one } else { many })
}

/// Names in a sentence: `a, b and c`.
pub(super) fn list<S: AsRef<str>>(names: &[S]) -> String {
    match names {
        [] => "none".to_owned(),
        [one] => one.as_ref().to_owned(),
        [first @ .., last] => {
            let first: Vec<&str> = first.iter().map(AsRef::as_ref).collect();
            format!("{} and {}", first.join(", "), last.as_ref())
        }
    }
}

/// The property and group that a factor scales: `conductivity of INS`.
pub(super) fn factor_meaning(factor: &Factor) -> String {
    let property = factor.property.label();
    if factor.property == Property::ContactConductance && !factor.group.is_empty() {
        return format!("{property} under {}", factor.group);
    }
    if let Some(state) = &factor.state {
        return format!("{property} of {state} {}", factor.group);
    }
    if factor.group.is_empty() { property.to_owned() } else { format!("{property} of {}", factor.group) }
}

/// A number to this many decimals, thousands grouped.
pub(super) fn grouped(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return if value.is_nan() { "unknown".to_owned() } else { "unbounded".to_owned() };
    }
    let text = format!("{:.*}", decimals, value.abs());
    let (whole, fraction) = text.split_once('.').map_or((text.as_str(), ""), |(whole, fraction)| (whole, fraction));
    let negative = value < 0.0 && text.contains(|c: char| ('1'..='9').contains(&c));
    let point = if fraction.is_empty() { "" } else { "." };
    format!("{}{}{point}{fraction}", if negative { "-" } else { "" }, group_digits(whole))
}

/// Remove trailing zeros after the decimal point, and the point if nothing follows it.
pub(super) fn trim_zeros(text: String) -> String {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// A text truncated to at most this many characters, with an ellipsis.
pub(super) fn truncate(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.to_owned();
    }
    text.chars().take(most - 1).chain(['…']).collect()
}

fn group_digits(digits: &str) -> String {
    let mut out = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

/// A counted proportion with its 95 % interval, to two digits of the latter: `99.12 % (98.81 to 99.34 %)`.
pub(super) fn proportion(counted: Proportion) -> String {
    let (low, high) = counted.interval_95();
    let decimals = (1.0 - (100.0 * (high - low)).log10().floor()).clamp(0.0, 6.0) as usize;
    let percent = |share: f64| grouped(100.0 * share, decimals);
    format!("{} % ({} to {} %)", percent(counted.fraction()), percent(low), percent(high))
}

/// A counted proportion, with its interval if the members are drawn independently of each other.
pub(super) fn proportion_of_members(counted: Proportion, are_independent: bool) -> String {
    if are_independent { proportion(counted) } else { percent_near_limits(counted.fraction()) }
}

/// Why members have no intervals.
pub(super) fn dependence(sampling: &str, without: &str) -> String {
    format!(
        "No {without}: members of {sampling} sampling are not independent. Draw them with normal or uniform sampling."
    )
}

/// A sentence without its full stop, as a clause of another.
pub(super) fn clause(text: &str) -> &str {
    text.trim().trim_end_matches('.')
}

/// The correlation of a noise model.
pub(super) fn noise_correlation(correlation_time_s: f64, white_share: f64) -> String {
    if correlation_time_s <= 0.0 {
        return "white noise".to_owned();
    }
    let white =
        if white_share > 0.0 { format!(" and a white-noise share of {}", percent(white_share)) } else { String::new() };
    format!("correlation time {}{white}", seconds(correlation_time_s))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Bounds;

    #[test]
    fn corners_that_fail_are_counted_beside_the_error_of_the_others() {
        let mut reached = ErrorEstimate::of_temperature(0.03, 0.05);
        assert_eq!(discretisation_error(&reached), "discretisation error: 0.030 K nominal");
        (reached.corners, reached.corners_k) = (16, Some(0.21));
        let sound = "discretisation error: 0.030 K nominal, 0.21 K at 16 corners of the small bounds";
        assert_eq!(discretisation_error(&reached), sound);
        reached.bounds = Bounds::Large;
        assert_eq!(discretisation_error(&reached), sound.replace("small", "large"));
        reached.failed_corners = 2;
        assert!(discretisation_error(&reached).contains("0.21 K (2 failed) at 16 corners"));
        (reached.failed_corners, reached.corners_k) = (16, None);
        assert!(discretisation_error(&reached).contains("unknown (16 failed) at 16 corners"));
    }

    #[test]
    fn a_temperature_is_given_in_kelvin_and_celsius() {
        assert_eq!(kelvin(873.15), "873 K (600 °C)");
        assert_eq!(kelvin(1480.0), "1,480 K (1,207 °C)");
        assert_eq!(kelvin(f64::NAN), "unknown");
    }

    #[test]
    fn a_length_has_at_least_two_decimals_and_three_digits() {
        let lengths_m = [25e-6, 0.14e-3, 6.35e-3, 12.406e-3, 3.2e-7, 0.0, 1.5];
        let expected = ["0.0250 mm", "0.140 mm", "6.35 mm", "12.41 mm", "0.000320 mm", "0.00 mm", "1,500.00 mm"];
        assert_eq!(lengths_m.map(millimetres), expected);
    }

    #[test]
    fn numbers_are_rounded_to_significant_digits() {
        assert_eq!(significant(2160.4, 3), "2,160");
        assert_eq!(significant(98_283.0, 2), "98,000");
        assert_eq!(significant(0.99312, 3), "0.993");
        assert_eq!(significant(1.234e-7, 2), "1.2e-7");
        assert_eq!(significant(f64::INFINITY, 3), "unbounded");
        assert_eq!(signed(-0.04, 1), "0.0");
        assert_eq!(signed(12.0, 1), "+12.0");
        assert_eq!(seconds(78.0), "78 s");
        assert_eq!(seconds(78.46), "78.5 s");
        assert_eq!(seconds(0.0), "0 s");
        assert_eq!(seconds(0.004_807_1), "0.0048 s");
        assert_eq!(temperature_change(f64::NAN), "unknown");
    }

    #[test]
    fn a_tiny_misfit_and_an_infinite_condition_number_are_marked() {
        assert_eq!([2.8e-7, 0.0123, 73.52].map(temperature_difference), ["<0.001 K", "0.012 K", "73.5 K"]);
        assert_eq!([25.21, 3.4e18, f64::INFINITY].map(condition_number), ["25.2", "infinite", "infinite"]);
    }

    #[test]
    fn an_interval_wider_than_twice_the_bounds_is_not_determined() {
        assert_eq!(interval((0.9, 1.1), (0.75, 1.25)), "0.900 to 1.100");
        for wide in [(-129.4, 131.5), (f64::NEG_INFINITY, f64::INFINITY), (f64::NAN, f64::NAN)] {
            assert_eq!(interval(wide, (0.75, 1.25)), "not determined");
        }
    }

    #[test]
    fn a_profile_interval_without_an_end_extends_beyond_its_bound() {
        let bounds = (0.75, 1.25);
        assert_eq!(profile_interval((Some(0.8), Some(1.1)), bounds), "0.800 to 1.100");
        assert_eq!(profile_interval((None, Some(1.1)), bounds), "from below its bound 0.75 to 1.100");
        assert_eq!(profile_interval((Some(0.8), None), bounds), "from 0.800 to beyond its bound 1.25");
        assert_eq!(profile_interval((None, None), bounds), "not determined");
    }

    #[test]
    fn a_fraction_close_to_zero_or_one_keeps_two_digits_of_its_distance() {
        assert_eq!(
            [0.99, 0.9912, 0.99953, 0.5, 0.0, 1.0].map(percent_near_limits),
            ["99 %", "99.12 %", "99.953 %", "50 %", "0 %", "100 %"]
        );
    }

    #[test]
    fn names_are_listed_with_commas_and_and() {
        assert_eq!(list::<&str>(&[]), "none");
        assert_eq!(list(&["a"]), "a");
        assert_eq!(list(&["a", "b", "c"]), "a, b and c");
    }
}
