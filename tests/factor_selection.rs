//! Factor selection: which factors the data determine. The paper reduced seven factors to three and two by inspection.

use crate::support::{case, modified};
use bondline::adapt::adapt;
use bondline::case::{Case, CaseBuilder};
use bondline::fit::DropReason;
use bondline::march::Precision;
use bondline::march::cpu::Cpu;
use bondline::study::sensitivity::{Sensitivity, sensitivity};

/// Run 2259 with changed settings of the estimate; the march is unchanged.
fn found(change: impl FnOnce(&mut CaseBuilder)) -> (Case, Sensitivity) {
    let shipped = case("lcat-2259");
    let plan = adapt(&shipped).expect("the processor does not fail");
    let case = modified(&shipped, change);
    let found = sensitivity(&case, &plan, &mut Cpu::new(Precision::F64), None);
    (case, found.expect("the processor does not fail"))
}

fn names<'a>(case: &'a Case, factors: &[usize]) -> Vec<&'a str> {
    factors.iter().map(|&factor| case.factors()[factor].name.as_str()).collect()
}

fn factor(case: &Case, name: &str) -> usize {
    case.factors().iter().position(|factor| factor.name == name).expect("the case has it")
}

#[test]
fn four_thermocouples_determine_the_papers_three_of_seven_factors() {
    let (case, found) = found(|case| {
        case.estimate.sensors.clear();
        case.estimate.window_s = None;
    });
    assert_eq!(found.all.factors.len(), 7);
    assert_eq!(names(&case, &found.recommended.factors), ["f_eps_OF", "f_k_OF", "f_k_INS"]);
    let dropped = found.dropped(factor(&case, "f_cp_GB")).expect("the gas barrier is dropped");
    assert!(matches!(dropped.reason, DropReason::SmallEffect { .. }), "{dropped:?}");
}

#[test]
fn the_bondline_alone_determines_one_of_the_papers_two_factors() {
    let (case, found) = found(|_| ());
    assert_eq!(names(&case, &found.influential_factors()), ["f_k_OF", "f_k_INS", "f_cp_INS", "f_rho_INS"]);
    assert_eq!(names(&case, &found.recommended.factors), ["f_k_INS"]);
    let emissivity = factor(&case, "f_eps_OF");
    assert!(found.shares[emissivity] < 0.01, "{:?}", found.shares);
    assert!(matches!(found.dropped(emissivity).map(|dropped| dropped.reason), Some(DropReason::SmallEffect { .. })));
    // As in the paper.
    let cloth = found.dropped(factor(&case, "f_k_OF")).expect("the cloth is dropped");
    let with_insulator =
        matches!(cloth.reason, DropReason::Correlation { with, .. } if with == factor(&case, "f_k_INS"));
    assert!(with_insulator, "{cloth:?}");
    let stated = found.stated.expect("the case states two");
    assert_eq!(names(&case, &stated.factors), ["f_eps_OF", "f_k_INS"]);
    assert!(stated.correlation[0][1].abs() > 0.95, "{:?}", stated.correlation);
}

#[test]
fn a_factor_with_a_wider_prior_has_a_larger_share() {
    let emissivity = |case: &Case| factor(case, "f_eps_OF");
    let (case, known) = found(|_| ());
    let place = emissivity(&case);
    let (wide_case, wide) = found(|case| {
        (case.factors[place].small, case.factors[place].large) = ((0.8, 1.2), (0.8, 1.2));
    });
    let share = known.shares[place];
    // Its squared effect is sixteen times larger; the others are unchanged.
    let expected = 16.0 * share / (1.0 + 15.0 * share);
    let found = wide.shares[emissivity(&wide_case)];
    assert!((found - expected).abs() < 1e-9, "{found}, expected {expected}");
    assert!(wide.influential_factors().contains(&emissivity(&wide_case)));
}

#[test]
fn a_case_that_states_nothing_to_estimate_is_not_compared() {
    let (_, found) = found(|case| case.estimate.factors.clear());
    assert!(found.stated.is_none() && !found.recommended.factors.is_empty());
}
