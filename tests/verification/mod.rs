//! Every row of `bondline verify` passes on the CPU in f64, and rows can fail.

use crate::support::case;
use bondline::adapt::adapt;
use bondline::case::Case;
use bondline::ensemble::Ensemble;
use bondline::march::cpu::{Cpu, ScalarReference};
use bondline::march::richardson::march_extrapolated;
use bondline::march::{Backend, March, MarchError, Precision};
use bondline::plan::Plan;
use bondline::traces::Traces;
use bondline::verify::problem::Problem;
use bondline::verify::problems::{all_problems, flexible};
use bondline::verify::{Group, VerificationRow, WIDE_REASON, largest_difference_k, text_table, verification_rows};
use std::ops::Range;

#[track_caller]
fn passes(group: Group) {
    let rows =
        verification_rows(&mut Cpu::new(Precision::F64), &mut [], &[group]).expect("the processor does not fail");
    assert!(!rows.is_empty(), "no rows in {}", group.name());
    assert!(rows.iter().all(|row| row.pass()), "\n{}", text_table(&rows));
    let wide: Vec<String> =
        text_table(&rows).lines().filter(|line| line.chars().count() > 120).map(str::to_owned).collect();
    assert!(wide.is_empty(), "more than 120 columns:\n{}", wide.join("\n"));
    for row in &rows {
        let texts = [&row.case, &row.reference, &row.quantity, &row.unit, &row.source_of_tolerance];
        assert!(texts.iter().all(|text| !text.is_empty()), "a row with an empty text: {row:?}");
        assert!(row.tolerance.is_finite() && row.tolerance > 0.0, "a row that cannot fail: {row:?}");
        assert!(!row.is_wide_without_reason(), "more than ten times the difference without a reason: {row:?}");
    }
}

#[test]
fn the_march_meets_exact_solutions() {
    passes(Group::Exact);
}

#[test]
fn the_march_is_of_the_order_that_each_row_claims() {
    passes(Group::Orders);
}

#[test]
fn the_march_agrees_with_other_codes_and_standards() {
    passes(Group::Codes);
}

#[test]
fn adapted_marches_agree_with_every_reference_within_the_error_that_they_report() {
    passes(Group::Adapted);
}

#[test]
fn heat_and_mass_are_conserved() {
    passes(Group::Balance);
}

#[test]
fn the_minimiser_meets_known_optima() {
    passes(Group::Fit);
}

#[test]
fn intervals_contain_known_truths_as_often_as_they_say() {
    passes(Group::Coverage);
}

#[test]
fn a_reference_moved_by_twice_its_tolerance_fails_its_row() {
    let mut problem =
        all_problems().into_iter().find(|p| p.case.name() == "SFPE S.02 case 2, plate under a flux").expect("listed");
    let check = &mut problem.checks[0];
    check.points[0].value += 2.0 * check.tolerance;
    let rows = problem.rows(&mut Cpu::new(Precision::F64)).expect("the processor does not fail");
    assert!(!rows[0].pass(), "\n{}", text_table(&rows));
    assert!(rows[1].pass(), "\n{}", text_table(&rows));
}

#[test]
fn a_tolerance_beyond_ten_times_the_difference_needs_a_reason() {
    let problem =
        all_problems().into_iter().find(|p| p.case.name().starts_with("TACOT, surface held")).expect("listed");
    let row = problem.rows(&mut Cpu::new(Precision::F64)).expect("the processor does not fail").remove(0);
    assert!(!row.is_wide_without_reason(), "{row:?}");
    let wider = VerificationRow { tolerance: 11.0 * row.difference, ..row };
    assert!(wider.is_wide_without_reason());
    let explained = VerificationRow {
        source_of_tolerance: format!("{}{WIDE_REASON}the reference is printed so", wider.reference),
        ..wider
    };
    assert!(!explained.is_wide_without_reason());
    // The reason is printed only where it is needed.
    assert!(text_table(std::slice::from_ref(&explained)).contains("the reference is printed so"));
    let near = VerificationRow { tolerance: 9.0 * explained.difference, ..explained };
    assert!(!text_table(std::slice::from_ref(&near)).contains("the reference is printed so"));
}

/// A march with spoiled traces, for negative controls.
struct Spoiled<F>(F);

impl<F: Fn(&Plan, &mut Traces) + Send> March for Spoiled<F> {
    fn backend(&self) -> Backend {
        ScalarReference(Precision::F64).backend()
    }

    fn capacity(&self, plan: &Plan) -> usize {
        ScalarReference(Precision::F64).capacity(plan)
    }

    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        let mut traces = Cpu::new(Precision::F64).march(plan, ensemble, members)?;
        (self.0)(plan, &mut traces);
        Ok(traces)
    }
}

