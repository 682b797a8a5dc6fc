//! What a case refers to: files beside it, and the database of materials and gases that is built in.

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

/// Finds what a case refers to.
pub(super) struct References<'a> {
    files: &'a dyn Files,
    faults: &'a Faults,
    /// Materials met so far, so that plies of one material share it.
    materials: RefCell<Vec<(String, Arc<Material>)>>,
}

impl<'a> References<'a> {
    pub(super) fn new(files: &'a dyn Files, faults: &'a Faults) -> Self {
        Self { files, faults, materials: RefCell::default() }
    }

    /// `"pyrogel3350"`: of `materials/pyrogel3350.toml` beside the case where there is one, else of the database that is
    /// built in; or `{ file = "mine.toml" }`.
    pub(super) fn material(&self, written: Written<'_>) -> Read<Arc<Material>> {
        if let Some((path, id)) = self.own(written, "materials")? {
            return self
                .shared(&self.files.label(&path), || material::material(self.document(&path)?.read(self.faults), id));
        }
        let id = written.text()?;
        let (id, text) = written.require(library::text(id).ok_or_else(|| unknown_material(id)))?;
        self.shared(id, || built_in_material(id, text, self.faults))
    }

    /// As a material, its folder `gases`.
    pub(super) fn gas(&self, written: Written<'_>) -> Read<Gas> {
        if let Some((path, id)) = self.own(written, "gases")? {
            return gas::gas(self.document(&path)?.read(self.faults), id);
        }
        let id = written.text()?;
        let (id, text) = written.require(library::gas_text(id).ok_or_else(|| unknown_gas(id)))?;
        built_in_gas(id, text, self.faults)
    }

    /// The gas that a case has which names none.
    pub(super) fn default_gas(&self, id: &str) -> Read<Gas> {
        named_gas(id, self.faults)
    }

    /// The path and the id of what lies beside the case; `None` of what can only be built in.
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

    /// The path of a file beside the case, which must be there.
    fn path<'w>(&self, written: Written<'w>) -> Read<&'w str> {
        let path = written.text()?;
        if self.files.contains(path) {
            return Ok(path);
        }
        Err(written.fault(format!("no such file: {}", self.files.label(path))))
    }

    fn document(&self, path: &str) -> Read<Node> {
        document(self.files.read(path), &self.files.label(path), self.faults)
    }

    pub(super) fn sheet(&self, written: Written<'_>) -> Read<Sheet> {
        let path = self.path(written)?;
        Sheet::read(self.files.read(path), &self.files.label(path), self.faults)
    }

    /// A column of a file over time; the column may be left out of a file of two.
    pub(super) fn series(&self, file: Written<'_>, column: Option<Written<'_>>, dimension: Dimension) -> Read<Series> {
        let name = column.map(Written::text).transpose();
        let sheet = self.sheet(file)?;
        let index = column.unwrap_or(file).require(sheet.named(name?))?;
        sheet.series(index, dimension, true, self.faults)
    }
}

/// The material of a name of the database that is built in.
pub(super) fn named_material(id: &str, faults: &Faults) -> Read<Material> {
    match library::text(id) {
        Some((id, text)) => built_in_material(id, text, faults),
        None => Err(faults.record(&Place::whole(id), unknown_material(id))),
    }
}

/// The gas of a name of the database that is built in.
pub(super) fn named_gas(id: &str, faults: &Faults) -> Read<Gas> {
    match library::gas_text(id) {
        Some((id, text)) => built_in_gas(id, text, faults),
        None => Err(faults.record(&Place::whole(id), unknown_gas(id))),
    }
}

fn unknown_material(id: &str) -> String {
    format!("unknown material {id:?}{}", suggestion(id, library::known()))
}

fn unknown_gas(id: &str) -> String {
    format!("unknown gas {id:?}{}", suggestion(id, library::known_gases()))
}

fn built_in_material(id: &str, text: &str, faults: &Faults) -> Read<Material> {
    let root = Node::document(text, &format!("data/materials/{id}.toml"), faults)?;
    material::material(root.read(faults), id.to_owned())
}

fn built_in_gas(id: &str, text: &str, faults: &Faults) -> Read<Gas> {
    let root = Node::document(text, &format!("data/gases/{id}.toml"), faults)?;
    gas::gas(root.read(faults), id.to_owned())
}
