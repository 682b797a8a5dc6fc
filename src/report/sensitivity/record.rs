//! What the derivatives add to `summary.json`.

use super::reduction;
use crate::case::Case;
use crate::report::files::json::Named;
use crate::study::sensitivity::Sensitivity;
use serde::Serialize;

#[derive(Serialize)]
pub(super) struct Estimable<'a> {
    factors: Vec<&'a str>,
    /// Of those that matter they are the ones that the data tell apart.
    matter: Vec<&'a str>,
    /// Of the variance of the data.
    shares: Named<'a, f64>,
    /// Why each of the others was left out, in the order they went.
    left_out: Vec<String>,
    /// How the set that the case states differs.
    #[serde(skip_serializing_if = "Option::is_none")]
    stated: Option<String>,
    standard_errors: &'a [f64],
    condition_number: f64,
    rank: usize,
    weakest: &'a str,
    all: Together<'a>,
}

/// What the data say of all factors at once.
#[derive(Serialize)]
struct Together<'a> {
    condition_number: f64,
    rank: usize,
    weakest: &'a str,
}

pub(super) fn estimable<'a>(case: &'a Case, outcome: &'a Sensitivity) -> Estimable<'a> {
    let (proposed, all) = (&outcome.proposed, &outcome.all);
    let name = |&factor: &usize| case.factors[factor].name.as_str();
    Estimable {
        factors: proposed.factors.iter().map(name).collect(),
        matter: outcome.matter().iter().map(name).collect(),
        shares: Named(all.factors.iter().map(|factor| (name(factor), outcome.shares[*factor])).collect()),
        left_out: outcome.reduction.iter().map(|dropped| reduction::left_out(case, dropped)).collect(),
        stated: reduction::stated(case, outcome),
        standard_errors: &proposed.standard_errors,
        condition_number: proposed.condition_number,
        rank: proposed.rank,
        weakest: &proposed.weakest,
        all: Together { condition_number: all.condition_number, rank: all.rank, weakest: &all.weakest },
    }
}
