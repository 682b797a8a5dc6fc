//! Discretisation error of a sweep, measured at some of its members.
//!
//! Cells and steps are adapted to the nominal member. Members far from it may have larger errors, and they decide the
//! percentiles and margins.

use crate::adapt::member_errors_k;
use crate::case::Case;
use crate::ensemble::Ensemble;
use crate::march::cpu::Cpu;
use crate::march::monitor::Monitor;
use crate::march::{March, MarchError, Precision};
use crate::plan::Plan;
use rayon::prelude::*;

/// Share of the members that are extreme.
const EXTREME_SHARE: f64 = 0.01;
/// Most extreme members, and number of others: SIMD groups in f64, few beside a sweep.
const MAX_EXTREME: usize = 64;
const OTHERS: usize = 16;
/// First members from which the scatter of each peak is taken, to compare sensors.
const SCALE_MEMBERS: usize = 1000;

/// Estimated discretisation error of the members of a sweep, with rounding in f32: the largest of all readings and
/// peaks, against the same members marched in f64 with twice the cells and steps.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct SweepError {
    /// The hundredth of the members, at most 64, whose peaks are farthest from the nominal ones by the derivatives of
    /// the peaks at nominal factors, in units of their root mean square over the first 1,000 members: the largest over
    /// the sensors.
    pub extreme: MembersError,
    /// The first other members, at most 16.
    pub others: MembersError,
}

/// The largest error of some members.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct MembersError {
    /// Number of members that were marched with twice the cells and steps.
    pub members: usize,
    /// Number of these members that did not complete both marches.
    pub failed: usize,
    /// Largest error of the members that completed both, K; `None` if none did.
    pub temperature_k: Option<f64>,
}

/// The error of the members of a sweep; `None` where the case states cells and steps, or nothing varies.
///
/// # Errors
/// [`MarchError::Cancelled`] or [`MarchError::Stopped`] by the monitor.
pub fn sweep_error(
    case: &Case,
    plan: &Plan,
    precision: Precision,
    ensemble: &Ensemble,
    monitor: &Monitor,
) -> Result<Option<SweepError>, MarchError> {
    if plan.error_estimate.is_none() || case.factors.is_empty() || ensemble.is_empty() {
        return Ok(None);
    }
    let extremeness = extremeness(case, plan, ensemble)?;
    let mut order: Vec<usize> = (0..ensemble.len()).collect();
    let count = ((EXTREME_SHARE * ensemble.len() as f64).ceil() as usize).min(MAX_EXTREME);
    // By member where equal, so that the choice does not depend on the sort.
    let by_extremeness = |a: &usize, b: &usize| extremeness[*b].total_cmp(&extremeness[*a]).then(a.cmp(b));
    if count < order.len() {
        order.select_nth_unstable_by(count, by_extremeness);
    }
    let mut others = order.split_off(count);
    order.sort_unstable();
    others.sort_unstable();
    others.truncate(OTHERS);
    let values = order.iter().chain(&others).flat_map(|&member| ensemble.member(member)).collect();
    let members = Ensemble::from_values(ensemble.factors(), values);
    let errors_k = member_errors_k(case, plan, precision, &members, &monitor.without_progress())?;
    let (extreme_k, others_k) = errors_k.split_at(order.len());
    Ok(Some(SweepError { extreme: MembersError::of(extreme_k), others: MembersError::of(others_k) }))
}

impl MembersError {
    /// From the errors of the members, K: infinite of those that did not complete.
    pub(in crate::study) fn of(errors_k: &[f64]) -> Self {
        let completed_k = errors_k.iter().copied().filter(|error_k| error_k.is_finite());
        let failed = errors_k.len() - completed_k.clone().count();
        Self { members: errors_k.len(), failed, temperature_k: completed_k.reduce(f64::max) }
    }
}

