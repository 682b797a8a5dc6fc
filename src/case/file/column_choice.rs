//! Columns of a table file that a case chooses: by heading, with a unit, and with an offset of the times.

use super::spanned_toml::{TableReader, ValueReader};
use super::table_file::{ChosenColumn, TableFile, TimeColumn};
use crate::case::error::ReadResult;
use crate::case::unit::{Dimension, unit_conversion};

/// `time = { column = "Time (s)", unit = "s", offset = "-17.5 s" }`, or `time = "Time (s)"`.
#[derive(Clone, Copy)]
pub(super) struct TimeChoice<'a> {
    column: Option<ValueReader<'a>>,
    conversion: Option<(f64, f64)>,
    offset_s: f64,
}

impl<'a> TimeChoice<'a> {
    pub(super) fn read(written: ValueReader<'a>) -> ReadResult<Self> {
        if written.is_text() {
            return written.text().map(|_| Self { column: Some(written), conversion: None, offset_s: 0.0 });
        }
        let section = written.section()?;
        let column = section.optional("column").map(|column| column.text().map(|_| column)).transpose();
        let conversion = stated_conversion(&section, Dimension::Time);
        let offset_s = section.optional("offset").map_or(Ok(0.0), |offset| offset.quantity(Dimension::Time));
        section.deny_unknown_keys();
        Ok(Self { column: column?, conversion: conversion?, offset_s: offset_s? })
    }

    /// The heading of the column of times.
    pub(super) fn heading(self) -> ReadResult<Option<&'a str>> {
        self.column.map(ValueReader::text).transpose()
    }

    /// The column of times in a file; the first one if the case names none.
    pub(super) fn find(self, table: &TableFile) -> ReadResult<TimeColumn> {
        let index = match self.column {
            Some(column) => column.require(table.find_column(column.text()?, None))?,
            None => 0,
        };
        Ok(TimeColumn { column: ChosenColumn { index, conversion: self.conversion }, offset_s: self.offset_s })
    }
}

/// Scale and offset of the `unit` that the case states for a column; `None` without the key.
pub(super) fn stated_conversion(section: &TableReader<'_>, dimension: Dimension) -> ReadResult<Option<(f64, f64)>> {
    let read = |written: ValueReader<'_>| {
        let unit = written.text()?;
        written.require(unit_conversion(unit, dimension).map_err(|message| format!("{message}, found {unit:?}")))
    };
    section.optional("unit").map(read).transpose()
}
