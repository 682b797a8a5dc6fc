//! How far a property of a material would have to change for another layup to come first.

use super::SizedLayup;
use super::mass_derivatives::MassDerivative;
use crate::case::{Material, Property, Provenance, SourceKind};

/// The relative change of a property, of the same material in all layups, at which another layup becomes the lightest;
/// linear in the property.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct RankChange {
    /// Id of the material.
    pub material: String,
    /// The property.
    pub property: Property,
    /// Relative change of the property: −0.2 for a fifth less.
    pub change: f64,
    /// Index of the layup that then comes first.
    pub new_first: usize,
    /// Stated relative standard deviation of the property; `None` where none is stated.
    pub relative_uncertainty: Option<f64>,
    /// Kind of source of the property.
    pub source_kind: SourceKind,
    /// Whether the material is a surrogate.
    pub is_surrogate: bool,
}

impl RankChange {
    /// The change in stated standard deviations of the property.
    pub fn deviations(&self) -> Option<f64> {
        self.relative_uncertainty.filter(|deviation| *deviation > 0.0).map(|deviation| self.change.abs() / deviation)
    }
}

/// Largest change that is reported: a linear extrapolation says nothing about more.
const MAX_CHANGE: f64 = 1.0;

/// The changes of at most 100 % by which another layup comes first, those of the fewest standard deviations first.
/// `layups` are in order of mass.
pub(super) fn rank_changes(
    layups: &[SizedLayup],
    derivatives: &[Vec<MassDerivative>],
    materials: &[&Material],
) -> Vec<RankChange> {
    let is_first = |layup: &SizedLayup| layup.rank.is_some_and(|rank| rank.rank == 1);
    let firsts = layups.iter().take_while(|layup| is_first(layup)).count();
    let ranked = layups.iter().take_while(|layup| layup.rank.is_some()).count();
    let slope = |layup: usize, of: &MassDerivative| {
        let known =
            derivatives[layup].iter().find(|known| (&known.material, known.property) == (&of.material, of.property));
        known.map_or(0.0, |known| known.mass_kg_m2)
    };
    let line = |layup: usize, of: &MassDerivative| (layups[layup].required_mass_kg_m2(), slope(layup, of));
    let mut changes: Vec<RankChange> = Vec::new();
    for of in derivatives[..ranked].iter().flatten() {
        if changes.iter().any(|known| (&known.material, known.property) == (&of.material, of.property)) {
            continue;
        }
        let lines: Vec<(f64, f64)> = (0..firsts).map(|layup| line(layup, of)).collect();
        let overtaking = (firsts..ranked).filter_map(|layup| Some((smallest_change(line(layup, of), &lines)?, layup)));
        let nearest = overtaking.min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        let Some((change, new_first)) = nearest.filter(|(change, _)| change.abs() < MAX_CHANGE) else { continue };
        let Some(material) = materials.iter().find(|material| material.id == of.material) else { continue };
        let Provenance { source_kind, relative_uncertainty, .. } = *provenance(material, of.property);
        let (property, is_surrogate) = (of.property, material.is_surrogate());
        let material = material.id.clone();
        changes.push(RankChange {
            material,
            property,
            change,
            new_first,
            relative_uncertainty,
            source_kind,
            is_surrogate,
        });
    }
    let likelihood = |change: &RankChange| (change.deviations().unwrap_or(f64::INFINITY), change.change.abs());
    changes.sort_by(|a, b| {
        let (a, b) = (likelihood(a), likelihood(b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    changes
}

/// The smallest change, of either sign, at which a mass is no larger than each of others; each mass is linear in the
/// change, as its value and its slope.
fn smallest_change((mass, slope): (f64, f64), others: &[(f64, f64)]) -> Option<f64> {
    let with_sign = |sign: f64| {
        let root = |&(other, other_slope): &(f64, f64)| {
            let closing = sign * (other_slope - slope);
            if closing > 0.0 { (mass - other) / closing } else { f64::INFINITY }
        };
        sign * others.iter().map(root).fold(0.0, f64::max)
    };
    let (up, down) = (with_sign(1.0), with_sign(-1.0));
    Some(if up <= -down { up } else { down }).filter(|change| change.is_finite())
}

fn provenance(material: &Material, property: Property) -> &Provenance {
    match property {
        Property::Density => &material.density_provenance,
        Property::HeatCapacity => &material.heat_capacity_provenance,
        Property::Emissivity => &material.emissivity_provenance,
        _ => &material.conductivity_provenance,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_layup_comes_first_once_it_is_lighter_than_all_first_ones() {
        // 2 + δ against 1 and 1 − δ: lighter than the first from −1 on, and than the second never.
        assert_eq!(smallest_change((2.0, 1.0), &[(1.0, 0.0)]), Some(-1.0));
        assert_eq!(smallest_change((2.0, 1.0), &[(1.0, 0.0), (1.0, 3.0)]), None);
        assert_eq!(smallest_change((2.0, -4.0), &[(1.0, 0.0), (1.0, -2.0)]), Some(0.5));
        assert_eq!(smallest_change((2.0, 1.0), &[(1.0, 1.0)]), None);
    }
}
