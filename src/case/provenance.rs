//! Provenance of numbers: kind of source, reference and uncertainty.

use super::validation::FieldPath;

/// Kind of source of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub enum SourceKind {
    /// Read from a public source.
    ReadInSource,
    /// Remembered from a named publication; not verified.
    Remembered,
    /// Engineering estimate, or computed for the database.
    Estimated,
    /// Stated in the paper.
    Paper,
    /// Measured by the authors of the file; the source names the report.
    Measured,
    /// The file states no mark.
    NotStated,
}

impl SourceKind {
    /// The kinds with a value in a material file.
    const KEYS: [(Self, &'static str); 5] = [
        (Self::ReadInSource, "read"),
        (Self::Remembered, "remembered"),
        (Self::Estimated, "estimated"),
        (Self::Paper, "paper"),
        (Self::Measured, "measured"),
    ];

    /// Value in a material file; `not stated` for a file without one.
    pub fn key(self) -> &'static str {
        Self::KEYS.iter().find(|(mark, _)| *mark == self).map_or("not stated", |(_, word)| word)
    }

    /// The kind with this value in a material file.
    pub fn named(word: &str) -> Option<Self> {
        Self::KEYS.iter().find(|(_, known)| *known == word).map(|&(mark, _)| mark)
    }
}

/// Provenance of a number.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Provenance {
    /// Kind of source.
    pub source_kind: SourceKind,
    /// The publication, the report, the supplier, or the basis of the estimate; may be empty where no kind is stated.
    pub source: String,
    /// Relative standard deviation; `None` where it is not stated.
    pub relative_uncertainty: Option<f64>,
}

impl Provenance {
    /// The source of a number of a kind: that of a measurement has the number of the report.
    pub(super) fn checked_source(kind: SourceKind, source: &str) -> Result<&str, String> {
        if kind == SourceKind::Measured && !source.contains(|c: char| c.is_ascii_digit()) {
            return Err(format!("expected the number of the report, such as \"TR-2031\", found {source:?}"));
        }
        Ok(source)
    }

    pub(super) fn check(&self, at: &FieldPath<'_>) {
        if self.source_kind != SourceKind::NotStated {
            at.not_blank("source", &self.source);
            at.child("source").require(Self::checked_source(self.source_kind, &self.source));
        }
        if let Some(uncertainty) = self.relative_uncertainty {
            at.not_negative("relative_uncertainty", uncertainty);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_source_is_found_by_its_value() {
        for (mark, word) in SourceKind::KEYS {
            assert_eq!((mark.key(), SourceKind::named(word)), (word, Some(mark)));
        }
    }
}
