//! Variants of a case: other materials of its plies, and the exposure of another case.

use super::error::CaseError;
use super::exposure::{Emissivity, Face};
use super::input_files::InputFiles;
use super::library::is_same_name;
use super::{Case, Conductivity, EstimationSettings, Material};
use std::sync::Arc;

impl Case {
    /// The plies of a group, or the one of this name.
    pub(crate) fn plies_of(&self, group: &str) -> Vec<usize> {
        let plies = &self.layup.plies;
        (0..plies.len()).filter(|&ply| plies[ply].belongs_to(group)).collect()
    }

    /// A material by its id: of a ply of this case, else of a file beside it, else of the database.
    ///
    /// # Errors
    /// The id is unknown, several files of the case have it, or its file has errors.
    pub(crate) fn material_named(&self, id: &str) -> Result<Arc<Material>, String> {
        let plies = self.layup.plies.iter().map(|ply| &ply.material);
        if let Some(own) = plies.into_iter().find(|own| is_same_name(&own.id, id)) {
            return Ok(own.clone());
        }
        let unused = &self.reading_notes.materials.unused;
        match unused.iter().filter(|own| is_same_name(&own.name, id)).collect::<Vec<_>>()[..] {
            [] => Material::named(id).map(Arc::new).map_err(|error| error.to_string()),
            [own] => own.read.as_ref().map(|(material, _)| material.clone()).map_err(Clone::clone),
            [one, other, ..] => Err(format!(
                "{} and {} have one name: - equals _, and capital letters equal small ones",
                one.path, other.path
            )),
        }
    }

    /// The case with other materials of some plies, and with their files. They are inert if all plies of the case are.
    ///
    /// # Errors
    /// All errors of the case with these materials.
    pub(crate) fn with_materials(&self, materials: &[(Vec<usize>, Arc<Material>)]) -> Result<Self, CaseError> {
        let is_inert = !self.layup.plies.iter().any(super::Ply::decomposes);
        let mut builder = self.to_builder();
        for (plies, material) in materials {
            let material = if is_inert { material.without_decomposition() } else { material.clone() };
            plies.iter().for_each(|&ply| builder.layup.plies[ply].material = material.clone());
        }
        let mut input_files = self.input_files.clone();
        let unused = self.reading_notes.materials.unused.iter().filter_map(|own| own.read.as_ref().ok());
        let chosen = unused.filter(|(own, _)| materials.iter().any(|(_, material)| material.id == own.id));
        input_files.files.extend(chosen.map(|(_, file)| file.clone()));
        Ok(Self { input_files, ..builder.build()? })
    }

    /// The case under the exposure of another case, at its resolution and without observations.
    ///
    /// # Errors
    /// All errors of the case under that exposure.
    pub(crate) fn with_exposure_of(&self, other: &Self) -> Result<Self, CaseError> {
        let mut builder = self.to_builder();
        builder.id.clone_from(&other.id);
        builder.exposure = other.exposure.clone();
        builder.resolution = other.resolution;
        builder.observations = Vec::new();
        builder.estimate = EstimationSettings::default();
        let files = self.input_files.files.iter().chain(&other.input_files.files).cloned().collect();
        let input_files = InputFiles { files, overrides: self.input_files.overrides.clone() };
        Ok(Self { input_files, ..builder.build()? })
    }

    /// The properties of a ply that affect a march, with the range of the table of each, K.
    pub(crate) fn table_ranges_k(&self, ply: usize) -> Vec<(&'static str, (f64, f64))> {
        let material = &self.layup.plies[ply].material;
        let conductivity = match &material.conductivity {
            Conductivity::Tables(tables) => tables
                .iter()
                .map(|(_, table)| table.range_k())
                .reduce(|a, b| (a.0.max(b.0), a.1.min(b.1)))
                .unwrap_or((f64::NEG_INFINITY, f64::INFINITY)),
            Conductivity::ThreePart(parts) => parts.range_k,
        };
        let mut known = vec![("conductivity", conductivity), ("heat capacity", material.heat_capacity.range_k())];
        if self.radiates(ply) {
            known.push(("emissivity", material.emissivity.range_k()));
        }
        known
    }

    /// Whether a ply has a face that radiates with the emissivity of its material.
    pub(crate) fn radiates(&self, ply: usize) -> bool {
        let radiates = |face: &Face| matches!(face, Face::Open(open) if open.emissivity == Emissivity::Material);
        let (is_hot, is_back) = (ply == 0, ply + 1 == self.layup.plies.len());
        (is_hot && radiates(&self.exposure.hot_face)) || (is_back && radiates(&self.exposure.back_face))
    }
}
