//! Errors of a case, reported together, each with file, line and column or with the path of a field.

use super::recorded_channel::RecordedChannel;
use crate::limits::LISTED_ERRORS;
use std::cell::{Cell, RefCell};
use std::fmt;
use std::io::{self, ErrorKind};
use std::sync::Arc;

/// A position in a file, or the path of a field.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub struct SourceLocation {
    /// A file as the user named it, an override such as `pressure=3 kPa`, or the path of a field of a
    /// [`CaseBuilder`](super::CaseBuilder) such as `layup.plies[2].thickness_m`.
    pub file: Arc<str>,
    /// A sheet of a workbook.
    pub sheet: Option<Arc<str>>,
    /// Line and column, counted from one, the column in characters, or row and column of a cell of the sheet; `None`
    /// for the whole file or sheet.
    pub line_column: Option<(usize, usize)>,
}

impl SourceLocation {
    /// A whole file, an override or a field.
    pub fn without_line(file: impl Into<Arc<str>>) -> Self {
        Self { file: file.into(), sheet: None, line_column: None }
    }
}

impl fmt::Display for SourceLocation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file)?;
        if let Some(sheet) = &self.sheet {
            let is_plain = sheet.chars().all(|c| c.is_alphanumeric() || c == '_');
            let sheet = if is_plain { sheet.to_string() } else { format!("'{}'", sheet.replace('\'', "''")) };
            write!(f, ":{sheet}")?;
        }
        match (self.line_column, &self.sheet) {
            (Some((row, column)), Some(_)) => write!(f, "!{}{row}", column_letters(column)),
            (Some((line, column)), None) => write!(f, ":{line}:{column}"),
            (None, _) => Ok(()),
        }
    }
}

/// The letters of a column of a sheet, counted from one: `AB` is 28.
fn column_letters(mut column: usize) -> String {
    let mut letters = Vec::new();
    while column > 0 {
        letters.insert(0, char::from(b'A' + ((column - 1) % 26) as u8));
        column = (column - 1) / 26;
    }
    letters.into_iter().collect()
}

/// One error of a case.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub struct Diagnostic {
    /// Position of the error.
    pub location: SourceLocation,
    /// The error, the value found and the value expected; a fragment in lower case.
    pub message: String,
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.location, self.message)
    }
}

/// The message for a file that cannot be read; a fragment in lower case.
pub fn unreadable_file_message(error: &io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "no such file".to_owned(),
        ErrorKind::IsADirectory => "is a folder: expected a file".to_owned(),
        ErrorKind::InvalidInput | ErrorKind::FileTooLarge => error.to_string(),
        _ => format!("cannot be read: {error}"),
    }
}

/// All errors of a case and of the files it names, or of a builder; never empty.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub struct CaseError {
    /// Sorted by file and line, or by field path; the first [`LISTED_ERRORS`](crate::limits::LISTED_ERRORS) found.
    pub diagnostics: Vec<Diagnostic>,
    /// Number of further errors.
    pub omitted: usize,
}

impl fmt::Display for CaseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for fault in &self.diagnostics {
            writeln!(f, "{fault}")?;
        }
        match (self.diagnostics.len(), self.omitted) {
            (1, 0) => write!(f, "1 error"),
            (count, 0) => write!(f, "{count} errors"),
            (count, more) => write!(f, "{count} errors, and {more} more that are not listed"),
        }
    }
}

/// Proof that an error was recorded, as `ErrorGuaranteed` of the Rust compiler.
#[derive(Clone, Copy, Debug)]
pub(super) struct ErrorReported(());

/// The result of reading a value: its error is recorded, not returned.
pub(super) type ReadResult<T> = Result<T, ErrorReported>;

/// The errors and the notes recorded so far. Reading continues after an error, so that one run reports
/// all of them.
#[derive(Debug, Default)]
pub(super) struct Diagnostics {
    errors: RefCell<Vec<Diagnostic>>,
    /// Number of further errors, which are not listed.
    omitted: Cell<usize>,
    notes: RefCell<Vec<Diagnostic>>,
    recorded: RefCell<Vec<RecordedChannel>>,
}

impl Diagnostics {
    pub(super) fn record(&self, place: &SourceLocation, message: impl Into<String>) -> ErrorReported {
        let mut errors = self.errors.borrow_mut();
        if errors.len() as u64 >= LISTED_ERRORS.max {
            self.omitted.set(self.omitted.get() + 1);
        } else {
            errors.push(Diagnostic { location: place.clone(), message: message.into() });
        }
        ErrorReported(())
    }

    /// Record what is no error but what the user should know.
    pub(super) fn record_note(&self, location: &SourceLocation, message: String) {
        self.notes.borrow_mut().push(Diagnostic { location: location.clone(), message });
    }

    /// Keep what was recorded of a sensor beside its observation.
    pub(super) fn record_channel(&self, channel: RecordedChannel) {
        self.recorded.borrow_mut().push(channel);
    }

    /// The channels recorded so far; they are removed here.
    pub(super) fn take_channels(&self) -> Vec<RecordedChannel> {
        self.recorded.take()
    }

    /// The notes recorded so far, sorted by position; they are removed here.
    pub(super) fn take_notes(&self) -> Vec<Diagnostic> {
        let mut notes = self.notes.take();
        notes.sort();
        notes.dedup();
        notes
    }

    /// The value if no error was recorded, else all errors, sorted and without duplicates.
    pub(super) fn into_result<T>(self, read: ReadResult<T>) -> Result<T, CaseError> {
        let mut faults = self.errors.into_inner();
        faults.sort();
        faults.dedup();
        match read {
            Ok(value) if faults.is_empty() => Ok(value),
            _ => Err(CaseError { diagnostics: faults, omitted: self.omitted.get() }),
        }
    }
}
