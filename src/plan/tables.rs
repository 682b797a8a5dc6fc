//! Material properties as columns of tables over temperature.
//!
//! A table has the nodes of the files and every step of a uniform grid. Between nodes all properties are linear, so
//! that stated tables are exact, jumps included; a list or a directory finds the row of a temperature. The parts of a
//! conductivity that are smooth formulas are linear between the nodes of the uniform grid, with values that keep their
//! integral.

mod row_search;

use super::factor_columns::conductivity_columns;
use crate::case::air::{
    AIR_ENTHALPY_CORNERS_K, air_conductivity_w_m_k, air_enthalpy_j_kg, air_slip_pa_k, cold_wall_enthalpy_j_kg,
};
use crate::case::{
    Case, Conductivity, Emissivity, Face, GAS_CONSTANT_J_MOL_K, GasFlowModel, Material, OutOfRange, Ply, Table,
};
use crate::limits::TABLE_TEMPERATURE_DISTANCE_K;
use crate::physics::layout::{
    FACE_COLUMNS, GAS_COLUMNS, MAX_STATES, PoreClass, TABLE_START_K, TABLE_STEP_K, TABLE_STEPS, TableLocation,
    properties_per_state,
};
use row_search::RowSearch;
use std::sync::Arc;

/// A node this close to a table step is at it, K: the rounding of a temperature in another unit.
const ROUNDING_K: f64 = 1e-9;
/// Steps of a ply advance enthalpies if the heat over this temperature range differs from that of the mean of the heat
/// capacities at its ends by more than this share: a step could pass over a peak of the heat capacity without the heat
/// that it takes. Elsewhere steps that advance temperatures need a quarter of the number for the same error.
const STEEP_RANGE_K: f64 = 20.0;
const STEEP_SHARE: f64 = 0.1;
/// Distance over which the lower bound of a heat capacity holds, and its mean is taken, K.
const LOWER_BOUND_RANGE_K: f64 = 100.0;
/// Largest correction of a formula's value at a node that keeps its integral, as a share of the value: near absolute
/// zero a power law is not smooth on the scale of the grid.
const MAX_CORRECTION: f64 = 0.01;
/// Corners of a table that are tried as origins of its steps.
const MAX_ORIGINS: usize = 64;

/// All tables of a case, that of the faces last, with the location of each ply's.
#[derive(Clone, Debug)]
pub(super) struct Tables {
    pub(super) values: Arc<[f64]>,
    pub(super) locations: Vec<TableLocation<u32>>,
}

impl Tables {
    pub(super) fn new(case: &Case) -> Self {
        let parts = conductivity_parts(case);
        let plies = &case.layup.plies;
        let mut words = vec![];
        let mut locations: Vec<TableLocation<u32>> = Vec::with_capacity(plies.len() + 1);
        for ply in plies {
            let own = conductivity_parts_of(case, ply);
            let is_alike = |before: &Ply| before.material == ply.material && conductivity_parts_of(case, before) == own;
            let alike = plies[..locations.len()].iter().position(is_alike);
            locations.push(match alike {
                Some(before) => locations[before],
                None => {
                    let levels_pa = pressure_levels_pa(case, ply);
                    let origin_k = ply_origin_k(case, &ply.material);
                    let level = |&pa| ply_columns(case, &ply.material, origin_k, pa, [own, parts]);
                    append_table(&mut words, origin_k, &levels_pa.iter().map(level).collect::<Vec<_>>())
                }
            });
        }
        locations.push(append_table(&mut words, TABLE_START_K, &[face_columns(case)]));
        Self { values: words.into(), locations }
    }
}

/// Whether steps of a ply of this material advance the enthalpy of its cells, so that they pass over no peak of its
/// heat capacity: where the heat of some state over 20 K differs by more than a tenth from that of the mean of the heat
/// capacities at both ends.
pub fn advances_enthalpy(material: &Material) -> bool {
    conductivity_and_heat_capacity(material).any(|(_, heat_capacity)| is_steep(heat_capacity))
}

