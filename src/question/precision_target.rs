//! The target of a sweep from a text: `TC4 P99 ± 2 K`.

use crate::case::Case;
use crate::case::unit::{Dimension, parse_quantity};
use crate::study::sequential_sampling::{HalfWidth, PrecisionTarget, TargetQuantity};

/// The two forms of a target.
const FORMS: &str = "expected a percentile, \"TC4 P99 ± 2 K\", or a probability, \"P(TC4 > 623 K) ± 0.001\" or \
                     \"P(TC4 > 623 K) ± 10 %\", with +- for ± where you like";

impl PrecisionTarget {
    /// A target from a text: `TC4 P99 ± 2 K`, `P(TC4 > 623 K) ± 0.001`, `P(TC4 > 623 K) ± 10 %` (of the probability);
    /// `+-` stands for `±`.
    ///
    /// # Errors
    /// A message, when the text has another form, there is no such sensor, or a number is out of range.
    pub fn parse(text: &str, case: &Case) -> Result<Self, String> {
        let text = text.replace("+-", "±").replace("+/-", "±");
        let (quantity, half_width) = text.split_once('±').ok_or_else(|| FORMS.to_owned())?;
        let (quantity, half_width) = (quantity.trim(), half_width.trim());
        match quantity.strip_prefix("P(").and_then(|rest| rest.strip_suffix(')')) {
            Some(inside) => Self::exceedance(inside, half_width, case),
            None => Self::percentile(quantity, half_width, case),
        }
    }

    fn exceedance(inside: &str, half_width: &str, case: &Case) -> Result<Self, String> {
        let (name, temperature) = inside.split_once('>').ok_or_else(|| {
            format!("expected a sensor above a temperature, such as P(TC4 > 623 K), found P({inside})")
        })?;
        let sensor = sensor(name.trim(), case)?;
        let temperature_k = parse_quantity(temperature.trim(), Dimension::LayupTemperature)?;
        let value = parse_quantity(half_width, Dimension::Fraction)?;
        let is_relative = half_width.ends_with('%');
        if !(value > 0.0 && value < 1.0) {
            return Err(format!("expected a half-width above 0 and below 1 (100 %), found {half_width:?}"));
        }
        let half_width = if is_relative { HalfWidth::Relative(value) } else { HalfWidth::Absolute(value) };
        Ok(Self { sensor, quantity: TargetQuantity::Exceedance { temperature_k }, half_width })
    }

    fn percentile(quantity: &str, half_width: &str, case: &Case) -> Result<Self, String> {
        let (name, percent) = quantity.rsplit_once(char::is_whitespace).ok_or_else(|| FORMS.to_owned())?;
        let percent = percent.strip_prefix(['P', 'p']).ok_or_else(|| FORMS.to_owned())?;
        let probability = percent.parse::<f64>().ok().map(|percent| percent / 100.0);
        let probability =
            probability.filter(|&probability| probability > 0.0 && probability < 1.0).ok_or_else(|| {
                format!("expected a percentile between P0 and P100, such as P99 or P99.87, found P{percent}")
            })?;
        let sensor = sensor(name.trim(), case)?;
        let half_width_k = parse_quantity(half_width, Dimension::TemperatureDifference)?;
        if half_width_k <= 0.0 {
            return Err(format!("expected a half-width above 0 K, found {half_width:?}"));
        }
        let half_width = HalfWidth::Absolute(half_width_k);
        Ok(Self { sensor, quantity: TargetQuantity::Percentile(probability), half_width })
    }
}

fn sensor(name: &str, case: &Case) -> Result<usize, String> {
    case.sensors.iter().position(|sensor| sensor.name == name).ok_or_else(|| {
        let names: Vec<&str> = case.sensors.iter().map(|sensor| sensor.name.as_str()).collect();
        format!("no sensor is called {name:?}; there are {}", names.join(", "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_is_read_as_it_is_said() {
        let case = Case::load("cases/lcat-2259".as_ref()).expect("a shipped case");
        let parse = |text: &str| PrecisionTarget::parse(text, &case);
        let percentile = |probability, half_width_k| PrecisionTarget {
            sensor: 3,
            quantity: TargetQuantity::Percentile(probability),
            half_width: HalfWidth::Absolute(half_width_k),
        };
        let exceedance = |half_width| PrecisionTarget {
            sensor: 3,
            quantity: TargetQuantity::Exceedance { temperature_k: 623.0 },
            half_width,
        };
        assert_eq!(parse("TC4 P99 ± 2 K"), Ok(percentile(0.99, 2.0)));
        assert_eq!(parse("  TC4  p2.5 +- 1.5 K "), Ok(percentile(0.025, 1.5)));
        assert_eq!(parse("P(TC4 > 623 K) ± 0.001"), Ok(exceedance(HalfWidth::Absolute(0.001))));
        assert_eq!(parse("P(TC4>623 K)+/-10 %"), Ok(exceedance(HalfWidth::Relative(0.1))));
        for (wrong, reason) in [
            ("TC4 P99", "expected a percentile"),
            ("TC4 ± 2 K", "expected a percentile"),
            ("TC9 P99 ± 2 K", "no sensor is called \"TC9\"; there are TC1, TC2, TC3, TC4"),
            ("TC4 P100 ± 2 K", "between P0 and P100"),
            ("TC4 P99 ± 2", "missing unit"),
            ("TC4 P99 ± 0 K", "above 0 K"),
            ("P(TC4 < 623 K) ± 0.001", "above a temperature"),
            ("P(TC4 > 623) ± 0.001", "missing unit"),
            ("P(TC4 > 623 K) ± 0", "above 0 and below 1"),
            ("P(TC4 > 623 K) ± 2 K", "K"),
        ] {
            let error = parse(wrong).expect_err(wrong);
            assert!(error.contains(reason), "{wrong}: {error}");
        }
    }
}
