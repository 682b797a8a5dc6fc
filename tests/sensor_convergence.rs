//! Temperatures of sensors next to decomposing plies.

use crate::support::{case, modified};
use bondline::case::Resolution;
use bondline::ensemble::Ensemble;
use bondline::march::cpu::ScalarReference;
use bondline::march::{March, Precision};
use bondline::plan::Plan;

/// Observed orders of convergence: largest differences between successive marches with ever smaller steps.
fn orders(marches: &[Vec<f64>]) -> Vec<f64> {
    let apart = |pair: &[Vec<f64>]| pair[0].iter().zip(&pair[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let differences: Vec<f64> = marches.windows(2).map(apart).collect();
    differences.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect()
}

/// Stages use the composition of an extrapolated instant. Readings with that composition converged with order 1.2 in
/// `lcat-2259-pyrolysis`, between cloth and insulator.
#[test]
fn readings_between_cloth_and_charring_insulator_converge_with_second_order() {
    let case = modified(&case("lcat-2259-pyrolysis"), |case| {
        case.resolution = Resolution { cells: 40, ..Resolution::default() };
    });
    let nominal = Ensemble::nominal(case.factors());
    let marched = |cuts: usize| {
        let traces = ScalarReference(Precision::F64).march(&Plan::with_refinement(&case, 1, cuts), &nominal, 0..1);
        traces.expect("the processor does not fail").temperatures_k
    };
    let cuts = [2, 4, 8, 16];
    let marches = cuts.map(marched);
    for order in orders(&marches) {
        assert!((1.85..2.3).contains(&order), "order {order:.2}");
    }
    let mut late = marches.clone();
    for (march, cuts) in late.iter_mut().zip(cuts) {
        march.iter_mut().for_each(|temperature_k| *temperature_k += 10.0 / cuts as f64);
    }
    assert!(orders(&late).iter().all(|order| *order < 1.5), "a first-order error passes");
}
