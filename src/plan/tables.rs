//! Material properties as columns on one uniform temperature grid.

use super::factor_columns::conductivity_columns;
use crate::case::air::{air_enthalpy_j_kg, cold_wall_enthalpy_j_kg};
use crate::case::{Case, Conductivity, Emissivity, Face, GAS_CONSTANT_J_MOL_K, GasFlowModel, Material, Ply, Table};
use crate::physics::layout::{
    FACE_COLUMNS, GAS_COLUMNS, MAX_PRESSURE_LEVELS, MAX_STATES, TABLE_NODES, TABLE_START_K, TABLE_STEP_K,
    properties_per_state,
};
use std::sync::Arc;

/// All tables of a case, the table of the faces last, and the offset of each ply's table.
pub(super) struct Tables {
    pub(super) values: Arc<[f64]>,
    pub(super) offsets: Vec<usize>,
}

impl Tables {
    pub(super) fn new(case: &Case) -> Self {
        let (words, places) = build_tables(case);
        Self { values: words.into(), offsets: places }
    }
}

fn build_tables(case: &Case) -> (Vec<f64>, Vec<usize>) {
    let (parts, (levels, middle_pa)) = (conductivity_parts(case), pressure_levels(case));
    let pressures_pa: Vec<f64> = match levels {
        1 => vec![case.exposure.pressure_pa.after(0.0)],
        _ => (0..levels).map(|level| level_pressure_pa(level, levels, middle_pa)).collect(),
    };
    let plies = &case.layup.plies;
    let (mut words, mut places) = (vec![], Vec::with_capacity(plies.len()));
    for ply in plies {
        let own = conductivity_parts_of(case, ply);
        let is_alike = |before: &Ply| before.material == ply.material && conductivity_parts_of(case, before) == own;
        let alike = plies[..places.len()].iter().position(is_alike);
        places.push(alike.map_or(words.len(), |before| places[before]));
        if alike.is_none() {
            for &pressure_pa in &pressures_pa {
                let rows = conductivity_and_heat_capacity(&ply.material).take(tabulated_states(&ply.material));
                let solid = rows.flat_map(|(conductivity, heat_capacity)| {
                    solid_properties(conductivity, heat_capacity, pressure_pa, [own, parts])
                });
                words.extend(with_increments(&solid.chain(gas_properties(case)).collect::<Vec<_>>()));
            }
        }
    }
    words.extend(face_table(case));
    (words, places)
}

/// Conductivity and heat capacity of each state of a material.
fn conductivity_and_heat_capacity(material: &Material) -> impl Iterator<Item = (&Conductivity, &Table)> {
    let residues = material.decomposition.iter().flat_map(|decomposition| &decomposition.residues);
    std::iter::once((&material.conductivity, &material.heat_capacity))
        .chain(residues.map(|residue| (&residue.conductivity, &residue.heat_capacity)))
}

/// Number of states of a material: virgin and residues.
pub(super) fn state_count(material: &Material) -> usize {
    1 + material.decomposition.as_ref().map_or(0, |decomposition| decomposition.residues.len())
}

/// Number of tabulated states: the others are multiples of the virgin one.
pub(super) fn tabulated_states(material: &Material) -> usize {
    if material.state_ratios().is_some() { 1 } else { state_count(material) }
}

/// Conductivity columns of a ply: see [`Plan::conductivity_parts`](super::Plan::conductivity_parts).
pub(super) fn conductivity_parts_of(case: &Case, ply: &Ply) -> usize {
    let told_apart = conductivity_columns(case, ply).into_iter().map(|row| {
        match (row.solid, row.gas, row.radiative, row.extinction) {
            (0, 0, 0, 0) => 1,
            (0, 0, 0, _) => 2,
            _ => 3,
        }
    });
    told_apart.max().unwrap_or(1)
}

/// The maximum over plies, for which all rows have columns.
pub(super) fn conductivity_parts(case: &Case) -> usize {
    case.layup.plies.iter().map(|ply| conductivity_parts_of(case, ply)).max().unwrap_or(1)
}

/// Columns of a table row of a ply.
pub(super) fn column_count(case: &Case, material: &Material, parts: usize) -> usize {
    2 * properties_per_state(parts) * tabulated_states(material) + if case.gas.is_some() { GAS_COLUMNS } else { 0 }
}

