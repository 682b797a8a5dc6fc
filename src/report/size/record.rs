//! The key `sizing` of `summary.json`.

use crate::case::Case;
use crate::fit::proportion::Proportion;
use crate::report::files::json::{OrderedMap, ProportionRecord};
use crate::study::size::{RequiredThickness, Sizing};
use serde::Serialize;

/// Total thicknesses of the sized plies, m; `null` where none or every thickness of the range suffices, as `outcome`
/// states.
#[derive(Serialize)]
pub(super) struct SizingRecord<'a> {
    ply: &'a str,
    /// Name and kind (`sensor`, `ply` or `interface`) of the part with the limit.
    part: String,
    kind: &'static str,
    limit_k: f64,
    probability: f64,
    thickness_range_m: (f64, f64),
    stated: Thickness,
    nominal: Thickness,
    required: Thickness,
    /// 95 % confidence interval of `required`.
    interval_m: (Option<f64>, Option<f64>),
    margin_m: Option<f64>,
    margin_kg_m2: Option<f64>,
    members: usize,
    /// `normal`, `uniform`, `lhs` or `sobol`; the last two have no intervals but those of the check.
    sampling: &'static str,
    failed: usize,
    marches: usize,
    peak_at_end: bool,
    variance_shares: OrderedMap<'a, f64>,
    check: Option<CheckRecord>,
}

#[derive(Serialize)]
struct Thickness {
    /// `found`, `every`, `none`.
    outcome: &'static str,
    thickness_m: Option<f64>,
    mass_kg_m2: Option<f64>,
    within_limit: Option<ProportionRecord>,
}

#[derive(Serialize)]
struct CheckRecord {
    seed: u64,
    failed: usize,
    within_limit: ProportionRecord,
    confirmed: Option<bool>,
    /// 95 % range of `within_limit`, from the sampling errors of thickness and check.
    expected: Option<(f64, f64)>,
    nominal_peak_k: f64,
    /// Percentiles 2.5, 50, 97.5.
    peaks_k: [f64; 3],
}

impl Thickness {
    fn of(outcome: &Sizing, needed: RequiredThickness, within_limit: Option<Proportion>) -> Self {
        Self {
            outcome: match needed {
                RequiredThickness::AtMost(_) => "every",
                RequiredThickness::At(_) => "found",
                RequiredThickness::Beyond(_) => "none",
            },
            thickness_m: needed.found_m(),
            mass_kg_m2: needed.found_m().map(|at_m| outcome.mass_kg_m2(at_m)),
            within_limit: within_limit
                .map(|counted| ProportionRecord::of_members(counted, outcome.has_independent_members)),
        }
    }
}

impl<'a> SizingRecord<'a> {
    pub(super) fn of(case: &'a Case, outcome: &'a Sizing) -> Self {
        let demand = &outcome.requirement;
        Self {
            ply: &demand.ply,
            part: demand.part.name(&case.layup, &case.sensors),
            kind: demand.part.kind(),
            limit_k: demand.limit_k,
            probability: demand.probability,
            thickness_range_m: outcome.thickness_range_m,
            stated: Thickness::of(
                outcome,
                RequiredThickness::At(outcome.case_thickness_m),
                Some(outcome.below_limit(outcome.case_thickness_m)),
            ),
            nominal: Thickness::of(
                outcome,
                outcome.nominal,
                outcome.nominal.found_m().map(|at_m| outcome.below_limit(at_m)),
            ),
            required: Thickness::of(outcome, outcome.required, None),
            interval_m: (
                outcome.interval.0.and_then(RequiredThickness::found_m),
                outcome.interval.1.and_then(RequiredThickness::found_m),
            ),
            margin_m: outcome.margin_m(),
            margin_kg_m2: outcome.margin_m().map(|margin_m| outcome.mass_kg_m2(margin_m)),
            members: outcome.members,
            sampling: outcome.sampling,
            failed: outcome.failures.iter().map(|failure| failure.members).sum(),
            marches: outcome.marches,
            peak_at_end: outcome.still_warming,
            variance_shares: OrderedMap(
                case.factors.iter().map(|factor| factor.name.as_str()).zip(outcome.shares.iter().copied()).collect(),
            ),
            check: outcome.check.as_ref().map(|check| CheckRecord {
                seed: check.seed,
                failed: check.failed,
                within_limit: ProportionRecord::of(check.below_limit),
                confirmed: outcome.is_confirmed(),
                expected: outcome.expected_count_95().map(|(low, high)| (low.fraction(), high.fraction())),
                nominal_peak_k: check.nominal_k,
                peaks_k: check.percentiles_k,
            }),
        }
    }
}
