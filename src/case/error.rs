//! What is wrong with a case: all of it at once, each fault at its line and column, or at its field.

use std::cell::RefCell;
use std::fmt;
use std::io::{self, ErrorKind};
use std::sync::Arc;

/// Where something was written, or which field holds it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub struct Place {
    /// The file as the user named it, the override `--set pressure=3 kPa`, or the path of a field of a
    /// [`CaseBuilder`](super::CaseBuilder): `layup.plies[2].thickness_m`.
    pub file: Arc<str>,
    /// Line and column from one, the column counted in characters; `None` for the file as a whole.
    pub at: Option<(usize, usize)>,
}

impl Place {
    /// A file as a whole.
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

/// One thing that is wrong.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub struct Fault {
    /// Where.
    pub place: Place,
    /// A lowercase fragment: what is wrong, and what was expected.
    pub message: String,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.message)
    }
}

/// Why a file cannot be read, a lowercase fragment.
pub fn unreadable(error: &io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "no such file".to_owned(),
        ErrorKind::IsADirectory => "is a folder: expected a file".to_owned(),
        _ => format!("cannot be read: {error}"),
    }
}

/// All faults of a case and of the files it names, or of a builder; never empty.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub struct CaseError {
    /// In the order of files and lines, or of the paths of fields.
    pub faults: Vec<Fault>,
}

impl fmt::Display for CaseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for fault in &self.faults {
            writeln!(f, "{fault}")?;
        }
        match self.faults.len() {
            1 => write!(f, "1 fault"),
            count => write!(f, "{count} faults"),
        }
    }
}

/// Proof that a fault was recorded: what reading gives in place of a value.
#[derive(Clone, Copy, Debug)]
pub(super) struct Faulty(());

/// What reading gives: a value, or the proof that its fault is on record.
pub(super) type Read<T> = Result<T, Faulty>;

/// The faults met so far. Reading goes on past a fault, so that all are found at once.
#[derive(Debug, Default)]
pub(super) struct Faults(RefCell<Vec<Fault>>);

impl Faults {
    pub(super) fn record(&self, place: &Place, message: impl Into<String>) -> Faulty {
        self.0.borrow_mut().push(Fault { place: place.clone(), message: message.into() });
        Faulty(())
    }

    /// The value if nothing at all was wrong, else every fault once.
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
