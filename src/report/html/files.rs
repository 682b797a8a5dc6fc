//! The section on the files of the report. Their meanings are those of `docs/reference/outputs.md`, which is read here.

use super::table::table;

const OUTPUTS: &str = include_str!("../../../docs/reference/outputs.md");

/// The files with their meanings; figures are one row.
pub(super) fn table_of(files: &[String]) -> String {
    let is_figure = |name: &&String| name.starts_with(FIGURES);
    let mut rows: Vec<Vec<String>> =
        files.iter().filter(|name| !is_figure(name)).map(|name| row(name, meaning(name))).collect();
    if files.iter().any(|name| name.starts_with(FIGURES)) {
        rows.push(row("figures/*.svg", meaning("figures/*.svg")));
    }
    rows.push(row("summary.json", meaning("summary.json")));
    table("Files of this report", &["File", "Meaning"], &rows)
}

const FIGURES: &str = "figures/";

fn row(name: &str, meaning: Option<String>) -> Vec<String> {
    vec![name.to_owned(), meaning.unwrap_or_default()]
}

/// The meaning of a file: its row in a table of files, else the paragraph after the heading that names it.
fn meaning(file: &str) -> Option<String> {
    let of_row = OUTPUTS.lines().filter_map(|line| line.strip_prefix("| ")).find_map(|line| {
        let (name, meaning) = line.trim_end_matches(" |").split_once(" | ")?;
        (name == format!("`{file}`")).then(|| plain(meaning))
    });
    of_row.or_else(|| {
        let sections = OUTPUTS.split("\n### ").skip(1);
        let (_, text) = sections
            .filter_map(|section| section.split_once("\n\n"))
            .find(|(head, _)| head.split('`').skip(1).step_by(2).any(|pattern| matches(pattern, file)))?;
        text.split("\n\n").next().map(plain)
    })
}

/// Whether a name fits a pattern, in which `<case>` stands for the name of a case.
fn matches(pattern: &str, name: &str) -> bool {
    match pattern.split_once("<case>") {
        None => pattern == name,
        Some((before, after)) => {
            name.len() > before.len() + after.len() && name.starts_with(before) && name.ends_with(after)
        }
    }
}

/// Markdown as plain text: links become their text, and a link without text is left out.
fn plain(markdown: &str) -> String {
    let mut text = String::new();
    let mut rest = markdown;
    while let Some((before, link)) = rest.split_once('[') {
        let Some((title, target)) = link.split_once("](") else { break };
        text += &format!("{before}{title}");
        rest = target.split_once(')').map_or("", |(_, after)| after);
    }
    (text + rest).replace('`', "").split_whitespace().collect::<Vec<&str>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::files::tables;
    use crate::report::fixture;

    #[test]
    fn every_file_of_a_report_has_a_meaning() {
        let answers = fixture::outcomes().answers("study");
        let tables = tables::all(&answers).expect("the tables of the fixture");
        assert!(tables.len() > 10);
        let others = ["report.html", "figures/*.svg", "summary.json", "members.parquet", "traces.parquet"];
        let others = others.into_iter().chain(["residuals-lcat-2330.csv", "traces-lcat-2330.csv"]);
        for name in tables.iter().map(|(name, _)| name.as_str()).chain(others) {
            let found = meaning(name).unwrap_or_else(|| panic!("docs/reference/outputs.md does not describe {name}"));
            assert!(found.len() > 20 && !found.contains(['`', '[', '|']), "{name}: {found}");
        }
        assert_eq!(meaning("unknown.csv"), None);
    }

    #[test]
    fn markdown_becomes_plain_text() {
        assert_eq!(plain("The `numbers`,\n[below](#summary-json)."), "The numbers, below.");
    }
}
