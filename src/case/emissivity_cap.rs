//! Factors that take an emissivity above one, at which a march caps it.

use super::{Bounds, Case, Emissivity, Face, Property};

/// A factor that takes the emissivity of a face above that of a black surface.
#[derive(Clone, Debug, PartialEq)]
pub struct CappedEmissivity<'a> {
    /// Name of the factor.
    pub factor: &'a str,
    /// Name of the ply whose face radiates.
    pub ply: &'a str,
    /// The largest product of factor and emissivity, above one.
    pub product: f64,
}

impl Case {
    /// Factors whose nominal value, or one within `bounds`, takes the emissivity of a face above one.
    pub fn capped_emissivities(&self, bounds: Option<Bounds>) -> Vec<CappedEmissivity<'_>> {
        let (first, last) = (self.layup.plies.first(), self.layup.plies.last());
        let faces = [(first, &self.exposure.hot_face), (last, &self.exposure.back_face)];
        let of_material = faces.into_iter().filter_map(|(ply, face)| match face {
            Face::Open(open) if open.emissivity == Emissivity::Material => ply,
            _ => None,
        });
        let mut found: Vec<CappedEmissivity<'_>> = Vec::new();
        for ply in of_material {
            let scales = |property, group: &str| property == Property::Emissivity && ply.belongs_to(group);
            let Some(factor) = self.factors.iter().find(|factor| scales(factor.property, &factor.group)) else {
                continue;
            };
            let material = &ply.material;
            let residues = material.decomposition.iter().flat_map(|decomposition| &decomposition.residues);
            let tables = residues.map(|residue| &residue.emissivity).chain([&material.emissivity]);
            let highest = tables.flat_map(|table| table.values.iter().copied()).fold(0.0, f64::max);
            let largest = bounds.map_or(factor.nominal, |bounds| factor.bounds(bounds).1.max(factor.nominal));
            let capped = CappedEmissivity { factor: &factor.name, ply: &ply.name, product: largest * highest };
            if capped.product > 1.0 && !found.contains(&capped) {
                found.push(capped);
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_is_capped_where_it_takes_the_emissivity_above_one() {
        let mut case = Case::load("cases/lcat-2259".as_ref()).expect("a shipped case");
        let factor = case.factors.iter().position(|factor| factor.property == Property::Emissivity).expect("a factor");
        let highest = case.layup.plies[0].material.emissivity.values.iter().copied().fold(0.0, f64::max);
        case.factors[factor].small = (0.9, 0.999 / highest);
        case.factors[factor].nominal = 1.0;
        assert_eq!(case.capped_emissivities(Some(Bounds::Small)), []);
        case.factors[factor].small.1 = 1.3;
        assert_eq!(case.capped_emissivities(None), [], "the nominal value is one");
        let capped = case.capped_emissivities(Some(Bounds::Small));
        assert_eq!(capped.iter().map(|capped| capped.product).collect::<Vec<_>>(), [1.3 * highest]);
        case.factors[factor].nominal = 1.2;
        assert_eq!(case.capped_emissivities(None).len(), 1);
    }
}
