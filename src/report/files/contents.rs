//! Descriptions of the files of a report: the list on its page, and the tables of `docs/reference/outputs.md`.

use super::table::{ColumnDescription, TableDescription};
use crate::report::table_descriptions;

/// Files that are no tables, with their meanings; Markdown.
const OTHERS: [(&str, &str); 4] = [
    ("report.html", "One page with interactive charts; it needs no network."),
    ("figures/*.svg", "The charts of the page; [other formats](../how-to/convert-figures.md)."),
    ("design.toml", "The case file of the design of a test."),
    ("summary.json", "The numbers of the report as JSON."),
];

/// Every table that a command writes.
fn tables() -> Vec<TableDescription> {
    let mut tables = vec![super::tables::traces_table().description()];
    tables.extend(table_descriptions());
    tables.extend([members(), member_traces(), measured()]);
    tables
}

fn column(name: &'static str, unit: &'static str, meaning: &'static str) -> ColumnDescription {
    ColumnDescription { name, unit, meaning }
}

/// The columns of `members.parquet`: those before the factors, the factors, and those of each sensor.
pub(super) const MEMBER: &str = "member";
pub(super) const STATUS: &str = "status";
pub(super) const PEAK: &str = "<sensor>_peak_k";
pub(super) const PEAK_TIME: &str = "<sensor>_peak_time_s";

fn members() -> TableDescription {
    TableDescription {
        files: &["members.parquet"],
        rows: "One row per member (on the command line: `uncertainty --keep members`, `--keep traces`). This \
               file and `traces.parquet` have key-value metadata: `bondline.case`, `bondline.fingerprint` of its \
               content, `bondline.sampling`, `bondline.backend`, `bondline.version`, and `bondline.checksum`: XXH3 \
               (128 bits) of all numbers, row by row, as doubles with their least significant byte first.",
        columns: vec![
            column(MEMBER, "–", "Index of the member (int64)."),
            column(STATUS, "–", "Member status (int32), above."),
            column("<factor>", "–", "Value of the factor (double)."),
            column(PEAK, "K", "Peak temperature, the same as in margins; NaN if the member failed (double)."),
            column(PEAK_TIME, "s", "Time of the peak (double)."),
        ],
    }
}

pub(super) const TIME: &str = "time_s";
pub(super) const TEMPERATURE: &str = "<sensor>_k";

fn member_traces() -> TableDescription {
    TableDescription {
        files: &["traces.parquet"],
        rows: "One row per completed member and instant (on the command line: `uncertainty --keep traces`).",
        columns: vec![
            column(MEMBER, "–", "Index of the member (int64)."),
            column(TIME, "s", "Time (double)."),
            column(TEMPERATURE, "K", "Temperature (double)."),
        ],
    }
}

fn measured() -> TableDescription {
    TableDescription {
        files: &["measured.csv"],
        rows: "Synthetic observations, one row per instant (on the command line: `twin` without `--study`).",
        columns: vec![column(TIME, "s", "Time."), column(TEMPERATURE, "K", "Temperature with noise.")],
    }
}

/// The meaning of a file as plain text; empty for a file of no report.
pub(in crate::report) fn meaning(file: &str) -> String {
    let other = OTHERS.iter().find(|(name, _)| *name == file).map(|(_, meaning)| plain(meaning));
    other.unwrap_or_else(|| table_of(file).map_or(String::new(), |table| plain(table.rows)))
}

/// Name, unit and meaning of every column of a file as plain text; none for a file that is no table.
pub(in crate::report) fn columns(file: &str) -> Vec<[String; 3]> {
    let columns = table_of(file).map_or(Vec::new(), |table| table.columns);
    columns.into_iter().map(|column| [column.name.to_owned(), column.unit.to_owned(), plain(column.meaning)]).collect()
}

