//! What a report shows of an answer, and which answers there are.

use super::ReportError;
use super::figure::Figure;
use super::files::json::Record;
use super::files::table::File;
use crate::study::answers::Answers;
use crate::study::nominal::Nominal;

/// An answer, as the report shows it. Each is implemented in one file, beside its figures and sentences; page, files
/// and screen go over [`all`] of them and name none.
///
/// `answers` are those at hand, of which this is one: an answer may be told beside another.
pub(super) trait Answer {
    /// Whether the question is another than the prediction: it comes first on page and screen, and the screen leaves
    /// the table of the prediction out.
    fn leads(&self) -> bool {
        false
    }

    /// Whether observations count for it.
    fn uses_observations(&self) -> bool {
        true
    }

    /// The march at the nominal factors, where it has one.
    fn nominal(&self) -> Option<&Nominal> {
        None
    }

    /// The march at fitted factors, where it has one.
    fn fitted(&self) -> Option<&Nominal> {
        None
    }

    /// Members drawn at random, where it has such.
    fn members(&self) -> Option<Members> {
        None
    }

    /// Facts for the head of the page, such as a number of members.
    fn facts(&self) -> Vec<String> {
        Vec::new()
    }

    /// What was found, in sentences.
    fn findings(&self, _: &Answers) -> Vec<Finding> {
        Vec::new()
    }

    /// Reasons for doubt, each a sentence or two.
    fn warnings(&self, _: &Answers) -> Vec<String> {
        Vec::new()
    }

    /// Its figures, each with the anchor of the section that it belongs to.
    fn figures(&self, _: &Answers) -> Vec<(&'static str, Figure)> {
        Vec::new()
    }

    /// Its sections of the page.
    fn sections(&self, _: &Answers) -> Vec<Section> {
        Vec::new()
    }

    /// How its numbers were found, a paragraph each.
    fn method(&self, _: &Answers) -> Vec<String> {
        Vec::new()
    }

    /// Its tables.
    ///
    /// # Errors
    /// When a row cannot be written.
    fn tables(&self, _: &Answers) -> Result<Vec<File>, ReportError> {
        Ok(Vec::new())
    }

    /// Puts its keys into `summary.json`.
    ///
    /// # Errors
    /// When JSON cannot be written.
    fn record(&self, _: &Answers, _: &mut Record<'_>) -> Result<(), ReportError> {
        Ok(())
    }

    /// Its lines on the screen.
    fn screen(&self, _: &Answers, _: &Room) -> Vec<String> {
        Vec::new()
    }

    /// Lines that the screen has behind those of all answers, where there is room.
    fn screen_at_the_end(&self, _: &Answers) -> Vec<String> {
        Vec::new()
    }
}

/// The answers at hand, in the order of their figures and tables. A new one has its line here.
pub(super) fn all(answers: &Answers) -> Vec<&dyn Answer> {
    fn shown<T: Answer>(answer: &Option<T>) -> Option<&dyn Answer> {
        answer.as_ref().map(|answer| answer as &dyn Answer)
    }
    let each = [
        shown(&answers.nominal),
        shown(&answers.uncertainty),
        shown(&answers.sensitivity),
        // With the posterior and the comparison with another case.
        shown(&answers.estimated),
        shown(&answers.sizing),
        shown(&answers.history),
        shown(&answers.recovery),
    ];
    each.into_iter().flatten().collect()
}

/// The answers at hand in the order in which page and screen show them.
pub(super) fn in_reading_order(answers: &Answers) -> Vec<&dyn Answer> {
    let mut each = all(answers);
    each.sort_by_key(|answer| !answer.leads());
    each
}

/// One finding: what it is about and the sentence.
pub(super) struct Finding {
    pub about: &'static str,
    pub said: String,
}

/// A section of the page; its figures follow its content. One that has neither is left out.
pub(super) struct Section {
    pub anchor: &'static str,
    pub title: &'static str,
    /// Markup.
    pub content: String,
    /// Whether captions stand above their figures.
    pub captions_first: bool,
}

impl Section {
    pub(super) fn new(anchor: &'static str, title: &'static str, content: String) -> Self {
        Self { anchor, title, content, captions_first: false }
    }
}

/// Members drawn, and those that completed the march.
pub(super) struct Members {
    pub asked: usize,
    pub ok: usize,
}

/// How much of each kind the screen shows at most.
pub(super) struct Room {
    pub sensors: usize,
    pub factors: usize,
    pub fitted: usize,
    /// Whether many answers share the screen.
    pub is_shared: bool,
    /// Whether an answer to another question than the prediction leads.
    pub is_led: bool,
}
