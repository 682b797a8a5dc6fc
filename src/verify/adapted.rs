//! Marches as an analyst gets them: cells and steps adapted to a tolerance, two resolutions extrapolated.
//!
//! Every reference problem is marched once more in this way. The tolerance is the sum of the problem's own and that of
//! the adaptation. Random cases show whether the reported error covers the true one.

use super::problem::{ErrorScale, Observable, Problem};
use super::random_case::random_case;
use super::{Group, VerificationRow, problems};
use crate::adapt::adapt;
use crate::adapt::error_estimate::{FRONT_TOLERANCE_M, GAUGE_TOLERANCE};
use crate::ensemble::Ensemble;
use crate::march::richardson::march_extrapolated;
use crate::march::{March, MarchError};
use crate::traces::MemberStatus;

/// Default temperature tolerance of a case file, K.
const DEFAULT_TOLERANCE_K: f64 = 0.05;
/// Refinement of the march that serves as the truth of a random case. The error estimate uses refinements of two and
/// four, and would cover the error against either of them by construction.
const TRUTH_REFINEMENT: usize = 6;
/// Number of random cases; their seeds count from zero.
const RANDOM_CASES: u64 = 20;

/// A row for every problem, and two for the reported error.
///
/// # Errors
/// As [`March::march`].
pub(super) fn adapted_rows(march: &mut dyn March) -> Result<Vec<VerificationRow>, MarchError> {
    let mut rows = Vec::new();
    for problem in problems::all_problems() {
        rows.push(adapted_row(march, problem)?);
    }
    rows.extend(reported_error_rows(march)?);
    Ok(rows)
}

fn adapted_row(march: &mut dyn March, mut problem: Problem) -> Result<VerificationRow, MarchError> {
    problem.case.resolution.tolerance_k = Some(DEFAULT_TOLERANCE_K);
    for check in &mut problem.checks {
        let largest = check.points.iter().fold(0.0_f64, |largest, point| largest.max(point.value.abs()));
        let Some(point) = check.points.first() else { continue };
        let plain = match point.observable {
            Observable::Depth(_) => DEFAULT_TOLERANCE_K,
            Observable::Gauge(gauge) if gauge.is_front() => FRONT_TOLERANCE_M,
            Observable::Gauge(_) => GAUGE_TOLERANCE * largest,
        };
        check.tolerance += match check.measure {
            ErrorScale::Absolute => plain,
            ErrorScale::RelativeTo(driving) => plain / driving,
            ErrorScale::Relative => {
                plain / check.points.iter().fold(largest, |least, point| least.min(point.value.abs()))
            }
        };
    }
    let rows = problem.rows(march)?;
    let worst = rows.iter().map(|row| row.difference / row.tolerance).fold(0.0, f64::max);
    Ok(VerificationRow {
        group: Group::Adapted,
        case: problem.case.name,
        reference: "the references of the problem".to_owned(),
        quantity: format!("worst of {} quantities, adapted and extrapolated", rows.len()),
        difference: worst,
        tolerance: 1.0,
        unit: "of the tolerance".to_owned(),
        source_of_tolerance:
            "sum of the tolerances of reference and adaptation; wide: the adaptation serves other outputs too"
                .to_owned(),
    })
}

/// The reported error against the true one, which is the difference from six times the cells and steps.
fn reported_error_rows(march: &mut dyn March) -> Result<[VerificationRow; 2], MarchError> {
    let (mut judged, mut beyond, mut worst) = (0_u32, 0_u32, 0.0_f64);
    for seed in 0..RANDOM_CASES {
        for ratio in error_ratios(march, seed)? {
            judged += 1;
            beyond += u32::from(ratio > 1.0);
            worst = worst.max(ratio);
        }
    }
    let row = |quantity: &str, difference: f64, tolerance: f64, unit: &str, source: &str| VerificationRow {
        group: Group::Adapted,
        case: format!("random cases 0 to {}", RANDOM_CASES - 1),
        reference: "six times the cells and steps".to_owned(),
        quantity: quantity.to_owned(),
        difference,
        tolerance,
        unit: unit.to_owned(),
        source_of_tolerance: source.to_owned(),
    };
    Ok([
        row(
            &format!("share of {judged} outputs whose error exceeds the reported error"),
            f64::from(beyond) / f64::from(judged),
            0.05,
            "of outputs",
            "the claim: the reported error covers the true one in 95 of 100; wide: few exceed it",
        ),
        row(
            "largest true error",
            worst,
            2.0,
            "of the reported one",
            "the claim: the reported error is never less than half the true one",
        ),
    ])
}

/// The true error of each output of a random case over the reported one; empty where the march does not complete.
///
/// # Errors
/// As [`March::march`].
fn error_ratios(march: &mut dyn March, seed: u64) -> Result<Vec<f64>, MarchError> {
    let Ok(case) = random_case(seed) else { return Ok(vec![f64::INFINITY]) };
    let plan = adapt(&case)?;
    let Some(reached) = &plan.error_estimate else { return Ok(Vec::new()) };
    let ensemble = Ensemble::nominal(&case.factors);
    let truth = march_extrapolated(
        march,
        &plan.rediscretised(&case, plan.discretisation.refined(TRUTH_REFINEMENT)),
        &ensemble,
        0..1,
    )?;
    if truth.statuses != [MemberStatus::Completed] {
        return Ok(Vec::new());
    }
    let given = march_extrapolated(march, &plan, &ensemble, 0..1)?;
    Ok(reached.error_ratios(&given, &truth))
}
