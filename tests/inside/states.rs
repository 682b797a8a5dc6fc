//! Factors on the conductivity of single states, and their estimation from temperatures.

use crate::support::{DOUBLE_K, PATO_K, case, modified, with_factor};
use bondline::adapt::adapt;
use bondline::case::{Case, EstimationSettings, Factor, Property, Table};
use bondline::ensemble::Ensemble;
use bondline::march::cpu::Cpu;
use bondline::march::richardson::RichardsonMarch;
use bondline::march::{March, Precision};
use bondline::plan::Plan;
use bondline::study::estimate::{ParameterEstimates, SearchOptions, estimate};
use bondline::traces::Gauge;
use bondline::work_log::NoLog;
use std::sync::Arc;

/// Temperatures of the two-state slab with these factors and values.
fn marched(factors: Vec<Factor>, values: &[f64]) -> Vec<f64> {
    let case = modified(&case("tacot-conductivity"), |case| {
        (case.factors, case.estimate) = (factors, EstimationSettings::default());
        (case.resolution.cells, case.resolution.max_step_s) = (40, 2.0);
    });
    let ensemble = Ensemble::from_values(values.len(), values.to_vec());
    let traces = Cpu::new(Precision::F64).march(&Plan::new(&case), &ensemble, 0..1);
    traces.expect("the processor does not fail").temperatures_k
}

#[test]
fn equal_factors_on_all_states_equal_one_factor_and_single_ones_differ() {
    let each = case("tacot-conductivity").factors().to_vec();
    let [solid, radiative] = [0, 1].map(|place| Factor { state: None, ..each[place].clone() });
    let whole = marched(vec![solid, radiative], &[1.3, 0.8]);
    assert_eq!(whole, marched(each.clone(), &[1.3, 0.8, 1.3, 0.8]), "both states scaled alike");
    for alone in [[1.3, 1.0, 1.0, 1.0], [1.0, 0.8, 1.0, 1.0], [1.0, 1.0, 1.3, 1.0], [1.0, 1.0, 1.0, 0.8]] {
        let marched = marched(each.clone(), &alone);
        let max_difference_k = whole.iter().zip(&marched).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(max_difference_k > 1.0, "{alone:?} is off by {max_difference_k} K");
    }
}

/// `lcat-2259-pyrolysis` on a coarse plan with changed char heat capacities: number of states with table rows of each
/// ply, and temperatures.
fn with_char(heat_capacity: impl Fn(f64) -> f64) -> (Vec<u32>, Vec<f64>) {
    let case = modified(&case("lcat-2259-pyrolysis"), |case| {
        (case.resolution.cells, case.resolution.max_step_s) = (60, 2.0);
        for ply in &mut case.layup.plies {
            let decomposition = Arc::make_mut(&mut ply.material).decomposition.iter_mut();
            for char in decomposition.flat_map(|decomposition| &mut decomposition.residues) {
                let (table, mut values) = (&char.heat_capacity, char.heat_capacity.values().to_vec());
                values.iter_mut().next_back().into_iter().for_each(|last| *last = heat_capacity(*last));
                char.heat_capacity =
                    Table::new(table.temperatures_k().to_vec(), values, table.outside()).expect("a valid table");
            }
        }
    });
    let (plan, nominal) = (Plan::new(&case), Ensemble::nominal(case.factors()));
    let traces = Cpu::new(Precision::F64).march(&plan, &nominal, 0..1).expect("the processor does not fail");
    (plan.rows.plies.iter().map(|ply| ply.rows).collect(), traces.temperatures_k)
}

#[test]
fn a_char_that_is_a_multiple_of_the_virgin_material_equals_one_with_table_rows() {
    let largest_difference_k =
        |one: &[f64], other: &[f64]| one.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let (rows, alike_k) = with_char(|value| value);
    assert_eq!(rows, [1; 5], "every state is a multiple of the virgin one");
    let (rows, tabulated_k) = with_char(|value| value * (1.0 + 1e-11));
    assert_eq!(rows, [1, 1, 2, 2, 2], "a char that is no multiple has rows of its own");
    let max_difference_k = largest_difference_k(&alike_k, &tabulated_k);
    assert!(max_difference_k <= DOUBLE_K, "{max_difference_k} K");
    let max_difference_k = largest_difference_k(&alike_k, &with_char(|value| value * 1.01).1);
    assert!(
        max_difference_k > 100.0 * DOUBLE_K,
        "a larger heat capacity changes temperatures by only {max_difference_k} K"
    );
}