/// Whether fluxes within a ply of this material are differences of the integrals of its conductivities, so that a jump
/// between two nodes counts where it lies: where the mean of the conductivities of some state at both ends of 20 K
/// differs by more than a tenth from their integral.
pub fn integrates_conductivity(material: &Material) -> bool {
    material.state_conductivities().any(|(_, conductivity)| match conductivity {
        Conductivity::Tables(tables) => tables.iter().any(|(_, table)| is_steep(table)),
        Conductivity::ThreePart(_) => false,
    })
}

fn is_steep(property: &Table) -> bool {
    let corners_k = property.corners_k();
    let integral = |from_k: f64, to_k: f64| integral_between(property, &corners_k, from_k, to_k);
    corners_k.iter().any(|&corner_k| {
        let around_k = [-LOWER_BOUND_RANGE_K, LOWER_BOUND_RANGE_K].map(|by_k| (corner_k + by_k).max(TABLE_START_K));
        let mean = integral(around_k[0], around_k[1]) / (around_k[1] - around_k[0]);
        [0.0, 0.5, 1.0].into_iter().any(|share| {
            let from_k = (corner_k - share * STEEP_RANGE_K).max(TABLE_START_K);
            let to_k = from_k + STEEP_RANGE_K;
            let of_ends = 0.5 * STEEP_RANGE_K * (property.just_below(from_k) + property.at(to_k));
            let missed = (integral(from_k, to_k) - of_ends).abs();
            missed > STEEP_SHARE * STEEP_RANGE_K * mean
        })
    })
}

/// Integral of a table with these corners between two temperatures.
fn integral_between(table: &Table, corners_k: &[f64], from_k: f64, to_k: f64) -> f64 {
    let first = corners_k.partition_point(|&at_k| at_k <= from_k);
    let end = corners_k.partition_point(|&at_k| at_k < to_k);
    let mut sum = 0.0;
    let mut start_k = from_k;
    for &end_k in corners_k[first..end].iter().chain([&to_k]) {
        sum += 0.5 * (end_k - start_k) * (table.at(start_k) + table.just_below(end_k));
        start_k = end_k;
    }
    sum
}

/// The smallest and the largest value of a table with these corners between two temperatures.
fn range_between(table: &Table, corners_k: &[f64], from_k: f64, to_k: f64) -> (f64, f64) {
    let (from_k, to_k) = (from_k.max(TABLE_START_K), to_k.max(TABLE_START_K));
    // By bisection: a table may have 100,000 corners, and this is called for each of them.
    let first = corners_k.partition_point(|&at_k| at_k < from_k);
    let end = corners_k.partition_point(|&at_k| at_k <= to_k);
    let inside = corners_k[first..end].iter().flat_map(|&at_k| [table.just_below(at_k), table.at(at_k)]);
    let values = inside.chain([table.at(from_k), table.just_below(to_k)]);
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), value| (least.min(value), most.max(value)))
}

/// A column of a table.
enum Column {
    Property(Table),
    /// Slope of the property this many columns before, per kelvin. Slopes are linear between nodes like any property:
    /// with piecewise constant slopes a temperature would jump slightly when a factor moves a cell across a node,
    /// enough to spoil a derivative by finite differences.
    Slope(usize),
    /// Integral of the property this many columns before.
    Integral(usize),
    /// Lower bound of a heat capacity.
    LowerBound(Table),
    /// Upper bound of a conductivity.
    UpperBound(Table),
    /// Start of the row, in table steps.
    Position,
}

/// A temperature at which a row starts, with those at which the limits from below and from above are taken, K.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Node {
    at_k: f64,
    below_k: f64,
    above_k: f64,
}