#[test]
fn an_error_of_too_low_an_order_in_the_step_fails_every_row_that_claims_a_higher_one() {
    for order in [1.0, 0.5] {
        let mut march = Spoiled(|plan: &Plan, traces: &mut Traces| {
            let share = (plan.steps() as f64).powf(-order);
            traces.temperatures_k.iter_mut().for_each(|temperature_k| *temperature_k += 1e3 * share);
            traces.gauges.iter_mut().for_each(|reading| *reading *= 1.0 + share);
        });
        let rows = verification_rows(&mut march, &mut [], &[Group::Orders]).expect("the processor does not fail");
        let of_itself = rows.iter().filter(|row| row.reference.starts_with("self-convergence"));
        for row in of_itself {
            assert_eq!(row.pass(), row.quantity.contains("Δx"), "order {order}: {row:?}");
        }
        assert!(rows.iter().filter(|row| !row.pass()).count() >= 8, "order {order}\n{}", text_table(&rows));
    }
}

#[test]
fn heat_and_mass_from_nowhere_fail_every_balance() {
    let mut march = Spoiled(|_: &Plan, traces: &mut Traces| {
        for balance in &mut traces.balances {
            let moved_j_m2 = balance.hot_in_j_m2 + balance.back_in_j_m2 + balance.hot_out_j_m2 + balance.back_out_j_m2;
            balance.stored_j_m2 += 1e-3 * moved_j_m2;
            balance.gas_stored_kg_m2 += 1e-7 * (balance.gas_in_kg_m2 + balance.gas_out_kg_m2);
        }
    });
    let rows = verification_rows(&mut march, &mut [], &[Group::Balance]).expect("the processor does not fail");
    for row in rows.iter().filter(|row| row.quantity.starts_with("residual")) {
        assert!(!row.pass(), "{row:?}");
    }
    assert!(rows.iter().any(|row| row.unit == "of the mass moved"), "no row of mass");
}

#[test]
fn the_held_tacot_is_verified_for_the_error_that_its_case_tolerates() {
    let (problem, case) = (held_tacot(), case("tacot-held"));
    assert_eq!(problem.case.resolution(), case.resolution());
    let march = |case: &Case| {
        let plan = adapt(case).expect("the processor does not fail");
        let ensemble = Ensemble::nominal(case.factors());
        let traces = march_extrapolated(&mut Cpu::new(Precision::F64), &plan, &ensemble, 0..1);
        (plan.instants_s().to_vec(), traces.expect("the processor does not fail"))
    };
    let ((verified_s, verified), (shipped_s, shipped)) = (march(&problem.case), march(&case));
    let mut compared = 0;
    for (index, sensor) in problem.case.sensors().iter().enumerate() {
        let same = case.sensors().iter().position(|other| (other.depth_m - sensor.depth_m).abs() < 1e-9);
        let same = same.unwrap_or_else(|| panic!("the case has no sensor at {}", sensor.name));
        for (instant, time_s) in verified_s.iter().enumerate() {
            let Some(other) = shipped_s.iter().position(|other_s| (other_s - time_s).abs() < 1e-6) else { continue };
            let off_k = (verified.trace(0, index)[instant] - shipped.trace(0, same)[other]).abs();
            // Each may be off by its tolerance, as their sensors differ.
            assert!(off_k < 0.1, "{}, {time_s} s: {off_k} K apart", sensor.name);
            compared += 1;
        }
    }
    assert!(compared > 8 * 50, "{compared} readings were compared");
}

#[test]
fn the_held_tacot_on_forty_stated_cells_misses_the_converged_curves() {
    let problem = held_tacot().with_cells(40, 0.2);
    let rows = problem.rows(&mut Cpu::new(Precision::F64)).expect("the processor does not fail");
    assert!(!rows[0].pass(), "\n{}", text_table(&rows[..1]));
}

fn held_tacot() -> Problem {
    all_problems().into_iter().find(|problem| problem.case.name() == "TACOT held at 1644 K").expect("listed")
}

#[test]
fn two_marches_are_compared_reading_by_reading() {
    let plan = Plan::new(&flexible::flexible_layup());
    let ensemble = Ensemble::from_values(0, Vec::new());
    let off_k = |temperature_k: f64| {
        let mut spoiled = Spoiled(|_: &Plan, traces: &mut Traces| {
            traces.temperatures_k.last_mut().map(|last_k| *last_k += temperature_k).expect("a trace has instants");
        });
        largest_difference_k(&mut Cpu::new(Precision::F64), &mut spoiled, &plan, &ensemble).expect("no device")
    };
    assert_eq!(off_k(0.0), 0.0);
    assert!((off_k(1e-3) - 1e-3).abs() < 1e-9);
    assert_eq!(off_k(f64::NAN), f64::INFINITY);
}
