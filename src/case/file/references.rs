//! Resolution of references: files next to the case, and the built-in database of materials and gases.

use super::column_choice::TimeChoice;
use super::files::FileSource;
use super::renamed_keys::FileKind;
use super::spanned_toml::{SpannedValue, ValueReader};
use super::table_file::{ChosenColumn, Headings, SheetChoice, TableFile, TimeColumn, TimeSeries};
use super::text_file::{parse_toml, parse_toml_file};
use super::{gas, material};
use crate::case::error::{Diagnostics, ReadResult, SourceLocation};
use crate::case::suggestion::suggestion;
use crate::case::unit::Dimension;
use crate::case::{Gas, Material, PyrometerDriver, SmoothedDriver, library};
use std::cell::RefCell;
use std::path::Path;
use std::sync::Arc;

/// Resolves the references of a case.
pub(super) struct ReferenceResolver<'a> {
    files: &'a dyn FileSource,
    diagnostics: &'a Diagnostics,
    /// Materials read so far: plies of one material share it.
    materials: RefCell<Vec<(String, Arc<Material>)>>,
    drivers: RefCell<Vec<SmoothedDriver>>,
    pyrometer_driver: RefCell<Option<PyrometerDriver>>,
}

impl<'a> ReferenceResolver<'a> {
    pub(super) fn new(files: &'a dyn FileSource, diagnostics: &'a Diagnostics) -> Self {
        Self {
            files,
            diagnostics,
            materials: RefCell::default(),
            drivers: RefCell::default(),
            pyrometer_driver: RefCell::default(),
        }
    }

    /// Keep the temperature of a held face as it was measured.
    pub(super) fn record_driver(&self, driver: SmoothedDriver) {
        self.drivers.borrow_mut().push(driver);
    }

    /// Keep the pyrometer that holds the hot face.
    pub(super) fn record_pyrometer(&self, driver: PyrometerDriver) {
        self.pyrometer_driver.replace(Some(driver));
    }

    /// Whether a pyrometer holds the hot face.
    pub(super) fn has_pyrometer(&self) -> bool {
        self.pyrometer_driver.borrow().is_some()
    }

    /// The drivers recorded so far: those that were smoothed, and the pyrometer.
    pub(super) fn into_drivers(self) -> (Vec<SmoothedDriver>, Option<PyrometerDriver>) {
        (self.drivers.into_inner(), self.pyrometer_driver.into_inner())
    }

    /// `"pyrogel3350"`: `materials/pyrogel3350.toml` next to the case if it exists, else the built-in material; or
    /// `{ file = "mine.toml" }`.
    pub(super) fn material(&self, written: ValueReader<'_>) -> ReadResult<Arc<Material>> {
        if let Some((path, id)) = self.local_path(written, "materials")? {
            return self.cached_material(&self.files.label(&path), || {
                material::material(self.document(&path, FileKind::Material)?.reader(self.diagnostics), id)
            });
        }
        let id = written.text()?;
        let (id, text) = written.require(library::material_toml(id).ok_or_else(|| unknown_material(id)))?;
        self.cached_material(id, || built_in_material(id, text, self.diagnostics))
    }

    /// As [`material`](Self::material), with the folder `gases`.
    pub(super) fn gas(&self, written: ValueReader<'_>) -> ReadResult<Gas> {
        if let Some((path, id)) = self.local_path(written, "gases")? {
            return gas::gas(self.document(&path, FileKind::Gas)?.reader(self.diagnostics), id);
        }
        let id = written.text()?;
        let (id, text) = written.require(library::gas_toml(id).ok_or_else(|| unknown_gas(id)))?;
        built_in_gas(id, text, self.diagnostics)
    }

    /// The gas of a case that names none.
    pub(super) fn default_gas(&self, id: &str) -> ReadResult<Gas> {
        built_in_gas_named(id, self.diagnostics)
    }

    /// Path and id of a file next to the case; `None` if there is no such file.
    fn local_path(&self, written: ValueReader<'_>, folder: &str) -> ReadResult<Option<(String, String)>> {
        if written.is_table() {
            let section = written.section()?;
            let path =
                section.required("file", "a file such as \"mine.toml\"").and_then(|file| self.existing_path(file));
            section.deny_unknown_keys();
            let path = path?;
            let stem = Path::new(path).file_stem().map_or(path.into(), |stem| stem.to_string_lossy());
            return Ok(Some((path.to_owned(), stem.into_owned())));
        }
        let id = written.text()?.replace('-', "_");
        let known = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let own = format!("{folder}/{id}.toml");
        Ok((id.chars().all(known) && self.files.contains(&own)).then_some((own, id)))
    }

