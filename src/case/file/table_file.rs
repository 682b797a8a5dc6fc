//! Table files (CSV and similar): a heading line `time_s,flux_w_cm2,TC1_K`, then numbers. The unit of a column ends its
//! heading, also as `TC1 (K)` or `TC1 [K]`, or is in a line of units below the headings.
//!
//! A case may choose columns by their headings. Lines above the headings are then ignored, and so are columns without a
//! heading and repeated headings, unless they are chosen.
//!
//! Cells are stored as numbers, which saves memory with a million rows. Line and column of an error are found in the
//! text when it is recorded.

mod dialect;

use super::text_file;
use crate::case::error::{Diagnostics, ErrorReported, ReadResult, SourceLocation};
use crate::case::suggestion::suggestion;
use crate::case::table::is_increasing;
use crate::case::unit::{Dimension, is_unit, unit_conversion};
use crate::limits::{COLUMNS, TABLE_FILE_MIB};
use dialect::Dialect;
use std::io;
use std::sync::Arc;

/// Errors recorded per column, and of row lengths, before reading stops.
const MAX_ERRORS: usize = 10;

/// Suffixes of a heading, in upper or lower case, and their units.
const UNIT_SUFFIXES: &[(&str, &str)] = &[
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

/// A table of numbers without interpretation of units.
#[derive(Debug)]
pub(super) struct TableFile {
    file: Arc<str>,
    text: String,
    dialect: Dialect,
    columns: Vec<Column>,
    /// Byte offset of each row in the text; blank lines and comments may precede the row.
    row_offsets: Vec<usize>,
    /// Numbers in row-major order: NaN for a missing value, infinite for a cell without a finite number.
    numbers: Vec<f64>,
}

/// A column's heading: `TC1_K` is the name `TC1` in the unit `K`.
#[derive(Debug)]
struct Column {
    heading: String,
    name: String,
    unit: Option<String>,
    location: SourceLocation,
}

/// A column, and the scale and offset of its values to SI if the case states their unit.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ChosenColumn {
    pub(super) index: usize,
    pub(super) conversion: Option<(f64, f64)>,
}

/// The column of times, and the time that is added to them. By default the first column as it is.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TimeColumn {
    pub(super) column: ChosenColumn,
    pub(super) offset_s: f64,
}

/// How much of a table file must be in order.
#[derive(Clone, Copy, Debug)]
pub(super) enum Headings<'a> {
    /// The headings are the first line; all are different, and none is empty.
    All,
    /// The case chooses columns. The headings are the first line with this one; without it, the first line.
    Chosen(Option<&'a str>),
}

/// Times (s) and values (SI) of a column.
pub(super) type TimeSeries = (Vec<f64>, Vec<f64>);

impl TableFile {
    /// # Errors
    /// No such file; no heading; a duplicate or missing column heading; no rows; a row with too few or too many values;
    /// an unclosed quote.
    pub(super) fn read(
        bytes: io::Result<Vec<u8>>,
        label: &str,
        headings: Headings<'_>,
        diagnostics: &Diagnostics,
    ) -> ReadResult<Self> {
        let mut text = text_file::decode_text_file(bytes, label, &TABLE_FILE_MIB, diagnostics)?;
        let file: Arc<str> = label.into();
        if text.contains('\r') {
            text = text.replace("\r\n", "\n").replace('\r', "\n");
        }
        if let Headings::Chosen(Some(heading)) = headings {
            blank_lines_above(&mut text, heading);
        }
        let dialect = Dialect::detect(&text);
        if let Some((line, column, message)) = dialect.first_quote_error(&text) {
            return Err(diagnostics.record(&SourceLocation { file, line_column: Some((line, column)) }, message));
        }
        let mut sheet = Self { file, text, dialect, columns: Vec::new(), row_offsets: Vec::new(), numbers: Vec::new() };
        let text = std::mem::take(&mut sheet.text);
        let read = sheet.read_rows(&text, headings, diagnostics);
        sheet.text = text;
        read.map(|()| sheet)
    }

