//! Tables as written: a heading line `time_s,flux_w_cm2,TC1_K`, then numbers; the unit of a column ends its heading.
//!
//! Values are separated by commas, semicolons or tabs, whichever the heading has; with the latter two a decimal comma is taken
//! too. Cells may be quoted, blank lines and lines that begin with `#` are passed over. A missing value is empty, `NaN` or `NA`.

use super::nearest::suggestion;
use super::source;
use super::written::all;
use crate::case::error::{Faults, Faulty, Place, Read};
use crate::case::unit::{Dimension, conversion};
use std::path::Path;
use std::sync::Arc;

/// Faults recorded of one column before reading gives up on it.
const MOST_FAULTS: usize = 10;

/// How a heading ends, and the unit it means; letters of either case.
const SUFFIXES: &[(&str, &str)] = &[
    ("_btu_ft2_s", "BTU/ft^2/s"),
    ("_kw_m2", "kW/m^2"),
    ("_w_cm2", "W/cm^2"),
    ("_w_m2", "W/m^2"),
    ("_kpa", "kPa"),
    ("_pa", "Pa"),
    ("_degc", "degC"),
    ("_degf", "degF"),
    ("_min", "min"),
    ("_ms", "ms"),
    ("_k", "K"),
    ("_s", "s"),
    ("_h", "h"),
];

/// A table of numbers, read but not yet understood.
#[derive(Debug)]
pub(super) struct Sheet {
    file: Arc<str>,
    columns: Vec<Column>,
    rows: Vec<Row>,
    has_decimal_commas: bool,
}

/// A column's heading: `TC1_K` is the stem `TC1` in the unit `K`.
#[derive(Debug)]
struct Column {
    heading: String,
    stem: String,
    unit: Option<&'static str>,
    place: Place,
}

#[derive(Debug)]
struct Row {
    line: usize,
    /// Column counted in characters, and text.
    cells: Vec<(usize, String)>,
}

impl Sheet {
    /// # Errors
    /// No such file; no heading; a row of another length than the heading; a heading that stands twice.
    pub(super) fn read(path: &Path, faults: &Faults) -> Read<Self> {
        let text = source::read(path, faults)?;
        let file: Arc<str> = path.display().to_string().into();
        let separator = separator(&text);
        let mut rows = rows(&text, separator)
            .map_err(|(line, message)| faults.record(&Place { file: file.clone(), at: Some((line, 1)) }, message))?
            .into_iter();
        let Some(heading) = rows.next() else {
            return Err(faults.record(&Place::whole(file), "no heading: expected a line such as \"time_s,TC1_K\""));
        };
        let columns: Vec<Column> = heading
            .cells
            .iter()
            .map(|(at, text)| {
                let (stem, unit) = split(text);
                let place = Place { file: file.clone(), at: Some((heading.line, *at)) };
                Column { heading: text.clone(), stem: stem.to_owned(), unit, place }
            })
            .collect();
        let sheet = Self { file, rows: rows.collect(), columns, has_decimal_commas: separator != b',' };
        sheet.check(faults)?;
        Ok(sheet)
    }

    fn check(&self, faults: &Faults) -> Read<()> {
        for (index, column) in self.columns.iter().enumerate() {
            if self.columns[..index].iter().any(|other| other.heading == column.heading) {
                return Err(faults.record(&column.place, format!("column {:?} stands twice", column.heading)));
            }
        }
        let count = self.columns.len();
        if let Some(row) = self.rows.iter().find(|row| row.cells.len() != count) {
            let message = format!("{} values under {count} headings", row.cells.len());
            return Err(faults.record(&self.place(row, 0), message));
        }
        if self.rows.is_empty() {
            return Err(faults.record(&Place::whole(self.file.clone()), "no rows under the heading"));
        }
        Ok(())
    }

    fn place(&self, row: &Row, column: usize) -> Place {
        Place { file: self.file.clone(), at: Some((row.line, row.cells.get(column).map_or(1, |cell| cell.0))) }
    }

    /// Where the heading stands.
    pub(super) fn heading_fault(&self, faults: &Faults, message: String) -> Faulty {
        faults.record(&self.columns[0].place, message)
    }

    /// The headings but the time's: index and name less its unit.
    pub(super) fn stems(&self) -> impl Iterator<Item = (usize, &str)> {
        self.columns.iter().enumerate().skip(1).map(|(index, column)| (index, column.stem.as_str()))
    }

    pub(super) fn fault(&self, column: usize, faults: &Faults, message: String) -> Faulty {
        faults.record(&self.columns[column].place, message)
    }

    /// The column of a name, with or without its unit; without a name, the only one beside the time.
    ///
    /// # Errors
    /// A message: no such column, or more than one to choose from.
    pub(super) fn named(&self, name: Option<&str>) -> Result<usize, String> {
        let Some(name) = name else {
            return match self.columns.len() {
                2 => Ok(1),
                count => {
                    Err(format!("{} has {count} columns: expected a time and one more, or a key `column`", self.file))
                }
            };
        };
        let found = self.columns.iter().position(|column| column.heading == name || column.stem == name);
        let known = self.columns.iter().skip(1).map(|column| column.heading.as_str());
        found
            .filter(|&index| index > 0)
            .ok_or_else(|| format!("{} has no column {name:?}{}", self.file, suggestion(name, known)))
    }

