//! What the reader of a case notes: old names of keys and values, and data that are not read.

use super::error::Diagnostic;
use super::renamed_key::RenamedKey;

/// Notes on the files of a case. They are no part of its content: cases that differ in them only are equal.
#[derive(Clone, Debug, Default)]
pub(crate) struct ReadingNotes {
    pub(super) renamed_keys: Vec<RenamedKey>,
    /// What was not read.
    pub(super) unread: Vec<Diagnostic>,
}

impl PartialEq for ReadingNotes {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
