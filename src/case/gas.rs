//! The gas that flows through a layup, and how it leaves.

use super::check::Field;
use super::decomposition::PyrolysisHeat;
use super::layup::{Layup, Ply};
use super::provenance::Provenance;
use super::table::{OutOfRange, Table};
use super::unit::Dimension;
use std::sync::Arc;

/// Properties of the gas that flows, at about the pressure of the case.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Gas {
    /// The file's name: `pyrolysis`.
    pub id: String,
    /// What people call it.
    pub name: String,
    /// A sentence for the report.
    pub note: String,
    /// kg/mol.
    pub molar_mass: Table,
    /// Strictly rising, clamped or refused outside of its range, J/kg.
    pub enthalpy: Table,
    /// Whether the enthalpy counts from the elements, as that of the solid it is made of; else it is sensible, from any level.
    pub enthalpy_is_absolute: bool,
    /// Pa s.
    pub viscosity: Table,
    /// Of all properties.
    pub provenance: Provenance,
}

impl Gas {
    /// That a table can be the enthalpy of a gas.
    pub(super) fn check_enthalpy(table: &Table) -> Result<(), String> {
        // Held in its ends or refused beyond them: a line continued has a floor that is of no use below zero.
        if table.outside == OutOfRange::Extrapolate {
            return Err("an enthalpy cannot be extrapolated: expected clamp or error".to_owned());
        }
        match table.values.windows(2).position(|pair| pair[0] >= pair[1]) {
            Some(at) => Err(format!("the enthalpy does not rise up to {} K", table.temperatures_k[at + 1])),
            None => Ok(()),
        }
    }

    fn check(&self, at: &Field<'_>) {
        at.not_blank("id", &self.id);
        self.molar_mass.check(&at.field("molar_mass"), Dimension::MolarMass);
        let enthalpy = at.field("enthalpy");
        self.enthalpy.check(&enthalpy, Dimension::SpecificEnthalpy);
        enthalpy.require(Self::check_enthalpy(&self.enthalpy));
        self.viscosity.check(&at.field("viscosity"), Dimension::Viscosity);
        self.provenance.check(&at.field("provenance"));
    }
}

/// How the gas made in a layup leaves it.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct GasFlow {
    /// Its way out.
    pub path: GasPath,
    /// What flows.
    pub gas: Arc<Gas>,
}

/// Ways out for gas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum GasPath {
    /// Straight to the hot face, exchanging no heat on its way.
    Unhindered,
    /// All gas made below a depth flows through it to the hot face as it is made (CMA, FIAT).
    QuasiSteady,
    /// By Darcy's law, stored on its way.
    Darcy,
}

/// Why a back face without Darcy's law has no pressure.
pub(super) const UNDRIVEN: &str = "a pressure drives gas by Darcy's law alone: expected [gas] with `flow = \"darcy\"`";

/// Why a flux without gas is not blown off.
pub(super) const UNBLOWN: &str = "no gas leaves the layup, which alone reduces a flux";

impl GasFlow {
    /// That the enthalpy of a gas counts from the level of every solid that it is made of.
    pub(super) fn check_level(gas: &Gas, layup: &Layup) -> Result<(), String> {
        let absolute = |ply: &&Ply| {
            let decomposition = ply.material.decomposition.as_ref();
            decomposition.is_some_and(|decomposition| matches!(decomposition.heat, PyrolysisHeat::Absolute { .. }))
        };
        match layup.plies.iter().find(absolute) {
            Some(ply) if !gas.enthalpy_is_absolute => Err(format!(
                "gas {:?} has a sensible enthalpy, ply {:?} has absolute ones: expected a gas such as \"tacot\"",
                gas.id, ply.name
            )),
            _ => Ok(()),
        }
    }

    /// That gas can take a path out of a layup, whose back face lets gas through or not.
    pub(super) fn check_path(path: GasPath, layup: &Layup, is_back_open: bool) -> Result<(), String> {
        let plies = &layup.plies;
        if path != GasPath::Darcy {
            if plies.iter().any(Ply::makes_gas) {
                return Ok(());
            }
            return Err("no ply makes gas: expected `decomposition = true`, or `flow = \"darcy\"`".to_owned());
        }
        if let Some(ply) = plies.iter().find(|ply| ply.material.pores_provenance.is_none()) {
            let (name, id) = (&ply.name, &ply.material.id);
            return Err(format!("nobody knows how gas passes ply {name:?}: {id:?} has no [pores]"));
        }
        let shut_in = |index: usize| {
            let above = plies[..=index].iter().rev().find(|ply| is_sealed(ply))?;
            let below = plies[index..].iter().find(|ply| is_sealed(ply));
            (!is_back_open || below.is_some()).then_some(above)
        };
        let mut makes_gas = plies.iter().enumerate().filter(|(_, ply)| ply.makes_gas());
        let Some((ply, above)) = makes_gas.find_map(|(index, ply)| Some((&ply.name, &shut_in(index)?.name))) else {
            return Ok(());
        };
        let shut = if ply == above {
            "nothing passes it".to_owned()
        } else {
            format!("nothing passes ply {above:?} above it")
        };
        let back = if is_back_open { "the back is no way out either" } else { "the back is sealed" };
        Err(format!("ply {ply:?} makes gas that has no way out: {shut}, and {back}"))
    }

    /// Record what is wrong with the gas and its way out of a layup.
    pub(super) fn check(&self, at: &Field<'_>, layup: &Layup, is_back_open: bool) {
        let gas = at.field("gas");
        self.gas.check(&gas);
        gas.require(Self::check_level(&self.gas, layup));
        at.field("path").require(Self::check_path(self.path, layup, is_back_open));
    }
}

/// Whether a ply lets nothing through, as made or as char.
fn is_sealed(ply: &Ply) -> bool {
    let mut residues = ply.material.decomposition.iter().flat_map(|decomposition| &decomposition.residues);
    ply.material.pores.permeability_m2 == 0.0 || residues.any(|residue| residue.pores.permeability_m2 == 0.0)
}
