//! The sheets of a workbook (`.xlsx`) as rows of text, as a CSV file has them.
//!
//! A damaged or hostile file is refused before it is unpacked into memory: its parts are unpacked once to count their
//! bytes. Rows are read one by one, because a sheet of two cells may span 10¹⁰.

use super::cell_range::CellRange;
use crate::case::suggestion::suggestion;
use crate::limits::{SHARED_TEXTS_MIB, UNPACKED_MIB, WORKBOOK_PART_MIB};
use calamine::{DataRef, ExcelDateTime, Reader, SheetType, Xlsx, XlsxCellReader};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{Cursor, Read};

const SECONDS_PER_DAY: f64 = 86_400.0;
/// A serial date of this century resolves 0.6 µs.
const TIME_STEPS_PER_SECOND: f64 = 1e5;
/// Longer texts of a cell are cut: a sheet may refer to one text a million times.
const CELL_CHARACTERS: usize = 200;

type File = Cursor<Vec<u8>>;

/// A sheet of a workbook.
pub(super) struct Workbook {
    file: Xlsx<File>,
    pub(super) sheet: String,
    /// The number of sheets that could have been chosen.
    pub(super) sheets: usize,
}

impl Workbook {
    /// Open a sheet: that of a name, else the first one.
    ///
    /// # Errors
    /// A message: too large when unpacked, or damaged. The inner error is that of the name.
    pub(super) fn open(bytes: Vec<u8>, name: Option<&str>) -> Result<Result<Self, String>, String> {
        check_parts(&bytes)?;
        let file = Xlsx::new(Cursor::new(bytes)).map_err(|error| format!("not an .xlsx workbook: {error}"))?;
        let sheets = file.sheets_metadata().iter().filter(|sheet| sheet.typ == SheetType::WorkSheet);
        let sheets: Vec<&str> = sheets.map(|sheet| sheet.name.as_str()).collect();
        let found = match name {
            None => sheets.first().ok_or("a workbook without sheets")?,
            Some(name) => match sheets.iter().find(|sheet| **sheet == name) {
                Some(found) => found,
                None => return Ok(Err(format!("no sheet {name:?}{}", suggestion(name, sheets.iter().copied())))),
            },
        };
        let (sheet, sheets) = ((*found).to_owned(), sheets.len());
        Ok(Ok(Self { file, sheet, sheets }))
    }

    /// The part of a range from the headings on: from the first row that `is_heading`, and from its first text. Without
    /// such a row, from the first row.
    pub(super) fn range_from(
        &mut self,
        range: CellRange,
        is_heading: impl Fn(&csv::StringRecord) -> bool,
    ) -> Result<CellRange, String> {
        let (mut rows, mut record) = (self.rows(range)?, csv::StringRecord::new());
        let mut found = None;
        while let Some(row) = rows.next(&mut record)? {
            let blank = record.iter().take_while(|cell| cell.trim().is_empty()).count();
            if blank == record.len() {
                continue;
            }
            let from =
                CellRange { rows: (row, range.rows.1), columns: (range.columns.0 + blank as u32, range.columns.1) };
            if is_heading(&record) {
                return Ok(from);
            }
            found = found.or(Some(from));
        }
        found.ok_or_else(|| "no cells".to_owned())
    }

    /// The rows of a range that have a cell.
    pub(super) fn rows(&mut self, range: CellRange) -> Result<SheetRows<'_>, String> {
        let cells = self.file.worksheet_cells_reader(&self.sheet).map_err(|error| error.to_string())?;
        Ok(SheetRows {
            cells,
            range,
            pending: None,
            last: None,
            is_at_end: false,
            columns: None,
            kinds: BTreeMap::new(),
        })
    }
}

/// The rows of a sheet, one after another.
pub(super) struct SheetRows<'w> {
    cells: XlsxCellReader<'w, File>,
    range: CellRange,
    /// A cell of the next row.
    pending: Option<(u32, u32, DataRef<'w>)>,
    /// Row and column of the cell before.
    last: Option<(u32, u32)>,
    /// The cells of the range have been read; the reader has no more.
    is_at_end: bool,
    /// The number of columns, once the headings are known.
    columns: Option<usize>,
    /// Kind of the cells below the headings, by column.
    kinds: BTreeMap<usize, Kind>,
}

