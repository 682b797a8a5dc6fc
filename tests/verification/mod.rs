//! Every row of `bondline verify` passes on the processor in f64, and a row can fail.

use bondline::ensemble::Ensemble;
use bondline::march::cpu::{Cpu, Reference};
use bondline::march::{Backend, March, MarchError, Precision};
use bondline::plan::Plan;
use bondline::traces::Traces;
use bondline::verify::problems::{all, flexible};
use bondline::verify::{Group, compare, rows, table};
use std::ops::Range;

#[track_caller]
fn passes(group: Group) {
    let rows = rows(&mut Cpu::new(Precision::F64), &mut [], &[group]).expect("the processor does not fail");
    assert!(!rows.is_empty(), "no rows in {}", group.name());
    assert!(rows.iter().all(|row| row.pass()), "\n{}", table(&rows));
}

#[test]
fn the_march_meets_exact_solutions() {
    passes(Group::Exact);
}

#[test]
fn the_march_is_second_order_in_space_and_time() {
    passes(Group::Orders);
}

#[test]
fn the_march_agrees_with_other_codes_and_standards() {
    passes(Group::Codes);
}

#[test]
fn heat_in_less_heat_out_is_heat_stored() {
    passes(Group::Balance);
}

#[test]
fn a_reference_moved_by_twice_its_tolerance_fails_its_row() {
    let mut problem =
        all().into_iter().find(|p| p.case.name == "SFPE S.02 case 2, plate under a flux").expect("listed");
    let check = &mut problem.checks[0];
    check.points[0].value += 2.0 * check.tolerance;
    let rows = problem.rows(&mut Cpu::new(Precision::F64)).expect("the processor does not fail");
    assert!(!rows[0].pass(), "\n{}", table(&rows));
    assert!(rows[1].pass(), "\n{}", table(&rows));
}

/// A march whose last reading is off by so much.
struct Spoiled {
    temperature_k: f64,
}

impl March for Spoiled {
    fn backend(&self) -> Backend {
        Reference(Precision::F64).backend()
    }

    fn capacity(&self, plan: &Plan) -> usize {
        Reference(Precision::F64).capacity(plan)
    }

    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        let mut traces = Reference(Precision::F64).march(plan, ensemble, members)?;
        if let Some(last_k) = traces.temperatures_k.last_mut() {
            *last_k += self.temperature_k;
        }
        Ok(traces)
    }
}

#[test]
fn two_marches_are_compared_reading_by_reading() {
    let plan = Plan::new(&flexible::layup());
    let ensemble = Ensemble::at(0, Vec::new());
    let off_k = |temperature_k| {
        compare(&mut Reference(Precision::F64), &mut Spoiled { temperature_k }, &plan, &ensemble).expect("no device")
    };
    assert_eq!(off_k(0.0), 0.0);
    assert!((off_k(1e-3) - 1e-3).abs() < 1e-9);
    assert_eq!(off_k(f64::NAN), f64::INFINITY);
}
