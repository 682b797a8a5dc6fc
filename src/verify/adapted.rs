//! Marches as an analyst gets them: cells and steps adapted to a tolerance, two resolutions extrapolated.
//!
//! Every reference problem is marched once more in this way. The tolerance is the sum of the problem's own and that of
//! the adaptation. Random cases show whether the reported error covers the true one.

use super::problem::{Measure, Place, Problem};
use super::random_case::random_case;
use super::{Group, Row, problems};
use crate::ensemble::Ensemble;
use crate::march::extrapolated::march_both;
use crate::march::{March, MarchError};
use crate::pilot::error_estimate::{FRONT_M, GAUGE_SHARE};
use crate::pilot::pilot;
use crate::traces::Arrival;

/// Default temperature tolerance of a case file, K.
const TEMPERATURE_K: f64 = 0.05;
/// Refinement of the march that serves as the truth of a random case. The error estimate uses refinements of two and
/// four, and would cover the error against either of them by construction.
const TRUTH: usize = 6;
/// Number of random cases; their seeds count from zero.
const RANDOM_CASES: u64 = 20;

/// A row for every problem, and two for the reported error.
///
/// # Errors
/// As [`March::march`].
pub(super) fn adapted(march: &mut dyn March) -> Result<Vec<Row>, MarchError> {
    let mut rows = Vec::new();
    for problem in problems::all() {
        rows.push(row(march, problem)?);
    }
    rows.extend(reported(march)?);
    Ok(rows)
}

fn row(march: &mut dyn March, mut problem: Problem) -> Result<Row, MarchError> {
    problem.case.resolution.tolerance_k = Some(TEMPERATURE_K);
    for check in &mut problem.checks {
        let largest = check.points.iter().fold(0.0_f64, |largest, point| largest.max(point.value.abs()));
        let Some(point) = check.points.first() else { continue };
        let plain = match point.place {
            Place::Depth(_) => TEMPERATURE_K,
            Place::Gauge(gauge) if gauge.is_front() => FRONT_M,
            Place::Gauge(_) => GAUGE_SHARE * largest,
        };
        check.tolerance += match check.measure {
            Measure::Plain => plain,
            Measure::ShareOf(driving) => plain / driving,
            Measure::Relative => plain / check.points.iter().fold(largest, |least, point| least.min(point.value.abs())),
        };
    }
    let rows = problem.rows(march)?;
    let worst = rows.iter().map(|row| row.difference / row.tolerance).fold(0.0, f64::max);
    Ok(Row {
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
fn reported(march: &mut dyn March) -> Result<[Row; 2], MarchError> {
    let (mut judged, mut beyond, mut worst) = (0_u32, 0_u32, 0.0_f64);
    for seed in 0..RANDOM_CASES {
        for ratio in ratios(march, seed)? {
            judged += 1;
            beyond += u32::from(ratio > 1.0);
            worst = worst.max(ratio);
        }
    }
    let row = |quantity: &str, difference: f64, tolerance: f64, unit: &str, source: &str| Row {
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
fn ratios(march: &mut dyn March, seed: u64) -> Result<Vec<f64>, MarchError> {
    let Ok(case) = random_case(seed) else { return Ok(vec![f64::INFINITY]) };
    let plan = pilot(&case)?;
    let Some(reached) = &plan.reached else { return Ok(Vec::new()) };
    let ensemble = Ensemble::nominal(&case.factors);
    let truth = march_both(march, &plan.recut(&case, plan.discretisation.refined(TRUTH)), &ensemble, 0..1)?;
    if truth.arrivals != [Arrival::Done] {
        return Ok(Vec::new());
    }
    let given = march_both(march, &plan, &ensemble, 0..1)?;
    Ok(reached.ratios(&given, &truth))
}
