//! Sizing of one layup for its limit under all exposures.

use super::{CandidateLayup, SizedLayup, Sweep, TableEnd};
use crate::adapt::{ACCEPTED_ERROR, adapt_for, checked_at_members};
use crate::case::{Bounds, Case, TemperatureLimit};
use crate::ensemble::Ensemble;
use crate::fit::proportion::quantile_ranks_95;
use crate::kept_work::work_log::WorkLog;
use crate::march::{March, MarchError};
use crate::plan::{ErrorEstimate, Plan};
use crate::study::margins::quantile_rank;
use crate::study::size::{
    MAX_ADAPTATIONS, NominalSizing, RequiredThickness, ScalableCase, SearchStart, SizeError, SizingRequirement,
    ThicknessMarch, by_reason, check_start, is_cooled, mass_kg_m2, size_nominally, squared_correlation_shares,
};
use crate::traces::{Balance, Peak};
use std::collections::BTreeMap;

/// A layup under one exposure, with a thickness factor on the sized plies.
pub(super) struct PreparedExposure {
    pub scalable: ScalableCase,
    pub plan: Plan,
}

impl PreparedExposure {
    /// The plan is that of [`size`](crate::study::size::size()), so that the thicknesses are.
    pub(super) fn new(case: &Case, requirement: &SizingRequirement, march: &mut dyn March) -> Result<Self, SizeError> {
        check_start(case, requirement)?;
        let mut limited = case.clone();
        limited.limits = vec![TemperatureLimit { part: requirement.part, limit_k: requirement.limit_k }];
        let scalable = ScalableCase::new(&limited, &requirement.ply)?;
        let plan = adapt_for(&scalable.case, march.backend().precision, &march.monitor())?;
        Ok(Self { scalable, plan })
    }
}

/// A sized layup, and the exposure that each member's thickness is from.
pub(super) struct LayupSizing {
    pub layup: SizedLayup,
    pub governing: Vec<usize>,
    pub marches: usize,
}

/// [`size_on_plans`], repeated on plans that are adapted to the thickness found where this one exceeds their
/// tolerance.
pub(super) fn size_layup(
    candidate: &CandidateLayup,
    exposures: &mut [PreparedExposure],
    march: &mut dyn March,
    requirement: &SizingRequirement,
    sweep: &Sweep,
    drawn: &Ensemble,
    log: &mut dyn WorkLog,
) -> Result<LayupSizing, SizeError> {
    let mut marches = 0;
    let mut adaptations = 1;
    loop {
        let mut sized = size_on_plans(candidate, exposures, march, requirement, sweep, drawn, log)?;
        marches += sized.marches;
        sized.marches = marches;
        if adaptations == MAX_ADAPTATIONS {
            sized.layup.error_estimate = largest_error(exposures, sweep.bounds, march)?;
            return Ok(sized);
        }
        let thickness_m = sized.layup.required.sort_key_m().min(sized.layup.thickness_range_m.1);
        let mut is_adapted_anew = false;
        for PreparedExposure { scalable, plan } in &mut *exposures {
            let at_answer = scalable.nominal_member(thickness_m);
            let (precision, monitor) = (march.backend().precision, march.monitor());
            let checked = checked_at_members(&scalable.case, plan, &at_answer, precision, ACCEPTED_ERROR, &monitor)?;
            is_adapted_anew |= checked.is_adapted_anew;
            *plan = checked.plan;
        }
        if !is_adapted_anew {
            sized.layup.error_estimate = largest_error(exposures, sweep.bounds, march)?;
            return Ok(sized);
        }
        adaptations += 1;
    }
}

