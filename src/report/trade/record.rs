//! The key `trade` of `summary.json`.

use super::mass_interval;
use crate::report::files::json::{OrderedMap, ProportionRecord};
use crate::study::answers::Answers;
use crate::study::size::RequiredThickness;
use crate::study::trade::{RankChange, SizedLayup, TableEnd, Trade};
use serde::Serialize;

#[derive(Serialize)]
pub(super) struct TradeRecord<'a> {
    /// Plies of the choices, in the order of the materials of a layup.
    plies: Vec<&'a str>,
    sized: &'a str,
    part: String,
    kind: &'static str,
    limit_k: f64,
    probability: f64,
    exposures: &'a [String],
    members: usize,
    /// `normal`, `uniform`, `lhs` or `sobol`; the last two have no intervals.
    sampling: &'static str,
    marches: usize,
    layups: Vec<LayupRecord<'a>>,
    /// `null` where the backend has no derivatives.
    rank_changes: Option<Vec<ChangeRecord<'a>>>,
}

#[derive(Serialize)]
struct LayupRecord<'a> {
    materials: Vec<&'a str>,
    rank: Option<usize>,
    rank_interval: Option<(usize, usize)>,
    first_share: Option<f64>,
    /// `found`; `every` or `none` where every or no allowed thickness suffices.
    outcome: &'static str,
    mass_kg_m2: Option<f64>,
    mass_interval_kg_m2: (Option<f64>, Option<f64>),
    thickness_range_m: (f64, f64),
    thickness_m: Option<f64>,
    nominal_m: Option<f64>,
    margin_m: Option<f64>,
    stated_m: f64,
    within_limit_as_stated: ProportionRecord,
    within_limit_thickest: ProportionRecord,
    governing_exposure: &'a str,
    variance_shares: OrderedMap<'a, f64>,
    failed: usize,
    peak_at_end: bool,
    not_cooled: bool,
    table_ends: &'a [TableEnd],
}

#[derive(Serialize)]
struct ChangeRecord<'a> {
    material: &'a str,
    property: &'static str,
    surrogate: bool,
    mark: &'static str,
    relative_uncertainty: Option<f64>,
    change: f64,
    deviations: Option<f64>,
    new_first: Vec<&'a str>,
}

impl<'a> TradeRecord<'a> {
    pub(super) fn of(answers: &'a Answers, outcome: &'a Trade) -> Self {
        let requirement = &outcome.request.requirement;
        let changes = outcome.rank_changes.as_ref();
        Self {
            plies: outcome.request.choices.iter().map(|(ply, _)| ply.as_str()).collect(),
            sized: &requirement.ply,
            part: requirement.part.name(&answers.case.layup, &answers.case.sensors),
            kind: requirement.part.kind(),
            limit_k: requirement.limit_k,
            probability: requirement.probability,
            exposures: &outcome.exposures,
            members: outcome.members,
            sampling: outcome.sampling,
            marches: outcome.marches,
            layups: outcome.layups.iter().map(|layup| layup_record(answers, outcome, layup)).collect(),
            rank_changes: changes.map(|changes| changes.iter().map(|change| change_record(outcome, change)).collect()),
        }
    }
}

fn layup_record<'a>(answers: &'a Answers, outcome: &'a Trade, layup: &'a SizedLayup) -> LayupRecord<'a> {
    let names = answers.case.factors.iter().map(|factor| factor.name.as_str());
    let within_limit = |thickness_m: f64| {
        ProportionRecord::of_members(layup.below_limit(thickness_m), outcome.has_independent_members)
    };
    LayupRecord {
        materials: outcome.materials_of(layup),
        rank: layup.rank.map(|rank| rank.rank),
        rank_interval: layup.rank.and_then(|rank| Some(rank.resampled?.interval)),
        first_share: layup.rank.and_then(|rank| Some(rank.resampled?.first_share)),
        outcome: match layup.required {
            RequiredThickness::AtMost(_) => "every",
            RequiredThickness::At(_) => "found",
            RequiredThickness::Beyond(_) => "none",
        },
        mass_kg_m2: layup.rank.map(|_| layup.required_mass_kg_m2()),
        mass_interval_kg_m2: mass_interval(layup),
        thickness_range_m: layup.thickness_range_m,
        thickness_m: layup.required.found_m(),
        nominal_m: layup.nominal_required().found_m(),
        margin_m: layup.margin_m(),
        stated_m: layup.case_thickness_m,
        within_limit_as_stated: within_limit(layup.case_thickness_m),
        within_limit_thickest: within_limit(layup.thickness_range_m.1),
        governing_exposure: &outcome.exposures[layup.governing_exposure()],
        variance_shares: OrderedMap(names.zip(layup.shares.iter().copied()).collect()),
        failed: layup.failures.iter().map(|failure| failure.members).sum(),
        peak_at_end: layup.still_warming,
        not_cooled: layup.not_cooled.is_some() && layup.failed_at_largest.is_none(),
        table_ends: &layup.table_ends,
    }
}

fn change_record<'a>(outcome: &'a Trade, change: &'a RankChange) -> ChangeRecord<'a> {
    ChangeRecord {
        material: &change.material,
        property: change.property.key(),
        surrogate: change.is_surrogate,
        mark: change.source_kind.key(),
        relative_uncertainty: change.relative_uncertainty,
        change: change.change,
        deviations: change.deviations(),
        new_first: outcome.materials_of(&outcome.layups[change.new_first]),
    }
}
