//! Warnings about a result.

use super::format;
use crate::case::{CappedEmissivity, Case, Material};
use crate::study::answers::Answers;
use crate::study::nominal::{ErrorEstimate, Prediction};
use crate::study::validity::{MAX_BALANCE_RESIDUAL, MOSTLY_ROUNDING, TableExcursion, balances};
use crate::traces::{Balance, MemberStatus};

/// All warnings: those of every result, then temperatures beyond property tables.
pub(super) fn all(answers: &Answers) -> Vec<String> {
    let each = answers.results();
    let mut warnings: Vec<String> = each.iter().flat_map(|answer| answer.warnings(answers)).collect();
    let marches: Vec<&Prediction> =
        answers.nominal_march().into_iter().chain(each.iter().find_map(|answer| answer.fitted())).collect();
    warnings.extend(answers.run.remarks.iter().cloned());
    warnings.extend(table_excursions(&answers.case, &marches));
    if !marches.is_empty() {
        warnings.extend(emissivity_caps(answers));
    }
    warnings
}

/// Warnings about factors that take an emissivity above one: those that vary in the study within their bounds, the
/// others at their nominal value.
fn emissivity_caps(answers: &Answers) -> Vec<String> {
    let swept = answers.uncertainty.as_ref().map(|swept| swept.bounds);
    let bounds = swept.or(answers.estimated.as_ref().map(|_| answers.case.estimate.bounds));
    let capped = answers.case.capped_emissivities(bounds);
    let warning = |capped: &CappedEmissivity<'_>| {
        format!(
            "{} takes the emissivity of {} up to {}, above that of a black surface: the march uses at most 1.",
            capped.factor,
            capped.ply,
            format::significant(capped.product, 3)
        )
    };
    capped.iter().map(warning).collect()
}

/// Materials of the layup whose note calls them surrogates, once each.
pub(super) fn surrogates(case: &Case) -> Vec<&Material> {
    let mut found: Vec<&Material> = Vec::new();
    for ply in &case.layup.plies {
        if ply.material.is_surrogate() && found.iter().all(|material| material.id != ply.material.id) {
            found.push(&ply.material);
        }
    }
    found
}

/// Warnings about the `which` march, `nominal` or `fitted`.
pub(super) fn march_warnings(case: &Case, outcome: &Prediction, which: &str) -> Vec<String> {
    let mut warnings = Vec::new();
    match &outcome.status {
        MemberStatus::Completed => {}
        MemberStatus::Diverged { time_s } => {
            warnings.push(format!("The {which} march diverged at {}: it has no values.", format::seconds(*time_s)));
        }
        MemberStatus::OutOfTable { ply, temperature_k } => warnings.push(format!(
            "The {which} march left a property table of ply {} at {}; the table does not allow extrapolation, so that \
             the march has no values.",
            case.layup.plies[*ply].name,
            format::kelvin(*temperature_k)
        )),
    }
    warnings.extend(accuracy_warnings(outcome.error_estimate.as_ref(), &outcome.balance, &format!("{which} march")));
    warnings
}

/// Warnings about the discretisation error and the balances of a march, such as the `nominal march`.
pub(super) fn accuracy_warnings(reached: Option<&ErrorEstimate>, balance: &Balance, march: &str) -> Vec<String> {
    let mut warnings = Vec::new();
    if let Some(reached) = reached.filter(|reached| reached.nominal_k > reached.tolerance_k) {
        let [cause, remedy] = match reached.is_rounding(reached.nominal_k, |rounding| rounding.nominal_k) {
            true => [MOSTLY_ROUNDING, "march in f64"],
            false => ["", "set cells and steps in [resolution]"],
        };
        warnings.push(format!(
            "The discretisation error of the {march}{cause} is {} K, above the tolerance of {} K: {remedy}.",
            format::significant(reached.nominal_k, 2),
            format::significant(reached.tolerance_k, 2)
        ));
    }
    if let Some(reached) = reached {
        for gauge in reached.gauges.iter().filter(|gauge| gauge.error > gauge.tolerance) {
            let [cause, remedy] = match reached.is_rounding(gauge.error, |rounding| rounding.of_gauge(gauge.gauge)) {
                true => [MOSTLY_ROUNDING, ": march in f64"],
                false => ["", ""],
            };
            warnings.push(format!(
                "The discretisation error of the {march} in {}{cause} is {}, above the tolerance of {}{remedy}.",
                format::gauge_name(gauge.gauge),
                format::gauge_error(gauge.gauge, gauge.error),
                format::gauge_error(gauge.gauge, gauge.tolerance)
            ));
        }
    }
    for (balance, residual, remedy) in balances(reached, balance) {
        if residual.abs() > MAX_BALANCE_RESIDUAL {
            warnings.push(format!(
                "The {balance} balance of the {march} has a relative residual of {}, above the limit of {}: {remedy}.",
                format::significant(residual, 2),
                format::significant(MAX_BALANCE_RESIDUAL, 1)
            ));
        }
    }
    warnings
}

