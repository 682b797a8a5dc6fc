//! Errors of a case, reported together, each with file, line and column or with the path of a field.

use std::cell::RefCell;
use std::fmt;
use std::io::{self, ErrorKind};
use std::sync::Arc;

/// A position in a file, or the path of a field.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub struct Place {
    /// A file as the user named it, an override such as `--set pressure=3 kPa`, or the path of a field of a
    /// [`CaseBuilder`](super::CaseBuilder) such as `layup.plies[2].thickness_m`.
    pub file: Arc<str>,
    /// Line and column, counted from one, the column in characters; `None` for the whole file.
    pub at: Option<(usize, usize)>,
}

impl Place {
    /// A whole file, an override or a field.
    pub fn whole(file: impl Into<Arc<str>>) -> Self {
        Self { file: file.into(), at: None }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.at {
            Some((line, column)) => write!(f, "{}:{line}:{column}", self.file),
            None => write!(f, "{}", self.file),
        }
    }
}

/// One error of a case.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub struct Fault {
    /// Its position.
    pub place: Place,
    /// The error, the value found and the value expected; a fragment in lower case.
    pub message: String,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.message)
    }
}

/// The message for a file that cannot be read; a fragment in lower case.
pub fn unreadable(error: &io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "no such file".to_owned(),
        ErrorKind::IsADirectory => "is a folder: expected a file".to_owned(),
        _ => format!("cannot be read: {error}"),
    }
}

/// All errors of a case and of the files it names, or of a builder; never empty.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub struct CaseError {
    /// Sorted by file and line, or by field path.
    pub faults: Vec<Fault>,
}

impl fmt::Display for CaseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for fault in &self.faults {
            writeln!(f, "{fault}")?;
        }
        match self.faults.len() {
            1 => write!(f, "1 error"),
            count => write!(f, "{count} errors"),
        }
    }
}

/// Proof that an error was recorded, as `ErrorGuaranteed` of the Rust compiler.
#[derive(Clone, Copy, Debug)]
pub(super) struct Faulty(());

/// The result of reading a value: its error is recorded, not returned.
pub(super) type Read<T> = Result<T, Faulty>;

/// The errors recorded so far. Reading continues after an error, so that one run reports all of them.
#[derive(Debug, Default)]
pub(super) struct Faults(RefCell<Vec<Fault>>);

impl Faults {
    pub(super) fn record(&self, place: &Place, message: impl Into<String>) -> Faulty {
        self.0.borrow_mut().push(Fault { place: place.clone(), message: message.into() });
        Faulty(())
    }

    /// The value if no error was recorded, else all errors, sorted and without duplicates.
    pub(super) fn settle<T>(self, read: Read<T>) -> Result<T, CaseError> {
        let mut faults = self.0.into_inner();
        faults.sort();
        faults.dedup();
        match read {
            Ok(value) if faults.is_empty() => Ok(value),
            _ => Err(CaseError { faults }),
        }
    }
}