    /// A column over the times of the first one: pairs of time (s) and value (SI); rows without the value are left out.
    /// Times rise; `jumps` lets one stand twice in a row.
    pub(super) fn series(&self, column: usize, dimension: Dimension, jumps: bool, faults: &Faults) -> Read<Series> {
        let (time, value) = (&self.columns[0], &self.columns[column]);
        let expected = "expected a first column such as \"time_s\"";
        let seconds = scale(time, Dimension::Time, faults, expected);
        let example = match dimension {
            Dimension::HeatFlux => "flux_w_cm2".to_owned(),
            Dimension::Pressure => "pressure_kpa".to_owned(),
            _ => format!("{}_K", value.stem),
        };
        let expected = format!("expected a heading with a unit such as {example:?}");
        let si = scale(value, dimension, faults, &expected);
        let (seconds, si) = (seconds?, si?);
        let mut last_s = f64::NEG_INFINITY;
        let rows = self.rows.iter().filter(|row| !is_missing(&row.cells[column].1));
        let read = rows.map(|row| {
            let time_s = self.number(row, 0, faults)? * seconds.0 + seconds.1;
            let value = self.number(row, column, faults)? * si.0 + si.1;
            let back = if jumps { time_s < last_s } else { time_s <= last_s };
            if back {
                let message = format!("time {time_s} s does not rise: the row before is at {last_s} s");
                return Err(faults.record(&self.place(row, 0), message));
            }
            last_s = time_s;
            if !dimension.is_allowed(value) {
                let message = format!("{value} K is {}", dimension.limit());
                return Err(faults.record(&self.place(row, column), message));
            }
            Ok((time_s, value))
        });
        let mut met = 0;
        let series = all(read.take_while(|row| {
            met += usize::from(row.is_err());
            met <= MOST_FAULTS
        }))?;
        if series.is_empty() {
            return Err(faults.record(&value.place, format!("column {:?} is empty", value.heading)));
        }
        Ok(series)
    }

    fn number(&self, row: &Row, column: usize, faults: &Faults) -> Read<f64> {
        let text = &row.cells[column].1;
        let with_point =
            if self.has_decimal_commas && !text.contains('.') { text.replacen(',', ".", 1) } else { text.clone() };
        match with_point.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(faults.record(&self.place(row, column), format!("expected a finite number, found {text:?}"))),
        }
    }
}

/// Pairs of time (s) and value (SI).
pub(super) type Series = Vec<(f64, f64)>;

fn scale(column: &Column, dimension: Dimension, faults: &Faults, expected: &str) -> Read<(f64, f64)> {
    let Some(unit) = column.unit else {
        let message = format!("missing unit in heading {:?}: {expected}", column.heading);
        return Err(faults.record(&column.place, message));
    };
    conversion(unit, dimension)
        .map_err(|message| faults.record(&column.place, format!("{message}, found {:?}", column.heading)))
}

/// `TC1_K` is `TC1` in `K`.
fn split(heading: &str) -> (&str, Option<&'static str>) {
    let lower = heading.to_ascii_lowercase();
    let found = SUFFIXES.iter().find(|(suffix, _)| lower.ends_with(suffix));
    match found {
        Some((suffix, unit)) => (&heading[..heading.len() - suffix.len()], Some(unit)),
        None => (heading, None),
    }
}

/// What separates values: a semicolon or a tab where the heading has one, else a comma.
fn separator(text: &str) -> u8 {
    let heading = text.lines().find(|line| !line.trim().is_empty() && !line.starts_with('#')).unwrap_or_default();
    [b';', b'\t'].into_iter().find(|&separator| heading.contains(char::from(separator))).unwrap_or(b',')
}

fn is_missing(text: &str) -> bool {
    text.is_empty() || ["nan", "na", "n/a"].iter().any(|missing| text.eq_ignore_ascii_case(missing))
}

/// The rows that are not blank.
///
/// # Errors
/// The line of a quote that is never closed, and what is wrong there.
fn rows(text: &str, separator: u8) -> Result<Vec<Row>, (usize, String)> {
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(separator)
        .comment(Some(b'#'))
        .has_headers(false)
        .flexible(true)
        .from_reader(text.as_bytes());
    let lines: Vec<&str> = text.lines().collect();
    let mut rows = Vec::new();
    for record in reader.records() {
        let record =
            record.map_err(|error| (error.position().map_or(1, |at| at.line() as usize), error.to_string()))?;
        let line = record.position().map_or(1, |at| at.line() as usize);
        // The reader tells the line at which it began to look for a record: blank lines and comments may come first.
        let skipped = |line: &&&str| line.trim().is_empty() || line.starts_with('#');
        let line = line + lines.iter().skip(line - 1).take_while(skipped).count();
        if record.iter().any(|cell| cell.contains('\n')) {
            return Err((line, "a quoted value goes on over the end of its line".to_owned()));
        }
        if record.iter().all(|cell| cell.trim().is_empty()) && record.len() <= 1 {
            continue;
        }
        rows.push(Row { line, cells: cells(&record, lines.get(line - 1).copied().unwrap_or_default()) });
    }
    Ok(rows)
}

/// Each value with the column, counted in characters, at which it stands in its line.
fn cells(record: &csv::StringRecord, line: &str) -> Vec<(usize, String)> {
    let mut at = 1;
    let mut rest = line.chars();
    record
        .iter()
        .map(|cell| {
            let lead = cell.chars().take_while(|c| c.is_whitespace()).count();
            let start = at + lead;
            let quotes = if rest.clone().next() == Some('"') { 2 + cell.matches('"').count() } else { 0 };
            let length = cell.chars().count() + quotes + 1;
            at += length;
            rest.by_ref().take(length).for_each(drop);
            (start, cell.trim().to_owned())
        })
        .collect()
}
