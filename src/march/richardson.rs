//! Richardson extrapolation of a march at two resolutions.
//!
//! Errors are second order in cells and steps (`verify --group orders`), so that the difference between a plan and the
//! plan with half of both is three times the error of the finer one; subtracting a third of it leaves terms of third
//! and fourth order (Richardson, Phil. Trans. A 210, 1911). On the paper's layup the second march costs a quarter more
//! and leaves a fifth of the error on 160 cells, a tenth on 320. The alternative, a scheme of fourth order through
//! interfaces, contacts and radiating faces, would have to be written in Rust and in WGSL and would not estimate its
//! own error.

use super::{Backend, March, MarchError, PendingBatch};
use crate::ensemble::Ensemble;
use crate::plan::Plan;
use crate::traces::{Balance, Gauge, MemberStatus, Traces};
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
        Ok(self.march.tangents(coarse, points, factors)?.map(|coarse| combine(fine, &coarse, richardson)))
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
            Some(coarser) => extrapolate(fine, &coarser),
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
    Ok(Box::new(|| Ok(extrapolate(fine()?, &coarse()?))))
}

/// Extrapolated traces. A member that failed at either resolution has failed; temperature ranges of plies are those of
/// the finer march.
fn extrapolate(fine: Traces, coarse: &Traces) -> Traces {
    combine(fine, coarse, richardson_nonnegative)
}

/// Fronts further apart than this, m, are not extrapolated: where a ply converts as a whole, a front jumps to the next
/// ply, possibly an instant earlier at one resolution.
const FRONT_JUMP_M: f64 = 0.3e-3;

/// Values that a task extrapolates at least: some ten microseconds.
const VALUES_PER_TASK: usize = 1 << 14;

fn combine(mut fine: Traces, coarse: &Traces, beyond: impl Fn(f64, f64) -> f64 + Copy + Sync) -> Traces {
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
    for (status, other) in fine.statuses.iter_mut().zip(&coarse.statuses) {
        if *status == MemberStatus::Completed {
            status.clone_from(other);
        }
    }
    for (balance, other) in fine.balances.iter_mut().zip(&coarse.balances) {
        *balance = Balance::zip_map(*balance, *other, beyond);
    }
    fine
}

/// Richardson extrapolation for halved cells and steps at second order.
fn richardson(fine: f64, coarse: f64) -> f64 {
    fine + (fine - coarse) / 3.0
}

/// The same for values, not derivatives. Quantities that are nonnegative at both resolutions stay so: no front lies
/// above the face, and no gas flows in because less flowed out.
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
        assert_eq!(richardson_nonnegative(0.0, 3.0), 0.0, "a front does not lie above the face");
        assert_eq!(richardson_nonnegative(-1.0, -4.0), 0.0);
    }

    #[test]
    fn a_member_that_fails_at_one_resolution_has_failed() {
        let traces = |statuses: Vec<MemberStatus>, temperatures_k: Vec<f64>| Traces {
            first: 0,
            sensors: 1,
            instants: 1,
            temperatures_k,
            limited_k: Vec::new(),
            gauges: Vec::new(),
            balances: vec![Balance::default(); statuses.len()],
            extremes_k: Vec::new(),
            statuses,
        };
        let diverged = MemberStatus::Diverged { time_s: 3.0 };
        let fine =
            traces(vec![MemberStatus::Completed, MemberStatus::Completed, diverged.clone()], vec![301.0, 302.0, 303.0]);
        let coarse =
            traces(vec![MemberStatus::Completed, diverged.clone(), MemberStatus::Completed], vec![304.0, 302.0, 303.0]);
        let both = extrapolate(fine, &coarse);
        assert_eq!(both.statuses, [MemberStatus::Completed, diverged.clone(), diverged]);
        assert_eq!(both.temperatures_k, [300.0, 302.0, 303.0]);
    }
}
