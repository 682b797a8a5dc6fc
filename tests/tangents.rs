//! Derivatives that a march tells beside its temperatures, against differences of temperatures.

use crate::support::{case, cases};
use bondline::ensemble::Ensemble;
use bondline::march::cpu::{Cpu, Reference};
use bondline::march::extrapolated::Extrapolated;
use bondline::march::{March, MarchError, Precision};
use bondline::plan::Plan;
use bondline::traces::{Arrival, Traces};
use bondline::verify::twins::{DERIVATIVE, SINGLE_DERIVATIVE, derivatives};
use std::ops::Range;

/// Near the nominal factors, but not at them.
fn point(case: &bondline::Case) -> Vec<f64> {
    case.factors.iter().enumerate().map(|(i, factor)| factor.nominal * (1.0 + 0.003 * (i % 3) as f64)).collect()
}

fn plan(case: &bondline::Case) -> Plan {
    let mut case = case.clone();
    case.resolution.cells = case.resolution.cells.min(48);
    Plan::new(&case)
}

fn off(march: &mut dyn March, case: &bondline::Case) -> f64 {
    derivatives(march, &mut Cpu::new(Precision::F64), &plan(case), &point(case)).expect("the processor marches")
}

#[test]
fn derivatives_of_every_case_are_those_of_differences_to_a_millionth() {
    for case in cases().iter().filter(|case| !case.factors.is_empty()) {
        let off = off(&mut Cpu::new(Precision::F64), case);
        assert!(off <= DERIVATIVE, "{}: {off:e}", case.id);
    }
}

#[test]
fn derivatives_in_single_precision_are_those_of_differences_in_double_to_a_hundred_thousandth() {
    for case in cases().iter().filter(|case| !case.factors.is_empty()) {
        let off = off(&mut Cpu::new(Precision::F32), case);
        assert!(off <= SINGLE_DERIVATIVE, "{}: {off:e}", case.id);
    }
}

#[test]
fn one_direction_at_a_time_tells_what_a_vector_of_them_tells() {
    let case = case("lcat-2259-pyrolysis");
    let (plan, factors) = (plan(&case), (0..case.factors.len()).collect::<Vec<_>>());
    let points = Ensemble::at(factors.len(), [point(&case), point(&case).iter().map(|x| 1.01 * x).collect()].concat());
    let of = |march: &mut dyn March| march.tangents(&plan, &points, &factors).expect("it marches").expect("it tells");
    let (together, alone) = (of(&mut Cpu::new(Precision::F64)), of(&mut Reference(Precision::F64)));
    assert_eq!(together.members(), 2 * (1 + factors.len()));
    assert_eq!(together.temperatures_k, alone.temperatures_k);
    assert_eq!(together.arrivals, alone.arrivals);
    let marched = Cpu::new(Precision::F64).march(&plan, &points, 0..2).expect("it marches");
    assert_eq!(together.member(1 + factors.len()), marched.member(1), "the member itself is marched as any other");
}

#[test]
fn what_two_resolutions_say_of_a_third_has_the_derivatives_that_it_has() {
    let case = case("lcat-2259");
    let march = || Extrapolated::new(Box::new(Cpu::new(Precision::F64)));
    let off = derivatives(&mut march(), &mut march(), &plan(&case), &point(&case)).expect("the processor marches");
    assert!(off <= DERIVATIVE, "{off:e}");
}

/// A march whose derivatives are those by a factor so many places before, or that tells none.
struct Spoiled {
    cpu: Cpu,
    places: Option<usize>,
}

impl March for Spoiled {
    fn backend(&self) -> bondline::march::Backend {
        self.cpu.backend()
    }
    fn capacity(&self, plan: &Plan) -> usize {
        self.cpu.capacity(plan)
    }
    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        self.cpu.march(plan, ensemble, members)
    }
    fn tangents(&mut self, plan: &Plan, at: &Ensemble, factors: &[usize]) -> Result<Option<Traces>, MarchError> {
        let Some(places) = self.places else { return Ok(None) };
        let mut factors = factors.to_vec();
        factors.rotate_right(places);
        self.cpu.tangents(plan, at, &factors)
    }
}

#[test]
fn derivatives_by_another_factor_are_caught_and_so_are_none() {
    let case = case("lcat-2259");
    let spoiled = |places| off(&mut Spoiled { cpu: Cpu::new(Precision::F64), places }, &case);
    assert!(spoiled(Some(0)) <= DERIVATIVE);
    assert!(spoiled(Some(1)) > 1e3 * DERIVATIVE);
    assert_eq!(spoiled(None), f64::INFINITY);
}

#[test]
fn derivatives_of_a_member_that_strays_arrive_as_it_does() {
    let case = case("lcat-2259");
    let mut far = point(&case);
    far[0] = 1e-6;
    far.iter_mut().skip(1).for_each(|factor| *factor *= 1e-9);
    let points = Ensemble::at(far.len(), [point(&case), far].concat());
    let told =
        Cpu::new(Precision::F64).tangents(&plan(&case), &points, &[0, 1]).expect("it marches").expect("it tells");
    assert!(told.arrivals[..3].iter().all(|arrival| *arrival == Arrival::Done));
    assert!(told.arrivals[3] != Arrival::Done && told.arrivals[3..].iter().all(|arrival| *arrival == told.arrivals[3]));
}
