//! The gas in the pores of a layup and its transport.

use super::decomposition::PyrolysisHeat;
use super::layup::{Layup, Ply};
use super::provenance::Provenance;
use super::table::{OutOfRange, Table};
use super::unit::Dimension;
use super::validation::FieldPath;
use std::sync::Arc;

/// Properties of a gas over temperature, at about the pressure of the case.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Gas {
    /// Name of its file: `pyrolysis`.
    pub id: String,
    /// Title.
    pub name: String,
    /// A sentence for the report.
    pub note: String,
    /// Molar mass, kg/mol.
    pub molar_mass: Table,
    /// Enthalpy, J/kg, strictly increasing; clamped or an error outside its range.
    pub enthalpy: Table,
    /// Whether the enthalpy is absolute (with the enthalpy of formation) or sensible.
    pub enthalpy_is_absolute: bool,
    /// Viscosity, Pa s.
    pub viscosity: Table,
    /// Provenance of all properties.
    pub provenance: Provenance,
}

impl Gas {
    /// Require an increasing enthalpy table without extrapolation.
    pub(super) fn check_enthalpy(table: &Table) -> Result<(), String> {
        // Extrapolation keeps a tenth of the end value as its floor, which is wrong for negative enthalpies.
        if table.outside == OutOfRange::Extrapolate {
            return Err("an enthalpy cannot be extrapolated: expected outside = \"clamp\" or \"error\"".to_owned());
        }
        match table.values.windows(2).position(|pair| pair[0] >= pair[1]) {
            Some(at) => Err(format!(
                "enthalpies must increase: {} J/kg at {} K follows {} J/kg",
                table.values[at + 1],
                table.temperatures_k[at + 1],
                table.values[at]
            )),
            None => Ok(()),
        }
    }

    fn check(&self, at: &FieldPath<'_>) {
        at.name("id", &self.id);
        at.one_line("name", &self.name);
        self.molar_mass.check(&at.child("molar_mass"), Dimension::MolarMass);
        let enthalpy = at.child("enthalpy");
        self.enthalpy.check(&enthalpy, Dimension::SpecificEnthalpy);
        enthalpy.require(Self::check_enthalpy(&self.enthalpy));
        self.viscosity.check(&at.child("viscosity"), Dimension::Viscosity);
        self.provenance.check(&at.child("provenance"));
    }
}

/// The gas of a case and its transport model.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct GasFlow {
    /// Transport model.
    pub model: GasFlowModel,
    /// The gas.
    pub gas: Arc<Gas>,
}

/// Models of gas transport.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub enum GasFlowModel {
    /// Pyrolysis gas leaves at the hot face at once, without heat exchange with the solid.
    Instantaneous,
    /// Pyrolysis gas flows to the hot face without storage, in thermal equilibrium with the solid (CMA, FIAT).
    QuasiSteady,
    /// Darcy's law with storage in the pores.
    Darcy,
}

/// Error for a back-face pressure without Darcy flow.
pub(super) const BACK_PRESSURE_NEEDS_DARCY: &str =
    "a back-face pressure needs Darcy flow: expected [gas] with `flow = \"darcy\"`";

/// Error for a blowing correction without gas.
pub(super) const BLOWING_NEEDS_GAS: &str =
    "blowing needs gas that leaves the layup: expected a ply that decomposes, or [gas]";

impl GasFlow {
    /// Require an absolute gas enthalpy if a ply has absolute enthalpies.
    pub(super) fn check_enthalpy_reference(gas: &Gas, layup: &Layup) -> Result<(), String> {
        let absolute = |ply: &&Ply| {
            let decomposition = ply.material.decomposition.as_ref();
            decomposition
                .is_some_and(|decomposition| matches!(decomposition.heat, PyrolysisHeat::AbsoluteEnthalpies { .. }))
        };
        match layup.plies.iter().find(absolute) {
            Some(ply) if !gas.enthalpy_is_absolute => Err(format!(
                "expected a gas with an absolute enthalpy such as \"tacot\", as ply {:?} has absolute enthalpies; gas \
                 {:?} has a sensible enthalpy",
                ply.name, gas.id
            )),
            _ => Ok(()),
        }
    }

    /// Require that the model fits the layup: a ply that decomposes, or the permeabilities of Darcy flow and a
    /// permeable way out for the gas of every ply that decomposes.
    pub(super) fn check_model(path: GasFlowModel, layup: &Layup, is_back_open: bool) -> Result<(), String> {
        let plies = &layup.plies;
        if path != GasFlowModel::Darcy {
            if plies.iter().any(Ply::decomposes) {
                return Ok(());
            }
            return Err("no ply decomposes: expected `decomposition = true`, or `flow = \"darcy\"`".to_owned());
        }
        if let Some(ply) = plies.iter().find(|ply| ply.material.pores_provenance.is_none()) {
            let (name, id) = (&ply.name, &ply.material.id);
            return Err(format!("Darcy flow needs the permeability of ply {name:?}: material {id:?} has no [pores]"));
        }
        let sealed_above = |index: usize| {
            let above = plies[..=index].iter().rev().find(|ply| is_impermeable(ply))?;
            let below = plies[index..].iter().find(|ply| is_impermeable(ply));
            (!is_back_open || below.is_some()).then_some(above)
        };
        let mut decomposing_plies = plies.iter().enumerate().filter(|(_, ply)| ply.decomposes());
        let Some((ply, above)) =
            decomposing_plies.find_map(|(index, ply)| Some((&ply.name, &sealed_above(index)?.name)))
        else {
            return Ok(());
        };
        let front = if ply == above {
            "the ply is impermeable".to_owned()
        } else {
            format!("ply {above:?} above it is impermeable")
        };
        let back = if is_back_open { "so is the way to the open back face" } else { "the back face is sealed" };
        Err(format!("the gas of ply {ply:?} cannot leave the layup: {front}, and {back}"))
    }

    /// Record all errors of the gas and its transport in a layup.
    pub(super) fn check(&self, at: &FieldPath<'_>, layup: &Layup, is_back_open: bool) {
        let gas = at.child("gas");
        self.gas.check(&gas);
        gas.require(Self::check_enthalpy_reference(&self.gas, layup));
        at.child("model").require(Self::check_model(self.model, layup, is_back_open));
    }
}

/// Whether the virgin material or a residue of a ply is impermeable.
fn is_impermeable(ply: &Ply) -> bool {
    let mut residues = ply.material.decomposition.iter().flat_map(|decomposition| &decomposition.residues);
    ply.material.pores.permeability_m2 == 0.0 || residues.any(|residue| residue.pores.permeability_m2 == 0.0)
}
