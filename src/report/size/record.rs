//! What `size` found, for a program.

use crate::case::Case;
use crate::report::files::json::{Counted, Named};
use crate::study::proportion::Proportion;
use crate::study::size::{Needed, Sizing};
use serde::Serialize;

/// Thicknesses of all the plies that are sized together, m; `null` where none within the bounds suffices, or every one does:
/// `outcome` says which.
#[derive(Serialize)]
pub(super) struct SizingRecord<'a> {
    ply: &'a str,
    sensor: &'a str,
    limit_k: f64,
    probability: f64,
    within_m: (f64, f64),
    drawn: Thickness,
    nominal: Thickness,
    needed: Thickness,
    /// Where `needed` lies with 95 % confidence.
    interval_m: (Option<f64>, Option<f64>),
    margin_m: Option<f64>,
    margin_kg_m2: Option<f64>,
    members: usize,
    failed: usize,
    marches: usize,
    still_warming: bool,
    shares: Named<'a, f64>,
    check: Option<CheckRecord>,
}

#[derive(Serialize)]
struct Thickness {
    /// `found`, `every`, `none`.
    outcome: &'static str,
    thickness_m: Option<f64>,
    kg_m2: Option<f64>,
    held: Option<Counted>,
}

#[derive(Serialize)]
struct CheckRecord {
    seed: u64,
    failed: usize,
    held: Counted,
    is_borne_out: Option<bool>,
    /// The shares between which `held` lies in 95 of 100 sizings: thickness and check both scatter.
    expected: Option<(f64, f64)>,
    nominal_peak_k: f64,
    /// Percentiles 2.5, 50, 97.5.
    peaks_k: [f64; 3],
}

impl Thickness {
    fn of(outcome: &Sizing, needed: Needed, held: Option<Proportion>) -> Self {
        Self {
            outcome: match needed {
                Needed::AtMost(_) => "every",
                Needed::At(_) => "found",
                Needed::Beyond(_) => "none",
            },
            thickness_m: needed.found_m(),
            kg_m2: needed.found_m().map(|at_m| outcome.mass_kg_m2(at_m)),
            held: held.map(Counted::of),
        }
    }
}

impl<'a> SizingRecord<'a> {
    pub(super) fn of(case: &'a Case, outcome: &'a Sizing) -> Self {
        let demand = &outcome.demand;
        Self {
            ply: &demand.ply,
            sensor: &case.sensors[demand.sensor].name,
            limit_k: demand.limit_k,
            probability: demand.probability,
            within_m: outcome.within_m,
            drawn: Thickness::of(outcome, Needed::At(outcome.drawn_m), Some(outcome.held(outcome.drawn_m))),
            nominal: Thickness::of(outcome, outcome.nominal, outcome.nominal.found_m().map(|at_m| outcome.held(at_m))),
            needed: Thickness::of(outcome, outcome.needed, None),
            interval_m: (outcome.interval.0.and_then(Needed::found_m), outcome.interval.1.and_then(Needed::found_m)),
            margin_m: outcome.margin_m(),
            margin_kg_m2: outcome.margin_m().map(|margin_m| outcome.mass_kg_m2(margin_m)),
            members: outcome.members,
            failed: outcome.failures.iter().map(|failure| failure.members).sum(),
            marches: outcome.marches,
            still_warming: outcome.still_warming,
            shares: Named(
                case.factors.iter().map(|factor| factor.name.as_str()).zip(outcome.shares.iter().copied()).collect(),
            ),
            check: outcome.check.as_ref().map(|check| CheckRecord {
                seed: check.seed,
                failed: check.failed,
                held: Counted::of(check.held),
                is_borne_out: outcome.is_borne_out(),
                expected: outcome.expected_95().map(|(low, high)| (low.share(), high.share())),
                nominal_peak_k: check.nominal_k,
                peaks_k: check.percentiles_k,
            }),
        }
    }
}
