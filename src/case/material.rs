//! A material: its properties over temperature and pressure, each with its provenance.

use super::conductivity::Conductivity;
use super::decomposition::{Decomposition, Pores, Residue};
use super::library::is_same_name;
use super::provenance::Provenance;
use super::table::Table;
use super::unit::Dimension;
use super::validation::FieldPath;
use std::sync::Arc;

/// A material.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Material {
    /// Name of its file: `pyrogel3350`.
    pub id: String,
    /// Title.
    pub name: String,
    /// A sentence for the report; says `surrogate` if the properties of the real material are not public.
    pub note: String,
    /// Virgin density, kg/m³.
    pub density_kg_m3: f64,
    /// Provenance of the density.
    pub density_provenance: Provenance,
    /// Virgin heat capacity, J/kg/K.
    pub heat_capacity: Table,
    /// Provenance of the heat capacity.
    pub heat_capacity_provenance: Provenance,
    /// Virgin conductivity, W/m/K.
    pub conductivity: Conductivity,
    /// Provenance of the conductivity.
    pub conductivity_provenance: Provenance,
    /// Virgin total hemispherical emissivity, 0 to 1.
    pub emissivity: Table,
    /// Provenance of the emissivity.
    pub emissivity_provenance: Provenance,
    /// Virgin porosity and permeability.
    pub pores: Pores,
    /// Provenance of the pores; `None` if the permeability is unknown.
    pub pores_provenance: Option<Provenance>,
    /// Thermal decomposition; `None` for an inert material.
    pub decomposition: Option<Decomposition>,
}

impl Material {
    /// Whether the note calls it a surrogate of a material whose properties are not public.
    pub fn is_surrogate(&self) -> bool {
        self.note.to_lowercase().contains("surrogate")
    }

    /// The same material without its decomposition.
    pub(super) fn without_decomposition(self: &Arc<Self>) -> Arc<Self> {
        match self.decomposition {
            Some(_) => Arc::new(Self { decomposition: None, ..Self::clone(self) }),
            None => self.clone(),
        }
    }

    /// Whether another material has its name, and other properties. That one of them may not decompose is a choice of
    /// its ply.
    pub(super) fn is_other_of_one_name(self: &Arc<Self>, other: &Arc<Self>) -> bool {
        is_same_name(&self.id, &other.id)
            && !Arc::ptr_eq(self, other)
            && self.without_decomposition() != other.without_decomposition()
    }

    /// Record all errors of the properties.
    pub(super) fn check(&self, at: &FieldPath<'_>) {
        at.name("id", &self.id);
        at.one_line("name", &self.name);
        at.child("density_kg_m3").require(Table::checked_value(self.density_kg_m3, Dimension::Density));
        self.density_provenance.check(&at.child("density_provenance"));
        self.heat_capacity.check(&at.child("heat_capacity"), Dimension::HeatCapacity);
        self.heat_capacity_provenance.check(&at.child("heat_capacity_provenance"));
        self.conductivity.check(&at.child("conductivity"));
        self.conductivity_provenance.check(&at.child("conductivity_provenance"));
        self.emissivity.check(&at.child("emissivity"), Dimension::Fraction);
        self.emissivity_provenance.check(&at.child("emissivity_provenance"));
        self.pores.check(&at.child("pores"));
        if let Some(provenance) = &self.pores_provenance {
            provenance.check(&at.child("pores_provenance"));
        }
        if let Some(decomposition) = &self.decomposition {
            decomposition.check(&at.child("decomposition"));
        }
    }

    /// The names of its states, `virgin` and then the residues, each with its conductivity.
    pub fn state_conductivities(&self) -> impl Iterator<Item = (&str, &Conductivity)> {
        let residues = self.decomposition.iter().flat_map(|decomposition| &decomposition.residues);
        std::iter::once(("virgin", &self.conductivity))
            .chain(residues.map(|residue| (residue.name.as_str(), &residue.conductivity)))
    }

    /// Conductivity and heat capacity of each state relative to the virgin material, if these ratios are constant over
    /// temperature and pressure.
    pub fn state_ratios(&self) -> Option<Vec<[f64; 2]>> {
        let residues = self.decomposition.iter().flat_map(|decomposition| &decomposition.residues);
        let of = |residue: &Residue| {
            Some([
                residue.conductivity.constant_ratio_to(&self.conductivity)?,
                residue.heat_capacity.constant_ratio_to(&self.heat_capacity)?,
            ])
        };
        std::iter::once(Some([1.0; 2])).chain(residues.map(of)).collect()
    }
}
