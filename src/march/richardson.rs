//! Richardson extrapolation of a march at two resolutions.
//!
//! Errors are second order in cells and steps (`verify --group orders`), so that the difference between a plan and the
//! plan with half of both is three times the error of the finer one; subtracting a third of it leaves terms of third
//! order (Richardson, Phil. Trans. A 210, 1911). On the paper's layup the second march costs a quarter more
//! and leaves a fifth of the error on 160 cells, a tenth on 320. The alternative, a scheme of fourth order through
//! interfaces, contacts and radiating faces, would have to be written in Rust and in WGSL and would not estimate its
//! own error.

use super::{Backend, March, MarchError, PendingBatch, gauge_bounds};
use crate::ensemble::Ensemble;
use crate::plan::Plan;
use crate::traces::{Balance, Gauge, GaugePeak, MemberStatus, Traces};
use rayon::prelude::*;
use std::ops::Range;

/// A march with Richardson extrapolation over both resolutions of a plan.
pub struct RichardsonMarch {
    march: Box<dyn March>,
}

impl RichardsonMarch {
    /// Extrapolates the results of `march`.
    pub fn new(march: Box<dyn March>) -> Self {
        Self { march }
    }
}

impl March for RichardsonMarch {
    fn backend(&self) -> Backend {
        self.march.backend()
    }

    fn capacity(&self, plan: &Plan) -> usize {
        self.march.capacity(plan)
    }

    fn remarks(&self) -> Vec<String> {
        self.march.remarks()
    }

    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        march_extrapolated(&mut *self.march, plan, ensemble, members)
    }

    fn begin<'a>(
        &mut self,
        plan: &'a Plan,
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<PendingBatch<'a>, MarchError> {
        begin_extrapolated(&mut *self.march, plan, ensemble, members)
    }

    /// Richardson extrapolation is linear, so it applies to derivatives.
    fn tangents(&mut self, plan: &Plan, points: &Ensemble, factors: &[usize]) -> Result<Option<Traces>, MarchError> {
        let Some(fine) = self.march.tangents(plan, points, factors)? else { return Ok(None) };
        let Some(coarse) = &plan.coarse else { return Ok(Some(fine)) };
        let end_s = plan.end_s();
        Ok(self.march.tangents(coarse, points, factors)?.map(|coarse| combine(fine, &coarse, end_s, richardson)))
    }

    fn march_plans(
        &mut self,
        plans: &[&Plan],
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<Vec<Traces>, MarchError> {
        let coarse: Vec<&Plan> = plans.iter().filter_map(|plan| plan.coarse.as_deref()).collect();
        let both: Vec<&Plan> = plans.iter().copied().chain(coarse).collect();
        let mut marched = self.march.march_plans(&both, ensemble, members)?;
        let mut coarse = marched.split_off(plans.len()).into_iter();
        let read = |(fine, plan): (Traces, &&Plan)| match plan.coarse.as_ref().and_then(|_| coarse.next()) {
            Some(coarser) => extrapolate(fine, &coarser, plan),
            None => fine,
        };
        Ok(marched.into_iter().zip(plans).map(read).collect())
    }
}

/// March members at both resolutions of a plan and extrapolate.
///
/// # Errors
/// As [`March::march`].
pub fn march_extrapolated(
    march: &mut dyn March,
    plan: &Plan,
    ensemble: &Ensemble,
    members: Range<usize>,
) -> Result<Traces, MarchError> {
    begin_extrapolated(march, plan, ensemble, members)?()
}

fn begin_extrapolated<'a>(
    march: &mut dyn March,
    plan: &'a Plan,
    ensemble: &Ensemble,
    members: Range<usize>,
) -> Result<PendingBatch<'a>, MarchError> {
    let fine = march.begin(plan, ensemble, members.clone())?;
    let Some(coarse) = &plan.coarse else { return Ok(fine) };
    let coarse = march.begin(coarse, ensemble, members)?;
    Ok(Box::new(move || Ok(extrapolate(fine()?, &coarse()?, plan))))
}

/// Extrapolated traces. A member that failed at either resolution has failed; temperature ranges of plies are those of
/// the finer march.
fn extrapolate(fine: Traces, coarse: &Traces, plan: &Plan) -> Traces {
    let mut traces = combine(fine, coarse, plan.end_s(), richardson_nonnegative);
    traces.balances.iter_mut().for_each(|balance| *balance = balance.without_negative_flows());
    gauge_bounds::keep_in_order(&mut traces, plan, 1);
    traces
}

/// Fronts further apart than this, m, are not extrapolated: where a ply converts as a whole, a front jumps to the next
/// ply, possibly an instant earlier at one resolution.
const FRONT_JUMP_M: f64 = 0.3e-3;

/// Values that a task extrapolates at least: some ten microseconds.
const VALUES_PER_TASK: usize = 1 << 14;

/// Times of peaks further apart than this share of the later one are not extrapolated: they are of two peaks of nearly
/// the same height.
const SAME_PEAK: f64 = 0.05;

