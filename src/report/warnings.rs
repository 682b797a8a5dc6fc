//! What an analyst should doubt before using an outcome.

use super::{answer, words};
use crate::case::{Case, Conductivity, Emissivity, Face, Material, Ply};
use crate::study::answers::Answers;
use crate::study::nominal::Nominal;
use crate::traces::Arrival;

/// A march whose heat, or mass, in, out and stored differ by more than this share of what moved is not trusted.
const BALANCE: f64 = 1e-3;
/// Tables that begin at room temperature are often left by a few kelvin, over which no property changes.
const EXCURSION_K: f64 = 10.0;
/// Beyond this a per cent of model error may be tens of per cent of an estimate (the range 30 to 100 marks
/// strong dependence in Belsley, Kuh & Welsch, *Regression Diagnostics*, 1980).
pub(super) const CONDITION: f64 = 50.0;

/// Every reason for doubt, each a sentence or two: those of every answer, then what temperatures were met beyond
/// tables.
pub(super) fn all(answers: &Answers) -> Vec<String> {
    let each = answer::all(answers);
    let mut doubts: Vec<String> = each.iter().flat_map(|answer| answer.warnings(answers)).collect();
    let marches: Vec<&Nominal> =
        answers.nominal_march().into_iter().chain(each.iter().find_map(|answer| answer.fitted())).collect();
    doubts.extend(excursions(&answers.case, &marches));
    doubts
}

/// The materials of a layup whose figures stand in for others, once each.
pub(super) fn surrogates(case: &Case) -> Vec<&Material> {
    let mut found: Vec<&Material> = Vec::new();
    for ply in &case.layup.plies {
        let stands_in = ply.material.note.to_lowercase().contains("surrogate");
        if stands_in && found.iter().all(|material| material.id != ply.material.id) {
            found.push(&ply.material);
        }
    }
    found
}

/// What is doubtful of the `which` march, `nominal` or `fitted`.
pub(super) fn march(case: &Case, outcome: &Nominal, which: &str) -> Vec<String> {
    let mut doubts = Vec::new();
    match &outcome.arrival {
        Arrival::Done => {}
        Arrival::Strayed { time_s } => doubts.push(format!(
            "The {which} march ran away at {}: nothing after that can be used.",
            words::seconds(*time_s)
        )),
        Arrival::LeftTable { ply, temperature_k } => doubts.push(format!(
            "The {which} march left a property table of ply {} at {}, and that table refuses to be left.",
            case.layup.plies[*ply].name,
            words::kelvin(*temperature_k)
        )),
    }
    if let Some(reached) = outcome.reached.as_ref().filter(|reached| reached.nominal_k > reached.tolerance_k) {
        doubts.push(format!(
            "The {which} march is off by {} K somewhere, more than the {} K asked for: state cells and steps under [resolution].",
            words::significant(reached.nominal_k, 2),
            words::significant(reached.tolerance_k, 2)
        ));
    }
    let gauges = outcome.reached.iter().flat_map(|reached| &reached.gauges);
    for gauge in gauges.filter(|gauge| gauge.error > gauge.tolerance) {
        doubts.push(format!(
            "The {which} march has an estimated error of the {} of {}, more than the tolerance of {}.",
            words::gauge_word(gauge.gauge),
            words::gauge_error(gauge.gauge, gauge.error),
            words::gauge_error(gauge.gauge, gauge.tolerance)
        ));
    }
    let residual = outcome.balance.residual();
    if residual.abs() > BALANCE {
        doubts.push(format!(
            "The energy of the {which} march does not balance: {} of the heat that moved is unaccounted for, where \
             {} is the limit. Refine the steps or the cells.",
            words::significant(residual, 2),
            words::significant(BALANCE, 1)
        ));
    }
    let residual = outcome.balance.mass_residual();
    if residual.abs() > BALANCE {
        doubts.push(format!(
            "The mass of the {which} march does not balance: {} of what moved is unaccounted for, where {} is the limit. \
             Refine the steps or the cells.",
            words::significant(residual, 2),
            words::significant(BALANCE, 1)
        ));
    }
    doubts
}

/// A property of a ply beyond the temperatures for which it was measured.
struct Excursion<'a> {
    ply: &'a Ply,
    is_above: bool,
    property: &'static str,
    /// Where its table ends, and what was met, K.
    bound_k: f64,
    met_k: f64,
}

