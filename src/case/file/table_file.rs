//! Table files (CSV and similar, and sheets of workbooks): a heading line `time_s,flux_w_cm2,TC1_K`, then numbers. The
//! unit of a column ends its heading, also as `TC1 (K)` or `TC1 [K]`, or is in a line of units below the headings.
//!
//! A case may choose columns by their headings. Lines above the headings are then ignored, and so are columns without a
//! heading and repeated headings, unless they are chosen.
//!
//! Cells are stored as numbers, which saves memory with a million rows. Line and column of an error are found in the
//! text when it is recorded.

mod cell_range;
mod clock;
mod dialect;
mod source;
mod table_choice;
mod workbook;

pub(super) use table_choice::TableChoice;

use super::text_file;
use crate::case::Table;
use crate::case::error::{Diagnostics, ErrorReported, ReadResult, SourceLocation};
use crate::case::suggestion::suggestion;
use crate::case::table::is_increasing;
use crate::case::unit::{Dimension, is_unit, unit_conversion};
use crate::case::validation::readable;
use crate::limits::{COLUMNS, TABLE_CELLS, TABLE_FILE_MIB};
use clock::ColumnKind;
use dialect::{Dialect, NOT_FINITE};
use source::Sheet;
use source::{Rows, Source};
use std::io;
use std::rc::Rc;
use std::sync::Arc;
use {crate::case::file::spanned_toml::ValueReader, std::collections::BTreeMap, workbook::Workbook};

/// Errors recorded per column, and of row lengths, before reading stops.
const MAX_ERRORS: usize = 10;

/// First bytes of an .xlsx workbook, and of one in an older format or with a password. No text begins with them.
const ZIP_ARCHIVE: &[u8] = b"PK\x03\x04";
const COMPOUND_FILE: &[u8] = b"\xd0\xcf\x11\xe0";

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
    source: Source,
    dialect: Dialect,
    columns: Vec<Column>,
    /// The key of each row in the source.
    rows: Vec<usize>,
    /// Numbers in row-major order: NaN for a missing value, infinite for a cell without a finite number.
    numbers: Vec<f64>,
}

/// A column's heading: `TC1_K` is the name `TC1` in the unit `K`.
#[derive(Debug)]
struct Column {
    heading: String,
    name: String,
    unit: Option<String>,
    /// If its cells are dates or durations, what their seconds count from.
    clock: Option<String>,
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

impl TimeColumn {
    /// A time of the clock with the offset, s; 0 where the sum is below their rounding.
    fn shifted_s(self, clock_s: f64) -> f64 {
        let time_s = clock_s + self.offset_s;
        if time_s.abs() < 4.0 * f64::EPSILON * clock_s.abs() { 0.0 } else { time_s }
    }
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
    /// an unclosed quote; a sheet or a range that is not there.
    pub(super) fn read(
        bytes: io::Result<Vec<u8>>,
        label: &str,
        sheet: TableChoice<'_>,
        headings: Headings<'_>,
        diagnostics: &Diagnostics,
    ) -> ReadResult<Self> {
        let bytes = match bytes {
            Ok(bytes) if bytes.starts_with(ZIP_ARCHIVE) => {
                return Self::read_workbook(bytes, label, sheet, headings, diagnostics);
            }
            Ok(bytes) if bytes.starts_with(COMPOUND_FILE) => {
                let message = "an .xls workbook or one with a password: expected an .xlsx workbook or a text file";
                return Err(diagnostics.record(&SourceLocation::without_line(label), message));
            }
            bytes => bytes,
        };
        if let Some((key, written)) = sheet.workbook_key() {
            return Err(written.error(format!("`{key}` needs a workbook: {label} is a text file")));
        }
        let missing = sheet.missing()?;
        let mut text = text_file::decode_table(bytes, label, &TABLE_FILE_MIB, diagnostics)?;
        let file: Arc<str> = label.into();
        if text.contains('\r') {
            text = text.replace("\r\n", "\n").replace('\r', "\n");
        }
        let is_toa5 = is_toa5(&text);
        if is_toa5 {
            blank_lines(&mut text, &TOA5_LINES_WITHOUT_DATA);
        }
        if let Headings::Chosen(Some(heading)) = headings {
            blank_lines_above(&mut text, heading);
        }
        let dialect = Dialect::detect(&text).with_missing(missing);
        if let Some((line, column, message)) = dialect.first_quote_error(&text) {
            let place = SourceLocation { line_column: Some((line, column)), ..SourceLocation::without_line(file) };
            return Err(diagnostics.record(&place, message));
        }
        let text = Rc::new(text);
        let mut table = Self::new(file, Source::Text(text.clone()), dialect);
        let mut rows = Rows::Text(table.dialect.reader(&text));
        table.read_rows(&mut rows, headings, is_toa5, diagnostics).map(|()| table)
    }

