//! Ply rows: properties of the states, reactions and factor columns.

use super::factor_columns::factor_column;
use super::tables::{conductivity_parts_of, integral_to, pores_of, pressure_levels_pa, state_count, tabulated_states};
use crate::case::GAS_CONSTANT_J_MOL_K;
use crate::case::{self, Case, Material, MixtureRule, Pores, Property, PyrolysisHeat, ReactionScheme, Table};
use crate::physics::layout::{BulkProperties, Ply, Reaction, ReactionPath, StateProperties};

/// The ply rows, given the cell range of each ply.
pub(super) fn ply_rows(case: &Case, cells: &[(usize, usize)]) -> Vec<Ply<u32>> {
    let (mut state, mut reaction, mut level) = (0, 0, 0);
    let mut above: Option<&str> = None;
    let cut = case.layup.plies.iter().zip(cells);
    cut.map(|(ply, &(first, end))| {
        let of = |property| factor_column(case, &ply.name, property);
        let levels = pressure_levels_pa(case, ply).len();
        let has_pores = pores_of(case, ply).iter().any(|pores| !pores.is_empty());
        let (states, reactions) = (state_count(&ply.material), reaction_paths(&ply.material).len());
        let row = Ply {
            first_cell: first as u32,
            end_cell: end as u32,
            states: states as u32,
            rows: tabulated_states(&ply.material) as u32,
            parts: conductivity_parts_of(case, ply) as u32,
            same_material_above: u32::from(above == Some(&ply.material.id)),
            first_level: level as u32,
            levels: levels as u32,
            depends_on_pressure: u32::from(levels > 1 || has_pores),
            first_state: state as u32,
            first_reaction: reaction as u32,
            end_reaction: (reaction + reactions) as u32,
            heat_capacity: of(Property::HeatCapacity),
            density: of(Property::Density),
            thickness: of(Property::Thickness),
            pre_exponential: of(Property::PreExponential),
            activation: of(Property::ActivationEnergy),
            pyrolysis_heat: of(Property::PyrolysisHeat),
            char_yield: of(Property::CharYield),
            permeability: of(Property::Permeability),
            holder: factor_column(case, "", Property::HolderLoss),
            contact: of(Property::ContactConductance),
        };
        (state, reaction, level) = (state + states, reaction + reactions, level + levels);
        above = Some(&ply.material.id);
        row
    })
    .collect()
}

/// The states that each reaction of a material consumes and produces: side by side from virgin to char, or in a chain.
pub(super) fn reaction_paths(material: &Material) -> Vec<ReactionPath<u32>> {
    let Some(decomposition) = &material.decomposition else { return vec![] };
    let places = 0..decomposition.reactions.len() as u32;
    places
        .map(|place| match decomposition.scheme {
            ReactionScheme::Parallel => ReactionPath { source: 0, product: 1 },
            ReactionScheme::Consecutive => ReactionPath { source: place, product: place + 1 },
        })
        .collect()
}

pub(super) fn bulk_properties(material: &Material, holder_w_m3_k: f64) -> BulkProperties<f64> {
    let density_kg_m3 = material.density_kg_m3;
    let inert = BulkProperties { density_kg_m3, shrinkage: 0.0, by_volume: 0.0, absolute: 0.0, holder_w_m3_k };
    let flag = |is: bool| f64::from(u8::from(is));
    material.decomposition.as_ref().map_or(inert, |decomposition| BulkProperties {
        shrinkage: decomposition.shrinkage,
        by_volume: flag(decomposition.mixture_rule == MixtureRule::VolumeFractions),
        absolute: flag(matches!(decomposition.heat, PyrolysisHeat::AbsoluteEnthalpies { .. })),
        ..inert
    })
}

pub(super) fn state_properties(material: &Material) -> Vec<StateProperties<f64>> {
    let multiples = material.state_ratios().unwrap_or_else(|| vec![[1.0; 2]; state_count(material)]);
    let row = |state: usize, remains: f64, pores: &Pores| StateProperties {
        remains,
        porosity: pores.porosity,
        permeability_m2: pores.permeability_m2,
        slip_pa_k: pores.slip_pa_k,
        forchheimer_1_m: pores.forchheimer_1_m,
        formation_j_kg: 0.0,
        conductivity: multiples[state][0],
        heat_capacity: multiples[state][1],
    };
    // The enthalpy in the tables is zero at their start.
    let over = |heat_capacity: &Table, stated_j_kg: f64, reference_k: f64| {
        stated_j_kg - integral_to(heat_capacity, reference_k)
    };
    let mut rows = vec![row(0, 1.0, &material.pores)];
    if let Some(decomposition) = &material.decomposition {
        let remains = decomposition.residue_densities_kg_m3(1.0);
        for (residue, remains) in decomposition.residues.iter().zip(remains) {
            rows.push(row(rows.len(), remains, &residue.pores));
        }
        if let PyrolysisHeat::AbsoluteEnthalpies { virgin_j_kg, residues_j_kg, reference_k } = &decomposition.heat {
            rows[0].formation_j_kg = over(&material.heat_capacity, *virgin_j_kg, *reference_k);
            for ((row, residue), stated_j_kg) in rows[1..].iter_mut().zip(&decomposition.residues).zip(residues_j_kg) {
                row.formation_j_kg = over(&residue.heat_capacity, *stated_j_kg, *reference_k);
            }
        }
    }
    rows
}

/// Largest converted share of the reactant over a whole march for which a reaction is skipped, for the fastest rates
/// that the bounds of a factor allow. A factor on activation energies shifts the threshold in the march.
const NEGLIGIBLE_CONVERSION: f64 = 1e-9;

pub(super) fn reactions(case: &Case, ply: &case::Ply, duration_s: f64) -> Vec<Reaction<f64>> {
    let Some(decomposition) = &ply.material.decomposition else { return vec![] };
    let fastest = match factor_column(case, &ply.name, Property::PreExponential) {
        0 => 1.0,
        column => case.factors[column as usize - 1].widest_bounds().1,
    };
    let total = decomposition.mass_loss();
    let is_chain = decomposition.scheme == ReactionScheme::Consecutive;
    let rows = decomposition.reactions.iter().enumerate();
    rows.map(|(place, reaction)| Reaction {
        log_rate_1_s: reaction.pre_exponential_1_s.ln(),
        activation_k: reaction.activation_energy_j_mol / GAS_CONSTANT_J_MOL_K,
        order: reaction.order,
        onset_k: reaction.onset_temperature_k,
        idle: reaction.pre_exponential_1_s.ln() + (fastest * duration_s / NEGLIGIBLE_CONVERSION).ln(),
        loss: reaction.mass_loss,
        share: if is_chain { 1.0 } else { reaction.mass_loss / total },
        heat_j_kg: reaction.heat_j_kg,
        chained: f64::from(u8::from(is_chain && place > 0)),
    })
    .collect()
}
