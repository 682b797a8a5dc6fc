//! Resolution of references: files next to the case, and the built-in database of materials and gases.

use super::column_choice::TimeChoice;
use super::files::{FileSource, RecordedFiles};
use super::spanned_toml::{SpannedValue, ValueReader};
use super::table_file::{ChosenColumn, Headings, TableChoice, TableFile, TimeColumn, TimeSeries};
use super::text_file::{parse_toml, parse_toml_file};
use super::{gas, material};
use crate::case::error::{Diagnostics, ReadResult, SourceLocation, unreadable_file_message};
use crate::case::input_files::InputFile;
use crate::case::own_materials::{OwnMaterials, UnusedMaterial};
use crate::case::suggestion::suggestion;
use crate::case::unit::Dimension;
use crate::case::{Gas, Material, PyrometerDriver, SmoothedDriver, library};
use std::cell::RefCell;
use std::path::Path;
use std::sync::Arc;

/// The folders of the materials and gases of a case.
const MATERIALS: &str = "materials";
const GASES: &str = "gases";

/// Resolves the references of a case.
pub(super) struct ReferenceResolver<'a> {
    files: &'a RecordedFiles<'a>,
    diagnostics: &'a Diagnostics,
    /// Materials read so far: plies of one material share it.
    materials: RefCell<Vec<(String, Arc<Material>)>>,
    drivers: RefCell<Vec<SmoothedDriver>>,
    pyrometer_driver: RefCell<Option<PyrometerDriver>>,
}

impl<'a> ReferenceResolver<'a> {
    pub(super) fn new(files: &'a RecordedFiles<'a>, diagnostics: &'a Diagnostics) -> Self {
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
        if let Some((path, id)) = self.own_file(written, MATERIALS)? {
            let label = self.files.label(&path);
            return self.cached_material(written, &label, || {
                material::material(self.document(&path)?.reader(self.diagnostics), id)
            });
        }
        let id = written.text()?;
        let found = library::material_toml(id).ok_or_else(|| self.unknown(MATERIALS, id));
        let (id, text) = written.require(found)?;
        self.cached_material(written, id, || built_in_material(id, text, self.diagnostics))
    }

    /// As [`material`](Self::material), with the folder `gases`.
    pub(super) fn gas(&self, written: ValueReader<'_>) -> ReadResult<Gas> {
        if let Some((path, id)) = self.own_file(written, GASES)? {
            return gas::gas(self.document(&path)?.reader(self.diagnostics), id);
        }
        let id = written.text()?;
        let (id, text) = written.require(library::gas_toml(id).ok_or_else(|| self.unknown(GASES, id)))?;
        built_in_gas(id, text, self.diagnostics)
    }

    /// The gas of a case that names none.
    pub(super) fn default_gas(&self, id: &str) -> ReadResult<Gas> {
        built_in_gas_named(id, self.diagnostics)
    }

    /// Path and id of a file of the case: the one that is written, or that of this name in the folder; `None` if there
    /// is no such file.
    fn own_file(&self, written: ValueReader<'_>, folder: &str) -> ReadResult<Option<(String, String)>> {
        if written.is_table() {
            let section = written.section()?;
            let path =
                section.required("file", "a file such as \"mine.toml\"").and_then(|file| self.existing_path(file));
            section.deny_unknown_keys();
            let path = path?;
            let stem = Path::new(path).file_stem().map_or(path.into(), |stem| stem.to_string_lossy());
            return Ok(Some((path.to_owned(), stem.into_owned())));
        }
        let name = written.text()?;
        let own = written.require(self.own_names(folder))?;
        let path = |own: &str| format!("{folder}/{own}.toml");
        match own.iter().filter(|own| library::is_same_name(own, name)).collect::<Vec<_>>()[..] {
            [] => Ok(None),
            [own] => Ok(Some((path(own), own.clone()))),
            [one, other, ..] => Err(written.error(format!(
                "{} and {} have one name: - equals _, and capital letters equal small ones",
                self.files.label(&path(one)),
                self.files.label(&path(other))
            ))),
        }
    }

