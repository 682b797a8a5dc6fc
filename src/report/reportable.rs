//! The interface between the results of a study and its report.

use super::ReportError;
use super::figure::Figure;
use super::files::json::JsonObject;
use super::files::table::{NamedFile, TableDescription};
use crate::study::answers::Answers;
use crate::study::nominal::Prediction;

/// A result as the report shows it. Page, files and screen iterate over all results of the answers and name none.
///
/// `answers` holds all results of the run, this one among them.
pub(super) trait Reportable {
    /// Whether the result comes first on page and screen; the screen then omits the table of the prediction.
    fn comes_first(&self) -> bool {
        false
    }

    /// Whether the result uses observations.
    fn uses_observations(&self) -> bool {
        true
    }

    /// March of the result at the nominal factors, if any.
    fn nominal(&self) -> Option<&Prediction> {
        None
    }

    /// March of the result at the estimated factors, if any.
    fn fitted(&self) -> Option<&Prediction> {
        None
    }

    /// Numbers of the sampled members of the result, if any.
    fn members(&self) -> Option<MemberCounts> {
        None
    }

    /// Facts for the header of the page, such as the number of members.
    fn facts(&self) -> Vec<String> {
        Vec::new()
    }

    /// Findings of the result.
    fn findings(&self, _: &Answers) -> Vec<Finding> {
        Vec::new()
    }

    /// Warnings of the result, each of one or two sentences.
    fn warnings(&self, _: &Answers) -> Vec<String> {
        Vec::new()
    }

    /// Figures of the result, each with the anchor of its section.
    fn figures(&self, _: &Answers) -> Vec<(&'static str, Figure)> {
        Vec::new()
    }

    /// Sections of the page for the result.
    fn sections(&self, _: &Answers) -> Vec<Section> {
        Vec::new()
    }

    /// Paragraphs on the methods used.
    fn methods(&self, _: &Answers) -> Vec<String> {
        Vec::new()
    }

    /// Descriptions of the tables of such a result, whether or not a report has them.
    fn table_descriptions() -> Vec<TableDescription>
    where
        Self: Sized,
    {
        Vec::new()
    }

    /// Tables of the result.
    ///
    /// # Errors
    /// When a row cannot be written.
    fn tables(&self, _: &Answers) -> Result<Vec<NamedFile>, ReportError> {
        Ok(Vec::new())
    }

    /// Write the keys of the result to `summary.json`.
    ///
    /// # Errors
    /// When JSON cannot be written.
    fn write_summary(&self, _: &Answers, _: &mut JsonObject<'_>) -> Result<(), ReportError> {
        Ok(())
    }

    /// Lines of the result on the screen.
    fn screen(&self, _: &Answers, _: &ScreenLimits) -> Vec<String> {
        Vec::new()
    }

    /// Lines shown after those of all results if there is room.
    fn screen_footer(&self, _: &Answers) -> Vec<String> {
        Vec::new()
    }
}

/// All results in the order of page and screen.
pub(super) fn in_reading_order(answers: &Answers) -> Vec<&dyn Reportable> {
    let mut each = answers.results();
    each.sort_by_key(|answer| !answer.comes_first());
    each
}

/// One finding: its label and its text.
pub(super) struct Finding {
    pub label: &'static str,
    pub text: String,
}

/// A section of the page; its figures follow its content. A section with neither is omitted.
pub(super) struct Section {
    pub anchor: &'static str,
    pub title: &'static str,
    /// HTML.
    pub content: String,
    /// Whether captions are above their figures.
    pub captions_above: bool,
}

impl Section {
    pub(super) fn new(anchor: &'static str, title: &'static str, content: String) -> Self {
        Self { anchor, title, content, captions_above: false }
    }
}

/// Numbers of members requested, completed and failed; a sweep that was stopped has others.
#[derive(Default)]
pub(super) struct MemberCounts {
    pub requested: usize,
    pub completed: usize,
    pub failed: usize,
}

/// Limits of the screen: rows of each kind.
pub(super) struct ScreenLimits {
    pub sensors: usize,
    pub factors: usize,
    pub misfits: usize,
    /// Whether many results share the screen.
    pub is_shared: bool,
    /// Whether a result other than the prediction comes first.
    pub has_leading_result: bool,
}

impl ScreenLimits {
    /// Fewer rows of each kind, but at least one.
    pub(super) fn with_fewer(&self, rows: usize) -> Self {
        let fewer = |most: usize| most.saturating_sub(rows).max(1);
        let [sensors, factors, misfits] = [self.sensors, self.factors, self.misfits].map(fewer);
        Self { sensors, factors, misfits, ..*self }
    }
}