/// The nodes of some properties: every corner of one, and every table step from an origin. Corners of different
/// properties that are closer than those of one property may be are one node.
fn nodes<'a>(origin_k: f64, properties: impl Iterator<Item = &'a Table>) -> Vec<Node> {
    let mut corners_k: Vec<f64> = properties.flat_map(Table::corners_k).collect();
    let step_k = |step: usize| origin_k + TABLE_STEP_K * step as f64;
    let inside_k = origin_k + TABLE_TEMPERATURE_DISTANCE_K..step_k(TABLE_STEPS) - TABLE_TEMPERATURE_DISTANCE_K;
    corners_k.retain(|corner_k| inside_k.contains(corner_k));
    corners_k.sort_by(f64::total_cmp);
    let mut nodes: Vec<Node> = vec![];
    for corner_k in corners_k {
        match nodes.last_mut().filter(|node| corner_k - node.below_k < TABLE_TEMPERATURE_DISTANCE_K) {
            Some(node) => node.above_k = corner_k,
            None => nodes.push(Node { at_k: corner_k, below_k: corner_k, above_k: corner_k }),
        }
    }
    let mut near_steps = vec![false; TABLE_STEPS + 1];
    for node in &mut nodes {
        node.at_k = 0.5 * (node.below_k + node.above_k);
        let step = ((node.at_k - origin_k) / TABLE_STEP_K).round() as usize;
        let distance_k = (step_k(step) - node.at_k).abs();
        near_steps[step] |= distance_k < TABLE_TEMPERATURE_DISTANCE_K;
        if distance_k < ROUNDING_K {
            node.at_k = step_k(step);
        }
    }
    let steps = (0..=TABLE_STEPS).filter(|&step| !near_steps[step]);
    nodes.extend(steps.map(|step| {
        let at_k = step_k(step);
        Node { at_k, below_k: at_k, above_k: at_k.max(f64::MIN_POSITIVE) }
    }));
    nodes.sort_by(|a, b| a.at_k.total_cmp(&b.at_k));
    nodes
}

/// The temperature from which on most corners of the stated tables of a ply are table steps, K: the start of the
/// tables, or, where no corner is near it, less than a step above it. Tables over degrees Celsius, or from 283 K in
/// steps of ten, are common.
fn ply_origin_k(case: &Case, material: &Material) -> f64 {
    let conductivities = conductivity_and_heat_capacity(material).flat_map(|(conductivity, _)| match conductivity {
        Conductivity::Tables(tables) => tables.iter().flat_map(|(_, table)| table.corners_k()).collect(),
        Conductivity::ThreePart(_) => vec![],
    });
    let heat_capacities = conductivity_and_heat_capacity(material).flat_map(|(_, table)| table.corners_k());
    let gas_columns = gas_columns(case);
    let of_gas = gas_columns.iter().flat_map(|column| match column {
        Column::Property(table) => table.corners_k(),
        _ => vec![],
    });
    let corners_k: Vec<f64> = conductivities.chain(heat_capacities).chain(of_gas).collect();
    let on_steps = |origin_k: f64| {
        let distance_k = |corner_k: &&f64| {
            let steps = (**corner_k - origin_k) / TABLE_STEP_K;
            (steps - steps.round()).abs() * TABLE_STEP_K
        };
        corners_k.iter().filter(|corner_k| distance_k(corner_k) < ROUNDING_K).count()
    };
    if corners_k.iter().any(|corner_k| *corner_k < TABLE_START_K + 2.0 * TABLE_STEP_K) {
        return TABLE_START_K;
    }
    let origins_k = corners_k.iter().take(MAX_ORIGINS).map(|corner_k| (corner_k - TABLE_START_K) % TABLE_STEP_K);
    let counted = origins_k.map(|origin_k| (on_steps(TABLE_START_K + origin_k), TABLE_START_K + origin_k));
    let first = (on_steps(TABLE_START_K), TABLE_START_K);
    counted.fold(first, |most, other| if other.0 > most.0 { other } else { most }).1
}

