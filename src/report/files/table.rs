//! A CSV file, written row by row.

use crate::report::ReportError;

/// A file of a report: its name in the folder and its content.
pub(in crate::report) type NamedFile = (String, Vec<u8>);

/// A CSV file in memory.
pub(in crate::report) struct CsvTable {
    name: String,
    rows: csv::Writer<Vec<u8>>,
}

impl CsvTable {
    pub(in crate::report) fn new<S: AsRef<str>>(
        name: &str,
        columns: impl IntoIterator<Item = S>,
    ) -> Result<Self, ReportError> {
        let mut table = Self { name: name.to_owned(), rows: csv::Writer::from_writer(Vec::new()) };
        table.text_row(columns.into_iter().map(|column| column.as_ref().to_owned()).collect())?;
        Ok(table)
    }

    pub(in crate::report) fn text_row(&mut self, cells: Vec<String>) -> Result<(), ReportError> {
        self.rows.write_record(cells).map_err(|error| self.fault(&error))
    }

    /// Append a row of numbers, after a name if there is one.
    pub(in crate::report) fn row(
        &mut self,
        name: Option<&str>,
        values: impl IntoIterator<Item = f64>,
    ) -> Result<(), ReportError> {
        self.text_row(name.map(str::to_owned).into_iter().chain(values.into_iter().map(cell)).collect())
    }

    pub(in crate::report) fn finish(self) -> Result<(String, Vec<u8>), ReportError> {
        let Self { name, rows } = self;
        match rows.into_inner() {
            Ok(bytes) => Ok((name, bytes)),
            Err(error) => Err(ReportError::Table { name, message: error.to_string() }),
        }
    }

    fn fault(&self, error: &csv::Error) -> ReportError {
        ReportError::Table { name: self.name.clone(), message: error.to_string() }
    }
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
}