/// Numbers, or times with the serial number from which they count.
enum Kind {
    Numbers,
    Times {
        origin_days: f64,
        are_durations: bool,
        clock: String,
        /// The last time of day with the midnights before it, days.
        last_days: f64,
        midnights: f64,
    },
}

impl<'w> SheetRows<'w> {
    /// The headings have been read: the rows below have this number of cells, and one more if there is text beyond
    /// them.
    pub(super) fn set_columns(&mut self, columns: usize) {
        self.columns = Some(columns);
    }

    /// The columns of dates and durations found so far, each with what its seconds count from.
    pub(super) fn clocks(&self) -> impl Iterator<Item = (usize, &str)> {
        self.kinds.iter().filter_map(|(column, kind)| match kind {
            Kind::Numbers => None,
            Kind::Times { clock, .. } => Some((*column, clock.as_str())),
        })
    }

    /// Read the next row that has a cell: its cells from the first column of the range on. Returns its number, from
    /// zero; `None` at the end.
    ///
    /// # Errors
    /// A message: damaged.
    pub(super) fn next(&mut self, record: &mut csv::StringRecord) -> Result<Option<u32>, String> {
        record.clear();
        let first = match self.pending.take() {
            Some(pending) => Some(pending),
            None => self.next_cell()?,
        };
        let Some(first) = first else { return Ok(None) };
        let row = first.0;
        let mut cell = Some(first);
        while let Some((of, column, value)) = cell {
            if of != row {
                self.pending = Some((of, column, value));
                break;
            }
            self.push(record, (column - self.range.columns.0) as usize, &value);
            cell = self.next_cell()?;
        }
        while self.columns.is_some_and(|columns| record.len() < columns) {
            record.push_field("");
        }
        Ok(Some(row))
    }

    fn push(&mut self, record: &mut csv::StringRecord, column: usize, value: &DataRef<'_>) {
        let most = self.columns.unwrap_or(usize::MAX);
        let text = self.text(column, value);
        if text.trim().is_empty() || record.len() > most {
            return;
        }
        while record.len() < column.min(most) {
            record.push_field("");
        }
        record.push_field(&text);
    }

    /// The next cell of the range.
    fn next_cell(&mut self) -> Result<Option<(u32, u32, DataRef<'w>)>, String> {
        let CellRange { rows, columns } = self.range;
        if self.is_at_end {
            return Ok(None);
        }
        while let Some(cell) = self.cells.next_cell().map_err(|error| error.to_string())? {
            let (row, column) = cell.get_position();
            if self.last.is_some_and(|last| last >= (row, column)) {
                return Err("damaged: its cells are not in order".to_owned());
            }
            self.last = Some((row, column));
            if row > rows.1 {
                break;
            }
            if row >= rows.0 && (columns.0..=columns.1).contains(&column) {
                return Ok(Some((row, column, cell.get_value().clone())));
            }
        }
        self.is_at_end = true;
        Ok(None)
    }

    /// The text of a cell; below the headings a date is the seconds since the first one of its column.
    fn text<'v>(&mut self, column: usize, value: &'v DataRef<'_>) -> Cow<'v, str> {
        let number = match value {
            DataRef::Empty | DataRef::Error(_) => return "".into(),
            DataRef::String(text) | DataRef::DateTimeIso(text) | DataRef::DurationIso(text) => return cut(text),
            DataRef::SharedString(text) => return cut(text),
            DataRef::Bool(truth) => return if *truth { "TRUE" } else { "FALSE" }.into(),
            DataRef::Int(number) => *number as f64,
            DataRef::Float(number) => *number,
            DataRef::DateTime(time) => return self.seconds(column, time).into(),
        };
        let is_below_headings = self.columns.is_some();
        if is_below_headings && matches!(self.kinds.entry(column).or_insert(Kind::Numbers), Kind::Times { .. }) {
            return format!("{number} without a date format").into();
        }
        number.to_string().into()
    }

