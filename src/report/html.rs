//! The page: one self-contained HTML file.
//!
//! Each figure is on the page twice: as a chart that plotly.js draws when it comes into view (`vendor/README.md` names
//! the build), and as a static SVG image for print and for browsers without scripts.

mod case;
mod content_policy;
mod files;
mod provenance;
mod sections;
pub(super) mod table;

use super::figure::Figure;
use super::{backend_text, chart, findings, format, warnings};
use crate::case::Case;
use crate::study::answers::Answers;
use serde_json::{Value, json};
use table::{escaped, list, paragraph};

const STYLE: &str = include_str!("html/page.css");
const SCRIPT: &str = include_str!("html/page.js");
const THEME_SCRIPT: &str = include_str!("html/theme.js");
const PLOTLY: &str = include_str!("html/vendor/plotly-cartesian.min.js.gz.base64");
const PLOTLY_LICENSE: &str = include_str!("html/vendor/LICENSE");

/// The page as HTML; `stills` are the figures as SVG, `files` the names of all files of the report.
pub(super) fn page(
    answers: &Answers,
    figures: &[(&'static str, Figure)],
    stills: &[String],
    files: &[String],
) -> String {
    let sections = sections::all(answers, figures, stills, files);
    let links: String =
        sections.iter().map(|section| format!("<a href=\"#{}\">{}</a>\n", section.anchor, section.title)).collect();
    let body: String = sections
        .iter()
        .map(|section| {
            format!("<section id=\"{}\">\n<h2>{}</h2>\n{}</section>\n", section.anchor, section.title, section.content)
        })
        .collect();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en-GB\">\n<head>\n<meta charset=\"utf-8\">\n\
         {policy}<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<script>\n{THEME_SCRIPT}</script>\n<style>\n{STYLE}</style>\n\
         <noscript><style>.chart {{ display: none; }} .still {{ display: block; }}</style></noscript>\n\
         </head>\n<body>\n\
         {header}<nav aria-label=\"Sections\">\n{links}\
         <button type=\"button\" id=\"theme\" hidden></button>\n</nav>\n<main>\n{summary}{body}</main>\n\
         {plotly}\n<script type=\"application/json\" id=\"charts\">{charts}</script>\n\
         <script>\n{SCRIPT}</script>\n</body>\n</html>\n",
        policy = content_policy::element(&[&format!("\n{THEME_SCRIPT}"), &format!("\n{SCRIPT}")]),
        title = escaped(&format!("{}: {}", answers.name(), answers.question)),
        header = header(answers),
        summary = summary(answers),
        plotly = plotly(),
        charts = charts(figures),
    )
}

/// plotly.js, compressed, in an element that a browser does not run; `page.js` decompresses and runs it. The licence
/// requires its text in every copy.
fn plotly() -> String {
    format!("<!--\nplotly.js\n\n{PLOTLY_LICENSE}-->\n<script type=\"application/gzip\" id=\"plotly\">{PLOTLY}</script>")
}

/// The charts as JSON, for a script element. Many traces have the same `x`: each array is written once to the list `x`,
/// and traces refer to it by index.
fn charts(figures: &[(&'static str, Figure)]) -> String {
    let mut charts: Vec<Value> = figures.iter().map(|(_, figure)| chart::draw(figure)).collect();
    let mut shared: Vec<Value> = Vec::new();
    for trace in charts.iter_mut().filter_map(|chart| chart["traces"].as_array_mut()).flatten() {
        if let Some(x) = trace.get_mut("x") {
            let found = shared.iter().position(|other| other == x);
            let index = found.unwrap_or_else(|| {
                shared.push(x.take());
                shared.len() - 1
            });
            *x = json!(index);
        }
    }
    // Only `<` can end a script element.
    json!({"charts": charts, "x": shared}).to_string().replace('<', "\\u003c")
}

fn header(answers: &Answers) -> String {
    let mut facts = vec![
        format!("bondline {} {}", env!("CARGO_PKG_VERSION"), answers.question),
        format!("case {}", answers.id()),
        backend_text(&answers.backend),
    ];
    facts.extend(answers.seed.map(|seed| format!("seed {seed}")));
    facts.extend(answers.results().iter().flat_map(|answer| answer.facts()));
    if let Some(march) = answers.nominal_march() {
        facts.push(format!("{} steps, {} cells", format::count(march.steps), format::count(march.cells)));
        facts.extend(march.error_estimate.as_ref().map(format::discretisation_error));
    }
    let seconds = answers.timing;
    let took = [("adaptation", seconds.plan_s), ("march", seconds.march_s), ("statistics", seconds.other_s)];
    let took: Vec<String> =
        took.iter().map(|(phase, time_s)| format!("{phase} {} s", format::significant(*time_s, 2))).collect();
    facts.push(took.join(", "));
    let facts: String = facts.iter().map(|fact| format!("<li>{}</li>\n", escaped(fact))).collect();
    format!(
        "<header>\n<h1>{}</h1>\n<ul class=\"facts\">\n{facts}</ul>\n{}</header>\n",
        escaped(&answers.name()),
        notes(answers)
    )
}

/// Notes of the cases, highlighted for synthetic data and surrogate properties.
fn notes(answers: &Answers) -> String {
    answers.cases().map(note).collect()
}

fn note(case: &Case) -> String {
    let lower = case.note.to_lowercase();
    let loud = lower.contains("synthetic") || lower.contains("surrogate");
    let mut out = String::new();
    if !case.note.is_empty() {
        let class = if loud { "note loud" } else { "note" };
        out.push_str(&format!("<div class=\"{class}\">\n{}</div>\n", paragraph(&case.note)));
    }
    let stand_ins: Vec<&str> = warnings::surrogates(case).iter().map(|material| material.name.as_str()).collect();
    if !stand_ins.is_empty() {
        let sentence = format!("Surrogate properties are used for {}.", format::list(&stand_ins));
        out.push_str(&format!("<div class=\"note loud\">\n{}</div>\n", paragraph(&sentence)));
    }
    out
}

fn summary(answers: &Answers) -> String {
    let rows: String = findings::all(answers)
        .iter()
        .map(|finding| format!("<dt>{}</dt>\n<dd>{}</dd>\n", escaped(finding.label), escaped(&finding.text)))
        .collect();
    let warnings = warnings::all(answers);
    let warned = if warnings.is_empty() {
        "<p class=\"calm\">No warnings.</p>\n".to_owned()
    } else {
        let title = format::counted(warnings.len(), "warning");
        format!("<div class=\"warnings\" role=\"note\">\n<h3>{title}</h3>\n{}</div>\n", list(&warnings))
    };
    format!("<section id=\"summary\">\n<h2>Summary</h2>\n<dl class=\"findings\">\n{rows}</dl>\n{warned}</section>\n")
}

#[cfg(test)]
mod tests {
    use super::super::{figures, marched, svg};
    use super::*;
    use crate::case::Bounds;
    use crate::traces::Gauge;

    fn made(outcomes: &marched::Study) -> String {
        let answers = outcomes.answers("study");
        let figures = figures::in_sections(&answers);
        let stills: Vec<String> = figures.iter().map(|(_, figure)| svg::draw(figure)).collect();
        page(&answers, &figures, &stills, &["traces.csv".to_owned(), "figures/nominal.svg".to_owned()])
    }

    /// The page without plotly.js, which contains URLs that it does not load.
    fn page_without_plotly(outcomes: &marched::Study) -> String {
        made(outcomes).replace(&plotly(), "")
    }

    #[test]
    fn the_page_has_no_external_references() {
        let page = page_without_plotly(&marched::study());
        for reference in ["src=", "href=\"http", "@import", "url(", "<link"] {
            assert!(!page.contains(reference), "the page refers to something: {reference}");
        }
    }

    /// An HTML comment ends at `--`, the text of an element at `<`.
    #[test]
    fn the_chart_script_is_base64_after_its_licence() {
        assert!(
            !PLOTLY_LICENSE.contains("--") && PLOTLY_LICENSE.contains("Permission is hereby granted, free of charge")
        );
        assert!(made(&marched::study()).contains(PLOTLY_LICENSE));
        assert!(PLOTLY.chars().all(|c| c.is_ascii_alphanumeric() || "+/=".contains(c)));
    }

    #[test]
    fn charts_keep_their_traces_and_each_array_of_x_is_written_once() {
        let outcomes = marched::study();
        let figures = figures::in_sections(&outcomes.answers("study"));
        let text = charts(&figures);
        let written: Value = serde_json::from_str(&text).expect("JSON");
        let shared = written["x"].as_array().expect("arrays");
        let mut traces = 0;
        for ((_, figure), written) in figures.iter().zip(written["charts"].as_array().expect("charts")) {
            // Numbers after one conversion to text and back.
            let drawn: Value = serde_json::from_str(&chart::draw(figure).to_string()).expect("JSON");
            let mut restored = written.clone();
            for trace in restored["traces"].as_array_mut().expect("traces") {
                if let Some(index) = trace["x"].as_u64() {
                    trace["x"] = shared[index as usize].clone();
                    traces += 1;
                }
            }
            assert_eq!(restored, drawn, "{}", figure.id);
        }
        assert!(shared.len() < traces, "{} arrays of {traces} traces", shared.len());
        assert!((1..shared.len()).all(|place| !shared[..place].contains(&shared[place])));
    }

    /// Relative luminance of WCAG 2 of `#rrggbb`.
    fn luminance(colour: &str) -> f64 {
        let part = |at: usize| {
            let value = f64::from(u8::from_str_radix(&colour[at..at + 2], 16).expect("a hexadecimal number")) / 255.0;
            if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * part(1) + 0.7152 * part(3) + 0.0722 * part(5)
    }

    fn contrast(one: &str, other: &str) -> f64 {
        let (one, other) = (luminance(one), luminance(other));
        (one.max(other) + 0.05) / (one.min(other) + 0.05)
    }

    /// The colours of a block of the style sheet.
    fn colours(head: &str) -> impl Fn(&str) -> String {
        let (_, rest) = STYLE.split_once(head).expect("a block of colours");
        let (block, _) = rest.split_once('}').expect("it ends");
        move |name: &str| {
            let value = block.split(&format!("--{name}: ")).nth(1).and_then(|rest| rest.split(';').next());
            value.unwrap_or_else(|| panic!("no --{name} in {head}")).to_owned()
        }
    }

    /// WCAG 2: 4.5 for text of normal size.
    #[test]
    fn text_of_the_light_and_of_the_dark_page_has_a_contrast_of_at_least_4_5() {
        assert!((contrast("#000000", "#ffffff") - 21.0).abs() < 1e-9);
        assert!(contrast("#888888", "#ffffff") < 4.5);
        for head in [":root {", ":root[data-theme=\"dark\"] {"] {
            let colour = colours(head);
            for text in ["ink", "soft", "blue", "warn"] {
                for ground in ["paper", "wash", "warn-wash"] {
                    let found = contrast(&colour(text), &colour(ground));
                    assert!(found >= 4.5, "{head} --{text} on --{ground}: {found:.2}");
                }
            }
        }
    }

    #[test]
    fn markup_in_names_is_escaped() {
        let mut outcomes = marched::study();
        let hostile = "</script><script>alert(1)</script>";
        outcomes.case.name = hostile.to_owned();
        outcomes.case.sensors[0].name = hostile.to_owned();
        outcomes.case.factors[0].name = hostile.to_owned();
        outcomes.case.note = hostile.to_owned();
        assert!(!page_without_plotly(&outcomes).contains("<script>alert"));
    }

    #[test]
    fn the_section_on_gas_is_there_only_where_gas_moves_with_captions_above_charts() {
        let inert = page_without_plotly(&marched::study());
        assert!(!inert.contains("id=\"gas\"") && !inert.contains("Mass balance:") && !inert.contains("gas flux"));
        let mut charring = marched::charring();
        charring.nominal.gauge_traces[Gauge::MassLost as usize].end = 0.36;
        let balance = &mut charring.nominal.balance;
        (balance.solid_lost_kg_m2, balance.gas_in_kg_m2) = (0.36, 0.002);
        let page = page_without_plotly(&charring);
        let (_, section) = page.split_once("<section id=\"gas\">\n<h2>Decomposition and gas</h2>").expect("a section");
        let (section, _) = section.split_once("</section>").expect("it ends");
        assert_eq!(section.matches("</figcaption>\n<div class=\"chart\"").count(), 4);
        assert!(section.contains("Final mass of solid converted to gas: 0.360\u{a0}kg/m²."));
        let (_, nominal) = page.split_once("<section id=\"nominal\">").expect("a section");
        assert!(
            nominal.contains("<p>Mass balance: solid converted to gas 0.360\u{a0}kg/m², gas in 0.00200\u{a0}kg/m²")
        );
    }

    #[test]
    fn the_page_names_the_bounds_of_the_sampling() {
        let mut outcomes = marched::study();
        for (bounds, others) in [(Bounds::Small, "large"), (Bounds::Large, "small")] {
            outcomes.uncertainty.bounds = bounds;
            let page = page_without_plotly(&outcomes);
            assert!(page.contains(&format!("within their {} bounds", bounds.name())), "{}", bounds.name());
            assert!(!page.contains(&format!("within their {others} bounds")), "{}", bounds.name());
        }
    }

    #[test]
    fn synthetic_data_and_warnings_are_at_the_top() {
        let mut outcomes = marched::study();
        outcomes.estimated.combinations[0].correlation = 0.993;
        outcomes.estimated.correlation_probability = 1.0;
        let page = page_without_plotly(&outcomes);
        let place = |text: &str| page.find(text).unwrap_or_else(|| panic!("no {text:?} on the page"));
        let nominal = place("<section id=\"nominal\"");
        assert!(place("Observations are synthetic") < nominal);
        assert!(place("have correlation 0.993") < nominal);
        assert!(place("The residuals are autocorrelated") < nominal);
    }
}
