//! The source of a table: the text of a file, or a sheet of a workbook. Both give rows of cells as text, and the
//! position and text of a cell for a message.

use super::dialect::Dialect;
use super::workbook::SheetRows;
use crate::case::error::SourceLocation;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::sync::Arc;

/// Where the cells of a table are found again.
#[derive(Debug)]
pub(super) enum Source {
    /// The text of a file. The key of a row is its byte offset; blank lines and comments may precede the row.
    Text(Rc<String>),
    /// The sheet of this name. The key of a row is its number from zero.
    Sheet(Arc<str>, Sheet),
}

/// The content of a sheet that is kept after reading.
#[derive(Debug)]
pub(super) struct Sheet {
    /// The first column of the table, from zero.
    pub(super) first_column: usize,
    /// Cells that are not numbers, by column and row of the table.
    pub(super) texts: BTreeMap<(usize, usize), String>,
}

impl Source {
    /// The position of a cell; without one, of the whole table.
    pub(super) fn location(&self, file: &Arc<str>, dialect: &Dialect, cell: Option<(usize, usize)>) -> SourceLocation {
        let (sheet, line_column) = match self {
            Self::Text(text) => (None, cell.map(|(row, column)| dialect.line_column(text, row, column))),
            Self::Sheet(name, Sheet { first_column, .. }) => {
                (Some(name.clone()), cell.map(|(row, column)| (row + 1, first_column + column + 1)))
            }
        };
        SourceLocation { file: file.clone(), sheet, line_column }
    }

    /// The text of a cell.
    pub(super) fn text(&self, dialect: &Dialect, row: usize, column: usize) -> String {
        match self {
            Self::Text(text) => {
                let mut record = csv::StringRecord::new();
                let mut reader = dialect.reader(&text[row..]);
                match reader.read_record(&mut record) {
                    Ok(true) => record.get(column).unwrap_or_default().trim().to_owned(),
                    _ => String::new(),
                }
            }
            Self::Sheet(_, sheet) => sheet.texts.get(&(column, row)).cloned().unwrap_or_default(),
        }
    }

    /// Keep a cell that is not a number for a message, up to `most` in a column. A text is read again instead.
    pub(super) fn keep(&mut self, row: usize, column: usize, cell: &str, most: usize) {
        match self {
            Self::Text(_) => {}
            Self::Sheet(_, Sheet { texts, .. }) => {
                if texts.range((column, 0)..(column + 1, 0)).count() < most {
                    texts.insert((column, row), cell.trim().to_owned());
                }
            }
        }
    }
}

/// The rows of a table, one after another.
pub(super) enum Rows<'t> {
    Text(csv::Reader<&'t [u8]>),
    Sheet(Box<SheetRows<'t>>),
}

impl Rows<'_> {
    /// Read the next row. Returns its key; `None` at the end.
    ///
    /// # Errors
    /// A message.
    pub(super) fn next(&mut self, record: &mut csv::StringRecord) -> Result<Option<usize>, String> {
        match self {
            Self::Text(reader) => {
                let found = reader.read_record(record).map_err(|error| error.to_string())?;
                Ok(found.then(|| record.position().map_or(0, |at| at.byte() as usize)))
            }
            Self::Sheet(rows) => rows.next(record).map(|row| row.map(|row| row as usize)),
        }
    }

    /// The headings have been read: there are as many columns.
    pub(super) fn set_columns(&mut self, columns: usize) {
        match self {
            Self::Text(_) => {}
            Self::Sheet(rows) => rows.set_columns(columns),
        }
    }

    /// Columns of dates and durations, each with what its seconds count from.
    pub(super) fn clocks(&self) -> Vec<(usize, String)> {
        match self {
            Self::Text(_) => Vec::new(),
            Self::Sheet(rows) => rows.clocks().map(|(column, clock)| (column, clock.to_owned())).collect(),
        }
    }
}