    fn read_rows(&mut self, text: &str, headings: Headings<'_>, diagnostics: &Diagnostics) -> ReadResult<()> {
        let mut reader = self.dialect.reader(text);
        let mut record = csv::StringRecord::new();
        let mut faulty = Ok(());
        let mut met = 0;
        let mut has_units = false;
        let failed = |error: csv::Error, file: &Arc<str>| {
            diagnostics.record(&SourceLocation::without_line(file.clone()), error.to_string())
        };
        while met < MAX_ERRORS && reader.read_record(&mut record).map_err(|error| failed(error, &self.file))? {
            if record.iter().all(|cell| cell.trim().is_empty()) {
                continue;
            }
            let start = record.position().map_or(0, |at| at.byte() as usize);
            if self.columns.is_empty() {
                self.columns = self.read_headings(text, start, &record, headings, diagnostics)?;
                continue;
            }
            let count = self.columns.len();
            let has_more = record.iter().skip(count).any(|cell| !cell.trim().is_empty());
            if record.len() < count || has_more {
                let place = self.dialect.line_column(text, start, 0);
                let message = format!(
                    "found {} values under {count} headings{}",
                    record.len(),
                    self.dialect.decimal_comma_hint()
                );
                faulty =
                    Err(diagnostics
                        .record(&SourceLocation { file: self.file.clone(), line_column: Some(place) }, message));
                met += 1;
                continue;
            }
            let cells = record.iter().take(count);
            if self.row_offsets.is_empty() && !has_units && self.dialect.is_row_of_text(cells.clone()) {
                let units = cells.map(|cell| cell.trim().trim_matches(['(', ')', '[', ']']));
                has_units = units.clone().any(is_unit);
                if has_units {
                    for (column, unit) in self.columns.iter_mut().zip(units).filter(|(_, unit)| !unit.is_empty()) {
                        column.unit = Some(unit.to_owned());
                    }
                    continue;
                }
            }
            self.row_offsets.push(start);
            self.numbers.extend(record.iter().take(count).map(|cell| self.dialect.number(cell)));
        }
        faulty?;
        let Some(time) = self.columns.first() else {
            let message = "no heading: expected a line such as \"time_s,TC1_K\"";
            return Err(diagnostics.record(&SourceLocation::without_line(self.file.clone()), message));
        };
        if self.row_offsets.is_empty() {
            return Err(diagnostics.record(&time.location, "no rows under this heading"));
        }
        Ok(())
    }

    /// The columns of a heading line; separators at its end are ignored.
    fn read_headings(
        &self,
        text: &str,
        start: usize,
        record: &csv::StringRecord,
        headings: Headings<'_>,
        diagnostics: &Diagnostics,
    ) -> ReadResult<Vec<Column>> {
        COLUMNS.check(record.len() as f64).map_err(|message| {
            let line_column = Some(self.dialect.line_column(text, start, 0));
            diagnostics.record(&SourceLocation { file: self.file.clone(), line_column }, message)
        })?;
        let mut columns: Vec<Column> = Vec::new();
        let trailing = (0..record.len()).rev().take_while(|&index| record[index].trim().is_empty()).count();
        for (index, heading) in record.iter().take(record.len() - trailing).enumerate() {
            let place = SourceLocation {
                file: self.file.clone(),
                line_column: Some(self.dialect.line_column(text, start, index)),
            };
            let heading = heading.trim().to_owned();
            let is_strict = matches!(headings, Headings::All);
            if is_strict && heading.is_empty() {
                return Err(diagnostics.record(&place, format!("column {} has no heading", index + 1)));
            }
            if is_strict && columns.iter().any(|other| other.heading == heading) {
                return Err(diagnostics.record(&place, format!("duplicate column {heading:?}")));
            }
            let (stem, unit) = split_heading(&heading);
            columns.push(Column { name: stem.to_owned(), unit: unit.map(str::to_owned), heading, location: place });
        }
        Ok(columns)
    }

    fn cell_location(&self, row: usize, column: usize) -> SourceLocation {
        SourceLocation {
            file: self.file.clone(),
            line_column: Some(self.dialect.line_column(&self.text, self.row_offsets[row], column)),
        }
    }

