//! Derivatives of the required mass of a layup by the properties of its materials.
//!
//! At the required thickness L of a member its peak T equals the limit, so that `dL/dp = −(∂T/∂p)/(∂T/∂L)` (implicit
//! function theorem), both exact derivatives of the march. The derivative of the quantile of L is the mean of `dL/dp`
//! over members whose thickness is that quantile (Hong, Operations Research 57, 2009): here over its neighbours in
//! order.

use super::SizedLayup;
use super::layup_sizing::{LayupSizing, PreparedExposure, ply_mass_kg_m2};
use crate::case::{Case, Factor, Property};
use crate::ensemble::Ensemble;
use crate::march::{March, MarchError};
use crate::plan::Plan;
use crate::study::margins::quantile_rank;
use crate::study::size::{RequiredThickness, ScalableCase};

/// Members about the quantile over which the derivative is averaged.
const NEIGHBOURS: usize = 16;

/// The properties whose change is considered.
const PROPERTIES: [Property; 4] =
    [Property::Conductivity, Property::HeatCapacity, Property::Density, Property::Emissivity];

/// Change of the required mass per area by a relative change of a property of a material, kg/m².
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MassDerivative {
    pub material: String,
    pub property: Property,
    pub mass_kg_m2: f64,
}

/// The factor of the case that scales a property of some plies.
struct Direction {
    factor: usize,
    property: Property,
    plies: Vec<usize>,
}

/// The derivatives of a layup; `None` where the march has no derivatives.
pub(super) fn mass_derivatives(
    exposures: &[PreparedExposure],
    sized: &LayupSizing,
    march: &mut dyn March,
    drawn: &Ensemble,
    probability: f64,
) -> Result<Option<Vec<MassDerivative>>, MarchError> {
    let layup = &sized.layup;
    let neighbours = neighbours(layup, probability);
    let weight = layup.density_kg_m3 / neighbours.len().max(1) as f64;
    let scalable = &exposures[0].scalable;
    let mut derivatives = own_masses(scalable, layup.required.sort_key_m().min(layup.thickness_range_m.1));
    for (exposure, prepared) in exposures.iter().enumerate() {
        let (case, directions) = with_directions(&prepared.scalable.case);
        let own: Vec<usize> = neighbours.iter().copied().filter(|&m| sized.governing[m] == exposure).collect();
        if own.is_empty() {
            continue;
        }
        let found = thickness_derivatives(prepared, &case, &directions, march, layup, drawn, &own)?;
        let Some(changes_m) = found else { return Ok(None) };
        for (place, direction) in directions.iter().enumerate() {
            let change_m: f64 = changes_m.iter().map(|of_member| of_member[place]).sum();
            let material = |&ply: &usize| &case.layup.plies[ply].material.id;
            let first = material(&direction.plies[0]);
            let is_of_one = direction.plies.iter().map(material).all(|id| id == first);
            if is_of_one && case.factors[direction.factor].state.is_none() {
                add(&mut derivatives, first, direction.property, weight * change_m);
            } else {
                // A factor of several materials, or of one state, does not scale the property of one material.
                let is_scaled = |id: &String| direction.plies.iter().map(material).any(|scaled| scaled == id);
                derivatives.retain(|known| known.property != direction.property || !is_scaled(&known.material));
            }
        }
    }
    Ok(Some(derivatives))
}

/// The mass of each material, as the derivative by its density at the same thickness.
fn own_masses(scalable: &ScalableCase, thickness_m: f64) -> Vec<MassDerivative> {
    let mut derivatives = Vec::new();
    for (ply, of) in scalable.case.layup.plies.iter().enumerate() {
        let is_sized = scalable.plies.contains(&ply);
        let stretched = if is_sized { thickness_m / scalable.case_thickness_m } else { 1.0 };
        let mass_kg_m2 = stretched * ply_mass_kg_m2(&scalable.case, ply);
        add(&mut derivatives, &of.material.id, Property::Density, mass_kg_m2);
    }
    derivatives
}

