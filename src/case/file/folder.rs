//! Where a case looks for the files that it names: beside itself, then in the database that is built in.

use super::nearest::suggestion;
use super::sheet::{Series, Sheet};
use super::written::{Node, Written};
use super::{document, gas, id, material};
use crate::case::error::{Faults, Read};
use crate::case::unit::Dimension;
use crate::case::{Material, library};
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Where a case looks for the files that it names.
pub(super) struct Folder<'a> {
    pub(super) path: &'a Path,
    pub(super) faults: &'a Faults,
    /// Materials met so far, so that plies of one material share it.
    pub(super) materials: RefCell<Vec<(String, Arc<Material>)>>,
}

impl Folder<'_> {
    /// `"pyrogel3350"`: of `materials/pyrogel3350.toml` beside the case where there is one, else of the database that is
    /// built in; or `{ file = "mine.toml" }`.
    pub(super) fn material(&self, written: Written<'_>) -> Read<Arc<Material>> {
        if let Some((file, id)) = self.own(written, "materials")? {
            return self.shared(&file.display().to_string(), || {
                material::material(document(&file, self.faults)?.read(self.faults), id)
            });
        }
        let id = written.text()?;
        let (id, text) = library::text(id).ok_or_else(|| written.fault(unknown_material(id)))?;
        self.shared(id, || shipped(id, text, self.faults))
    }

    /// As a material, its folder `gases`.
    pub(super) fn gas(&self, written: Written<'_>) -> Read<gas::Filed> {
        if let Some((file, id)) = self.own(written, "gases")? {
            return gas::filed(document(&file, self.faults)?.read(self.faults), id);
        }
        let id = written.text()?;
        let (id, text) = library::gas_text(id).ok_or_else(|| written.fault(unknown_gas(id)))?;
        shipped_gas(id, text, self.faults)
    }

    /// The file and the id of what lies beside the case; `None` of what can only be built in.
    fn own(&self, written: Written<'_>, folder: &str) -> Read<Option<(PathBuf, String)>> {
        if written.is_table() {
            let section = written.section()?;
            let file = section.required("file", "a file such as \"mine.toml\"").and_then(|file| self.file(file));
            section.close();
            let file = file?;
            let id = id(&file);
            return Ok(Some((file, id)));
        }
        let id = written.text()?.replace('-', "_");
        let known = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let own = self.path.join(folder).join(format!("{id}.toml"));
        Ok((id.chars().all(known) && own.is_file()).then_some((own, id)))
    }

    fn shared(&self, key: &str, read: impl FnOnce() -> Read<Material>) -> Read<Arc<Material>> {
        if let Some((_, material)) = self.materials.borrow().iter().find(|(other, _)| other == key) {
            return Ok(material.clone());
        }
        let material = Arc::new(read()?);
        self.materials.borrow_mut().push((key.to_owned(), material.clone()));
        Ok(material)
    }

    /// A file beside the case, which must be there.
    fn file(&self, written: Written<'_>) -> Read<PathBuf> {
        let path = self.path.join(written.text()?);
        if path.is_file() { Ok(path) } else { Err(written.fault(format!("no such file: {}", path.display()))) }
    }

    pub(super) fn sheet(&self, written: Written<'_>) -> Read<Sheet> {
        Sheet::read(&self.file(written)?, self.faults)
    }

    /// A column of a file over time; the column may be left out of a file of two.
    pub(super) fn series(&self, file: Written<'_>, column: Option<Written<'_>>, dimension: Dimension) -> Read<Series> {
        let name = column.map(Written::text).transpose();
        let sheet = self.sheet(file)?;
        let index = sheet.named(name?).map_err(|message| column.unwrap_or(file).fault(message))?;
        sheet.series(index, dimension, true, self.faults)
    }
}

pub(super) fn unknown_material(id: &str) -> String {
    format!("unknown material {id:?}{}", suggestion(id, library::known()))
}

pub(super) fn unknown_gas(id: &str) -> String {
    format!("unknown gas {id:?}{}", suggestion(id, library::known_gases()))
}

pub(super) fn shipped(id: &str, text: &str, faults: &Faults) -> Read<Material> {
    let root = Node::document(text, &format!("data/materials/{id}.toml"), faults)?;
    material::material(root.read(faults), id.to_owned())
}

pub(super) fn shipped_gas(id: &str, text: &str, faults: &Faults) -> Read<gas::Filed> {
    let root = Node::document(text, &format!("data/gases/{id}.toml"), faults)?;
    gas::filed(root.read(faults), id.to_owned())
}