/// A factor on a part of the conductivity of one ply gives it table rows of its own.
#[test]
fn a_front_passes_between_plies_of_one_material_of_which_one_has_a_factor() {
    const INTERFACE_M: f64 = 4.02e-3;
    let case = modified(&case("lcat-2259-pyrolysis"), |case| {
        (case.resolution.cells, case.resolution.max_step_s) = (60, 2.0);
    });
    let fronts_m = |case: &Case| {
        let (plan, nominal) = (Plan::new(case), Ensemble::nominal(case.factors()));
        let traces = Cpu::new(Precision::F64).march(&plan, &nominal, 0..1).expect("the processor does not fail");
        (plan, traces.gauge(0, Gauge::VirginFront).expect("gas has gauges").to_vec())
    };
    let [(plan, alike_m), (other_plan, factored_m)] =
        [case.clone(), with_factor(&case, "INS1", Property::ConductivityRadiative)].map(|case| fronts_m(&case));
    assert_eq!(plan.rows.tables[2].offset, plan.rows.tables[3].offset);
    assert_ne!(other_plan.rows.tables[2].offset, other_plan.rows.tables[3].offset);
    let near = |front_m: &&f64| (*front_m - INTERFACE_M).abs() < 1e-4;
    assert!(alike_m.iter().filter(near).count() > 0, "the front does not pass the interface: {alike_m:?}");
    let off_m = alike_m.iter().zip(&factored_m).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off_m < 1e-9, "{off_m:.1e} m: {alike_m:?} and {factored_m:?}");
}

/// Estimate of a case as the command makes it, and the root mean square of all residuals, K.
fn estimated(case: &Case) -> (ParameterEstimates, f64) {
    let plan = adapt(case).expect("the processor marches");
    let mut march = RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)));
    let found = estimate(&[(case, &plan)], &mut march, &SearchOptions::for_precision(Precision::F64), &mut NoLog)
        .expect("an estimate");
    let left = found.fitted[0].misfits.iter().map(|(_, after)| (after.samples as f64, after.rms_k));
    let (count, sum) = left.fold((0.0, 0.0), |(count, sum), (n, rms_k)| (count + n, sum + n * rms_k * rms_k));
    (found, (sum / count).sqrt())
}

/// PATO does not publish the coefficients behind its temperatures. All four intervals contain a round number, within
/// 2.5 % of each estimate and within PATO's search bounds: these are taken as the true values.
#[test]
fn four_coefficients_of_conductivity_are_found_from_temperatures_of_another_code() {
    let case = case("tacot-conductivity");
    let (found, left_k) = estimated(&case);
    assert!(found.converged && !found.at_bound.contains(&true), "{found:?}");
    assert_eq!(found.samples, 480, "a reading a second at each of four depths");
    assert!(left_k <= PATO_K, "{left_k} K");
    for ((value, (low, high)), round) in found.values.iter().zip(&found.intervals).zip([2.0, 2.0, 1.0, 1.0]) {
        assert!((low..=high).contains(&&round), "{low} to {high} does not contain {round}");
        // Residuals of the other code are correlated over minutes: effective sample size 10 of 480.
        assert!(high - low < 0.35 * value, "{low} to {high} is too wide");
    }
    let alike = modified(&case, |case| {
        case.factors.truncate(2);
        case.factors.iter_mut().for_each(|factor| factor.state = None);
        case.estimate.factors.truncate(2);
        case.estimate.start.truncate(2);
    });
    let (_, left_k) = estimated(&alike);
    assert!(left_k > 2.0 * PATO_K, "one conductivity in both states passed: {left_k} K");
}