/// Append a table of some columns at each level, and what finds its rows.
fn append_table(words: &mut Vec<f64>, origin_k: f64, levels: &[Vec<Column>]) -> TableLocation<u32> {
    let properties = levels.iter().flatten().filter_map(|column| match column {
        Column::Property(table) => Some(table),
        _ => None,
    });
    let nodes = nodes(origin_k, properties);
    let (rows, offset) = (nodes.len() - 1, words.len() as u32);
    for level in levels {
        let columns = columns_at(level, &nodes);
        words.extend((0..rows).flat_map(|row| columns.iter().flat_map(move |column| column[row])));
    }
    let positions: Vec<f64> = nodes.iter().map(|node| (node.at_k - TABLE_START_K) / TABLE_STEP_K).collect();
    let search = RowSearch::new(&positions);
    let end = words.len() as u32;
    let advances_enthalpy = levels[0].iter().any(|column| matches!(column, Column::LowerBound(_)));
    // The integrals of heat capacities are two columns from them.
    let conductivity_integral =
        levels[0].iter().position(|column| matches!(column, Column::Integral(distance) if *distance > 2));
    let location = TableLocation {
        offset,
        columns: 2 * levels[0].len() as u32,
        rows: rows as u32,
        directory: if search == RowSearch::Steps { 0 } else { end },
        buckets_per_step: if let RowSearch::Directory { buckets_per_step, .. } = &search {
            *buckets_per_step
        } else {
            1
        },
        last_bucket: if let RowSearch::Directory { entries, .. } = &search { entries.len() } else { rows } as u32 - 1,
        list_length: if let RowSearch::List { length, .. } = &search { *length } else { 0 },
        conductivity_integral: conductivity_integral.unwrap_or(0) as u32,
        enthalpy_search_span: if advances_enthalpy { (rows as u32).next_power_of_two() / 2 } else { 0 },
    };
    if let RowSearch::List { groups, .. } | RowSearch::Directory { entries: groups, .. } = search {
        words.extend(groups.into_iter().flatten());
    }
    location
}

/// Value at the start of each row and rise per table step, of each column.
fn columns_at(columns: &[Column], nodes: &[Node]) -> Vec<Vec<[f64; 2]>> {
    let steps = |row: usize| (nodes[row + 1].at_k - nodes[row].at_k) / TABLE_STEP_K;
    let between = |start: &dyn Fn(usize) -> f64, end: &dyn Fn(usize) -> f64| -> Vec<[f64; 2]> {
        (0..nodes.len() - 1).map(|row| [start(row), (end(row) - start(row)) / steps(row)]).collect()
    };
    let through = |values: &[f64]| between(&|row| values[row], &|row| values[row + 1]);
    let mut found: Vec<Vec<[f64; 2]>> = vec![];
    for column in columns {
        let lines = match column {
            Column::Property(table) => {
                between(&|row| table.at(nodes[row].above_k), &|row| table.just_below(nodes[row + 1].below_k))
            }
            Column::Slope(distance) => {
                let of = &found[found.len() - distance];
                let slope = |node: usize| {
                    let (first, last) = (node.saturating_sub(1), node.min(of.len() - 1));
                    let end = of[last][0] + of[last][1] * steps(last);
                    (end - of[first][0]) / (nodes[last + 1].at_k - nodes[first].at_k)
                };
                through(&(0..nodes.len()).map(slope).collect::<Vec<_>>())
            }
            Column::Integral(distance) => {
                let of = &found[found.len() - distance];
                let mut sums = vec![match &columns[found.len() - distance] {
                    Column::Property(table) => {
                        integral_between(table, &table.corners_k(), TABLE_START_K, nodes[0].at_k)
                    }
                    _ => 0.0,
                }];
                for (row, [start, rise]) in of.iter().enumerate() {
                    sums.push(sums[row] + steps(row) * TABLE_STEP_K * (start + 0.5 * rise * steps(row)));
                }
                through(&sums)
            }
            Column::LowerBound(table) => through(&ranges_around(table, nodes).map(|range| range.0).collect::<Vec<_>>()),
            Column::UpperBound(table) => through(&ranges_around(table, nodes).map(|range| range.1).collect::<Vec<_>>()),
            Column::Position => nodes[1..].iter().zip(nodes).map(|(_, node)| [node.at_k / TABLE_STEP_K, 0.0]).collect(),
        };
        found.push(lines);
    }
    found
}

