//! Keys of a sensitivity study in `summary.json`.

use super::reduction;
use crate::case::Case;
use crate::report::files::json::Named;
use crate::study::sensitivity::Sensitivity;
use serde::Serialize;

#[derive(Serialize)]
pub(super) struct Estimable<'a> {
    /// The proposed set: influential factors that the data can distinguish.
    factors: Vec<&'a str>,
    influential: Vec<&'a str>,
    /// Factor → share of the variance of the data.
    variance_shares: Named<'a, f64>,
    /// Why each of the others was excluded, in the order of exclusion.
    excluded: Vec<String>,
    /// How the set that the case states differs.
    #[serde(skip_serializing_if = "Option::is_none")]
    stated: Option<String>,
    standard_errors: &'a [f64],
    condition_number: f64,
    rank: usize,
    weakest_direction: &'a str,
    all_factors: Together<'a>,
}

/// The set of all factors.
#[derive(Serialize)]
struct Together<'a> {
    condition_number: f64,
    rank: usize,
    weakest_direction: &'a str,
}

pub(super) fn estimable<'a>(case: &'a Case, outcome: &'a Sensitivity) -> Estimable<'a> {
    let (proposed, all) = (&outcome.proposed, &outcome.all);
    let name = |&factor: &usize| case.factors[factor].name.as_str();
    Estimable {
        factors: proposed.factors.iter().map(name).collect(),
        influential: outcome.matter().iter().map(name).collect(),
        variance_shares: Named(all.factors.iter().map(|factor| (name(factor), outcome.shares[*factor])).collect()),
        excluded: outcome.reduction.iter().map(|dropped| reduction::left_out(case, dropped)).collect(),
        stated: reduction::stated(case, outcome),
        standard_errors: &proposed.standard_errors,
        condition_number: proposed.condition_number,
        rank: proposed.rank,
        weakest_direction: &proposed.weakest,
        all_factors: Together {
            condition_number: all.condition_number,
            rank: all.rank,
            weakest_direction: &all.weakest,
        },
    }
}
