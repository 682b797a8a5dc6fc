//! Tables of a report. A table is one list of columns, each with its name, unit, meaning and value: the list writes the
//! file and describes it, on the page and in `docs/reference/outputs.md`.

use crate::case::Case;
use crate::report::ReportError;

/// A file of a report: its name in the folder and its content.
pub(in crate::report) type NamedFile = (String, Vec<u8>);

/// The meaning of a file and of its columns.
#[derive(Clone, Debug)]
pub(in crate::report) struct TableDescription {
    /// Names of the files; `<case>` stands for the id of a further case.
    pub files: &'static [&'static str],
    /// Meaning of a row, and the commands that write the file; Markdown.
    pub rows: &'static str,
    pub columns: Vec<ColumnDescription>,
}

/// A column, or several that share a meaning. In the name `<sensor>` and `<factor>` stand for the names of the case,
/// and `{low,high}` for each of the names in braces.
#[derive(Clone, Copy, Debug)]
pub(in crate::report) struct ColumnDescription {
    pub name: &'static str,
    /// A dash where there is none.
    pub unit: &'static str,
    /// Markdown.
    pub meaning: &'static str,
}

/// A table whose rows are made from an `R` each.
pub(in crate::report) struct Table<R> {
    description: TableDescription,
    values: Vec<Value<R>>,
}

/// The cells of a row in one column or in several.
enum Value<R> {
    Text(fn(&R) -> String),
    Number(fn(&R) -> f64),
    Numbers(fn(&R) -> Vec<f64>),
}

impl<R> Table<R> {
    pub(in crate::report) fn new(files: &'static [&'static str], rows: &'static str) -> Self {
        Self { description: TableDescription { files, rows, columns: Vec::new() }, values: Vec::new() }
    }

    /// Add a column of texts.
    pub(in crate::report) fn text(self, name: &'static str, meaning: &'static str, value: fn(&R) -> String) -> Self {
        self.with(ColumnDescription { name, unit: NO_UNIT, meaning }, Value::Text(value))
    }

    /// Add a column of numbers.
    pub(in crate::report) fn number(
        self,
        name: &'static str,
        unit: &'static str,
        meaning: &'static str,
        value: fn(&R) -> f64,
    ) -> Self {
        self.with(ColumnDescription { name, unit, meaning }, Value::Number(value))
    }

    /// Add columns of numbers, in the order of [`expanded`] names.
    pub(in crate::report) fn numbers(
        self,
        name: &'static str,
        unit: &'static str,
        meaning: &'static str,
        values: fn(&R) -> Vec<f64>,
    ) -> Self {
        self.with(ColumnDescription { name, unit, meaning }, Value::Numbers(values))
    }

    fn with(mut self, column: ColumnDescription, value: Value<R>) -> Self {
        self.description.columns.push(column);
        self.values.push(value);
        self
    }

    /// Without the columns of these names, which do not exist in this report.
    pub(in crate::report) fn without(mut self, absent: &[&str]) -> Self {
        let mut keep = self.description.columns.iter().map(|column| !absent.contains(&column.name));
        self.values.retain(|_| keep.next().unwrap_or(true));
        self.description.columns.retain(|column| !absent.contains(&column.name));
        self
    }

    pub(in crate::report) fn description(self) -> TableDescription {
        self.description
    }

    /// The table as CSV, under the first of its names.
    ///
    /// # Errors
    /// When a row cannot be written.
    pub(in crate::report) fn csv(
        &self,
        names: &Names,
        rows: impl IntoIterator<Item = R>,
    ) -> Result<NamedFile, ReportError> {
        self.csv_as(self.description.files[0], names, rows)
    }

    /// The table as CSV, under a name.
    ///
    /// # Errors
    /// When a row cannot be written.
    pub(in crate::report) fn csv_as(
        &self,
        file: &str,
        names: &Names,
        rows: impl IntoIterator<Item = R>,
    ) -> Result<NamedFile, ReportError> {
        let mut written = csv::Writer::from_writer(Vec::new());
        let fault =
            |error: &dyn std::fmt::Display| ReportError::Table { name: file.to_owned(), message: error.to_string() };
        let header = self.description.columns.iter().flat_map(|column| expanded(column.name, names));
        written.write_record(header).map_err(|error| fault(&error))?;
        for row in rows {
            let mut cells = Vec::new();
            for value in &self.values {
                match value {
                    Value::Text(text) => cells.push(text(&row)),
                    Value::Number(number) => cells.push(cell(number(&row))),
                    Value::Numbers(numbers) => cells.extend(numbers(&row).into_iter().map(cell)),
                }
            }
            written.write_record(cells).map_err(|error| fault(&error))?;
        }
        let bytes = written.into_inner().map_err(|error| fault(&error))?;
        Ok((file.to_owned(), bytes))
    }
}