fn add(derivatives: &mut Vec<MassDerivative>, material: &str, property: Property, mass_kg_m2: f64) {
    match derivatives.iter_mut().find(|known| known.material == material && known.property == property) {
        Some(known) => known.mass_kg_m2 += mass_kg_m2,
        None => derivatives.push(MassDerivative { material: material.to_owned(), property, mass_kg_m2 }),
    }
}

/// The members whose thicknesses are next to the quantile in order, if it lies between the bounds.
fn neighbours(layup: &SizedLayup, probability: f64) -> Vec<usize> {
    let RequiredThickness::At(_) = layup.required else { return Vec::new() };
    let needed_m = &layup.member_thicknesses_m;
    let (low_m, high_m) = layup.thickness_range_m;
    let is_between = |member: &usize| needed_m[*member] > low_m && needed_m[*member] < high_m;
    let mut inorder: Vec<usize> = (0..needed_m.len()).collect();
    inorder.sort_by(|&a, &b| needed_m[a].total_cmp(&needed_m[b]));
    let rank = quantile_rank(needed_m.len(), probability) - 1;
    let end = (rank + NEIGHBOURS / 2).min(inorder.len());
    let near = &inorder[end.saturating_sub(NEIGHBOURS)..end];
    near.iter().copied().filter(is_between).collect()
}

/// The case with a factor on each property of each ply, and these factors.
fn with_directions(case: &Case) -> (Case, Vec<Direction>) {
    let mut case = case.clone();
    let mut directions: Vec<Direction> = Vec::new();
    for (ply, property) in (0..case.layup.plies.len()).flat_map(|ply| PROPERTIES.map(|property| (ply, property))) {
        if property == Property::Emissivity && !case.radiates(ply) {
            continue;
        }
        let group = case.layup.plies[ply].group.clone();
        let (own, name) = (case.layup.plies[ply].clone(), format!("{group} {}", property.key()));
        let scales = |factor: &Factor| {
            let holds = factor.group.is_empty() || factor.group == own.group || factor.group == own.name;
            factor.property == property && holds
        };
        let factor = case.factors.iter().position(scales).unwrap_or_else(|| {
            let (state, bounds) = (None, (1.0, 1.0));
            case.factors.push(Factor { name, group, property, state, nominal: 1.0, small: bounds, large: bounds });
            case.factors.len() - 1
        });
        match directions.iter_mut().find(|direction| direction.factor == factor) {
            Some(direction) => direction.plies.push(ply),
            None => directions.push(Direction { factor, property, plies: vec![ply] }),
        }
    }
    (case, directions)
}

/// Change of the required thickness of some members by a relative change of each direction, m: member × direction.
fn thickness_derivatives(
    prepared: &PreparedExposure,
    case: &Case,
    directions: &[Direction],
    march: &mut dyn March,
    layup: &SizedLayup,
    drawn: &Ensemble,
    members: &[usize],
) -> Result<Option<Vec<Vec<f64>>>, MarchError> {
    let scalable = &prepared.scalable;
    let row = |&member: &usize| {
        let mut row = scalable.member_factors(&drawn.member(member), layup.member_thicknesses_m[member]);
        row.resize(case.factors.len(), 1.0);
        row
    };
    let rows: Vec<Vec<f64>> = members.iter().map(row).collect();
    let columns: Vec<usize> = directions.iter().map(|direction| direction.factor).chain([scalable.factor]).collect();
    let plan = Plan::with_discretisation(case, prepared.plan.discretisation().clone());
    let points = Ensemble::from_values(case.factors.len(), rows.concat());
    let Some(traces) = march.tangents(&plan, &points, &columns)? else { return Ok(None) };
    let of_member = |(point, row): (usize, &Vec<f64>)| -> Option<Vec<f64>> {
        let at = point * (1 + columns.len());
        let relative_k = |place: usize| row[columns[place]] * traces.limited_peak(at + 1 + place, 0).temperature_k;
        let by_thickness_k = relative_k(columns.len() - 1) / layup.member_thicknesses_m[members[point]];
        let change_m = |place: usize| -relative_k(place) / by_thickness_k;
        (by_thickness_k < 0.0).then(|| (0..directions.len()).map(change_m).collect())
    };
    Ok(Some(rows.iter().enumerate().filter_map(of_member).collect()))
}
