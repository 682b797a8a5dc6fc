//! The section on the files of the report.

use super::table::table;
use crate::report::files::contents::{columns, meaning};

/// The files with their meanings, figures as one row, and the columns of the tables, folded up.
pub(super) fn table_of(files: &[String]) -> String {
    let is_figure = |name: &&str| name.starts_with("figures/");
    let names = || files.iter().map(String::as_str);
    let figures = names().any(|name| is_figure(&name)).then_some("figures/*.svg");
    let listed = names().filter(|name| !is_figure(name)).chain(figures).chain(["summary.json"]);
    let rows: Vec<Vec<String>> = listed.map(|name| vec![name.to_owned(), meaning(name)]).collect();
    let columns: Vec<Vec<String>> = names()
        .flat_map(|name| columns(name).into_iter().map(|column| [&[name.to_owned()], &column[..]].concat()))
        .collect();
    let of_files = table("Files of this report", &["File", "Meaning"], &rows);
    if columns.is_empty() {
        return of_files;
    }
    let title = "In a name, {a,b} stands for each of the names in braces";
    let of_columns = table(title, &["File", "Column", "Unit", "Meaning"], &columns);
    format!("{of_files}<details>\n<summary>Columns of the tables</summary>\n{of_columns}</details>\n")
}
