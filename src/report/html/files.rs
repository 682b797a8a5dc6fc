//! The section on the files of the report.

use super::table::table;
use crate::report::files::contents::meaning;

/// The files with their meanings; figures are one row.
pub(super) fn table_of(files: &[String]) -> String {
    let is_figure = |name: &&str| name.starts_with("figures/");
    let names = || files.iter().map(String::as_str);
    let figures = names().any(|name| is_figure(&name)).then_some("figures/*.svg");
    let names = names().filter(|name| !is_figure(name)).chain(figures).chain(["summary.json"]);
    let rows: Vec<Vec<String>> = names.map(|name| vec![name.to_owned(), meaning(name)]).collect();
    table("Files of this report", &["File", "Meaning"], &rows)
}