/// The error under the exposure where it is largest, with its corners at the bounds between which members are drawn.
fn largest_error(
    exposures: &[PreparedExposure],
    bounds: Bounds,
    march: &dyn March,
) -> Result<Option<ErrorEstimate>, MarchError> {
    let estimates = exposures.iter().filter_map(|exposure| Some((exposure, exposure.plan.error_estimate.as_ref()?)));
    let largest = estimates.max_by(|(_, one), (_, other)| one.nominal_k.total_cmp(&other.nominal_k));
    let (precision, monitor) = (march.backend().precision, march.monitor());
    let at_corners = |(exposure, error): (&PreparedExposure, &ErrorEstimate)| {
        error.clone().at_corners_of(bounds, &exposure.scalable.case, &exposure.plan, precision, &monitor)
    };
    largest.map(at_corners).transpose()
}

/// The thickness that each member requires under all exposures: that of the exposure that requires most at nominal
/// factors, unless it does not suffice for another one.
fn size_on_plans(
    candidate: &CandidateLayup,
    exposures: &[PreparedExposure],
    march: &mut dyn March,
    requirement: &SizingRequirement,
    sweep: &Sweep,
    drawn: &Ensemble,
    log: &mut dyn WorkLog,
) -> Result<LayupSizing, SizeError> {
    let mut marches = 0;
    let mut nominals = Vec::with_capacity(exposures.len());
    for PreparedExposure { scalable, plan } in exposures {
        let mut trial = ThicknessMarch { scalable, plan, march, log, marches: 0 };
        nominals.push(size_nominally(&mut trial, requirement)?);
        marches += trial.marches;
    }
    let exceeds =
        |nominal: &NominalSizing| nominal.curve.iter().any(|(_, peak)| peak.temperature_k > requirement.limit_k);
    let not_cooled = nominals.iter().position(|nominal| !is_cooled(&nominal.curve) && exceeds(nominal));
    let mut order: Vec<usize> = (0..exposures.len()).collect();
    order.sort_by(|&a, &b| nominals[b].required.sort_key_m().total_cmp(&nominals[a].required.sort_key_m()));
    let within_m = nominals[0].within_m;
    let mut required = vec![RequiredThickness::AtMost(within_m.0); drawn.len()];
    let mut governing = vec![order[0]; drawn.len()];
    let mut failed: BTreeMap<usize, String> = BTreeMap::new();
    if not_cooled.is_some() {
        required.fill(RequiredThickness::Beyond(within_m.1));
    }
    for (place, &exposure) in order.iter().enumerate() {
        let PreparedExposure { scalable, plan } = &exposures[exposure];
        let mut trial = ThicknessMarch { scalable, plan, march, log, marches: 0 };
        let open: Vec<usize> = (0..drawn.len()).filter(|&m| required[m].sort_key_m().is_finite()).collect();
        let start = |&member: &usize| match place {
            0 => SearchStart { within_m, first_m: nominals[exposure].first_m },
            _ => {
                let so_far_m = required[member].sort_key_m();
                SearchStart { within_m: (so_far_m, within_m.1), first_m: so_far_m }
            }
        };
        let starts: Vec<SearchStart> = open.iter().map(start).collect();
        let found = trial.required_thicknesses(&starts, &nominals[exposure].curve, |i| drawn.member(open[i]))?;
        failed.extend(found.failed.into_iter().map(|(i, reason)| (open[i], reason)));
        for (&member, found) in open.iter().zip(found.required) {
            // The thickness so far is the smallest of the search, which suffices.
            if place == 0 || !matches!(found, RequiredThickness::AtMost(_)) {
                (required[member], governing[member]) = (found, exposure);
            }
        }
        marches += trial.marches;
    }
    let mut inorder = required.clone();
    inorder.sort_by(|a, b| a.sort_key_m().total_cmp(&b.sort_key_m()));
    let members = drawn.len();
    let needed = inorder[quantile_rank(members, requirement.probability) - 1];
    let is_independent = sweep.sampling.kind.has_independent_members();
    let end = |rank: Option<usize>| rank.filter(|_| is_independent).map(|rank| inorder[rank - 1]);
    let (low, high) = quantile_ranks_95(members, requirement.probability);
    let (first, factors) = (&exposures[0].scalable, drawn.factors());
    let drawn_m = first.case_thickness_m;
    let density_kg_m3 = mass_kg_m2(&first.case, &first.plies, drawn_m) / drawn_m;
    let others: Vec<usize> = (0..first.case.layup.plies.len()).filter(|ply| !first.plies.contains(ply)).collect();
    let layup = SizedLayup {
        candidates: candidate.candidates.clone(),
        thickness_range_m: within_m,
        case_thickness_m: drawn_m,
        fixed_mass_kg_m2: others.iter().map(|&ply| ply_mass_kg_m2(&first.case, ply)).sum(),
        density_kg_m3,
        nominal: nominals.iter().map(|nominal| nominal.required).collect(),
        required: needed,
        interval: (end(low), end(high)),
        member_thicknesses_m: required.iter().map(|needed| needed.sort_key_m()).collect(),
        shares: squared_correlation_shares(factors, &required, |member| drawn.member(member)),
        failures: by_reason(failed),
        not_cooled,
        failed_at_largest: not_cooled.and_then(|exposure| nominals[exposure].failed_at_largest.clone()),
        thickest_peak_k: nominals.iter().map(thickest_peak_k).fold(f64::NEG_INFINITY, f64::max),
        still_warming: false,
        table_ends: Vec::new(),
        rank: None,
        error_estimate: None,
        balance: Balance::default(),
    };
    let mut found = LayupSizing { layup, governing, marches };
    found.add_nominal_march(exposures, march)?;
    Ok(found)
}

