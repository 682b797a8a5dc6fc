//! The text of values: quantities with their units, ranges and lists, in the same form on the command line, in a file
//! and from Python. A file and Python may also give a list in place of a text with commas or a colon.

use crate::case::unit::{Dimension, parse_quantity};
use serde::{Deserialize, Deserializer, Serializer};
use std::fmt::{self, Display};
use std::str::FromStr;

/// A value of a file or of Python.
#[derive(Deserialize)]
#[serde(untagged)]
enum Given {
    Nothing(()),
    Flag(bool),
    Whole(i64),
    Seed(u64),
    Number(f64),
    Text(String),
    List(Vec<Self>),
}

impl Given {
    /// The text on the command line, with the items of a list joined.
    fn text(&self, joint: &str) -> String {
        match self {
            Self::Nothing(()) => String::new(),
            Self::Flag(value) => value.to_string(),
            Self::Whole(value) => value.to_string(),
            Self::Seed(value) => value.to_string(),
            Self::Number(value) => value.to_string(),
            Self::Text(text) => text.clone(),
            Self::List(_) => self.items().join(joint),
        }
    }

    /// The items of a list; one value is a list of one.
    fn items(&self) -> Vec<String> {
        match self {
            Self::Nothing(()) => Vec::new(),
            Self::List(items) => items.iter().map(|item| item.text(",")).collect(),
            one => vec![one.text(",")],
        }
    }
}

/// A value with a text.
pub(crate) trait Textual: Sized {
    /// Between the items of a list.
    const JOINT: &'static str = ",";

    /// `None` where nothing is stated.
    fn text(&self, of_number: &dyn Fn(f64) -> String) -> Option<String>;

    fn parse(text: &str, number: &dyn Fn(&str) -> Result<f64, String>) -> Result<Self, String>;
}

impl Textual for f64 {
    fn text(&self, of_number: &dyn Fn(f64) -> String) -> Option<String> {
        Some(of_number(*self))
    }

    fn parse(text: &str, number: &dyn Fn(&str) -> Result<f64, String>) -> Result<Self, String> {
        number(text.trim())
    }
}

/// A range `A:B`.
impl Textual for (f64, f64) {
    const JOINT: &'static str = ":";

    fn text(&self, of_number: &dyn Fn(f64) -> String) -> Option<String> {
        Some(format!("{}:{}", of_number(self.0), of_number(self.1)))
    }

    fn parse(text: &str, number: &dyn Fn(&str) -> Result<f64, String>) -> Result<Self, String> {
        match text.split(':').collect::<Vec<_>>()[..] {
            [start, end] => Ok((number(start.trim())?, number(end.trim())?)),
            _ => Err(format!("expected a range START:END, found {text:?}")),
        }
    }
}

impl Textual for Vec<f64> {
    fn text(&self, of_number: &dyn Fn(f64) -> String) -> Option<String> {
        Some(self.iter().map(|value| of_number(*value)).collect::<Vec<_>>().join(","))
    }

    fn parse(text: &str, number: &dyn Fn(&str) -> Result<f64, String>) -> Result<Self, String> {
        text.split(',').filter(|item| !item.trim().is_empty()).map(|item| number(item.trim())).collect()
    }
}

impl<T: Textual> Textual for Option<T> {
    const JOINT: &'static str = T::JOINT;

    fn text(&self, of_number: &dyn Fn(f64) -> String) -> Option<String> {
        self.as_ref().and_then(|value| value.text(of_number))
    }

    fn parse(text: &str, number: &dyn Fn(&str) -> Result<f64, String>) -> Result<Self, String> {
        T::parse(text, number).map(Some)
    }
}

fn serialize_text<S: Serializer>(text: Option<String>, serializer: S) -> Result<S::Ok, S::Error> {
    match text {
        Some(text) => serializer.serialize_str(&text),
        None => serializer.serialize_none(),
    }
}

/// `value` in the first of the units in which its text has exactly this value and is about as short as in another.
fn text_in(value: f64, dimension: Dimension, units: &[&str]) -> String {
    let texts = units.iter().map(|unit| {
        let scale = parse_quantity(&format!("1 {unit}"), dimension).unwrap_or(1.0);
        format!("{} {unit}", value / scale)
    });
    let exact: Vec<String> = texts.filter(|text| parse_quantity(text, dimension) == Ok(value)).collect();
    let shortest = exact.iter().map(String::len).min().unwrap_or(0);
    let short = exact.into_iter().find(|text| text.len() <= shortest + 2);
    short.unwrap_or_else(|| format!("{value:?} {}", units.last().copied().unwrap_or_default()))
}

