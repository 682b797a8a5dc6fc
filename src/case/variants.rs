//! Variants of a case: other materials of its plies, and the exposure of another case.

use super::error::CaseError;
use super::exposure::{Emissivity, Face};
use super::gas::GasFlowModel;
use super::input_files::InputFiles;
use super::layup::Ply;
use super::library::is_same_name;
use super::{Case, Conductivity, EstimationSettings, Material, Table};
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
        let is_inert = !self.layup.plies.iter().any(Ply::decomposes);
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

    /// The properties of a ply that affect a march, with the range of the table of each, K. Those of its residues that
    /// end elsewhere have no lower end, as a residue is made in heat.
    pub(crate) fn table_ranges_k(&self, ply: usize) -> Vec<(String, (f64, f64))> {
        let material = &self.layup.plies[ply].material;
        let of = |conductivity: &Conductivity, heat_capacity: &Table, emissivity: &Table| {
            let ranges_k = [conductivity.range_k(), heat_capacity.range_k(), emissivity.range_k()];
            let named = ["conductivity", "heat capacity", "emissivity"].into_iter().zip(ranges_k);
            named.take(if self.radiates(ply) { 3 } else { 2 }).collect::<Vec<_>>()
        };
        let virgin = of(&material.conductivity, &material.heat_capacity, &material.emissivity);
        let residues = material.decomposition.iter().flat_map(|decomposition| &decomposition.residues);
        let residues = residues.flat_map(|residue| {
            let own = of(&residue.conductivity, &residue.heat_capacity, &residue.emissivity);
            let differing = own.into_iter().zip(&virgin).filter(|(own, virgin)| own.1.1 != virgin.1.1);
            differing.map(|((property, (_, end_k)), _)| {
                (format!("{property} of {}", residue.name), (f64::NEG_INFINITY, end_k))
            })
        });
        let virgin = virgin.iter().map(|&(property, range_k)| (property.to_owned(), range_k));
        let gas =
            self.gas_tables(ply).into_iter().map(|(property, table)| (format!("{property} of gas"), table.range_k()));
        virgin.chain(residues).chain(gas).collect()
    }

    /// The properties of the gas in a ply that affect a march. Quasi-steady gas needs only its enthalpy, in the plies
    /// that it crosses on its way to the hot face; Darcy's law needs all properties in all plies.
    pub(crate) fn gas_tables(&self, ply: usize) -> Vec<(&'static str, &Table)> {
        let Some(flow) = &self.gas else { return Vec::new() };
        let gas = &flow.gas;
        let mut known = vec![("enthalpy", &gas.enthalpy)];
        if flow.model == GasFlowModel::Darcy {
            known.extend([("viscosity", &gas.viscosity), ("molar mass", &gas.molar_mass)]);
        } else if !self.layup.plies[ply..].iter().any(Ply::decomposes) {
            known.clear();
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