const NO_UNIT: &str = "–";

/// The names that placeholders of columns stand for.
#[derive(Clone, Debug, Default)]
pub(in crate::report) struct Names {
    pub sensors: Vec<String>,
    pub factors: Vec<String>,
}

impl Names {
    pub(in crate::report) fn of(case: &Case) -> Self {
        Self {
            sensors: case.sensors.iter().map(|sensor| sensor.name.clone()).collect(),
            factors: case.factors.iter().map(|factor| factor.name.clone()).collect(),
        }
    }

    pub(in crate::report) fn of_factors<S: ToString>(factors: impl IntoIterator<Item = S>) -> Self {
        Self { sensors: Vec::new(), factors: factors.into_iter().map(|name| name.to_string()).collect() }
    }
}

/// The columns of a name: each of the names in braces in turn, and of each all sensors or factors.
pub(super) fn expanded(name: &str, names: &Names) -> Vec<String> {
    if let Some((before, (inside, after))) =
        name.split_once('{').and_then(|(before, rest)| Some((before, rest.split_once('}')?)))
    {
        return inside.split(',').flat_map(|part| expanded(&format!("{before}{part}{after}"), names)).collect();
    }
    for (placeholder, own) in [("<sensor>", &names.sensors), ("<factor>", &names.factors)] {
        if name.contains(placeholder) {
            return own.iter().map(|own| name.replace(placeholder, own)).collect();
        }
    }
    vec![name.to_owned()]
}

/// A number with nine significant digits; empty if it is not finite.
pub(in crate::report) fn cell(value: f64) -> String {
    if !value.is_finite() {
        return String::new();
    }
    let rounded: f64 = format!("{value:.8e}").parse().unwrap_or(value);
    format!("{rounded}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_that_is_not_finite_is_an_empty_cell() {
        assert_eq!(cell(f64::NAN), "");
        assert_eq!(cell(f64::INFINITY), "");
        assert_eq!(cell(873.123_456_789_012), "873.123457");
        assert_eq!(cell(0.1), "0.1");
    }

    fn table() -> Table<(&'static str, [f64; 4])> {
        Table::<(&'static str, [f64; 4])>::new(&["a.csv", "a-<case>.csv"], "One row per name.")
            .text("name", "Name.", |row| row.0.to_owned())
            .numbers("<factor>_{low,high}", "–", "Interval.", |row| row.1.to_vec())
            .number("first_k", "K", "The first number.", |row| row.1[0])
    }

    #[test]
    fn the_cells_of_a_row_are_under_the_names_of_their_columns() {
        let names = Names::of_factors(["f", "g"]);
        let rows = [("one", [1.0, 2.0, 3.0, f64::NAN]), ("two", [5.0; 4])];
        let (name, bytes) = table().csv(&names, rows).expect("a table");
        let text = "name,f_low,g_low,f_high,g_high,first_k\none,1,2,3,,1\ntwo,5,5,5,5,5\n";
        assert_eq!((name.as_str(), String::from_utf8(bytes).expect("text").as_str()), ("a.csv", text));
        let (name, bytes) = table().without(&["<factor>_{low,high}"]).csv_as("b.csv", &names, rows).expect("a table");
        assert_eq!((name.as_str(), bytes.as_slice()), ("b.csv", &b"name,first_k\none,1\ntwo,5\n"[..]));
    }

    #[test]
    fn a_row_with_too_few_numbers_is_an_error() {
        let error = table().csv(&Names::of_factors(["f", "g", "h"]), [("one", [1.0; 4])]).expect_err("two are missing");
        assert!(error.to_string().starts_with("table a.csv: "), "{error}");
    }
}
