//! What `size` and `twin --study` found, for a program.

use super::Named;
use crate::case::Case;
use crate::study::proportion::Proportion;
use crate::study::recovery::Recovery;
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

/// A counted share with its binomial interval at 95 %.
#[derive(Serialize)]
struct Counted {
    count: usize,
    of: usize,
    share: f64,
    interval: (f64, f64),
}

impl Counted {
    fn of(counted: Proportion) -> Self {
        Self { count: counted.count, of: counted.of, share: counted.share(), interval: counted.interval_95() }
    }
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

/// A study of twins.
#[derive(Serialize)]
pub(super) struct RecoveryRecord<'a> {
    asked: usize,
    converged: usize,
    /// K; `null` where each sample had the standard deviation that the case states.
    noise_k: Option<f64>,
    correlation_s: f64,
    drawn: &'a str,
    samples: usize,
    effective_samples: f64,
    covered: Counted,
    factors: Named<'a, RecoveredRecord>,
}

#[derive(Serialize)]
struct RecoveredRecord {
    bias: f64,
    bias_standard_error: f64,
    rms: f64,
    half_width: f64,
    covered: Counted,
    at_bound: usize,
}

impl<'a> RecoveryRecord<'a> {
    pub(super) fn of(outcome: &'a Recovery) -> Self {
        let factors = outcome.recovered.iter().map(|factor| {
            let record = RecoveredRecord {
                bias: factor.bias,
                bias_standard_error: factor.bias_error,
                rms: factor.rms,
                half_width: factor.half_width,
                covered: Counted::of(factor.covered),
                at_bound: factor.at_bound,
            };
            (factor.name.as_str(), record)
        });
        Self {
            asked: outcome.twins.len(),
            converged: outcome.converged(),
            noise_k: outcome.noise_k,
            correlation_s: outcome.noise.correlation_s,
            drawn: outcome.drawn.name(),
            samples: outcome.samples,
            effective_samples: outcome.effective_samples,
            covered: Counted::of(outcome.covered),
            factors: Named(factors.collect()),
        }
    }
}
