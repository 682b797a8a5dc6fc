//! Provenance of numbers: kind of source, reference and uncertainty.

use super::check::Field;

/// Kind of source of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum Mark {
    /// Read from a public source.
    Read,
    /// Remembered from a named publication; not verified.
    Remembered,
    /// Engineering estimate, or computed for the database.
    Estimated,
    /// Stated in the paper.
    Paper,
}

impl Mark {
    /// All kinds and their values in a material file.
    const WORDS: [(Self, &'static str); 4] = [
        (Self::Read, "read"),
        (Self::Remembered, "remembered"),
        (Self::Estimated, "estimated"),
        (Self::Paper, "paper"),
    ];

    /// Value in a material file.
    pub fn word(self) -> &'static str {
        Self::WORDS.iter().find(|(mark, _)| *mark == self).map_or("", |(_, word)| word)
    }

    /// The kind with this value in a material file.
    pub fn named(word: &str) -> Option<Self> {
        Self::WORDS.iter().find(|(_, known)| *known == word).map(|&(mark, _)| mark)
    }
}

/// Provenance of a number.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Provenance {
    /// Kind of source.
    pub mark: Mark,
    /// The publication, the supplier, or the basis of the estimate.
    pub source: String,
    /// Relative standard deviation.
    pub relative_uncertainty: f64,
}

impl Provenance {
    pub(super) fn check(&self, at: &Field<'_>) {
        at.not_blank("source", &self.source);
        at.not_negative("relative_uncertainty", self.relative_uncertainty);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_source_is_found_by_its_value() {
        for (mark, word) in Mark::WORDS {
            assert_eq!((mark.word(), Mark::named(word)), (word, Some(mark)));
        }
    }
}
