//! Keys of a sensitivity study in `summary.json`.

use super::subset_selection;
use crate::case::Case;
use crate::report::files::json::OrderedMap;
use crate::study::sensitivity::Sensitivity;
use serde::Serialize;

#[derive(Serialize)]
pub(super) struct IdentifiabilityRecord<'a> {
    /// The proposed set: influential factors that the data can distinguish.
    factors: Vec<&'a str>,
    influential: Vec<&'a str>,
    /// Factor → share of the variance of the data.
    variance_shares: OrderedMap<'a, f64>,
    /// Why each of the others was excluded, in the order of exclusion.
    excluded: Vec<String>,
    /// How the set that the case states differs.
    #[serde(skip_serializing_if = "Option::is_none")]
    stated: Option<String>,
    standard_errors: &'a [f64],
    condition_number: f64,
    rank: usize,
    weakest_direction: &'a str,
    all_factors: AllFactorsRecord<'a>,
}

/// The set of all factors.
#[derive(Serialize)]
struct AllFactorsRecord<'a> {
    condition_number: f64,
    rank: usize,
    weakest_direction: &'a str,
}

pub(super) fn identifiability_record<'a>(case: &'a Case, outcome: &'a Sensitivity) -> IdentifiabilityRecord<'a> {
    let (proposed, all) = (&outcome.recommended, &outcome.all);
    let name = |&factor: &usize| case.factors[factor].name.as_str();
    IdentifiabilityRecord {
        factors: proposed.factors.iter().map(name).collect(),
        influential: outcome.influential_factors().iter().map(name).collect(),
        variance_shares: OrderedMap(all.factors.iter().map(|factor| (name(factor), outcome.shares[*factor])).collect()),
        excluded: outcome.reduction.iter().map(|dropped| subset_selection::exclusion_reason(case, dropped)).collect(),
        stated: subset_selection::stated_set(case, outcome),
        standard_errors: &proposed.standard_errors,
        condition_number: proposed.condition_number,
        rank: proposed.rank,
        weakest_direction: &proposed.weakest_direction,
        all_factors: AllFactorsRecord {
            condition_number: all.condition_number,
            rank: all.rank,
            weakest_direction: &all.weakest_direction,
        },
    }
}
