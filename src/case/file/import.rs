//! Import of a material from files of other forms. An import is the text of a material file, which the reader of
//! material files has accepted, or all errors.

mod material_text;
mod pato;
mod property_table;

pub use pato::{PatoHeat, PatoOptions};
pub use property_table::{MaterialColumns, PropertyColumns};

use super::material;
use super::text_file::parse_toml;
use crate::case::error::{CaseError, Diagnostics, ReadResult, SourceLocation};
use crate::case::{Material, Provenance, SourceKind};
use std::path::Path;

/// Title, date and marks of an imported material.
#[derive(Clone, Copy, Debug)]
pub struct ImportRecord<'a> {
    /// Title of the material.
    pub name: &'a str,
    /// The day of the import, `2026-11-24`.
    pub date: &'a str,
    /// Mark and uncertainty (text such as `10 %`) of every property; `None` if they are not stated.
    pub mark: Option<(SourceKind, &'a str)>,
    /// The publication or the report that the files are from.
    pub source: Option<&'a str>,
}

/// An imported material.
#[derive(Clone, Debug)]
pub struct ImportedMaterial {
    /// The text of its material file.
    pub text: String,
    /// The material that the text describes.
    pub material: Material,
}

impl ImportedMaterial {
    /// Import columns of a table file.
    ///
    /// # Errors
    /// All errors of the table and of the choice of columns.
    pub fn from_table(
        path: &Path,
        columns: &MaterialColumns<'_>,
        record: &ImportRecord<'_>,
    ) -> Result<Self, CaseError> {
        Self::checked(record, |diagnostics| property_table::material_text(path, columns, record, diagnostics))
    }

    /// Import a material of PATO: a folder with the files `constantProperties`, `virgin` and, if it pyrolyses, `char`.
    ///
    /// # Errors
    /// All errors of the files, each with its line.
    pub fn from_pato(folder: &Path, options: &PatoOptions, record: &ImportRecord<'_>) -> Result<Self, CaseError> {
        Self::checked(record, |diagnostics| pato::material_text(folder, options, record, diagnostics))
    }

    fn checked(
        record: &ImportRecord<'_>,
        text: impl FnOnce(&Diagnostics) -> ReadResult<String>,
    ) -> Result<Self, CaseError> {
        let diagnostics = Diagnostics::default();
        let source = record.mark.map_or(Ok(""), |(kind, _)| {
            let source = Provenance::checked_source(kind, record.source.unwrap_or_default());
            source.map_err(|message| diagnostics.record(&SourceLocation::without_line("source"), message))
        });
        let imported = source.and_then(|_| text(&diagnostics)).and_then(|text| {
            let root = parse_toml(&text, "the imported material", &diagnostics)?;
            let material = material::material(root.reader(&diagnostics), "imported".to_owned())?;
            Ok(Self { text, material })
        });
        diagnostics.into_result(imported)
    }
}