    fn read_workbook(
        bytes: Vec<u8>,
        label: &str,
        choice: TableChoice<'_>,
        headings: Headings<'_>,
        diagnostics: &Diagnostics,
    ) -> ReadResult<Self> {
        let place = SourceLocation::without_line(label);
        let failed = |message| diagnostics.record(&place, message);
        TABLE_FILE_MIB.check(bytes.len().div_ceil(1 << 20) as f64).map_err(failed)?;
        let (name, range) = (choice.sheet.map(ValueReader::text).transpose()?, choice.cells()?);
        let missing = choice.missing()?;
        let mut workbook = match (Workbook::open(bytes, name).map_err(failed)?, choice.sheet) {
            (Ok(workbook), _) => workbook,
            (Err(message), Some(written)) => return Err(written.error(format!("{label} has {message}"))),
            (Err(message), None) => return Err(failed(message)),
        };
        if let (None, 2..) = (name, workbook.sheets) {
            let message = format!("sheet {:?} read, the first of {}", workbook.sheet, workbook.sheets);
            diagnostics.record_note(&place, message);
        }
        let place = SourceLocation { sheet: Some(workbook.sheet.as_str().into()), ..place };
        let failed = |message| diagnostics.record(&place, message);
        let is_heading = |cells: &csv::StringRecord| match headings {
            Headings::Chosen(Some(heading)) => cells.iter().any(|cell| is_named(cell, heading)),
            _ => true,
        };
        let range = workbook.range_from(range, is_heading).map_err(failed)?;
        let sheet = Sheet { first_column: range.columns.0 as usize, texts: BTreeMap::new() };
        let name = place.sheet.clone().unwrap_or_default();
        let mut table =
            Self::new(place.file.clone(), Source::Sheet(name, sheet), Dialect::of_sheets().with_missing(missing));
        let mut rows = Rows::Sheet(Box::new(workbook.rows(range).map_err(failed)?));
        table.read_rows(&mut rows, headings, false, diagnostics)?;
        for (column, clock) in rows.clocks() {
            if let Some(column) = table.columns.get_mut(column) {
                column.clock = Some(clock);
            }
        }
        Ok(table)
    }

    fn new(file: Arc<str>, source: Source, dialect: Dialect) -> Self {
        Self { file, source, dialect, columns: Vec::new(), rows: Vec::new(), numbers: Vec::new() }
    }

