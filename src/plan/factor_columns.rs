//! Factor columns: the column of the ensemble that scales a property; column 0 is one.

use crate::case::{Case, Ply, Property};
use crate::physics::layout::ConductivityColumns;

/// The column of the factor on a property of a ply (by its group or name, or of all plies); 0 where there is none.
pub(super) fn factor_column(case: &Case, ply: &str, property: Property) -> u32 {
    factor_column_of_state(case, ply, "", property)
}

/// As [`factor_column`], for one state of the ply.
fn factor_column_of_state(case: &Case, ply: &str, state: &str, property: Property) -> u32 {
    let group = case.layup.plies.iter().find(|p| p.name == ply).map_or("", |p| p.group.as_str());
    case.factors
        .iter()
        .position(|factor| {
            let holds = ply.is_empty() || factor.group.is_empty() || factor.group == group || factor.group == ply;
            factor.property == property && holds && factor.state.as_deref().is_none_or(|only| only == state)
        })
        .map_or(0, |factor| factor as u32 + 1)
}

/// Factor columns of the conductivity of every state of a ply, without pores.
pub(super) fn conductivity_columns(case: &Case, ply: &Ply) -> Vec<ConductivityColumns<u32>> {
    let states = ply.material.state_conductivities();
    states
        .map(|(state, conductivity)| {
            let of = |property| factor_column_of_state(case, &ply.name, state, property);
            ConductivityColumns {
                whole: of(Property::Conductivity),
                solid: of(Property::ConductivitySolid),
                gas: of(Property::ConductivityGas),
                radiative: of(Property::ConductivityRadiative),
                extinction: if conductivity.extinction_follows_density() { of(Property::Density) } else { 0 },
                first_pore: 0,
                end_pore: 0,
            }
        })
        .collect()
}
