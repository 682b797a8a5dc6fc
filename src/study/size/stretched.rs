//! A case whose plies of a group may be made thicker.

use super::SizeError;
use crate::case::{Case, Factor, Property};

/// A case with a factor on the thickness of the plies that are sized.
pub(super) struct Stretched {
    pub case: Case,
    /// The plies that are sized: all of the group, or the one of the name.
    pub plies: Vec<usize>,
    /// The factor that stretches them.
    column: usize,
    /// Whether the case had it before: then members scatter by it, and the stretch multiplies theirs.
    is_own: bool,
    /// Their thickness as drawn, all together, m.
    pub drawn_m: f64,
}

impl Stretched {
    /// # Errors
    /// When no ply is of that name or group, or a factor on thickness scales some of them and not the others.
    pub(super) fn new(case: &Case, group: &str) -> Result<Self, SizeError> {
        let layup = &case.layup.plies;
        let within = |group: &str| -> Vec<usize> {
            (0..layup.len()).filter(|&ply| layup[ply].group == group || layup[ply].name == group).collect()
        };
        let plies = within(group);
        if plies.is_empty() {
            let mut known: Vec<&str> = layup.iter().flat_map(|ply| [ply.group.as_str(), ply.name.as_str()]).collect();
            known.sort_unstable();
            known.dedup();
            return Err(SizeError::NoPly { name: group.to_owned(), known: known.join(", ") });
        }
        let mut case = case.clone();
        let scales = |factor: &Factor| {
            let every = factor.group.is_empty();
            factor.property == Property::Thickness && (every || within(&factor.group).iter().any(|p| plies.contains(p)))
        };
        let own = case.factors.iter().position(scales);
        if let Some(own) = own
            && within(&case.factors[own].group) != plies
        {
            let factor = case.factors[own].name.clone();
            return Err(SizeError::OtherPlies { ply: group.to_owned(), factor });
        }
        let column = own.unwrap_or(case.factors.len());
        if own.is_none() {
            case.factors.push(Factor {
                name: "thickness".to_owned(),
                group: group.to_owned(),
                property: Property::Thickness,
                state: None,
                nominal: 1.0,
                small: (1.0, 1.0),
                large: (1.0, 1.0),
            });
        }
        let drawn_m = plies.iter().map(|&ply| layup[ply].thickness_m).sum();
        Ok(Self { plies, column, is_own: own.is_some(), drawn_m, case })
    }

    /// A member's factors with the plies so thick.
    pub(super) fn row(&self, factors: &[f64], thickness_m: f64) -> Vec<f64> {
        let mut row = factors.to_vec();
        if !self.is_own {
            row.push(1.0);
        }
        row[self.column] *= thickness_m / self.drawn_m;
        row
    }
}

/// The case drawn anew with some of its plies stretched by one ratio: what lies behind them moves, what lies within them
/// keeps its share of the way through.
pub(super) fn redrawn(case: &Case, plies: &[usize], ratio: f64) -> Case {
    let mut drawn = case.clone();
    for &ply in plies {
        drawn.layup.plies[ply].thickness_m *= ratio;
    }
    let ends_m =
        |case: &Case| -> Vec<f64> { std::iter::once(case.layup.origin_m).chain(case.layup.faces_m()).collect() };
    let (before_m, after_m) = (ends_m(case), ends_m(&drawn));
    let moved = |depth_m: f64| {
        let ply = before_m[1..].iter().position(|&end_m| depth_m <= end_m).unwrap_or(before_m.len() - 2);
        let way = (depth_m - before_m[ply]) / (before_m[ply + 1] - before_m[ply]);
        // On an interface it is to equal the depth of that interface exactly.
        if way == 1.0 { after_m[ply + 1] } else { after_m[ply] + way * (after_m[ply + 1] - after_m[ply]) }
    };
    for sensor in drawn.sensors.iter_mut().filter(|sensor| sensor.depth_m >= before_m[0]) {
        sensor.depth_m = moved(sensor.depth_m);
    }
    // A straight line over a ply that is stretched and over one that is not is no straight line any more.
    let exposure = &case.exposure;
    let mut depths_m: Vec<f64> = exposure.initial_k.iter().map(|point| point.0).chain(before_m.clone()).collect();
    depths_m.retain(|depth_m| (before_m[0]..=before_m[before_m.len() - 1]).contains(depth_m));
    depths_m.sort_by(f64::total_cmp);
    depths_m.dedup();
    if exposure.initial_k.len() > 1 {
        drawn.exposure.initial_k =
            depths_m.iter().map(|&depth_m| (moved(depth_m), exposure.initial_at(depth_m))).collect();
    }
    drawn
}

/// Mass of some plies on an area, kg/m², so thick all together, with the factors nominal.
pub(super) fn mass_kg_m2(case: &Case, plies: &[usize], thickness_m: f64) -> f64 {
    let layup = &case.layup.plies;
    let drawn_m: f64 = plies.iter().map(|&ply| layup[ply].thickness_m).sum();
    let scale = |ply: usize| {
        let of_it = |factor: &&Factor| {
            let group = &factor.group;
            factor.property == Property::Density
                && (group.is_empty() || *group == layup[ply].group || *group == layup[ply].name)
        };
        case.factors.iter().find(of_it).map_or(1.0, |factor| factor.nominal)
    };
    let mass = |&ply: &usize| layup[ply].material.density_kg_m3 * scale(ply) * layup[ply].thickness_m;
    plies.iter().map(mass).sum::<f64>() * thickness_m / drawn_m
}