/// Number of pressure levels that a case needs, and the pressure at the middle level, Pa.
///
/// Levels are equidistant in `P/(P + P_middle)`, which maps all pressures to [0, 1] and in which the gas part of a
/// conductivity, `P/(P + B(T))`, is nearly linear.
pub(super) fn pressure_levels(case: &Case) -> (usize, f64) {
    let exposure = &case.exposure;
    let pressures_pa =
        exposure.pressure_pa.values.iter().chain(exposure.back_pressure_pa.iter().flat_map(|p| &p.values));
    let (low, high) = pressures_pa.fold((f64::INFINITY, 0.0_f64), |(low, high), &p| (low.min(p), high.max(p)));
    let middle_pa = (low.max(1.0) * high.max(1.0)).sqrt();
    let is_steady = high - low <= 1e-9 * high;
    let flows = case.gas.as_ref().is_some_and(|flow| flow.model == GasFlowModel::Darcy);
    let feels = case.layup.plies.iter().any(|ply| {
        ply.material.state_conductivities().any(|(_, conductivity)| match conductivity {
            Conductivity::Tables(tables) => tables.len() > 1,
            Conductivity::ThreePart(parts) => !parts.pores.is_empty(),
        })
    });
    (if feels && (flows || !is_steady) { MAX_PRESSURE_LEVELS } else { 1 }, middle_pa)
}

/// The pressure of a level, Pa; the end levels are shifted off zero and infinity.
fn level_pressure_pa(level: usize, levels: usize, middle_pa: f64) -> f64 {
    let share = (level as f64 / (levels - 1) as f64).clamp(1e-6, 1.0 - 1e-6);
    middle_pa * share / (1.0 - share)
}

/// Node temperatures, K; absolute zero is shifted, where the gas conductivity is 0/0.
fn node_temperatures_k() -> impl Iterator<Item = f64> {
    (0..TABLE_NODES).map(|node| (TABLE_START_K + TABLE_STEP_K * node as f64).max(1e-6))
}

/// Slope of a column at its nodes, per kelvin. Slopes are interpolated like any property: with piecewise constant
/// slopes a temperature would jump slightly when a factor moves a cell across a node, enough to spoil a derivative by
/// finite differences.
fn slopes(column: &[f64]) -> Vec<f64> {
    let last = column.len() - 1;
    (0..column.len())
        .map(|node| {
            let (under, over) = (node.saturating_sub(1), (node + 1).min(last));
            (column[over] - column[under]) / (TABLE_STEP_K * (over - under) as f64)
        })
        .collect()
}

/// Properties of a state at the nodes, with `own` conductivity parts of its ply and columns for `parts`. Enthalpy is
/// the exact integral of the resampled heat capacity.
fn solid_properties(
    conductivity: &Conductivity,
    heat_capacity: &Table,
    pressure_pa: f64,
    [own, parts]: [usize; 2],
) -> Vec<Vec<f64>> {
    let heat_capacities: Vec<f64> =
        node_temperatures_k().map(|temperature_k| heat_capacity.at(temperature_k)).collect();
    let mut conductivities = [(); 3].map(|()| Vec::with_capacity(TABLE_NODES));
    for temperature_k in node_temperatures_k() {
        let [solid, gas, radiative] = conductivity.parts(temperature_k, pressure_pa);
        let told_apart = match own {
            1 => [solid + gas + radiative, 0.0, 0.0],
            2 => [solid + gas, radiative, 0.0],
            _ => [solid, radiative, gas],
        };
        conductivities.iter_mut().zip(told_apart).for_each(|(column, part)| column.push(part));
    }
    let enthalpies = enthalpies(&heat_capacities);
    let [(solid, solid_slope), (radiative, radiative_slope), (gas, gas_slope)] = conductivities.map(|column| {
        let slope = slopes(&column);
        (column, slope)
    });
    let mut columns = vec![solid, heat_capacities, solid_slope, enthalpies];
    if parts > 1 {
        columns.extend([radiative, radiative_slope, gas, gas_slope]);
    }
    columns
}

