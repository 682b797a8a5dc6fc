//! The sheet and the range of a workbook that a case chooses.

#[cfg(feature = "xlsx")]
use super::cell_range::CellRange;
#[cfg(feature = "xlsx")]
use crate::case::error::ReadResult;
use crate::case::file::spanned_toml::{TableReader, ValueReader};

/// The keys `sheet` and `range` beside a `file`; without them the first sheet and all its cells.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::case::file) struct SheetChoice<'a> {
    pub(super) sheet: Option<ValueReader<'a>>,
    pub(super) range: Option<ValueReader<'a>>,
}

impl<'a> SheetChoice<'a> {
    pub(in crate::case::file) fn of(section: &TableReader<'a>) -> Self {
        Self { sheet: section.optional("sheet"), range: section.optional("range") }
    }

    /// The name of the key that is given, with its value.
    pub(in crate::case::file) fn key(self) -> Option<(&'static str, ValueReader<'a>)> {
        self.sheet.map(|sheet| ("sheet", sheet)).or(self.range.map(|range| ("range", range)))
    }

    /// The chosen cells.
    #[cfg(feature = "xlsx")]
    pub(super) fn cells(self) -> ReadResult<CellRange> {
        self.range.map_or(Ok(CellRange::ALL), |range| range.require(CellRange::parse(range.text()?)))
    }
}
