//! A case whose sized plies have a variable thickness.

use super::SizeError;
use crate::case::{Case, Factor, Property};
use crate::ensemble::Ensemble;

/// A case with a thickness factor on the sized plies.
pub(in crate::study) struct ScalableCase {
    pub case: Case,
    /// The sized plies: all of the group, or the one with the name.
    pub plies: Vec<usize>,
    /// Index of the thickness factor.
    pub factor: usize,
    /// Whether the case defines this factor itself; then the ratio multiplies each member's value.
    is_case_factor: bool,
    /// Total thickness of the sized plies in the case, m.
    pub case_thickness_m: f64,
}

impl ScalableCase {
    /// # Errors
    /// When no ply has that name or group, or a thickness factor scales some of the plies and others besides.
    pub(in crate::study) fn new(case: &Case, group: &str) -> Result<Self, SizeError> {
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
        Ok(Self { plies, factor: column, is_case_factor: own.is_some(), case_thickness_m: drawn_m, case })
    }

    /// The nominal factors of the case that is sized.
    pub(in crate::study) fn nominal_factors(&self) -> Vec<f64> {
        let own = self.case.factors.len() - usize::from(!self.is_case_factor);
        self.case.factors[..own].iter().map(|factor| factor.nominal).collect()
    }

    /// The nominal member at a total thickness of the plies.
    pub(in crate::study) fn nominal_member(&self, thickness_m: f64) -> Ensemble {
        let row = self.member_factors(&self.nominal_factors(), thickness_m);
        Ensemble::from_values(row.len(), row)
    }

    /// Factors of a member at a total thickness of the plies.
    pub(in crate::study) fn member_factors(&self, factors: &[f64], thickness_m: f64) -> Vec<f64> {
        let mut row = factors.to_vec();
        if !self.is_case_factor {
            row.push(1.0);
        }
        row[self.factor] *= thickness_m / self.case_thickness_m;
        row
    }
}

/// The case with some plies scaled by one ratio: positions behind them shift, and positions within them keep their
/// relative depth.
pub(super) fn with_scaled_plies(case: &Case, plies: &[usize], ratio: f64) -> Case {
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
        // A sensor on an interface must have exactly its depth.
        if way == 1.0 { after_m[ply + 1] } else { after_m[ply] + way * (after_m[ply + 1] - after_m[ply]) }
    };
    for sensor in drawn.sensors.iter_mut().filter(|sensor| sensor.depth_m >= before_m[0]) {
        sensor.depth_m = moved(sensor.depth_m);
    }
    // A linear initial profile across a scaled and an unscaled ply becomes piecewise linear.
    let exposure = &case.exposure;
    let mut depths_m: Vec<f64> = exposure.initial_k.iter().map(|point| point.0).chain(before_m.clone()).collect();
    depths_m.retain(|depth_m| (before_m[0]..=before_m[before_m.len() - 1]).contains(depth_m));
    depths_m.sort_by(f64::total_cmp);
    depths_m.dedup();
    if exposure.initial_k.len() > 1 {
        drawn.exposure.initial_k =
            depths_m.iter().map(|&depth_m| (moved(depth_m), exposure.initial_temperature_k(depth_m))).collect();
    }
    drawn
}

/// Mass per area of some plies at a total thickness, kg/m², with nominal factors.
pub(in crate::study) fn mass_kg_m2(case: &Case, plies: &[usize], thickness_m: f64) -> f64 {
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