    /// `has_units` says that a line of units follows the headings, whatever they are.
    fn read_rows(
        &mut self,
        rows: &mut Rows<'_>,
        headings: Headings<'_>,
        has_units: bool,
        diagnostics: &Diagnostics,
    ) -> ReadResult<()> {
        let mut record = csv::StringRecord::new();
        let mut faulty = Ok(());
        let mut met = 0;
        let (expects_units, mut has_units) = (has_units, false);
        let mut kinds: Vec<ColumnKind> = Vec::new();
        while met < MAX_ERRORS
            && let Some(row) = rows.next(&mut record).map_err(|message| self.error_of_all(message, diagnostics))?
        {
            if record.iter().all(|cell| cell.trim().is_empty()) {
                continue;
            }
            if self.columns.is_empty() {
                self.columns = self.read_headings(row, &record, headings, diagnostics)?;
                rows.set_columns(self.columns.len());
                kinds.resize_with(self.columns.len(), ColumnKind::default);
                continue;
            }
            let count = self.columns.len();
            let has_more = record.iter().skip(count).any(|cell| !cell.trim().is_empty());
            if record.len() < count || has_more {
                let message = format!(
                    "found {} values under {count} headings{}",
                    record.len(),
                    self.dialect.decimal_comma_hint()
                );
                faulty = Err(diagnostics.record(&self.location(row, 0), message));
                met += 1;
                continue;
            }
            let cells = record.iter().take(count);
            if self.rows.is_empty() && !has_units && self.dialect.is_row_of_text(cells.clone()) {
                let units = cells.map(|cell| cell.trim().trim_matches(['(', ')', '[', ']']));
                has_units = expects_units || units.clone().any(is_unit);
                if has_units {
                    for (column, unit) in self.columns.iter_mut().zip(units).filter(|(_, unit)| !unit.is_empty()) {
                        column.unit = Some(unit.to_owned());
                    }
                    continue;
                }
            }
            TABLE_CELLS
                .check((self.numbers.len() + count) as f64)
                .map_err(|message| diagnostics.record(&self.location(row, 0), message))?;
            self.rows.push(row);
            for (column, cell) in record.iter().take(count).enumerate() {
                let number = kinds[column].number(cell, self.dialect.number(cell), NOT_FINITE);
                if number == NOT_FINITE {
                    self.source.keep(row, column, cell, MAX_ERRORS);
                }
                self.numbers.push(number);
            }
        }
        for (column, kind) in self.columns.iter_mut().zip(&kinds) {
            column.clock = kind.clock();
        }
        faulty?;
        let Some(time) = self.columns.first() else {
            let message = "no heading: expected a line such as \"time_s,TC1_K\"".to_owned();
            return Err(self.error_of_all(message, diagnostics));
        };
        if self.rows.is_empty() {
            return Err(diagnostics.record(&time.location, "no rows under this heading"));
        }
        Ok(())
    }

    /// The columns of a heading line; separators at its end are ignored.
    fn read_headings(
        &self,
        row: usize,
        record: &csv::StringRecord,
        headings: Headings<'_>,
        diagnostics: &Diagnostics,
    ) -> ReadResult<Vec<Column>> {
        let check = COLUMNS.check(record.len() as f64);
        check.map_err(|message| diagnostics.record(&self.location(row, 0), message))?;
        let mut columns: Vec<Column> = Vec::new();
        let trailing = (0..record.len()).rev().take_while(|&index| record[index].trim().is_empty()).count();
        for (index, heading) in record.iter().take(record.len() - trailing).enumerate() {
            let location = self.location(row, index);
            let heading = heading.trim().to_owned();
            let is_strict = matches!(headings, Headings::All);
            if is_strict && heading.is_empty() {
                return Err(diagnostics.record(&location, format!("column {} has no heading", index + 1)));
            }
            if is_strict && columns.iter().any(|other| other.heading == heading) {
                return Err(diagnostics.record(&location, format!("duplicate column {heading:?}")));
            }
            let (stem, unit) = split_heading(&heading);
            let (name, unit) = (stem.to_owned(), unit.map(str::to_owned));
            columns.push(Column { name, unit, clock: None, heading, location });
        }
        Ok(columns)
    }

    /// The position of a cell of the row of a key.
    fn location(&self, row: usize, column: usize) -> SourceLocation {
        self.source.location(&self.file, &self.dialect, Some((row, column)))
    }

    /// Record an error of the whole table.
    fn error_of_all(&self, message: String, diagnostics: &Diagnostics) -> ErrorReported {
        diagnostics.record(&self.source.location(&self.file, &self.dialect, None), message)
    }

    fn cell_location(&self, row: usize, column: usize) -> SourceLocation {
        self.location(self.rows[row], column)
    }

    /// Note what the seconds of the times count from, if their cells are dates or durations.
    pub(super) fn note_clock(&self, time: TimeColumn, diagnostics: &Diagnostics) {
        let Column { heading, clock, location, .. } = &self.columns[time.column.index];
        if let Some(clock) = clock {
            let place = SourceLocation { line_column: None, ..location.clone() };
            diagnostics.record_note(&place, format!("times {heading:?} are {clock}"));
        }
    }

    /// Index and name without unit of each column other than the time.
    pub(super) fn value_columns(&self, time: TimeColumn) -> impl Iterator<Item = (usize, &str)> {
        let columns = self.columns.iter().enumerate().filter(move |(index, _)| *index != time.column.index);
        columns.map(|(index, column)| (index, column.name.as_str()))
    }