    /// Index and name without unit of each column other than the time.
    pub(super) fn value_columns(&self, time: TimeColumn) -> impl Iterator<Item = (usize, &str)> {
        let columns = self.columns.iter().enumerate().filter(move |(index, _)| *index != time.column.index);
        columns.map(|(index, column)| (index, column.name.as_str()))
    }

    /// The name of the file in messages.
    pub(super) fn file(&self) -> Arc<str> {
        self.file.clone()
    }

    /// The heading of a column, as written.
    pub(super) fn heading(&self, column: usize) -> &str {
        &self.columns[column].heading
    }

    /// Record an error at the heading of a column.
    pub(super) fn error(&self, column: usize, diagnostics: &Diagnostics, message: String) -> ErrorReported {
        diagnostics.record(&self.columns[column].location, message)
    }

    /// The only column other than the time.
    ///
    /// # Errors
    /// A message: there is none, or several.
    pub(super) fn only_value_column(&self, time: TimeColumn) -> Result<usize, String> {
        let mut others = self.value_columns(time);
        match (others.next(), others.next()) {
            (None, _) => Err(format!("{} has only a time column: expected a column of values", self.file)),
            (Some((index, _)), None) => Ok(index),
            _ => Err(format!("{} has {} columns: choose one with a key `column`", self.file, self.columns.len())),
        }
    }

    /// The column of a name, with or without its unit; `time` is the column that is not meant.
    ///
    /// # Errors
    /// A message: unknown or ambiguous column.
    pub(super) fn find_column(&self, name: &str, time: Option<TimeColumn>) -> Result<usize, String> {
        let matches = |is: &dyn Fn(&Column) -> bool| -> Vec<usize> {
            (0..self.columns.len()).filter(|&index| is(&self.columns[index])).collect()
        };
        let by_heading = matches(&|column| column.heading == name);
        let found = if by_heading.is_empty() { matches(&|column| column.name == name) } else { by_heading };
        match found.as_slice() {
            [index] => Ok(*index),
            [] => {
                let times = time.map(|time| time.column.index);
                let others = self.columns.iter().enumerate().filter(|(index, _)| Some(*index) != times);
                let headings = others.map(|(_, column)| column.heading.as_str());
                Err(format!("{} has no column {name:?}{}", self.file, suggestion(name, headings)))
            }
            several => {
                let several: Vec<&str> = several.iter().map(|&index| self.columns[index].heading.as_str()).collect();
                Err(format!("{} has several columns {name:?}: choose one of {}", self.file, several.join(", ")))
            }
        }
    }

    /// A column over the times, without the rows where it has no value. Times must increase; `jumps` allows equal ones.
    pub(super) fn time_series(
        &self,
        time: TimeColumn,
        column: ChosenColumn,
        dimension: Dimension,
        jumps: bool,
        diagnostics: &Diagnostics,
    ) -> ReadResult<TimeSeries> {
        let TimeColumn { column: ChosenColumn { index: time, conversion: stated_time }, offset_s } = time;
        let ChosenColumn { index: column, conversion: stated } = column;
        let (time_column, value) = (&self.columns[time], &self.columns[column]);
        let expected = "expected a first column such as \"time_s\"";
        let seconds = stated_time.map_or_else(|| unit_scale(time_column, Dimension::Time, diagnostics, expected), Ok);
        let example = match dimension {
            Dimension::HeatFlux => "flux_w_cm2".to_owned(),
            Dimension::Pressure => "pressure_kpa".to_owned(),
            _ => format!("{}_K", value.name),
        };
        let expected = format!("expected a heading with a unit such as {example:?}");
        let si = stated.map_or_else(|| unit_scale(value, dimension, diagnostics, &expected), Ok);
        let (seconds, si) = (seconds?, si?);
        let (mut times_s, mut values) =
            (Vec::with_capacity(self.row_offsets.len()), Vec::with_capacity(self.row_offsets.len()));
        let mut last_s = f64::NEG_INFINITY;
        let (mut faulty, mut met) = (Ok(()), 0);
        for (row, cells) in self.numbers.chunks_exact(self.columns.len()).enumerate() {
            if cells[column].is_nan() {
                continue;
            }
            let (time_s, si_value) = (cells[time] * seconds.0 + offset_s, cells[column] * si.0 + si.1);
            let fault = if !time_s.is_finite() {
                self.not_a_number_error(row, time, diagnostics)
            } else if !si_value.is_finite() {
                self.not_a_number_error(row, column, diagnostics)
            } else if !is_increasing(last_s, time_s, jumps) {
                let rule = if jumps { "must not decrease" } else { "must increase" };
                let message = format!("times {rule}: {time_s} s follows {last_s} s");
                diagnostics.record(&self.cell_location(row, time), message)
            } else if !dimension.is_allowed(si_value) {
                diagnostics
                    .record(&self.cell_location(row, column), format!("{si_value} K is {}", dimension.violation()))
            } else {
                last_s = time_s;
                times_s.push(time_s);
                values.push(si_value);
                continue;
            };
            (faulty, met) = (Err(fault), met + 1);
            if met == MAX_ERRORS {
                break;
            }
        }
        faulty?;
        if values.is_empty() {
            return Err(diagnostics.record(&value.location, format!("column {:?} has no value", value.heading)));
        }
        Ok((times_s, values))
    }