    fn seconds(&mut self, column: usize, time: &ExcelDateTime) -> String {
        let days = time.as_f64();
        if self.columns.is_none() {
            return date(time);
        }
        let kind = self.kinds.entry(column).or_insert_with(|| {
            if time.is_duration() {
                let clock = "durations in seconds".to_owned();
                Kind::Times { origin_days: 0.0, are_durations: true, clock, last_days: 0.0, midnights: 0.0 }
            } else {
                let clock = format!("dates or times of day, as seconds since the first, {}", date(time));
                Kind::Times { origin_days: days, are_durations: false, clock, last_days: days, midnights: 0.0 }
            }
        });
        match kind {
            Kind::Times { origin_days, are_durations, last_days, midnights, .. }
                if *are_durations == time.is_duration() =>
            {
                let mut days = days;
                // Without a date, a time of day more than half a day before the last one is of the next day.
                if !*are_durations && *origin_days < 1.0 && days < 1.0 {
                    *midnights += f64::from(*last_days - (days + *midnights) > 0.5);
                    days += *midnights;
                    *last_days = days;
                }
                let steps = (days - *origin_days) * SECONDS_PER_DAY * TIME_STEPS_PER_SECOND;
                (steps.round() / TIME_STEPS_PER_SECOND).to_string()
            }
            _ => date(time),
        }
    }
}

/// `2026-11-24 10:15:30.000`; without the date if it is the first day of the calendar of Excel.
fn date(time: &ExcelDateTime) -> String {
    let (year, month, day, hour, minute, second, millisecond) = time.to_ymd_hms_milli();
    let clock = format!("{hour:02}:{minute:02}:{second:02}.{millisecond:03}");
    if time.as_f64() < 1.0 { clock } else { format!("{year}-{month:02}-{day:02} {clock}") }
}

fn cut(text: &str) -> Cow<'_, str> {
    let end = text.char_indices().nth(CELL_CHARACTERS).map_or(text.len(), |(end, _)| end);
    text[..end].into()
}

/// Count the bytes of the parts of a workbook, within the limits.
///
/// # Errors
/// A message: beyond a limit, or damaged.
fn check_parts(bytes: &[u8]) -> Result<(), String> {
    let damaged = |error: &dyn std::fmt::Display| format!("a damaged workbook: {error}");
    let mut parts = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|error| damaged(&error))?;
    let mut total = 0;
    for index in 0..parts.len() {
        let part = parts.by_index(index).map_err(|error| damaged(&error))?;
        let name = part.name().map_err(|error| damaged(&error))?.to_ascii_lowercase();
        let name = name.rsplit(['/', '\\']).next().unwrap_or_default().to_owned();
        let is_text = [".xml", ".rels"].iter().any(|ending| name.ends_with(ending));
        let holds_texts = name.ends_with("sharedstrings.xml");
        let limit = match () {
            () if holds_texts => &SHARED_TEXTS_MIB,
            () if is_text && !name.starts_with("sheet") => &WORKBOOK_PART_MIB,
            () => &UNPACKED_MIB,
        };
        let most = limit.bytes().min(UNPACKED_MIB.bytes() - total);
        let mut part = part.take(most + 1);
        let mut texts = Vec::new();
        let size = if holds_texts {
            part.read_to_end(&mut texts).map(|size| size as u64)
        } else {
            std::io::copy(&mut part, &mut std::io::sink())
        };
        let size = size.map_err(|error| damaged(&error))?;
        if size > most {
            let limit = if most < limit.bytes() { &UNPACKED_MIB } else { limit };
            return Err(format!("expected at most {limit}, found more in {name:?}"));
        }
        total += size;
        check_count_of_texts(&texts)?;
    }
    Ok(())
}

/// The file states the number of its texts, for which calamine reserves memory.
fn check_count_of_texts(part: &[u8]) -> Result<(), String> {
    const KEY: &[u8] = b"uniqueCount";
    if part.contains(&0) {
        return Err("a damaged workbook: its texts are not UTF-8".to_owned());
    }
    let keys = part.windows(KEY.len()).enumerate().filter(|(_, window)| *window == KEY);
    for (at, _) in keys {
        let value = part[at + KEY.len()..].iter().skip_while(|byte| !byte.is_ascii_digit());
        let digits: String = value.take_while(|byte| byte.is_ascii_digit()).map(|&byte| char::from(byte)).collect();
        if digits.parse::<f64>().is_ok_and(|count| count > part.len() as f64) {
            return Err(format!("a damaged workbook: {digits} texts in {} bytes", part.len()));
        }
    }
    Ok(())
}