/// A module for values of one dimension: `parse` and `range` for the command line, the others for `serde(with)`.
macro_rules! dimension {
    ($(#[$doc:meta])* $module:ident, $dimension:ident, $units:expr) => {
        $(#[$doc])*
        pub(crate) mod $module {
            use super::*;

            /// The text of a value in SI.
            pub(crate) fn text(value: f64) -> String {
                text_in(value, Dimension::$dimension, $units)
            }

            /// A value in SI.
            pub(crate) fn parse(text: &str) -> Result<f64, String> {
                parse_quantity(text, Dimension::$dimension)
            }

            pub(crate) fn serialize<T: Textual, S: Serializer>(value: &T, to: S) -> Result<S::Ok, S::Error> {
                serialize_text(value.text(&text), to)
            }

            pub(crate) fn deserialize<'de, T: Textual + Default, D: Deserializer<'de>>(from: D) -> Result<T, D::Error> {
                given(from, T::JOINT, |text| T::parse(text, &parse))
            }
        }
    };
}

fn given<'de, T: Default, D: Deserializer<'de>>(
    from: D,
    joint: &str,
    parse: impl Fn(&str) -> Result<T, String>,
) -> Result<T, D::Error> {
    match Given::deserialize(from)? {
        Given::Nothing(()) => Ok(T::default()),
        given => parse(&given.text(joint)).map_err(serde::de::Error::custom),
    }
}

dimension!(
    /// Lengths, m.
    length,
    Length,
    &["mm", "m"]
);
dimension!(
    /// Times, s.
    time,
    Time,
    &["s"]
);
dimension!(
    /// Temperature differences, K.
    temperature_difference,
    TemperatureDifference,
    &["K"]
);

/// Times in seconds without a unit.
pub(crate) mod seconds {
    use super::*;

    fn parse(text: &str) -> Result<f64, String> {
        let number = text.parse().ok().filter(|value: &f64| value.is_finite());
        number.ok_or_else(|| "expected START:END in seconds, such as 0:80".to_owned())
    }

    /// The range of `--window`.
    pub(crate) fn range(text: &str) -> Result<(f64, f64), String> {
        Textual::parse(text, &parse).map_err(|_| "expected START:END in seconds, such as 0:80".to_owned())
    }

    pub(crate) fn serialize<T: Textual, S: Serializer>(value: &T, to: S) -> Result<S::Ok, S::Error> {
        serialize_text(value.text(&|value| value.to_string()), to)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<(f64, f64)>, D::Error> {
        given(from, ":", |text| range(text).map(Some))
    }
}

/// A range of lengths with their units, m.
#[cfg(feature = "command")]
pub(crate) fn length_range(text: &str) -> Result<(f64, f64), String> {
    if !text.contains(':') {
        return Err("expected THINNEST:THICKEST with units, such as \"3 mm:20 mm\"".to_owned());
    }
    Textual::parse(text, &length::parse)
}

/// A value by its own text.
pub(crate) mod text {
    use super::*;

    pub(crate) fn serialize<T: Display, S: Serializer>(value: &Option<T>, to: S) -> Result<S::Ok, S::Error> {
        serialize_text(value.as_ref().map(ToString::to_string), to)
    }

    pub(crate) fn deserialize<'de, T, D: Deserializer<'de>>(from: D) -> Result<Option<T>, D::Error>
    where
        T: FromStr,
        T::Err: Display,
    {
        given(from, ",", |text| text.parse().map(Some).map_err(|error: T::Err| error.to_string()))
    }
}

/// A list of values by their texts; one text has several, with commas.
pub(crate) mod list {
    use super::*;

    pub(crate) fn serialize<T: Display, S: Serializer>(values: &[T], to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(values.iter().map(ToString::to_string))
    }

    pub(crate) fn deserialize<'de, T, D: Deserializer<'de>>(from: D) -> Result<Vec<T>, D::Error>
    where
        T: FromStr,
        T::Err: Display,
    {
        let items = match Given::deserialize(from)? {
            Given::Text(text) => text.split(',').filter(|item| !item.trim().is_empty()).map(str::to_owned).collect(),
            given => given.items(),
        };
        parsed(&items)
    }
}

/// A list of values whose texts have commas.
pub(crate) mod list_of_lists {
    use super::*;
    pub(crate) use list::serialize;

    pub(crate) fn deserialize<'de, T, D: Deserializer<'de>>(from: D) -> Result<Vec<T>, D::Error>
    where
        T: FromStr,
        T::Err: Display,
    {
        parsed(&Given::deserialize(from)?.items())
    }
}

fn parsed<T: FromStr<Err: Display>, E: serde::de::Error>(items: &[String]) -> Result<Vec<T>, E> {
    let parse = |item: &String| item.trim().parse().map_err(|error: T::Err| E::custom(error.to_string()));
    items.iter().map(parse).collect()
}

/// A seed, which a file has as a text where it is too large for one of its numbers.
pub(crate) mod seed {
    use super::*;

    pub(crate) fn serialize<S: Serializer>(seed: &u64, to: S) -> Result<S::Ok, S::Error> {
        match i64::try_from(*seed) {
            Ok(seed) => to.serialize_i64(seed),
            Err(_) => to.serialize_str(&seed.to_string()),
        }
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<u64, D::Error> {
        let text = Given::deserialize(from)?.text(",");
        let fault =
            || serde::de::Error::custom(format!("expected a whole number from 0 to {}, found {text:?}", u64::MAX));
        text.parse().map_err(|_| fault())
    }
}

/// A name on the command line, without the spaces around it.
#[cfg(feature = "command")]
pub(crate) fn name(text: &str) -> Result<String, std::convert::Infallible> {
    Ok(text.trim().to_owned())
}

/// A number of members, also in scientific notation.
pub(crate) mod count {
    use super::*;

    pub(crate) fn parse(text: &str) -> Result<usize, String> {
        let scientific =
            || text.parse::<f64>().ok().filter(|count| (0.0..1e15).contains(count) && count.fract() == 0.0);
        text.parse()
            .ok()
            .or(scientific().map(|count| count as usize))
            .ok_or("expected a whole number such as 5000 or 1e6".into())
    }

    pub(crate) fn serialize<S: Serializer>(count: &usize, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_u64(*count as u64)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<usize, D::Error> {
        parse(&Given::deserialize(from)?.text(",")).map_err(serde::de::Error::custom)
    }
}

/// The value of a factor: `f_k=1.2`, or `f_k@ID=1.2` of one case.
#[derive(Clone, Debug, PartialEq)]
pub struct FactorValue {
    /// Name of the factor.
    pub factor: String,
    /// The id of the case whose factor it is; `None`: every case that has it.
    pub case: Option<String>,
    /// The value, above zero.
    pub value: f64,
}

impl FactorValue {
    /// A value of the factor of every case.
    pub fn new(factor: impl Into<String>, value: f64) -> Self {
        Self { factor: factor.into(), case: None, value }
    }
}

impl Display for FactorValue {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let case = self.case.as_ref().map_or(String::new(), |case| format!("@{case}"));
        write!(formatter, "{}{case}={}", self.factor, self.value)
    }
}

impl FromStr for FactorValue {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE")?;
        let (factor, case) = name.trim().split_once('@').map_or((name.trim(), None), |(name, id)| (name, Some(id)));
        let number = value.trim().parse::<f64>().ok().filter(|value| value.is_finite() && *value > 0.0);
        let value = number.ok_or_else(|| format!("expected a number above zero, found {value:?}"))?;
        Ok(Self { factor: factor.to_owned(), case: case.map(str::to_owned), value })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_of_a_quantity_has_exactly_its_value() {
        for value in [0.5e-3, 0.0, 1e-9, 0.1 + 0.2, 1.0 / 3.0, 12.0, 1e-300, f64::MAX] {
            assert_eq!(length::parse(&length::text(value)), Ok(value));
            assert_eq!(time::parse(&time::text(value)), Ok(value));
            assert_eq!(temperature_difference::parse(&temperature_difference::text(value)), Ok(value));
        }
        assert_eq!(length::text(0.5e-3), "0.5 mm");
        assert_eq!(length::text(2.0), "2 m");
        assert!(length::parse("5 s").is_err() && length::parse("5").is_err());
    }

    #[test]
    fn a_value_of_a_factor_is_read_back_from_its_text() {
        for value in
            [FactorValue::new("f_k", 1.25), FactorValue { case: Some("b".to_owned()), ..FactorValue::new("f", 0.1) }]
        {
            assert_eq!(value.to_string().parse(), Ok(value));
        }
        for wrong in ["f_k", "f_k=", "f_k=0", "f_k=-1", "f_k=nan"] {
            assert!(wrong.parse::<FactorValue>().is_err(), "{wrong}");
        }
    }
}