    /// Record a missing time or a cell that is not a finite number.
    fn not_a_number_error(&self, row: usize, column: usize, diagnostics: &Diagnostics) -> ErrorReported {
        let mut record = csv::StringRecord::new();
        let mut reader = self.dialect.reader(&self.text[self.row_offsets[row]..]);
        let text = match reader.read_record(&mut record) {
            Ok(true) => record.get(column).unwrap_or_default().trim(),
            _ => "",
        };
        let message = if self.numbers[row * self.columns.len() + column].is_nan() {
            format!("missing time: expected a number, found {text:?}")
        } else {
            format!("expected a finite number, found {text:?}{}", self.dialect.number_hint(text))
        };
        diagnostics.record(&self.cell_location(row, column), message)
    }
}

fn unit_scale(
    column: &Column,
    dimension: Dimension,
    diagnostics: &Diagnostics,
    expected: &str,
) -> ReadResult<(f64, f64)> {
    let Some(unit) = &column.unit else {
        let message = format!("missing unit in heading {:?}: {expected}", column.heading);
        return Err(diagnostics.record(&column.location, message));
    };
    unit_conversion(unit, dimension)
        .map_err(|message| diagnostics.record(&column.location, format!("{message}, found {:?}", column.heading)))
}

/// Name and unit: `TC1_K`, `TC1 (K)` and `TC1 [K]` are `TC1` in `K`.
fn split_heading(heading: &str) -> (&str, Option<&str>) {
    for (open, close) in [('(', ')'), ('[', ']')] {
        if let Some((name, unit)) = heading.strip_suffix(close).and_then(|inner| inner.rsplit_once(open)) {
            return (name.trim_end(), Some(unit.trim()));
        }
    }
    let lower = heading.to_ascii_lowercase();
    let found = UNIT_SUFFIXES.iter().find(|(suffix, _)| lower.ends_with(suffix));
    match found {
        Some((suffix, unit)) => (&heading[..heading.len() - suffix.len()], Some(unit)),
        None => (heading, None),
    }
}

/// Make the lines above the first line with this heading empty, so that the numbers of the lines stay the same. Without
/// such a line the text stays as it is, and the heading is not found.
fn blank_lines_above(text: &mut String, heading: &str) {
    let is_heading = |cell: &str| {
        let cell = cell.trim().trim_matches('"').trim();
        cell == heading || split_heading(cell).0 == heading
    };
    let mut starts = text.split_inclusive('\n').scan(0, |end, line| {
        let start = *end;
        *end += line.len();
        Some((start, line))
    });
    let Some((start, _)) = starts.find(|(_, line)| line.split([',', ';', '\t']).any(is_heading)) else { return };
    let above = text[..start].matches('\n').count();
    text.replace_range(..start, &"\n".repeat(above));
}