/// Warnings about materials that left a property table in any of the marches.
pub(super) fn table_excursions(case: &Case, marches: &[&Prediction]) -> Vec<String> {
    let mut warnings = Vec::new();
    let mut left = TableExcursion::all(case, marches);
    // One warning for all plies of a material.
    while let Some(first) = left.first() {
        let (id, is_above) = (first.ply.material.id.clone(), first.is_above);
        let alike = |other: &TableExcursion<'_>| other.ply.material.id == id && other.is_above == is_above;
        let (together, others): (Vec<_>, Vec<_>) = left.into_iter().partition(alike);
        warnings.push(excursion_warning(&together));
        left = others;
    }
    warnings
}

/// Warning about excursions of one material in one direction.
fn excursion_warning(together: &[TableExcursion<'_>]) -> String {
    let (mut plies, mut tables): (Vec<&str>, Vec<String>) = (Vec::new(), Vec::new());
    for left in together {
        let ends = if left.is_above { "ends" } else { "begins" };
        let table = format!("{} {ends} at {} K", left.property, format::grouped(left.bound_k, 0));
        if !plies.contains(&left.ply.name.as_str()) {
            plies.push(&left.ply.name);
        }
        if !tables.contains(&table) {
            tables.push(table);
        }
    }
    let farthest =
        together.iter().max_by(|a, b| (a.extreme_k - a.bound_k).abs().total_cmp(&(b.extreme_k - b.bound_k).abs()));
    let (material, met_k) = farthest.map_or(("", f64::NAN), |left| (left.ply.material.name.as_str(), left.extreme_k));
    format!(
        "{material} ({}) reaches {}, beyond its property tables: {}.",
        format::list(&plies),
        format::kelvin(met_k),
        format::list(&tables)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::marched;

    /// Number of warnings of a study that contain a text.
    fn count_of(outcomes: &marched::Study, text: &str) -> usize {
        all(&outcomes.answers("study")).iter().filter(|warning| warning.contains(text)).count()
    }

    #[test]
    fn a_mass_imbalance_is_warned_of() {
        let mut outcomes = marched::charring();
        assert_eq!(count_of(&outcomes, "The mass balance of the nominal march"), 0);
        outcomes.estimated.fitted[0].before.balance.gas_out_kg_m2 *= 0.99;
        outcomes.nominal.balance = outcomes.estimated.fitted[0].before.balance;
        assert_eq!(count_of(&outcomes, "The mass balance of the nominal march"), 1);
    }

    #[test]
    fn a_ply_beyond_its_tables_is_warned_of_and_one_within_them_is_not() {
        let mut outcomes = marched::study();
        let fitted = &mut outcomes.estimated.fitted[0];
        for march in [&mut outcomes.nominal, &mut fitted.before, &mut fitted.after] {
            (march.extremes_k[2].1, march.extremes_k[3].1) = (1320.0, 900.0);
        }
        assert_eq!(
            count_of(&outcomes, "Pyrogel 3350 (INS1) reaches 1,320 K (1,047 °C), beyond its property tables"),
            1
        );
        outcomes.estimated.fitted[0].after.extremes_k[3].1 = 1250.0;
        assert_eq!(count_of(&outcomes, "Pyrogel 3350 (INS1 and INS2) reaches 1,320 K"), 1);
        outcomes.case.layup.plies[2].material = std::sync::Arc::clone(&outcomes.case.layup.plies[0].material);
        assert_eq!(count_of(&outcomes, "Pyrogel 3350 (INS2) reaches 1,250 K"), 1);
    }
}