    /// Number of rows, and the times of the first and of the last of them, s; rows without a time are left out.
    pub(super) fn span(&self, time: TimeColumn, diagnostics: &Diagnostics) -> ReadResult<(usize, (f64, f64))> {
        let (scale, _) = self.seconds(time, diagnostics)?;
        let rows = self.numbers.chunks_exact(self.columns.len()).map(|cells| cells[time.column.index]);
        let mut times_s = rows.filter(|time| time.is_finite()).map(|cell| time.shifted_s(cell * scale));
        let first_s = times_s.next().unwrap_or(f64::NAN);
        Ok((self.rows.len(), (first_s, times_s.next_back().unwrap_or(first_s))))
    }

    /// Scale and offset of the times to seconds.
    fn seconds(&self, time: TimeColumn, diagnostics: &Diagnostics) -> ReadResult<(f64, f64)> {
        let column = &self.columns[time.column.index];
        match (&column.clock, time.column.conversion) {
            (Some(clock), Some(_)) => {
                let message = format!("times {:?} are {clock}: expected no `unit`", column.heading);
                Err(diagnostics.record(&column.location, message))
            }
            (Some(_), None) => Ok((1.0, 0.0)),
            (None, Some(stated)) => Ok(stated),
            (None, None) => {
                if let (None, Some((row, text))) = (&column.unit, self.first_text(time.column.index)) {
                    let message = format!(
                        "times {:?}: expected numbers, or clock times such as \"2025-03-30 01:59:30\" or \"01:59:30\", \
                         found {text:?}",
                        column.heading
                    );
                    return Err(diagnostics.record(&self.cell_location(row, time.column.index), message));
                }
                unit_scale(column, Dimension::Time, diagnostics, "expected a first column such as \"time_s\"")
            }
        }
    }