    /// The names of the files in a folder of the case, in order.
    fn own_names(&self, folder: &str) -> Result<Vec<String>, String> {
        let listed = self.files.list(folder);
        let listed =
            listed.map_err(|error| format!("{}: {}", self.files.label(folder), unreadable_file_message(&error)))?;
        let mut names: Vec<String> =
            listed.iter().filter_map(|name| name.strip_suffix(".toml")).map(str::to_owned).collect();
        names.sort_unstable();
        Ok(names)
    }

    /// The material files of the case. Those of the database are kept by their ids, which are no paths.
    pub(super) fn own_materials(&self) -> OwnMaterials {
        let read = self.materials.borrow();
        let used = read.iter().filter(|(key, material)| *key != material.id);
        let used: Vec<(String, String)> = used.map(|(path, material)| (material.id.clone(), path.clone())).collect();
        let names = self.own_names(MATERIALS).unwrap_or_default().into_iter();
        let all = names.map(|name| (self.files.label(&format!("{MATERIALS}/{name}.toml")), name));
        let unused = all.filter(|(path, _)| used.iter().all(|(_, other)| other != path));
        OwnMaterials { unused: unused.map(|(path, name)| self.unused_material(path, name)).collect(), used }
    }

    /// A material file that no ply uses. It is no input of the case.
    fn unused_material(&self, path: String, name: String) -> UnusedMaterial {
        let diagnostics = Diagnostics::default();
        let bytes = self.files.read_unrecorded(&format!("{MATERIALS}/{name}.toml"));
        let file = InputFile::new(path.clone(), bytes.as_deref().unwrap_or_default());
        let material = parse_toml_file(bytes, &path, &diagnostics)
            .and_then(|root| material::material(root.reader(&diagnostics), name.clone()));
        let read = diagnostics.into_result(material).map(|material| (Arc::new(material), file));
        UnusedMaterial { name, path, read: read.map_err(|error| error.to_string()) }
    }

    /// The message for a name that neither the case nor the database has.
    fn unknown(&self, folder: &str, name: &str) -> String {
        let own = self.own_names(folder).unwrap_or_default();
        let (kind, built_in) = match folder {
            MATERIALS => ("material", library::material_ids()),
            _ => ("gas", library::gas_ids()),
        };
        format!("unknown {kind} {name:?}{}", suggestion(name, own.iter().map(String::as_str).chain(built_in)))
    }

    fn cached_material(
        &self,
        written: ValueReader<'_>,
        key: &str,
        read: impl FnOnce() -> ReadResult<Material>,
    ) -> ReadResult<Arc<Material>> {
        if let Some((_, material)) = self.materials.borrow().iter().find(|(other, _)| other == key) {
            return Ok(material.clone());
        }
        let material = Arc::new(read()?);
        // Factors, trade studies and reports name a material by its id.
        let is_other = |other: &&(String, Arc<Material>)| material.is_other_of_one_name(&other.1);
        if let Some((other, _)) = self.materials.borrow().iter().find(is_other) {
            let id = &material.id;
            return Err(written.error(format!("{key} and {other} are different materials of one name, {id:?}")));
        }
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

    fn document(&self, path: &str) -> ReadResult<SpannedValue> {
        parse_toml_file(self.files.read(path), &self.files.label(path), self.diagnostics)
    }

    pub(super) fn table_file(
        &self,
        written: ValueReader<'_>,
        sheet: TableChoice<'_>,
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
        sheet: TableChoice<'_>,
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
    let root = parse_toml(text, &format!("data/materials/{id}.toml"), diagnostics)?;
    material::material(root.reader(diagnostics), id.to_owned())
}

fn built_in_gas(id: &str, text: &str, diagnostics: &Diagnostics) -> ReadResult<Gas> {
    let root = parse_toml(text, &format!("data/gases/{id}.toml"), diagnostics)?;
    gas::gas(root.reader(diagnostics), id.to_owned())
}