/// The least and the largest value of a table around each node.
fn ranges_around(table: &Table, nodes: &[Node]) -> impl Iterator<Item = (f64, f64)> {
    let corners_k = table.corners_k();
    nodes.iter().map(move |node| {
        let [from_k, to_k] = [-LOWER_BOUND_RANGE_K, LOWER_BOUND_RANGE_K].map(|by_k| node.at_k + by_k);
        range_between(table, &corners_k, from_k, to_k)
    })
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

/// Conductivity columns of a ply: see [`PlanRows::conductivity_parts`](crate::physics::layout::PlanRows).
pub(super) fn conductivity_parts_of(case: &Case, ply: &Ply) -> usize {
    if !pores_of(case, ply).iter().all(|pores| pores.is_empty()) {
        return 3;
    }
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

/// Whether the pressure in the layup changes, in time or through the thickness.
fn pressure_changes(case: &Case) -> bool {
    let exposure = &case.exposure;
    let pressures_pa =
        exposure.pressure_pa.values.iter().chain(exposure.back_pressure_pa.iter().flat_map(|p| &p.values));
    let (low, high) = pressures_pa.fold((f64::INFINITY, 0.0_f64), |(low, high), &p| (low.min(p), high.max(p)));
    let flows = case.gas.as_ref().is_some_and(|flow| flow.model == GasFlowModel::Darcy);
    flows || high > low
}

/// The pressures at which a ply's conductivity is tabulated, Pa: those of its tables, between which it is linear in the
/// logarithm of the pressure; one where no table follows a changing pressure.
pub(super) fn pressure_levels_pa(case: &Case, ply: &Ply) -> Vec<f64> {
    let mut levels_pa = vec![];
    if pressure_changes(case) {
        for (_, conductivity) in ply.material.state_conductivities() {
            if let Conductivity::Tables(tables) = conductivity
                && tables.len() > 1
            {
                levels_pa.extend(tables.iter().map(|(pressure_pa, _)| *pressure_pa));
            }
        }
    }
    if levels_pa.is_empty() {
        return vec![case.exposure.pressure_pa.after(0.0)];
    }
    levels_pa.sort_by(f64::total_cmp);
    levels_pa.dedup();
    levels_pa
}

/// The pores of each state of a ply whose gas conductivity follows a changing pressure.
pub(super) fn pores_of(case: &Case, ply: &Ply) -> Vec<Vec<PoreClass<f64>>> {
    let changes = pressure_changes(case);
    let pores = |conductivity: &Conductivity| match conductivity {
        Conductivity::ThreePart(parts) if changes => {
            let pore = |&(share, length_m): &(f64, f64)| PoreClass { share, slip_pa_k: air_slip_pa_k(length_m) };
            parts.pores.iter().map(pore).collect()
        }
        _ => vec![],
    };
    ply.material.state_conductivities().map(|(_, conductivity)| pores(conductivity)).collect()
}

/// Columns of a ply's table at a pressure level: of its states, with `own` conductivity parts of its ply and columns
/// for `parts`; then those of the gas.
fn ply_columns(
    case: &Case,
    material: &Material,
    origin_k: f64,
    pressure_pa: f64,
    [own, parts]: [usize; 2],
) -> Vec<Column> {
    let follows_pressure = pressure_changes(case);
    let states = conductivity_and_heat_capacity(material).take(tabulated_states(material));
    let mut columns = vec![];
    for (conductivity, heat_capacity) in states {
        let part = |of: [bool; 3]| conductivity_part(conductivity, origin_k, pressure_pa, follows_pressure, of);
        let (first, radiative, gas) = match own {
            1 => ([true; 3], [false; 3], [false; 3]),
            2 => ([true, true, false], [false, false, true], [false; 3]),
            _ => ([true, false, false], [false, false, true], [false, true, false]),
        };
        columns.extend([
            Column::Property(part(first)),
            Column::Property(heat_capacity.clone()),
            Column::Slope(2),
            Column::Integral(2),
        ]);
        if parts > 1 {
            let separate_parts = [part(radiative), part(gas)];
            columns.extend(separate_parts.into_iter().flat_map(|part| [Column::Property(part), Column::Slope(1)]));
        }
    }
    debug_assert_eq!(columns.len(), tabulated_states(material) * properties_per_state(parts), "the layout's columns");
    columns.extend(gas_columns(case));
    if integrates_conductivity(material) {
        for state in 0..tabulated_states(material) {
            let first_column = state * properties_per_state(parts);
            let Column::Property(conductivity) = &columns[first_column] else { continue };
            let bound = Column::UpperBound(conductivity.clone());
            columns.extend([Column::Integral(columns.len() - first_column), bound]);
        }
    }
    if advances_enthalpy(material) {
        for (_, heat_capacity) in conductivity_and_heat_capacity(material).take(tabulated_states(material)) {
            columns.extend([Column::LowerBound(heat_capacity.clone()), Column::Position]);
        }
    }
    columns
}

/// The sum of some parts of a conductivity (solid, gas, radiative) at a pressure. Of pores that follow a changing
/// pressure the gas part is the conductivity of unconfined air.
fn conductivity_part(
    conductivity: &Conductivity,
    origin_k: f64,
    pressure_pa: f64,
    follows_pressure: bool,
    of: [bool; 3],
) -> Table {
    let sum = |parts: [f64; 3]| parts.iter().zip(of).map(|(part, counts)| if counts { *part } else { 0.0 }).sum();
    match conductivity {
        Conductivity::Tables(tables) => {
            let mut corners_k: Vec<f64> = tables.iter().flat_map(|(_, table)| table.corners_k()).collect();
            corners_k.sort_by(f64::total_cmp);
            corners_k.dedup();
            piecewise_linear(
                &corners_k,
                |temperature_k| sum(conductivity.parts(temperature_k, pressure_pa)),
                |temperature_k| sum(conductivity.parts_just_below(temperature_k, pressure_pa)),
            )
        }
        Conductivity::ThreePart(parts) => smooth(origin_k, |temperature_k| {
            let [solid, mut gas, radiative] = conductivity.parts(temperature_k, pressure_pa);
            if follows_pressure && !parts.pores.is_empty() {
                gas = air_conductivity_w_m_k(temperature_k);
            }
            sum([solid, gas, radiative])
        }),
    }
}

/// A function that is linear between corners, from its limits at temperatures from above and from below.
fn piecewise_linear(corners_k: &[f64], at: impl Fn(f64) -> f64, just_below: impl Fn(f64) -> f64) -> Table {
    let ends_k = [TABLE_START_K + f64::MIN_POSITIVE, TABLE_START_K + TABLE_STEP_K * TABLE_STEPS as f64];
    let (mut temperatures_k, mut values) = (vec![], vec![]);
    let inside = corners_k.iter().copied().filter(|at_k| ends_k[0] < *at_k && *at_k < ends_k[1]);
    for at_k in std::iter::once(ends_k[0]).chain(inside).chain([ends_k[1]]) {
        let (below, above) = (just_below(at_k), at(at_k));
        if below != above {
            temperatures_k.push(at_k);
            values.push(below);
        }
        temperatures_k.push(at_k);
        values.push(above);
    }
    Table { temperatures_k, values, outside: OutOfRange::Clamp }
}

/// A smooth function, linear between table steps from an origin. The values at the nodes are lowered by a twelfth of
/// the second difference, so that the integral over each step is that of the function up to the fourth order of the
/// step: chords of a convex conductivity would be up to 2e-4 too high.
fn smooth(origin_k: f64, function: impl Fn(f64) -> f64) -> Table {
    let temperatures_k: Vec<f64> =
        (0..=TABLE_STEPS).map(|step| (origin_k + TABLE_STEP_K * step as f64).max(1e-6)).collect();
    let exact: Vec<f64> = temperatures_k.iter().map(|&temperature_k| function(temperature_k)).collect();
    let mut values = exact.clone();
    for (value, around) in values[1..].iter_mut().zip(exact.windows(3)) {
        let correction = (around[0] - 2.0 * around[1] + around[2]) / 12.0;
        if correction.abs() < MAX_CORRECTION * value.abs() {
            *value -= correction;
        }
    }
    Table { temperatures_k, values, outside: OutOfRange::Clamp }
}

/// Integral of a table from the start of the tables to a temperature.
pub(super) fn integral_to(table: &Table, temperature_k: f64) -> f64 {
    integral_between(table, &table.corners_k(), TABLE_START_K, temperature_k)
}

/// Enthalpy of air at the wall, its slope, then the emissivities of the hot face and of the back face in every state.
fn face_columns(case: &Case) -> Vec<Column> {
    let (exposure, plies) = (&case.exposure, &case.layup.plies);
    let over_cold_wall = |temperature_k| air_enthalpy_j_kg(temperature_k) - cold_wall_enthalpy_j_kg();
    let enthalpy = piecewise_linear(&AIR_ENTHALPY_CORNERS_K, over_cold_wall, over_cold_wall);
    let mut columns = vec![Column::Property(enthalpy), Column::Slope(1)];
    for (face, ply) in [(&exposure.hot_face, plies.first()), (&exposure.back_face, plies.last())] {
        columns.extend((0..MAX_STATES).map(|state| Column::Property(emissivity(face, ply, state))));
    }
    debug_assert_eq!(2 * columns.len(), FACE_COLUMNS, "columns as the layout declares");
    columns
}

/// Emissivity of a face with its ply in a state; for a state beyond the last, that of the char.
fn emissivity(face: &Face, ply: Option<&Ply>, state: usize) -> Table {
    let own = |ply: &Ply| {
        let residues = ply.material.decomposition.iter().flat_map(|decomposition| &decomposition.residues);
        let tables: Vec<&Table> =
            std::iter::once(&ply.material.emissivity).chain(residues.map(|residue| &residue.emissivity)).collect();
        tables[state.min(tables.len() - 1)].clone()
    };
    match (face, ply) {
        (Face::Open(open), Some(ply)) => match open.emissivity {
            Emissivity::Material => own(ply),
            Emissivity::Constant(value) => Table::constant(value),
        },
        _ => Table::constant(0.0),
    }
}

/// Enthalpy of the gas, its slope, its molar mass over the gas constant, its viscosity; empty without gas.
fn gas_columns(case: &Case) -> Vec<Column> {
    let Some(flow) = &case.gas else { return vec![] };
    let mut molar_mass = flow.gas.molar_mass.clone();
    molar_mass.values.iter_mut().for_each(|value| *value /= GAS_CONSTANT_J_MOL_K);
    let columns = vec![
        Column::Property(flow.gas.enthalpy.clone()),
        Column::Slope(1),
        Column::Property(molar_mass),
        Column::Property(flow.gas.viscosity.clone()),
    ];
    debug_assert_eq!(2 * columns.len(), GAS_COLUMNS, "columns as the layout declares");
    columns
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heat_capacity(temperatures_k: &[f64], values: &[f64]) -> Table {
        Table::new(temperatures_k.to_vec(), values.to_vec(), OutOfRange::Clamp).expect("a table")
    }

    #[test]
    fn peaks_and_jumps_of_a_heat_capacity_are_steep_and_slopes_are_not() {
        for (temperatures_k, values, expected) in [
            (&[300.0, 301.0, 302.0][..], &[1000.0, 50_000.0, 1000.0][..], true),
            (&[300.0, 360.0, 420.0], &[1000.0, 9000.0, 1000.0], true),
            (&[300.0, 400.0, 400.0, 500.0], &[1000.0, 1000.0, 1500.0, 1500.0], true),
            (&[300.0, 400.0, 400.0, 500.0], &[1000.0, 1000.0, 1100.0, 1100.0], false),
            (&[300.0, 500.0, 1000.0], &[700.0, 1000.0, 1200.0], false),
            (&[300.0, 400.0, 500.0], &[767.0, 93.0, 1018.0], false),
        ] {
            assert_eq!(is_steep(&heat_capacity(temperatures_k, values)), expected, "{temperatures_k:?}, {values:?}");
        }
    }

    #[test]
    fn a_formula_on_table_steps_keeps_its_integral() {
        let cubic = |temperature_k: f64| 1e-9 * temperature_k.powi(3);
        let (from_k, to_k) = (300.0_f64, 1500.0_f64);
        let exact = 1e-9 * (to_k.powi(4) - from_k.powi(4)) / 4.0;
        let integral = |table: &Table| integral_to(table, to_k) - integral_to(table, from_k);
        let error = (integral(&smooth(TABLE_START_K, cubic)) / exact - 1.0).abs();
        let nodes: Vec<f64> = (0..=TABLE_STEPS).map(|step| (TABLE_STEP_K * step as f64).max(1e-6)).collect();
        let values = nodes.iter().map(|&node_k| cubic(node_k)).collect();
        let chords = Table { temperatures_k: nodes, values, outside: OutOfRange::Clamp };
        assert!(error < 1e-9 && (integral(&chords) / exact - 1.0).abs() > 1e-5, "{error}");
    }
}
