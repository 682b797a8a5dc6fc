//! Provenance of numbers: kind of source, reference and uncertainty.

use super::validation::FieldPath;

/// Kind of source of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
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
}

impl SourceKind {
    /// All kinds and their values in a material file.
    const KEYS: [(Self, &'static str); 4] = [
        (Self::ReadInSource, "read"),
        (Self::Remembered, "remembered"),
        (Self::Estimated, "estimated"),
        (Self::Paper, "paper"),
    ];

    /// Value in a material file.
    pub fn key(self) -> &'static str {
        Self::KEYS.iter().find(|(mark, _)| *mark == self).map_or("", |(_, word)| word)
    }

    /// The kind with this value in a material file.
    pub fn named(word: &str) -> Option<Self> {
        Self::KEYS.iter().find(|(_, known)| *known == word).map(|&(mark, _)| mark)
    }
}

/// Provenance of a number.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Provenance {
    /// Kind of source.
    pub source_kind: SourceKind,
    /// The publication, the supplier, or the basis of the estimate.
    pub source: String,
    /// Relative standard deviation.
    pub relative_uncertainty: f64,
}

impl Provenance {
    pub(super) fn check(&self, at: &FieldPath<'_>) {
        at.not_blank("source", &self.source);
        at.not_negative("relative_uncertainty", self.relative_uncertainty);
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
