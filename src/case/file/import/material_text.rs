//! The text of an imported material file.

use super::ImportRecord;
use crate::case::OutOfRange;
use crate::case::input_files::InputFile;
use crate::case::toml_string;
use crate::case::unit::Dimension;

/// Numbers on a line of a list.
const NUMBERS_PER_LINE: usize = 8;

/// A property: one value, or a table over temperature (K) in SI.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Property {
    Constant(f64),
    Table { temperatures_k: Vec<f64>, values: Vec<f64> },
}

impl Property {
    /// The keys of the property.
    pub(super) fn keys(&self, dimension: Dimension, outside: OutOfRange) -> String {
        let unit = unit(dimension);
        match self {
            Self::Constant(value) if unit.is_empty() => format!("value = {value}\n"),
            Self::Constant(value) => format!("value = \"{value} {unit}\"\n"),
            Self::Table { temperatures_k, values } => {
                let stated = if unit.is_empty() { String::new() } else { format!("unit = \"{unit}\"\n") };
                let outside = match outside {
                    OutOfRange::Error => "error",
                    OutOfRange::Clamp => "clamp",
                    OutOfRange::Extrapolate => "extrapolate",
                };
                format!(
                    "temperatures_k = {}\nvalues = {}\n{stated}outside = \"{outside}\"\n",
                    list(temperatures_k),
                    list(values)
                )
            }
        }
    }
}

/// The SI unit of a property.
fn unit(dimension: Dimension) -> &'static str {
    match dimension {
        Dimension::Conductivity => "W/m/K",
        Dimension::HeatCapacity => "J/kg/K",
        _ => "",
    }
}

/// Numbers in brackets, on lines of some numbers each if there are many.
fn list(numbers: &[f64]) -> String {
    let line = |numbers: &[f64]| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
    if numbers.len() <= NUMBERS_PER_LINE {
        return format!("[{}]", line(numbers));
    }
    let lines: Vec<String> =
        numbers.chunks(NUMBERS_PER_LINE).map(|numbers| format!("  {},\n", line(numbers))).collect();
    format!("[\n{}]", lines.concat())
}

/// The keys `mark`, `source` and `uncertainty` of a property from some files.
pub(super) fn provenance(record: &ImportRecord<'_>, files: &[InputFile]) -> String {
    let files: Vec<String> = files.iter().map(|file| format!("{}, SHA-256 {}", file.path, file.sha256)).collect();
    let stated = record.source.map_or(String::new(), |source| format!("{source}; "));
    let source = toml_string(&format!("{stated}imported on {} from {}", record.date, files.join(" and ")));
    match record.mark {
        Some((mark, uncertainty)) => {
            format!("mark = \"{}\"\nsource = {source}\nuncertainty = {}\n", mark.key(), toml_string(uncertainty))
        }
        None => format!("source = {source}\n"),
    }
}
