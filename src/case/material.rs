//! A substance: its properties over temperature and pressure, each with where it came from.

use super::check::Field;
use super::conductivity::Conductivity;
use super::decomposition::{Decomposition, Pores, Residue};
use super::provenance::Provenance;
use super::table::Table;
use super::unit::Dimension;
use std::sync::Arc;

/// A substance.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Material {
    /// The file's name: `pyrogel3350`.
    pub id: String,
    /// What people call it.
    pub name: String,
    /// A sentence for the report; says `surrogate` where the real figures are not public.
    pub note: String,
    /// As made, kg/m³.
    pub density_kg_m3: f64,
    /// Of the density.
    pub density_provenance: Provenance,
    /// J/kg/K.
    pub heat_capacity: Table,
    /// Of the heat capacity.
    pub heat_capacity_provenance: Provenance,
    /// W/m/K.
    pub conductivity: Conductivity,
    /// Of the conductivity.
    pub conductivity_provenance: Provenance,
    /// Total hemispherical, 0 to 1.
    pub emissivity: Table,
    /// Of the emissivity.
    pub emissivity_provenance: Provenance,
    /// As made.
    pub pores: Pores,
    /// Of the pores; `None` where nobody knows how gas passes.
    pub pores_provenance: Option<Provenance>,
    /// `None` never changes.
    pub decomposition: Option<Decomposition>,
}

impl Material {
    /// The same substance, which never changes.
    pub(super) fn as_made(self: &Arc<Self>) -> Arc<Self> {
        match self.decomposition {
            Some(_) => Arc::new(Self { decomposition: None, ..Self::clone(self) }),
            None => self.clone(),
        }
    }

    /// Record what is wrong with each property.
    pub(super) fn check(&self, at: &Field<'_>) {
        at.not_blank("id", &self.id);
        at.positive("density_kg_m3", self.density_kg_m3);
        self.density_provenance.check(&at.field("density_provenance"));
        self.heat_capacity.check(&at.field("heat_capacity"), Dimension::HeatCapacity);
        self.heat_capacity_provenance.check(&at.field("heat_capacity_provenance"));
        self.conductivity.check(&at.field("conductivity"));
        self.conductivity_provenance.check(&at.field("conductivity_provenance"));
        self.emissivity.check(&at.field("emissivity"), Dimension::Fraction);
        self.emissivity_provenance.check(&at.field("emissivity_provenance"));
        self.pores.check(&at.field("pores"));
        if let Some(provenance) = &self.pores_provenance {
            provenance.check(&at.field("pores_provenance"));
        }
        if let Some(decomposition) = &self.decomposition {
            decomposition.check(&at.field("decomposition"));
        }
    }

    /// Its states by their names, `virgin` first, then its residues, each with its conductivity.
    pub fn conductivities(&self) -> impl Iterator<Item = (&str, &Conductivity)> {
        let residues = self.decomposition.iter().flat_map(|decomposition| &decomposition.residues);
        std::iter::once(("virgin", &self.conductivity))
            .chain(residues.map(|residue| (residue.name.as_str(), &residue.conductivity)))
    }

    /// How many times the virgin conductivity and heat capacity each of its states has, where all have so many times both at every
    /// temperature and pressure.
    pub fn multiples(&self) -> Option<Vec<[f64; 2]>> {
        let residues = self.decomposition.iter().flat_map(|decomposition| &decomposition.residues);
        let of = |residue: &Residue| {
            Some([residue.conductivity.times(&self.conductivity)?, residue.heat_capacity.times(&self.heat_capacity)?])
        };
        std::iter::once(Some([1.0; 2])).chain(residues.map(of)).collect()
    }
}