/// How far the peaks of each member are from the nominal ones, by their derivatives at nominal factors: the largest
/// over the sensors, each in units of its root mean square over the first members.
fn extremeness(case: &Case, plan: &Plan, ensemble: &Ensemble) -> Result<Vec<f64>, MarchError> {
    let nominal = Ensemble::nominal(&case.factors);
    let factors: Vec<usize> = (0..case.factors.len()).collect();
    let traces = Cpu::new(Precision::F64).tangents(plan, &nominal, &factors)?;
    let sensors = case.sensors.len();
    let slope = |sensor: usize, factor: usize| {
        let slope = traces.as_ref().map_or(0.0, |traces| traces.peak(1 + factor, sensor).temperature_k);
        if slope.is_finite() { slope } else { 0.0 }
    };
    let slopes: Vec<Vec<f64>> =
        (0..sensors).map(|sensor| factors.iter().map(|&factor| slope(sensor, factor)).collect()).collect();
    let nominal = nominal.member(0);
    let changes = |member: usize| -> Vec<f64> {
        let values = ensemble.member(member);
        let change = |slopes: &Vec<f64>| -> f64 {
            slopes.iter().zip(values.iter().zip(&nominal)).map(|(slope, (value, at))| slope * (value - at)).sum()
        };
        slopes.iter().map(change).collect()
    };
    let first: Vec<Vec<f64>> = (0..ensemble.len().min(SCALE_MEMBERS)).map(&changes).collect();
    let scales: Vec<f64> = (0..sensors)
        .map(|sensor| {
            let mean_square = first.iter().map(|of| of[sensor] * of[sensor]).sum::<f64>() / first.len() as f64;
            if mean_square > 0.0 { mean_square.sqrt() } else { f64::INFINITY }
        })
        .collect();
    let largest = |member: usize| {
        changes(member).iter().zip(&scales).map(|(change, scale)| change.abs() / scale).fold(0.0, f64::max)
    };
    Ok((0..ensemble.len()).into_par_iter().map(largest).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adapt::{adapt, refined_traces};
    use crate::case::{Bounds, Resolution};
    use crate::ensemble::{Sampling, SamplingKind};

    /// Against four times the cells and steps of all members; the claim is from twice those of some.
    #[test]
    fn the_error_of_a_few_members_is_near_the_largest_of_all_members_of_a_sweep() {
        let case = Case::load("cases/lamp-test".as_ref()).expect("a shipped case");
        let plan = adapt(&case).expect("the processor does not fail");
        for bounds in [Bounds::Small, Bounds::Large] {
            let sampling = Sampling { kind: SamplingKind::Normal, seed: 3 };
            let ensemble = Ensemble::sample(&case.factors, bounds, &sampling, 200);
            let monitor = Monitor::default();
            let found = sweep_error(&case, &plan, Precision::F64, &ensemble, &monitor).expect("the processor works");
            let SweepError { extreme, others } = found.expect("cells and steps are adapted");
            assert_eq!((extreme.members, others.members, extreme.failed + others.failed), (2, 16, 0));
            let claimed_k = extreme.temperature_k.into_iter().chain(others.temperature_k).fold(0.0, f64::max);
            let all = Ensemble::from_values(
                case.factors.len(),
                (0..ensemble.len()).flat_map(|member| ensemble.member(member)).collect(),
            );
            let all = refined_traces(&case, &plan, Precision::F64, &all, &monitor).expect("the processor works");
            let largest_k = all.temperature_error_k();
            assert!((0.5 * largest_k..=1.2 * largest_k).contains(&claimed_k), "{bounds:?}: {claimed_k}, {largest_k}");
        }
    }

    #[test]
    fn a_sweep_on_stated_cells_or_without_factors_has_no_error() {
        let mut case = Case::load("cases/lamp-test".as_ref()).expect("a shipped case");
        let error = |case: &Case| {
            let plan = adapt(case).expect("the processor does not fail");
            let ensemble = Ensemble::nominal(&case.factors);
            sweep_error(case, &plan, Precision::F64, &ensemble, &Monitor::default()).expect("the processor works")
        };
        assert!(error(&case).is_some());
        case.resolution = Resolution { tolerance_k: None, ..case.resolution };
        assert_eq!(error(&case), None);
    }

    #[test]
    fn members_that_do_not_complete_are_counted_and_have_no_error() {
        let found = MembersError::of(&[0.02, f64::INFINITY, 0.05]);
        assert_eq!(found, MembersError { members: 3, failed: 1, temperature_k: Some(0.05) });
        assert_eq!(MembersError::of(&[f64::INFINITY]).temperature_k, None);
    }
}
