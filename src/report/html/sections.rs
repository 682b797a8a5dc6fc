//! The sections of the page: those of every result with their figures, then the case, the methods and the files.

use super::case;
use super::files;
use super::provenance::provenance;
use super::table::{escaped, paragraph};
use crate::case::Case;
use crate::report::figure::Figure;
use crate::report::reportable::{self, Section};
use crate::study::answers::Answers;

/// The sections in reading order; figures follow the content of their section.
pub(super) fn all(
    answers: &Answers,
    figures: &[(&'static str, Figure)],
    stills: &[String],
    files: &[String],
) -> Vec<Section> {
    let mut sections: Vec<Section> =
        reportable::in_reading_order(answers).iter().flat_map(|answer| answer.sections(answers)).collect();
    sections.push(if answers.other_cases.is_empty() {
        Section::new("case", "Case", case::case_description(&answers.case))
    } else {
        let titled = |case: &Case| paragraph(&format!("{}: {}", case.id, case.name)) + &case::case_description(case);
        Section::new("case", "Cases", answers.cases().map(titled).collect())
    });
    sections.push(Section::new("method", "Method", case::methods(answers)));
    sections.push(Section::new("provenance", "Provenance", provenance(answers)));
    sections.push(Section::new("files", "Files", files::table_of(files)));
    for section in &mut sections {
        let own = figures.iter().zip(stills).enumerate().filter(|(_, ((anchor, _), _))| *anchor == section.anchor);
        let html: String = own
            .map(|(index, ((_, figure), still))| figure_html(index, figure, still, section.captions_above))
            .collect();
        if !html.is_empty() {
            section.content += &format!("<div class=\"figures\">\n{html}</div>\n");
        }
    }
    sections.retain(|section| !section.content.is_empty());
    sections
}

fn figure_html(index: usize, figure: &Figure, still: &str, caption_first: bool) -> String {
    let title = escaped(&figure.title);
    let chart = format!(
        "<div class=\"chart\" data-chart=\"{index}\" role=\"img\" aria-label=\"{title}\"></div>\n\
         <div class=\"still\">{still}</div>\n",
    );
    let caption = format!("<figcaption>{}</figcaption>\n", escaped(&figure.caption));
    let content = if caption_first { caption + &chart } else { chart + &caption };
    format!("<figure>\n<h3>{title}</h3>\n{content}</figure>\n")
}