/// Mass per area of a ply of the case, kg/m².
pub(super) fn ply_mass_kg_m2(case: &Case, ply: usize) -> f64 {
    mass_kg_m2(case, &[ply], case.layup.plies[ply].thickness_m)
}

fn thickest_peak_k(nominal: &NominalSizing) -> f64 {
    nominal.curve.last().map_or(f64::NAN, |(_, peak)| peak.temperature_k)
}

impl LayupSizing {
    /// Temperatures at the required thickness, or at the largest one where it does not suffice, at nominal factors.
    fn add_nominal_march(&mut self, exposures: &[PreparedExposure], march: &mut dyn March) -> Result<(), MarchError> {
        let layup = &mut self.layup;
        let thickness_m = layup.required.sort_key_m().min(layup.thickness_range_m.1);
        let governing = layup.governing_exposure();
        for (exposure, PreparedExposure { scalable, plan }) in exposures.iter().enumerate() {
            let traces = march.march(plan, &scalable.nominal_member(thickness_m), 0..1)?;
            self.marches += 1;
            let Peak { time_s, .. } = traces.limited_peak(0, 0);
            if exposure == governing {
                layup.still_warming = time_s >= scalable.case.exposure.duration_s;
            }
            // A residual that is not a number is the largest.
            let off = |balance: &Balance| {
                let [energy, mass] = [balance.residual().abs(), balance.mass_residual().abs()];
                if energy.total_cmp(&mass).is_gt() { energy } else { mass }
            };
            if exposure == 0 || off(&traces.balances[0]).total_cmp(&off(&layup.balance)).is_gt() {
                layup.balance = traces.balances[0];
            }
            for (ply, &(_, met_k)) in traces.extremes_k.iter().enumerate() {
                let material = &scalable.case.layup.plies[ply].material.id;
                for (property, (_, end_k)) in scalable.case.table_ranges_k(ply) {
                    add_table_end(&mut layup.table_ends, material, property, end_k, met_k);
                }
            }
        }
        Ok(())
    }
}

/// Temperatures above the end of a table up to this are ignored, K: over a few kelvin no property changes.
const TABLE_MARGIN_K: f64 = 10.0;

fn add_table_end(ends: &mut Vec<TableEnd>, material: &str, property: String, end_k: f64, met_k: f64) {
    if met_k <= end_k + TABLE_MARGIN_K {
        return;
    }
    match ends.iter_mut().find(|end| end.material == material && end.property == property) {
        Some(end) => end.met_k = end.met_k.max(met_k),
        None => ends.push(TableEnd { material: material.to_owned(), property, end_k, met_k }),
    }
}