fn combine(mut fine: Traces, coarse: &Traces, end_s: f64, beyond: impl Fn(f64, f64) -> f64 + Copy + Sync) -> Traces {
    let all = |fine: &mut [f64], coarse: &[f64]| {
        let tasks = fine.par_chunks_mut(VALUES_PER_TASK).zip(coarse.par_chunks(VALUES_PER_TASK));
        tasks.for_each(|(fine, coarse)| {
            fine.iter_mut().zip(coarse).for_each(|(fine, &coarse)| *fine = beyond(*fine, coarse));
        });
    };
    all(&mut fine.temperatures_k, &coarse.temperatures_k);
    all(&mut fine.limited_k, &coarse.limited_k);
    // Across a jump the errors of the two resolutions are not proportional.
    let front = |fine: f64, coarse: f64| if (fine - coarse).abs() > FRONT_JUMP_M { fine } else { beyond(fine, coarse) };
    let instants = fine.instants.max(1);
    let gauges = fine.gauges.chunks_exact_mut(instants).zip(coarse.gauges.chunks_exact(instants));
    for ((fine, coarse), gauge) in gauges.zip(Gauge::ALL.iter().cycle()) {
        for (fine, &coarse) in fine.iter_mut().zip(coarse) {
            *fine = if gauge.is_front() { front(*fine, coarse) } else { beyond(*fine, coarse) };
        }
    }
    let time_s = |fine_s: f64, coarse_s: f64| {
        let is_same = (fine_s - coarse_s).abs() <= SAME_PEAK * fine_s.max(coarse_s);
        if is_same { richardson(fine_s, coarse_s).clamp(0.0, end_s) } else { fine_s }
    };
    let peaks = fine.peaks.iter_mut().chain(&mut fine.limited_peaks);
    for (peak, other) in peaks.zip(coarse.peaks.iter().chain(&coarse.limited_peaks)) {
        peak.temperature_k = beyond(peak.temperature_k, other.temperature_k);
        peak.time_s = time_s(peak.time_s, other.time_s);
    }
    for (above_s, other_s) in fine.times_above_s.iter_mut().zip(&coarse.times_above_s) {
        *above_s = richardson(*above_s, *other_s).clamp(0.0, end_s);
    }
    for ((peak, other), gauge) in fine.gauge_peaks.iter_mut().zip(&coarse.gauge_peaks).zip(Gauge::ALL.iter().cycle()) {
        let value = if gauge.is_front() { front(peak.value, other.value) } else { beyond(peak.value, other.value) };
        *peak = GaugePeak { value, time_s: time_s(peak.time_s, other.time_s) };
    }
    for (status, other) in fine.statuses.iter_mut().zip(&coarse.statuses) {
        if *status == MemberStatus::Completed {
            status.clone_from(other);
        }
    }
    for (balance, other) in fine.balances.iter_mut().zip(&coarse.balances) {
        // Linear, so that what closes at both resolutions closes.
        *balance = Balance::zip_map(*balance, *other, richardson);
    }
    fine
}

/// Richardson extrapolation for halved cells and steps at second order.
fn richardson(fine: f64, coarse: f64) -> f64 {
    fine + (fine - coarse) / 3.0
}

/// Richardson extrapolation for values, not derivatives. Quantities that are nonnegative at both resolutions stay so:
/// no gas flows in because less flowed out.
#[inline]
fn richardson_nonnegative(fine: f64, coarse: f64) -> f64 {
    let beyond = richardson(fine, coarse);
    if fine >= 0.0 && coarse >= 0.0 { beyond.max(0.0) } else { beyond }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_order_error_cancels() {
        let truth = 412.0;
        assert_eq!(richardson_nonnegative(truth + 0.5, truth + 2.0), truth);
        assert_eq!(richardson_nonnegative(0.0, 3.0), 0.0);
        assert_eq!(richardson_nonnegative(-1.0, -4.0), 0.0);
    }

    #[test]
    fn a_balance_that_closes_at_both_resolutions_closes() {
        let balance = |gas_in_kg_m2, gas_out_kg_m2, solid_lost_kg_m2| Balance {
            gas_in_kg_m2,
            gas_out_kg_m2,
            solid_lost_kg_m2,
            ..Balance::default()
        };
        let (fine, coarse) = (balance(1.0, 4.0, 3.0), balance(5.0, 9.0, 4.0));
        let both = Balance::zip_map(fine, coarse, richardson).without_negative_flows();
        assert!(fine.mass_residual() == 0.0 && coarse.mass_residual() == 0.0);
        assert!(both.gas_in_kg_m2 == 0.0 && both.mass_residual().abs() < 1e-15, "{both:?}");
    }

    #[test]
    fn a_member_that_fails_at_one_resolution_has_failed() {
        let traces = |statuses: Vec<MemberStatus>, temperatures_k: Vec<f64>| Traces {
            temperatures_k,
            balances: vec![Balance::default(); statuses.len()],
            statuses,
            ..Traces::empty(0, 1, 1)
        };
        let diverged = MemberStatus::Diverged { time_s: 3.0 };
        let fine =
            traces(vec![MemberStatus::Completed, MemberStatus::Completed, diverged.clone()], vec![301.0, 302.0, 303.0]);
        let coarse =
            traces(vec![MemberStatus::Completed, diverged.clone(), MemberStatus::Completed], vec![304.0, 302.0, 303.0]);
        let both = combine(fine, &coarse, 1.0, richardson_nonnegative);
        assert_eq!(both.statuses, [MemberStatus::Completed, diverged.clone(), diverged]);
        assert_eq!(both.temperatures_k, [300.0, 302.0, 303.0]);
    }
}
