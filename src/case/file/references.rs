//! Resolution of references: files next to the case, and the built-in database of materials and gases.

use super::files::Files;
use super::sheet::{Series, Sheet};
use super::source::document;
use super::written::{Node, Written};
use super::{gas, material};
use crate::case::error::{Faults, Place, Read};
use crate::case::nearest::suggestion;
use crate::case::unit::Dimension;
use crate::case::{Gas, Material, library};
use std::cell::RefCell;
use std::path::Path;
use std::sync::Arc;

/// Resolves the references of a case.
pub(super) struct References<'a> {
    files: &'a dyn Files,
    diagnostics: &'a Faults,
    /// Materials read so far: plies of one material share it.
    materials: RefCell<Vec<(String, Arc<Material>)>>,
}

impl<'a> References<'a> {
    pub(super) fn new(files: &'a dyn Files, diagnostics: &'a Faults) -> Self {
        Self { files, diagnostics, materials: RefCell::default() }
    }

    /// `"pyrogel3350"`: `materials/pyrogel3350.toml` next to the case if it exists, else the built-in material; or
    /// `{ file = "mine.toml" }`.
    pub(super) fn material(&self, written: Written<'_>) -> Read<Arc<Material>> {
        if let Some((path, id)) = self.own(written, "materials")? {
            return self.shared(&self.files.label(&path), || {
                material::material(self.document(&path)?.read(self.diagnostics), id)
            });
        }
        let id = written.text()?;
        let (id, text) = written.require(library::text(id).ok_or_else(|| unknown_material(id)))?;
        self.shared(id, || built_in_material(id, text, self.diagnostics))
    }

    /// As [`material`](Self::material), with the folder `gases`.
    pub(super) fn gas(&self, written: Written<'_>) -> Read<Gas> {
        if let Some((path, id)) = self.own(written, "gases")? {
            return gas::gas(self.document(&path)?.read(self.diagnostics), id);
        }
        let id = written.text()?;
        let (id, text) = written.require(library::gas_text(id).ok_or_else(|| unknown_gas(id)))?;
        built_in_gas(id, text, self.diagnostics)
    }

    /// The gas of a case that names none.
    pub(super) fn default_gas(&self, id: &str) -> Read<Gas> {
        named_gas(id, self.diagnostics)
    }

    /// Path and id of a file next to the case; `None` if there is no such file.
    fn own(&self, written: Written<'_>, folder: &str) -> Read<Option<(String, String)>> {
        if written.is_table() {
            let section = written.section()?;
            let path = section.required("file", "a file such as \"mine.toml\"").and_then(|file| self.path(file));
            section.close();
            let path = path?;
            let stem = Path::new(path).file_stem().map_or(path.into(), |stem| stem.to_string_lossy());
            return Ok(Some((path.to_owned(), stem.into_owned())));
        }
        let id = written.text()?.replace('-', "_");
        let known = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let own = format!("{folder}/{id}.toml");
        Ok((id.chars().all(known) && self.files.contains(&own)).then_some((own, id)))
    }

    fn shared(&self, key: &str, read: impl FnOnce() -> Read<Material>) -> Read<Arc<Material>> {
        if let Some((_, material)) = self.materials.borrow().iter().find(|(other, _)| other == key) {
            return Ok(material.clone());
        }
        let material = Arc::new(read()?);
        self.materials.borrow_mut().push((key.to_owned(), material.clone()));
        Ok(material)
    }

    /// The path of a file next to the case, which must exist.
    fn path<'w>(&self, written: Written<'w>) -> Read<&'w str> {
        let path = written.text()?;
        if self.files.contains(path) {
            return Ok(path);
        }
        Err(written.fault(format!("no such file: {}", self.files.label(path))))
    }

    fn document(&self, path: &str) -> Read<Node> {
        document(self.files.read(path), &self.files.label(path), self.diagnostics)
    }

    pub(super) fn sheet(&self, written: Written<'_>) -> Read<Sheet> {
        let path = self.path(written)?;
        Sheet::read(self.files.read(path), &self.files.label(path), self.diagnostics)
    }

    /// A column of a table file over time; `column` is optional if the file has only one besides time.
    pub(super) fn series(&self, file: Written<'_>, column: Option<Written<'_>>, dimension: Dimension) -> Read<Series> {
        let name = column.map(Written::text).transpose();
        let sheet = self.sheet(file)?;
        let index = column.unwrap_or(file).require(sheet.named(name?))?;
        sheet.series(index, dimension, true, self.diagnostics)
    }
}

/// A material of the built-in database.
pub(super) fn named_material(id: &str, diagnostics: &Faults) -> Read<Material> {
    match library::text(id) {
        Some((id, text)) => built_in_material(id, text, diagnostics),
        None => Err(diagnostics.record(&Place::whole(id), unknown_material(id))),
    }
}

/// A gas of the built-in database.
pub(super) fn named_gas(id: &str, diagnostics: &Faults) -> Read<Gas> {
    match library::gas_text(id) {
        Some((id, text)) => built_in_gas(id, text, diagnostics),
        None => Err(diagnostics.record(&Place::whole(id), unknown_gas(id))),
    }
}

fn unknown_material(id: &str) -> String {
    format!("unknown material {id:?}{}", suggestion(id, library::known()))
}

fn unknown_gas(id: &str) -> String {
    format!("unknown gas {id:?}{}", suggestion(id, library::known_gases()))
}

fn built_in_material(id: &str, text: &str, diagnostics: &Faults) -> Read<Material> {
    let root = Node::document(text, &format!("data/materials/{id}.toml"), diagnostics)?;
    material::material(root.read(diagnostics), id.to_owned())
}

fn built_in_gas(id: &str, text: &str, diagnostics: &Faults) -> Read<Gas> {
    let root = Node::document(text, &format!("data/gases/{id}.toml"), diagnostics)?;
    gas::gas(root.read(diagnostics), id.to_owned())
}
