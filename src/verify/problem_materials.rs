//! Decomposing and porous materials of the verification problems.

use super::exact::kinetics::Arrhenius;
use super::problem::provenance;
use crate::case::{
    Conductivity, Decomposition, Gas, Material, MixtureRule, Pores, PyrolysisHeat, Reaction, ReactionScheme, Residue,
    Table,
};
use std::sync::Arc;

/// A reaction that turns a share of the virgin mass into gas and absorbs heat, J per kg of gas.
pub(super) fn reaction(loss: f64, arrhenius: Arrhenius, heat_j_kg: f64) -> Reaction {
    let Arrhenius { rate_1_s, activation_energy_j_mol, order, onset_k } = arrhenius;
    Reaction {
        mass_loss: loss,
        pre_exponential_1_s: rate_1_s,
        activation_energy_j_mol,
        order,
        onset_temperature_k: onset_k,
        heat_j_kg,
    }
}

/// A residue with the properties of the virgin material.
pub(super) fn unchanged_residue(virgin: &Material) -> Residue {
    Residue {
        name: "char".to_owned(),
        heat_capacity: virgin.heat_capacity.clone(),
        conductivity: virgin.conductivity.clone(),
        emissivity: virgin.emissivity.clone(),
        pores: virgin.pores,
    }
}

/// Reactions with their heats and residues, mixed by mass, without shrinkage.
pub(super) fn decomposition(
    sequence: ReactionScheme,
    reactions: Vec<Reaction>,
    residues: Vec<Residue>,
) -> Decomposition {
    Decomposition {
        reactions,
        scheme: sequence,
        residues,
        mixture_rule: MixtureRule::MassFractions,
        heat: PyrolysisHeat::HeatsOfReaction,
        shrinkage: 0.0,
        provenance: provenance(),
    }
}

/// The material with pores.
pub(super) fn with_pores(material: &Material, pores: Pores) -> Material {
    Material { pores, pores_provenance: Some(provenance()), ..material.clone() }
}

/// The material with a decomposition.
pub(super) fn with_decomposition(virgin: &Material, decomposition: Decomposition) -> Arc<Material> {
    Arc::new(Material { decomposition: Some(decomposition), ..virgin.clone() })
}

/// A gas by its molar mass (kg/mol), enthalpy (J/kg) and viscosity (Pa s).
pub(super) fn gas(molar_mass: Table, enthalpy: Table, viscosity: Table) -> Arc<Gas> {
    Arc::new(Gas {
        id: "reference".to_owned(),
        name: "reference".to_owned(),
        note: String::new(),
        molar_mass,
        enthalpy,
        enthalpy_is_absolute: true,
        viscosity,
        provenance: provenance(),
    })
}

/// A gas of 22 g/mol and 30 µPa s with a constant heat capacity, J/kg/K.
pub(super) fn constant_gas(heat_capacity_j_kg_k: f64) -> Arc<Gas> {
    gas(Table::constant(0.022), linear_enthalpy(heat_capacity_j_kg_k), Table::constant(3e-5))
}

/// Enthalpy of a constant heat capacity, zero at 0 K.
pub(super) fn linear_enthalpy(heat_capacity_j_kg_k: f64) -> Table {
    super::problem::clamped_table(vec![0.0, 4000.0], vec![0.0, 4000.0 * heat_capacity_j_kg_k])
}

/// A conductivity that does not depend on pressure.
pub(super) fn pressure_independent(conductivity: Table) -> Conductivity {
    Conductivity::Tables(vec![(101_325.0, conductivity)])
}
