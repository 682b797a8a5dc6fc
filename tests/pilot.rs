//! Cells and steps for an error that was asked for, and what two resolutions say of a third.

use crate::support::{case, cases};
use bondline::case::{Case, Resolution};
use bondline::ensemble::Ensemble;
use bondline::march::extrapolated::march_both;
use bondline::march::{March, Precision, cpu::Cpu};
use bondline::pilot::pilot;
use bondline::plan::Plan;
use bondline::plan::clock::Pace;
use bondline::plan::grid::Density;
use bondline::traces::Traces;
use bondline::verify::problems::flexible;

fn marched(plan: &Plan, case: &Case) -> Traces {
    let ensemble = Ensemble::nominal(&case.factors);
    march_both(&mut Cpu::new(Precision::F64), plan, &ensemble, 0..1).expect("the processor does not fail")
}

/// The largest difference at any sensor and instant, K.
fn apart_k(one: &Traces, other: &Traces) -> f64 {
    assert_eq!(one.temperatures_k.len(), other.temperatures_k.len(), "not the same instants");
    let pairs = one.temperatures_k.iter().zip(&other.temperatures_k);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// A case on many cells, shared as no pilot shares them, and on short steps.
fn fine(case: &Case) -> Plan {
    Plan::cut(case, &Density::shared(case, 240.0), &Pace::slowed(&Resolution::default(), 1.0))
}

#[test]
fn what_is_asked_for_is_kept_against_a_march_that_shares_neither_cells_nor_steps() {
    for id in ["slab", "lcat-2259", "lcat-2330", "stack-saffil-sic"] {
        let case = case(id);
        let plan = pilot(&case).expect("the processor does not fail");
        let off_k = apart_k(&marched(&plan, &case), &marched(&fine(&case), &case));
        assert!(off_k <= 0.05, "{id}: {off_k} K off on {} cells, {} steps", plan.cells(), plan.steps());
    }
}

#[test]
fn what_a_pilot_says_is_left_holds_and_falls_with_what_is_asked_for() {
    let mut case = case("lcat-2259");
    let reference = marched(&fine(&case), &case);
    let mut last = (f64::INFINITY, 0);
    for tolerance_k in [2.0, 0.3, 0.05] {
        case.resolution.tolerance_k = Some(tolerance_k);
        let plan = pilot(&case).expect("the processor does not fail");
        let reached = plan.reached.expect("a pilot says how far it came");
        let off_k = apart_k(&marched(&plan, &case), &reference);
        assert!(reached.nominal_k <= tolerance_k, "{reached:?}");
        assert!((0.5..=1.5).contains(&(off_k / reached.nominal_k)), "{reached:?}, but {off_k} K off");
        let work = plan.cells() * plan.steps();
        assert!(off_k < last.0 && work > last.1, "{off_k} K with {work} cell-steps, after {last:?}");
        last = (off_k, work);
    }
}

#[test]
fn every_shipped_case_keeps_its_tolerance_or_states_its_cells() {
    for case in cases() {
        let plan = pilot(&case).expect("the processor does not fail");
        match plan.reached {
            Some(reached) => assert!(reached.nominal_k <= reached.tolerance_k, "{}: {reached:?}", case.id),
            None => assert_eq!(case.resolution.tolerance_k, None, "{}", case.id),
        }
    }
}

#[test]
fn cells_and_steps_that_are_stated_are_taken() {
    let mut case = case("lcat-2259");
    case.resolution = Resolution { tolerance_k: None, cells: 96, ..case.resolution };
    let (piloted, stated) = (pilot(&case).expect("the processor does not fail"), Plan::new(&case));
    assert_eq!(piloted.reached, None);
    assert_eq!((piloted.cells(), piloted.steps()), (stated.cells(), stated.steps()));
}

/// The grid under a plan has every other face of it, and so has its clock: without that, two errors would not be in proportion.
#[test]
fn half_of_a_plan_has_every_other_step_and_all_cells_twice_as_wide() {
    let case = case("lcat-2259");
    let plan = Plan::new(&case);
    let coarse = plan.coarse.as_ref().expect("a plan has a coarse one");
    assert_eq!(coarse.times_s, plan.times_s.iter().copied().step_by(2).collect::<Vec<_>>());
    for (ply, half) in plan.plies.iter().zip(&coarse.plies) {
        let widths = |plan: &Plan, from: u32, to: u32| -> Vec<f64> {
            plan.rows.cells[from as usize..to as usize].iter().map(|cell| cell.width_m).collect()
        };
        let (fine, wide) =
            (widths(&plan, ply.first_cell, ply.end_cell), widths(coarse, half.first_cell, half.end_cell));
        assert_eq!(fine.len(), 2 * wide.len());
        for ends in [(fine[0], wide[0]), (fine[fine.len() - 1], wide[wide.len() - 1])] {
            assert!((2.0 * ends.0 / ends.1 - 1.0).abs() < 1e-9, "{ends:?}");
        }
    }
}

#[test]
fn what_is_left_of_two_resolutions_falls_by_more_than_five_as_both_are_halved() {
    let case = flexible::layup();
    let at = |times: f64| {
        let pace = Pace::slowed(&Resolution::default(), 4.0 / times);
        Plan::cut(&case, &Density::shared(&case, 48.0 * times), &pace)
    };
    let plans = [1.0, 2.0, 4.0].map(at);
    let both = plans.each_ref().map(|plan| marched(plan, &case));
    let alone = plans.each_ref().map(|plan| {
        let traces = Cpu::new(Precision::F64).march(plan, &Ensemble::nominal(&case.factors), 0..1);
        traces.expect("the processor does not fail")
    });
    let falls = |of: &[Traces; 3]| apart_k(&of[0], &of[1]) / apart_k(&of[1], &of[2]);
    assert!((3.0..5.5).contains(&falls(&alone)), "one resolution alone: {}", falls(&alone));
    // Eight would be the third order; tables have a corner every 5 K.
    assert!(falls(&both) > 5.0, "both: {}", falls(&both));
    assert!(apart_k(&both[0], &both[2]) < 0.3 * apart_k(&alone[0], &both[2]), "both are no better than one");
}