/// Enthalpy at every node relative to the first, J/kg: the exact integral of a heat capacity linear between nodes.
fn enthalpies(heat_capacities: &[f64]) -> Vec<f64> {
    let rises = heat_capacities.windows(2).map(|pair| 0.5 * TABLE_STEP_K * (pair[0] + pair[1]));
    std::iter::once(0.0)
        .chain(rises.scan(0.0, |sum, rise| {
            *sum += rise;
            Some(*sum)
        }))
        .collect()
}

/// Enthalpy at a temperature relative to the first node, as the march interpolates it, J/kg.
pub(super) fn enthalpy_j_kg(heat_capacity: &Table, temperature_k: f64) -> f64 {
    let heat_capacities: Vec<f64> =
        node_temperatures_k().map(|temperature_k| heat_capacity.at(temperature_k)).collect();
    let position = (temperature_k - TABLE_START_K) / TABLE_STEP_K;
    let row = (position.max(0.0) as usize).min(TABLE_NODES - 2);
    let (share, under, over) = (position - row as f64, heat_capacities[row], heat_capacities[row + 1]);
    enthalpies(&heat_capacities)[row] + TABLE_STEP_K * share * (under + 0.5 * share * (over - under))
}

/// Properties at the nodes, each paired with its increment to the next node.
fn with_increments(properties: &[Vec<f64>]) -> Vec<f64> {
    let of = |node: usize, property: &Vec<f64>| {
        let next = property.get(node + 1).unwrap_or(&property[node]);
        [property[node], next - property[node]]
    };
    (0..TABLE_NODES).flat_map(|node| properties.iter().flat_map(move |property| of(node, property))).collect()
}

/// Enthalpy of air at the wall, then the emissivities of the hot face and of the back face in every state.
fn face_table(case: &Case) -> Vec<f64> {
    let (exposure, plies) = (&case.exposure, &case.layup.plies);
    let cold_wall = cold_wall_enthalpy_j_kg();
    let enthalpies: Vec<f64> =
        node_temperatures_k().map(|temperature_k| air_enthalpy_j_kg(temperature_k) - cold_wall).collect();
    let rises = slopes(&enthalpies);
    let mut columns = vec![enthalpies, rises];
    for (face, ply) in [(&exposure.hot_face, plies.first()), (&exposure.back_face, plies.last())] {
        columns.extend((0..MAX_STATES).map(|state| emissivities(face, ply, state)));
    }
    debug_assert_eq!(2 * columns.len(), FACE_COLUMNS, "columns as the layout declares");
    with_increments(&columns)
}

/// Emissivity of a face at every node with its ply in a state; for a state beyond the last, that of the char.
fn emissivities(face: &Face, ply: Option<&Ply>, state: usize) -> Vec<f64> {
    let own = |ply: &Ply| {
        let residues = ply.material.decomposition.iter().flat_map(|decomposition| &decomposition.residues);
        let tables: Vec<&Table> =
            std::iter::once(&ply.material.emissivity).chain(residues.map(|residue| &residue.emissivity)).collect();
        let table = tables[state.min(tables.len() - 1)];
        node_temperatures_k().map(|temperature_k| table.at(temperature_k)).collect()
    };
    match (face, ply) {
        (Face::Open(open), Some(ply)) => match open.emissivity {
            Emissivity::Material => own(ply),
            Emissivity::Constant(value) => vec![value; TABLE_NODES],
        },
        _ => vec![0.0; TABLE_NODES],
    }
}

/// Enthalpy of the gas, its slope, its molar mass over the gas constant, its viscosity; empty without gas.
fn gas_properties(case: &Case) -> Vec<Vec<f64>> {
    let Some(flow) = &case.gas else { return vec![] };
    let read = |table: &Table, scale: f64| {
        node_temperatures_k().map(|temperature_k| scale * table.at(temperature_k)).collect()
    };
    let enthalpies: Vec<f64> = read(&flow.gas.enthalpy, 1.0);
    let rises = slopes(&enthalpies);
    let columns =
        vec![enthalpies, rises, read(&flow.gas.molar_mass, 1.0 / GAS_CONSTANT_J_MOL_K), read(&flow.gas.viscosity, 1.0)];
    debug_assert_eq!(2 * columns.len(), GAS_COLUMNS, "columns as the layout declares");
    columns
}
