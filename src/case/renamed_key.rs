//! Old names of keys and values, which the files of a case may still use.

use std::fmt;

/// A key or a value of a file that has been renamed, and was read under its old name.
///
/// It displays as `case.toml:12: "every" is now "output_interval"`.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct RenamedKey {
    /// The file with the old name, or the override.
    pub file: String,
    /// The line, counted from one; none for an override.
    pub line: Option<usize>,
    /// The old name, as written.
    pub old: &'static str,
    /// The name that replaces it.
    pub new: &'static str,
}

impl fmt::Display for RenamedKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let line = self.line.map_or_else(String::new, |line| format!(":{line}"));
        write!(f, "{}{line}: {:?} is now {:?}", self.file, self.old, self.new)
    }
}
