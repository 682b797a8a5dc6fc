//! The variables of a joint estimate: the factors of several cases, shared by name.

use super::EstimateError;
use crate::case::{Case, Factor};

/// A factor to estimate, in every case that has it.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct Estimand {
    /// The factor as the first case defines it. Its name ends in `@` and the case id where other cases define a
    /// different factor of that name.
    pub factor: Factor,
    /// Index of the estimand among the factors of each case; `None` where the case lacks it.
    pub factor_indices: Vec<Option<usize>>,
    /// Intersection of the side constraints of all its cases.
    pub bounds: (f64, f64),
    /// Start of the first minimisation.
    pub start: f64,
}

/// The factors that any case selects, in order. Factors of one name are one variable in all cases where they scale the
/// same property of the same materials. Where the materials differ, they are different variables, estimated only by the
/// cases that select them.
pub(super) fn estimands(cases: &[&Case]) -> Result<Vec<Estimand>, EstimateError> {
    let mut found: Vec<Estimand> = Vec::new();
    for (which, case) in cases.iter().enumerate() {
        for (chosen, &place) in case.estimate.factors.iter().enumerate() {
            if found.iter().any(|estimand| estimand.factor_indices[which] == Some(place)) {
                continue;
            }
            let factor = &case.factors[place];
            let places: Vec<Option<usize>> = cases.iter().map(|other| matching_factor(case, factor, other)).collect();
            let start = case.estimate.start.get(chosen).copied().unwrap_or(factor.nominal);
            let bounds = bounds(cases, &places, factor)?;
            found.push(Estimand {
                factor: factor.clone(),
                factor_indices: places,
                bounds,
                start: start.max(bounds.0).min(bounds.1),
            });
        }
    }
    let names: Vec<String> = found.iter().map(|estimand| estimand.factor.name.clone()).collect();
    for estimand in &mut found {
        let home = estimand.factor_indices.iter().position(Option::is_some);
        if let Some(home) = home.filter(|_| names.iter().filter(|name| **name == estimand.factor.name).count() > 1) {
            estimand.factor.name += &format!("@{}", cases[home].id);
        }
    }
    Ok(found)
}

/// Index of the factor in another case with the same name, property and materials.
fn matching_factor(case: &Case, factor: &Factor, other: &Case) -> Option<usize> {
    other.factors.iter().position(|candidate| {
        let is_same = (&candidate.name, candidate.property, &candidate.state, &candidate.group)
            == (&factor.name, factor.property, &factor.state, &factor.group);
        is_same && scaled_materials(other, candidate) == scaled_materials(case, factor)
    })
}

/// The materials of the plies that a factor scales, each once.
fn scaled_materials<'a>(case: &'a Case, factor: &Factor) -> Vec<&'a str> {
    let scaled = case.layup.plies.iter().filter(|ply| ply.group == factor.group || ply.name == factor.group);
    let mut materials: Vec<&str> = scaled.map(|ply| ply.material.id.as_str()).collect();
    materials.sort_unstable();
    materials.dedup();
    materials
}

fn bounds(cases: &[&Case], places: &[Option<usize>], factor: &Factor) -> Result<(f64, f64), EstimateError> {
    let each =
        cases.iter().zip(places).filter_map(|(case, place)| Some(case.factors[(*place)?].bounds(case.estimate.bounds)));
    let (low, high) = each.fold((f64::NEG_INFINITY, f64::INFINITY), |(a, b), (low, high)| (a.max(low), b.min(high)));
    if low < high {
        Ok((low, high))
    } else {
        Err(EstimateError::DisjointBounds { factor: factor.name.clone(), low, high })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Bounds, Property};

    fn case(id: &str, material: &str) -> Case {
        let mut case = Case::load("cases/lcat-2259".as_ref()).expect("a shipped case");
        case.id = id.to_owned();
        let felt = crate::case::Material::named(material).expect("a shipped material");
        for ply in case.layup.plies.iter_mut().filter(|ply| ply.group == "INS") {
            ply.material = std::sync::Arc::new(felt.clone());
        }
        case
    }

    #[test]
    fn a_factor_is_shared_by_name_where_it_scales_the_same_material_and_split_otherwise() {
        let cases = [case("thick", "pyrogel3350"), case("thin", "pyrogel2250")];
        let found = estimands(&cases.each_ref()).expect("bounds that meet");
        let variables: Vec<(&str, &[Option<usize>])> =
            found.iter().map(|estimand| (estimand.factor.name.as_str(), estimand.factor_indices.as_slice())).collect();
        let (cloth, thick, thin) = ([Some(0), Some(0)], [Some(3), None], [None, Some(3)]);
        assert_eq!(variables, [("f_eps_OF", &cloth[..]), ("f_k_INS@thick", &thick[..]), ("f_k_INS@thin", &thin[..])]);
        let same = [case("a", "pyrogel3350"), case("b", "pyrogel3350")];
        assert_eq!(estimands(&same.each_ref()).expect("bounds that meet").len(), 2);
    }

    #[test]
    fn a_case_shares_a_factor_that_another_selects_only_for_the_same_property() {
        let mut cases = [case("a", "pyrogel3350"), case("b", "pyrogel3350")];
        cases[1].estimate.factors.clear();
        let found = estimands(&cases.each_ref()).expect("bounds that meet");
        assert!(found.len() == 2 && found.iter().all(|estimand| estimand.factor_indices[1].is_some()));
        cases[1].factors[3].property = Property::HeatCapacity;
        assert_eq!(estimands(&cases.each_ref()).expect("bounds that meet")[1].factor_indices, [Some(3), None]);
    }

    #[test]
    fn bounds_are_the_intersection_over_cases_and_an_empty_one_is_an_error() {
        let mut cases = [case("a", "pyrogel3350"), case("b", "pyrogel3350")];
        cases[0].estimate.bounds = Bounds::Large;
        cases[0].estimate.start = vec![1.0, 1.4];
        let found = estimands(&cases.each_ref()).expect("bounds that meet");
        assert_eq!((found[1].bounds, found[1].start), ((0.75, 1.25), 1.25), "a start is clamped to the bounds");
        cases[1].factors[3].small = (1.6, 1.8);
        let fault = estimands(&cases.each_ref()).expect_err("no room");
        assert!(fault.to_string().contains("f_k_INS") && fault.to_string().contains("1.6"), "{fault}");
    }
}