    /// The row and the text of the first cell of a column that is not a number.
    fn first_text(&self, column: usize) -> Option<(usize, String)> {
        let mut cells = self.numbers.chunks_exact(self.columns.len()).map(|cells| cells[column]);
        let row = cells.position(|number| number == NOT_FINITE)?;
        Some((row, self.source.text(&self.dialect, self.rows[row], column)))
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
        let seconds = self.seconds(time, diagnostics);
        let (times, time) = (time, time.column.index);
        let ChosenColumn { index: column, conversion: stated } = column;
        let value = &self.columns[column];
        if let Some(clock) = &value.clock {
            let message =
                format!("column {:?} holds {clock}: expected {}", value.heading, dimension.name_and_example());
            return Err(diagnostics.record(&value.location, message));
        }
        let example = match dimension {
            Dimension::HeatFlux => "flux_w_cm2".to_owned(),
            Dimension::Pressure => "pressure_kpa".to_owned(),
            _ => format!("{}_K", value.name),
        };
        let expected = format!("expected a heading with a unit such as {example:?}");
        let si = stated.map_or_else(|| unit_scale(value, dimension, diagnostics, &expected), Ok);
        let (seconds, si) = (seconds?, si?);
        let (mut times_s, mut values) = (Vec::with_capacity(self.rows.len()), Vec::with_capacity(self.rows.len()));
        let mut last_s = f64::NEG_INFINITY;
        let (mut faulty, mut met) = (Ok(()), 0);
        for (row, cells) in self.numbers.chunks_exact(self.columns.len()).enumerate() {
            if cells[column].is_nan() {
                continue;
            }
            let (time_s, si_value) = (times.shifted_s(cells[time] * seconds.0), cells[column] * si.0 + si.1);
            let fault = if !time_s.is_finite() {
                self.not_a_number_error(row, time, diagnostics)
            } else if !si_value.is_finite() {
                self.not_a_number_error(row, column, diagnostics)
            } else if !is_increasing(last_s, time_s, jumps) {
                let rule = if jumps { "must not decrease" } else { "must increase" };
                let message = format!("times {rule}: {time_s} s follows {last_s} s");
                diagnostics.record(&self.cell_location(row, time), message)
            } else if !dimension.is_allowed(si_value) {
                let (value, violation) = (readable(si_value), dimension.violation(si_value));
                let code = readable(cells[column]);
                let message =
                    format!("{value} K is {violation}; if {code} marks a missing value, state `missing = [{code}]`");
                diagnostics.record(&self.cell_location(row, column), message)
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

    /// Whether a heading or the line of units states the unit of a column.
    pub(super) fn has_unit(&self, column: usize) -> bool {
        self.columns[column].unit.is_some()
    }

    /// A column of a property over that of temperatures (K), which must not decrease, without the rows where it has no
    /// value.
    pub(super) fn property_over_temperature(
        &self,
        temperature: ChosenColumn,
        property: ChosenColumn,
        dimension: Dimension,
        diagnostics: &Diagnostics,
    ) -> ReadResult<(Vec<f64>, Vec<f64>)> {
        let expected = "expected a heading with a unit, a line of units below the headings, or a stated unit";
        let conversion = |chosen: ChosenColumn, dimension| {
            let column = &self.columns[chosen.index];
            chosen.conversion.map_or_else(|| unit_scale(column, dimension, diagnostics, expected), Ok)
        };
        let (kelvin, si) = (conversion(temperature, Dimension::Temperature), conversion(property, dimension));
        let (kelvin, si) = (kelvin?, si?);
        let rows = self.numbers.chunks_exact(self.columns.len()).enumerate();
        let rows = rows.filter(|(_, cells)| !cells[property.index].is_nan());
        let (mut temperatures_k, mut values) = (Vec::new(), Vec::new());
        for (row, cells) in rows {
            let fault = |column, message| Err(diagnostics.record(&self.cell_location(row, column), message));
            temperatures_k.push(cells[temperature.index] * kelvin.0 + kelvin.1);
            if let Err(message) = Table::check_temperature(&temperatures_k, temperatures_k.len() - 1) {
                return fault(temperature.index, message);
            }
            match Table::checked_value(cells[property.index] * si.0 + si.1, dimension) {
                Ok(value) => values.push(value),
                Err(message) => return fault(property.index, message),
            }
        }
        if values.is_empty() {
            let column = &self.columns[property.index];
            return Err(diagnostics.record(&column.location, format!("column {:?} has no value", column.heading)));
        }
        Ok((temperatures_k, values))
    }

    /// Record a missing time or a cell that is not a finite number.
    fn not_a_number_error(&self, row: usize, column: usize, diagnostics: &Diagnostics) -> ErrorReported {
        let text = &self.source.text(&self.dialect, self.rows[row], column);
        let message = if self.numbers[row * self.columns.len() + column].is_nan() {
            format!("missing time: expected a number, found {text:?}")
        } else if self.columns[column].clock.is_some() {
            format!("expected a time written as those before, found {text:?}")
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

/// Whether a text is a file of a logger of Campbell Scientific, in the format TOA5: lines of the station, of headings,
/// of units and of processing, then rows.
fn is_toa5(text: &str) -> bool {
    text.lines().next().is_some_and(|line| line.split(',').next().is_some_and(|cell| cell.trim_matches('"') == "TOA5"))
}

/// The lines of the station and of processing, from zero.
const TOA5_LINES_WITHOUT_DATA: [usize; 2] = [0, 3];

/// Make lines empty, so that the numbers of the others stay the same.
fn blank_lines(text: &mut String, lines: &[usize]) {
    let kept = text.split_inclusive('\n').enumerate().map(|(index, line)| match lines.contains(&index) {
        true => &line[line.trim_end_matches('\n').len()..],
        false => line,
    });
    *text = kept.collect();
}

/// Whether a cell is this heading, with or without its unit.
fn is_named(cell: &str, heading: &str) -> bool {
    let cell = cell.trim().trim_matches('"').trim();
    cell == heading || split_heading(cell).0 == heading
}

/// Make the lines above the first line with this heading empty, so that the numbers of the lines stay the same. Without
/// such a line the text stays as it is, and the heading is not found.
fn blank_lines_above(text: &mut String, heading: &str) {
    let mut starts = text.split_inclusive('\n').scan(0, |end, line| {
        let start = *end;
        *end += line.len();
        Some((start, line))
    });
    let Some((start, _)) = starts.find(|(_, line)| line.split([',', ';', '\t']).any(|cell| is_named(cell, heading)))
    else {
        return;
    };
    let above = text[..start].matches('\n').count();
    text.replace_range(..start, &"\n".repeat(above));
}