fn table_of(file: &str) -> Option<TableDescription> {
    tables().into_iter().find(|table| table.files.iter().any(|name| matches(name, file)))
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

/// Markdown as plain text: a link becomes its text.
fn plain(markdown: &str) -> String {
    let mut text = String::new();
    let mut rest = markdown;
    while let Some((before, link)) = rest.split_once('[') {
        let Some((title, target)) = link.split_once("](") else { break };
        text += &format!("{before}{title}");
        rest = target.split_once(')').map_or("", |(_, after)| after);
    }
    (text + rest).replace('`', "")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::files::tables as written;
    use crate::report::marched;
    use crate::study::observation_check::FlagKind;
    use crate::traces::Gauge;

    /// The section `## Tables` of the page.
    fn section() -> String {
        let mut text = "## Tables\n".to_owned();
        for table in tables() {
            let names: Vec<String> = table.files.iter().map(|name| format!("`{name}`")).collect();
            text += &format!(
                "\n### {}\n\n{}\n\n| column | unit | meaning |\n|---|---|---|\n",
                names.join(", "),
                wrapped(table.rows)
            );
            for ColumnDescription { name, unit, meaning } in table.columns {
                text += &format!("| `{name}` | {unit} | {meaning} |\n");
            }
        }
        text
    }

    /// A paragraph in lines of at most 120 characters.
    fn wrapped(text: &str) -> String {
        let mut lines = vec![String::new()];
        for word in text.split(' ') {
            let line = lines.last_mut().expect("a line");
            if line.is_empty() {
                line.push_str(word);
            } else if line.chars().count() + 1 + word.chars().count() <= 120 {
                *line += &format!(" {word}");
            } else {
                lines.push(word.to_owned());
            }
        }
        lines.join("\n")
    }

    /// `BONDLINE_BLESS=1` renews the section.
    #[test]
    fn the_page_on_output_files_has_every_column_with_its_unit_and_meaning() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/reference/outputs.md");
        let page = std::fs::read_to_string(path).expect("a page");
        let (before, rest) = page.split_once("## Tables\n").expect("the section of tables");
        let (found, after) = rest.split_once("\n### Pieces of a sweep\n").expect("its end");
        if std::env::var_os("BONDLINE_BLESS").is_some() {
            let renewed = format!("{before}{}\n### Pieces of a sweep\n{after}", section());
            std::fs::write(path, renewed).expect("the page can be written");
            return;
        }
        let is_same = format!("## Tables\n{found}") == section();
        assert!(is_same, "{path} differs from the columns of the tables: BONDLINE_BLESS=1 renews it");
        for (name, meaning) in OTHERS {
            assert!(before.contains(&format!("\n| `{name}` | {meaning} |\n")), "{name}: {meaning}");
        }
        for line in section().lines() {
            assert!(line.chars().count() <= 120, "{line}");
        }
    }

    #[test]
    fn every_file_of_a_report_has_a_meaning() {
        let answers = marched::study().answers("study");
        let files = written::all(&answers).expect("the tables of the study");
        assert!(files.len() > 10);
        let others = ["report.html", "figures/*.svg", "summary.json", "design.toml", "members.parquet"];
        let others = others.into_iter().chain(["traces.parquet", "residuals-lcat-2330.csv", "traces-lcat-2330.csv"]);
        for name in files.iter().map(|(name, _)| name.as_str()).chain(others) {
            let found = meaning(name);
            assert!(found.len() > 20 && !found.contains(['`', '[', '|']), "{name}: {found:?}");
        }
        assert_eq!(meaning("unknown.csv"), "");
    }

    /// A unit is in lower case at the end of the name, whatever follows in it.
    #[test]
    fn the_name_of_every_column_ends_in_its_unit() {
        let ending = |unit: &str| match unit {
            "K" | "s" | "m" | "Pa" => Some(format!("_{}", unit.to_lowercase())),
            "kg/m²/s" => Some("_kg_m2_s".to_owned()),
            "kg/m²" | "kg/m³" | "W/m²" | "J/m²" => {
                Some(format!("_{}", unit.to_lowercase().replace('/', "_").replace('²', "2").replace('³', "3")))
            }
            "K/min" => Some("_k_min".to_owned()),
            "K/%" => Some("_k_per_percent".to_owned()),
            "–" | "K or –" => None,
            other => panic!("the unit {other}"),
        };
        let mut judged = 0;
        for table in tables() {
            for ColumnDescription { name, unit, .. } in table.columns {
                judged += usize::from(ending(unit).is_some());
                assert!(ending(unit).is_none_or(|ending| name.ends_with(&ending)), "{:?}: {name}, {unit}", table.files);
                assert_eq!(name, name.to_lowercase(), "{:?}", table.files);
            }
        }
        assert!(judged > 60, "{judged} columns with a unit");
    }

    #[test]
    fn gauges_and_flags_have_the_columns_of_their_names() {
        let columns: Vec<&str> = tables().iter().flat_map(|table| &table.columns).map(|column| column.name).collect();
        for gauge in Gauge::ALL {
            assert!(columns.contains(&gauge.name()), "{}", gauge.name());
        }
        let flags = FlagKind::ALL.map(FlagKind::name).join(",");
        assert!(columns.contains(&format!("{{{flags}}}").as_str()), "{flags}");
    }

    #[test]
    fn markdown_becomes_plain_text() {
        assert_eq!(plain("The `numbers`, [below](#summary-json)."), "The numbers, below.");
    }
}
