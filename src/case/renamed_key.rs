//! Old names of keys and values, which the files of a case may still use.

use super::error::SourceLocation;
use std::fmt;

/// A key or a value of a file that has been renamed, and was read under its old name.
///
/// It displays as `case.toml:12: "every" is now "output_interval"`.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct RenamedKey {
    /// Position of the old name.
    pub location: SourceLocation,
    /// The old name, as written.
    pub old: &'static str,
    /// The name that replaces it.
    pub new: &'static str,
}

impl fmt::Display for RenamedKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let SourceLocation { file, line_column } = &self.location;
        let line = line_column.map_or_else(String::new, |(line, _)| format!(":{line}"));
        write!(f, "{file}{line}: {:?} is now {:?}", self.old, self.new)
    }
}

/// The old names in the files of a case. They are no part of its content: cases that differ in them only are equal.
#[derive(Clone, Debug, Default)]
pub(crate) struct RenamedKeys(pub(super) Vec<RenamedKey>);

impl PartialEq for RenamedKeys {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
