//! Where numbers came from, and how far they can be trusted.

use super::check::Field;

/// How far a number can be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum Mark {
    /// Read in a public source.
    Read,
    /// Remembered of a named publication; unverified.
    Remembered,
    /// Engineering estimate, or computed for this database.
    Estimated,
    /// Stated in the paper.
    Paper,
}

impl Mark {
    /// Each mark and its word in a material file.
    const WORDS: [(Self, &'static str); 4] = [
        (Self::Read, "read"),
        (Self::Remembered, "remembered"),
        (Self::Estimated, "estimated"),
        (Self::Paper, "paper"),
    ];

    /// Its word in a material file.
    pub fn word(self) -> &'static str {
        Self::WORDS.iter().find(|(mark, _)| *mark == self).map_or("", |(_, word)| word)
    }

    /// The mark of a word, if there is one.
    pub fn named(word: &str) -> Option<Self> {
        Self::WORDS.iter().find(|(_, known)| *known == word).map(|&(mark, _)| mark)
    }
}

/// Where a number came from.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Provenance {
    /// How far the number can be trusted.
    pub mark: Mark,
    /// The publication, supplier or estimate, in words.
    pub source: String,
    /// One standard deviation relative to the value.
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
    fn every_mark_has_a_word_of_its_own() {
        for (mark, word) in Mark::WORDS {
            assert_eq!((mark.word(), Mark::named(word)), (word, Some(mark)));
        }
    }
}