/// Materials that met temperatures, in any of the marches, for which a property was not measured.
pub(super) fn excursions(case: &Case, marches: &[&Nominal]) -> Vec<String> {
    let mut doubts = Vec::new();
    let mut left: Vec<Excursion<'_>> = Vec::new();
    for (index, ply) in case.layup.plies.iter().enumerate() {
        let met = marches.iter().filter_map(|march| march.extremes_k.get(index));
        let Some((coldest_k, hottest_k)) = met.copied().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))) else { continue };
        for (property, (low_k, high_k)) in known(case, index) {
            if hottest_k > high_k + EXCURSION_K {
                left.push(Excursion { ply, is_above: true, property, bound_k: high_k, met_k: hottest_k });
            }
            if coldest_k < low_k - EXCURSION_K {
                left.push(Excursion { ply, is_above: false, property, bound_k: low_k, met_k: coldest_k });
            }
        }
    }
    // Plies of one material are told together.
    while let Some(first) = left.first() {
        let (id, is_above) = (first.ply.material.id.clone(), first.is_above);
        let alike = |other: &Excursion<'_>| other.ply.material.id == id && other.is_above == is_above;
        let (together, others): (Vec<_>, Vec<_>) = left.into_iter().partition(alike);
        doubts.push(told(&together));
        left = others;
    }
    doubts
}

/// Excursions of one material in one direction, in a sentence.
fn told(together: &[Excursion<'_>]) -> String {
    let (mut plies, mut tables): (Vec<&str>, Vec<String>) = (Vec::new(), Vec::new());
    for left in together {
        let ends = if left.is_above { "ends" } else { "begins" };
        let table = format!("{} {ends} at {} K", left.property, words::grouped(left.bound_k, 0));
        if !plies.contains(&left.ply.name.as_str()) {
            plies.push(&left.ply.name);
        }
        if !tables.contains(&table) {
            tables.push(table);
        }
    }
    let farthest = together.iter().max_by(|a, b| (a.met_k - a.bound_k).abs().total_cmp(&(b.met_k - b.bound_k).abs()));
    let (material, met_k) = farthest.map_or(("", f64::NAN), |left| (left.ply.material.name.as_str(), left.met_k));
    format!(
        "{material} ({}) met {}, beyond its tables: {}.",
        words::listed(&plies),
        words::kelvin(met_k),
        words::listed(&tables)
    )
}

/// The properties of a ply that act, and the temperatures between which each is known, K.
fn known(case: &Case, index: usize) -> Vec<(&'static str, (f64, f64))> {
    let material = &case.layup.plies[index].material;
    let conductivity = match &material.conductivity {
        Conductivity::Tables(tables) => tables
            .iter()
            .map(|(_, table)| table.range_k())
            .reduce(|a, b| (a.0.max(b.0), a.1.min(b.1)))
            .unwrap_or((f64::NEG_INFINITY, f64::INFINITY)),
        Conductivity::Parts(parts) => parts.range_k,
    };
    let mut known = vec![("conductivity", conductivity), ("heat capacity", material.heat_capacity.range_k())];
    let radiates = |face: &Face| matches!(face, Face::Open(open) if open.emissivity == Emissivity::Material);
    let (hot, back) = (index == 0, index + 1 == case.layup.plies.len());
    if (hot && radiates(&case.exposure.hot_face)) || (back && radiates(&case.exposure.back_face)) {
        known.push(("emissivity", material.emissivity.range_k()));
    }
    known
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fixture;

    /// How many doubts of a study say this.
    fn saying(outcomes: &fixture::Outcomes, text: &str) -> usize {
        all(&outcomes.answers("study")).iter().filter(|doubt| doubt.contains(text)).count()
    }

    #[test]
    fn gas_that_is_lost_on_its_way_is_doubted() {
        let mut outcomes = fixture::outcomes().charring();
        assert_eq!(saying(&outcomes, "The mass of the nominal march does not balance"), 0);
        outcomes.estimated.fitted[0].before.balance.gas_out_kg_m2 *= 0.99;
        outcomes.nominal.balance = outcomes.estimated.fitted[0].before.balance;
        assert_eq!(saying(&outcomes, "The mass of the nominal march does not balance"), 1);
    }

    #[test]
    fn a_ply_hotter_than_its_tables_is_doubted_and_one_within_them_is_not() {
        let mut outcomes = fixture::outcomes();
        assert_eq!(saying(&outcomes, "Pyrogel 3350 (INS1) met 1,320 K (1,047 °C), beyond its tables"), 1);
        outcomes.estimated.fitted[0].after.extremes_k[3].1 = 1250.0;
        assert_eq!(saying(&outcomes, "Pyrogel 3350 (INS1 and INS2) met 1,320 K"), 1);
        outcomes.case.layup.plies[2].material = std::sync::Arc::clone(&outcomes.case.layup.plies[0].material);
        assert_eq!(saying(&outcomes, "Pyrogel 3350 (INS2) met 1,250 K"), 1);
    }
}