    fn cached_material(&self, key: &str, read: impl FnOnce() -> ReadResult<Material>) -> ReadResult<Arc<Material>> {
        if let Some((_, material)) = self.materials.borrow().iter().find(|(other, _)| other == key) {
            return Ok(material.clone());
        }
        let material = Arc::new(read()?);
        self.materials.borrow_mut().push((key.to_owned(), material.clone()));
        Ok(material)
    }

    /// The path of a file next to the case, which must exist.
    fn existing_path<'w>(&self, written: ValueReader<'w>) -> ReadResult<&'w str> {
        let path = written.text()?;
        if self.files.contains(path) {
            return Ok(path);
        }
        Err(written.error(format!("no such file: {}", self.files.label(path))))
    }

    /// The name of a file in messages.
    pub(super) fn label(&self, path: &str) -> String {
        self.files.label(path)
    }

    fn document(&self, path: &str, kind: FileKind) -> ReadResult<SpannedValue> {
        parse_toml_file(self.files.read(path), &self.files.label(path), kind, self.diagnostics)
    }

    pub(super) fn table_file(
        &self,
        written: ValueReader<'_>,
        sheet: SheetChoice<'_>,
        headings: Headings<'_>,
    ) -> ReadResult<TableFile> {
        let path = self.existing_path(written)?;
        TableFile::read(self.files.read(path), &self.files.label(path), sheet, headings, self.diagnostics)
    }

    /// A column of a table file over time; `column` is optional if the file has only one besides time. `conversion` is
    /// that of a stated unit.
    pub(super) fn series(
        &self,
        file: ValueReader<'_>,
        sheet: SheetChoice<'_>,
        column: Option<ValueReader<'_>>,
        conversion: Option<(f64, f64)>,
        time: Option<TimeChoice<'_>>,
        dimension: Dimension,
    ) -> ReadResult<TimeSeries> {
        let name = column.map(ValueReader::text).transpose()?;
        let headings = time.map_or(Ok(Headings::All), |time| time.heading().map(Headings::Chosen))?;
        let table = self.table_file(file, sheet, headings)?;
        let time = time.map_or(Ok(TimeColumn::default()), |time| time.find(&table))?;
        let found = name.map_or_else(|| table.only_value_column(time), |name| table.find_column(name, Some(time)));
        let column = ChosenColumn { index: column.unwrap_or(file).require(found)?, conversion };
        table.note_clock(time, self.diagnostics);
        table.time_series(time, column, dimension, true, self.diagnostics)
    }
}

/// A material of the built-in database.
pub(super) fn built_in_material_named(id: &str, diagnostics: &Diagnostics) -> ReadResult<Material> {
    match library::material_toml(id) {
        Some((id, text)) => built_in_material(id, text, diagnostics),
        None => Err(diagnostics.record(&SourceLocation::without_line(id), unknown_material(id))),
    }
}

/// A gas of the built-in database.
pub(super) fn built_in_gas_named(id: &str, diagnostics: &Diagnostics) -> ReadResult<Gas> {
    match library::gas_toml(id) {
        Some((id, text)) => built_in_gas(id, text, diagnostics),
        None => Err(diagnostics.record(&SourceLocation::without_line(id), unknown_gas(id))),
    }
}

fn unknown_material(id: &str) -> String {
    format!("unknown material {id:?}{}", suggestion(id, library::material_ids()))
}

fn unknown_gas(id: &str) -> String {
    format!("unknown gas {id:?}{}", suggestion(id, library::gas_ids()))
}

fn built_in_material(id: &str, text: &str, diagnostics: &Diagnostics) -> ReadResult<Material> {
    let root = parse_toml(text, &format!("data/materials/{id}.toml"), FileKind::Material, diagnostics)?;
    material::material(root.reader(diagnostics), id.to_owned())
}

fn built_in_gas(id: &str, text: &str, diagnostics: &Diagnostics) -> ReadResult<Gas> {
    let root = parse_toml(text, &format!("data/gases/{id}.toml"), FileKind::Gas, diagnostics)?;
    gas::gas(root.reader(diagnostics), id.to_owned())
}
