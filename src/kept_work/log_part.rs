//! Some rows of the log of a study, computed by one process for another, which takes them in place of the work.

use super::checksum::{sealed, unsealed};
use super::kept_rows::KeptRows;
use super::work_log::WorkLog;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Some consecutive rows of the log of a study. An estimate has a row for the minimisation from each start, a coverage
/// study one for each data set.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LogPart {
    pub(crate) head: KeptRows,
    first: usize,
    /// The bits of the numbers, because the interval of an undetermined factor is infinite.
    numbers: Vec<u64>,
}

impl LogPart {
    /// Rows from `first` on, for a `head` without rows.
    pub(crate) fn new(mut head: KeptRows, first: usize, rows: &[Vec<f64>]) -> Self {
        head.finished = rows.len();
        Self { head, first, numbers: rows.iter().flatten().map(|number| number.to_bits()).collect() }
    }

    /// The first of the rows, and one past the last.
    pub fn rows(&self) -> Range<usize> {
        self.first..self.first + self.head.finished
    }

    /// The text of the part, with its checksum.
    pub fn to_json(&self) -> String {
        sealed(self)
    }

    /// Read a part from its text.
    ///
    /// # Errors
    /// When the text is not that of a part, or does not have its checksum.
    pub fn from_json(text: &str) -> Result<Self, String> {
        let part: Self = serde_json::from_str(unsealed(text)?).map_err(|error| error.to_string())?;
        let (found, expected) = (part.numbers.len(), part.head.finished.saturating_mul(part.head.columns));
        if found == expected { Ok(part) } else { Err(format!("{found} numbers, expected {expected}")) }
    }
}

/// The rows of parts, one after another.
pub(crate) struct PartialLog {
    rows: Vec<f64>,
    columns: usize,
    taken: usize,
}

impl PartialLog {
    /// The rows of parts, from the first row of the log on. A row that several parts have counts once. `head` is that
    /// of the study.
    ///
    /// # Errors
    /// When a part is of another study, a row before the last one is missing, or two parts differ in a row.
    pub(crate) fn of(head: &KeptRows, parts: &[LogPart]) -> Result<Self, String> {
        let mut ordered: Vec<&LogPart> = parts.iter().collect();
        ordered.sort_by_key(|part| part.first);
        let (mut bits, columns): (Vec<u64>, usize) = (Vec::new(), head.columns);
        for part in ordered {
            if (&part.head.study, part.head.columns) != (&head.study, columns) {
                return Err(format!("a part is of another study: {}, expected {}", part.head.study, head.study));
            }
            let (next, Range { start, end }) = (bits.len() / columns, part.rows());
            if start > next {
                return Err(format!("no part has rows {next}..{start}"));
            }
            let (known, new) = part.numbers.split_at(columns * (next.min(end) - start));
            if bits[columns * start..][..known.len()] != *known {
                return Err(format!("two parts differ in rows {start}..{}", next.min(end)));
            }
            bits.extend(new);
        }
        Ok(Self { rows: bits.into_iter().map(f64::from_bits).collect(), columns, taken: 0 })
    }
}

impl WorkLog for PartialLog {
    fn next(&mut self) -> Option<&[f64]> {
        let row = self.rows.get(self.taken * self.columns..)?.get(..self.columns)?;
        self.taken += 1;
        Some(row)
    }

    fn add(&mut self, _row: &[f64]) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::march::{Backend, Precision};
    use crate::study::run_record::RunRecord;

    fn head(options: &str) -> KeptRows {
        let backend = Backend { name: String::new(), kind: "cpu", driver: None, precision: Precision::F64 };
        KeptRows::new(std::iter::empty(), &backend, RunRecord::new(None, &backend, 1), options, (2, Some(5)))
    }

    fn part(first: usize, rows: &[[f64; 2]]) -> LogPart {
        let rows: Vec<Vec<f64>> = rows.iter().map(|row| row.to_vec()).collect();
        LogPart::from_json(&LogPart::new(head("a"), first, &rows).to_json()).expect("a part")
    }

    fn rows(parts: &[LogPart]) -> Result<Vec<f64>, String> {
        let mut log = PartialLog::of(&head("a"), parts)?;
        let mut found = Vec::new();
        while let Some(row) = log.next() {
            found.extend(row);
        }
        Ok(found)
    }

    #[test]
    fn parts_in_any_order_are_the_rows_of_a_log_and_those_that_are_repeated_count_once() {
        let (first, second) = ([[0.1 + 0.2, f64::INFINITY], [2.0, 3.0]], [[4.0, f64::MIN_POSITIVE]]);
        let found = rows(&[part(2, &second), part(0, &first), part(1, &[first[1], second[0]]), part(0, &first)]);
        assert_eq!(found, Ok([first.concat(), second.concat()].concat()));
    }

    #[test]
    fn rows_that_are_missing_or_differ_or_are_of_another_study_are_refused() {
        assert_eq!(rows(&[part(0, &[[1.0, 2.0]]), part(2, &[[5.0, 6.0]])]), Err("no part has rows 1..2".to_owned()));
        let differs = rows(&[part(0, &[[1.0, 2.0], [3.0, 4.0]]), part(1, &[[3.0, 4.5]])]);
        assert_eq!(differs, Err("two parts differ in rows 1..2".to_owned()));
        let other = PartialLog::of(&head("b"), &[part(0, &[[1.0, 2.0]])]);
        assert!(other.is_err_and(|message| message.contains(", a, expected") && message.ends_with(", b")));
        let text = part(0, &[[1.0, 2.0]]).to_json();
        assert!(LogPart::from_json(&text.replace("\"columns\":2", "\"columns\":3")).is_err());
    }
}
