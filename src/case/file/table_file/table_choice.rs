//! Options of a case for a table file beside its name: sheet and range of a workbook, and codes of missing values.

use super::cell_range::CellRange;
use crate::case::error::ReadResult;
use crate::case::file::spanned_toml::{TableReader, ValueReader, collect_all};

/// The keys `sheet`, `range` and `missing` beside a `file`; without them the first sheet, all its cells, and the words
/// that all tables may have for a missing value.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::case::file) struct TableChoice<'a> {
    pub(super) sheet: Option<ValueReader<'a>>,
    pub(super) range: Option<ValueReader<'a>>,
    missing: Option<ValueReader<'a>>,
}

impl<'a> TableChoice<'a> {
    pub(in crate::case::file) fn of(section: &TableReader<'a>) -> Self {
        Self {
            sheet: section.optional("sheet"),
            range: section.optional("range"),
            missing: section.optional("missing"),
        }
    }

    /// The name of a key that is given, with its value.
    pub(in crate::case::file) fn key(self) -> Option<(&'static str, ValueReader<'a>)> {
        self.workbook_key().or(self.missing.map(|missing| ("missing", missing)))
    }

    /// The name of a key that only a workbook can have, with its value.
    pub(super) fn workbook_key(self) -> Option<(&'static str, ValueReader<'a>)> {
        self.sheet.map(|sheet| ("sheet", sheet)).or(self.range.map(|range| ("range", range)))
    }

    /// The codes of missing values: `"OPEN"`, or `["OPEN", -9999]`.
    pub(super) fn missing(self) -> ReadResult<Vec<String>> {
        let Some(written) = self.missing else { return Ok(Vec::new()) };
        let codes = if written.is_list() { written.list()? } else { vec![written] };
        collect_all(codes.into_iter().map(|code| match code.is_text() {
            true => code.text().map(|text| text.trim().to_owned()),
            false => code.number().map(|number| number.to_string()),
        }))
    }

    /// The chosen cells.
    pub(super) fn cells(self) -> ReadResult<CellRange> {
        self.range.map_or(Ok(CellRange::ALL), |range| range.require(CellRange::parse(range.text()?)))
    }
}
