//! Tangents computed by a march, against finite differences of temperatures.

use crate::support::{adapter, all_numbers, case, cases, modified, runs_all};
use bondline::ensemble::Ensemble;
use bondline::march::cpu::{Cpu, ScalarReference};
use bondline::march::gpu::Gpu;
use bondline::march::gpu::device::Device;
use bondline::march::richardson::RichardsonMarch;
use bondline::march::{March, MarchError, Precision};
use bondline::plan::Plan;
use bondline::traces::{MemberStatus, Traces};
use bondline::verify::cross_backend::{SINGLE_TANGENT_TOLERANCE, TANGENT_TOLERANCE, tangent_error};
use std::ops::Range;
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};

/// A point near the nominal factors, but not at them.
fn point(case: &bondline::Case) -> Vec<f64> {
    case.factors().iter().enumerate().map(|(i, factor)| factor.nominal * (1.0 + 0.003 * (i % 3) as f64)).collect()
}

/// With 48 cells, `stack-saffil-sic` and, in f32, `kaowool` fail at the point above and not at one beside it: a
/// temperature meets a table node within rounding, where the derivative is discontinuous. With 40 or 44 cells they
/// pass.
fn plan(case: &bondline::Case) -> Plan {
    Plan::new(&modified(case, |case| case.resolution.cells = case.resolution.cells.min(44)))
}

/// Devices opened once, so that every test uses the same compiled kernels.
static SINGLE: LazyLock<Mutex<Gpu>> = LazyLock::new(|| open(Precision::F32, false));
static DOUBLE: LazyLock<Mutex<Gpu>> = LazyLock::new(|| open(Precision::F64, false));

fn open(precision: Precision, checks: bool) -> Mutex<Gpu> {
    let device = Device::open(adapter(), checks).expect("the device opens");
    Mutex::new(Gpu::new(device, precision).expect("the device passes its self-tests"))
}

fn locked(gpu: &'static LazyLock<Mutex<Gpu>>) -> MutexGuard<'static, Gpu> {
    gpu.lock().unwrap_or_else(PoisonError::into_inner)
}

fn tangents(march: &mut dyn March, plan: &Plan, points: &Ensemble, factors: &[usize]) -> Traces {
    march.tangents(plan, points, factors).expect("it marches").expect("it has tangents")
}

/// Number of differing values and statuses; zeros of either sign are equal, because a dual number adds zeros that a
/// kernel omits.
fn differing(one: &Traces, other: &Traces) -> usize {
    let (a, b) = (all_numbers(one), all_numbers(other));
    let statuses = usize::from(one.statuses != other.statuses);
    statuses + a.len().abs_diff(b.len()) + a.iter().zip(&b).filter(|(a, b)| a != b).count()
}

fn off(march: &mut dyn March, case: &bondline::Case) -> f64 {
    tangent_error(march, &mut Cpu::new(Precision::F64), &plan(case), &point(case)).expect("the processor marches")
}

#[test]
fn tangents_of_every_case_equal_differences_to_a_millionth() {
    for case in cases().iter().filter(|case| !case.factors().is_empty()) {
        let off = off(&mut Cpu::new(Precision::F64), case);
        assert!(off <= TANGENT_TOLERANCE, "{}: {off:e}", case.id());
    }
}

#[test]
fn tangents_in_single_precision_equal_differences_in_double_to_a_hundred_thousandth() {
    for case in cases().iter().filter(|case| !case.factors().is_empty()) {
        let off = off(&mut Cpu::new(Precision::F32), case);
        assert!(off <= SINGLE_TANGENT_TOLERANCE, "{}: {off:e}", case.id());
    }
}

#[test]
fn one_direction_at_a_time_equals_a_vector_of_directions() {
    let case = case("lcat-2259-pyrolysis");
    let (plan, factors) = (plan(&case), (0..case.factors().len()).collect::<Vec<_>>());
    let points =
        Ensemble::from_values(factors.len(), [point(&case), point(&case).iter().map(|x| 1.01 * x).collect()].concat());
    let of = |march: &mut dyn March| tangents(march, &plan, &points, &factors);
    let (together, alone) = (of(&mut Cpu::new(Precision::F64)), of(&mut ScalarReference(Precision::F64)));
    assert_eq!(together.members(), 2 * (1 + factors.len()));
    assert_eq!(together.temperatures_k, alone.temperatures_k);
    assert_eq!(together.statuses, alone.statuses);
    let marched = Cpu::new(Precision::F64).march(&plan, &points, 0..2).expect("it marches");
    assert_eq!(together.member(1 + factors.len()), marched.member(1), "the primal member equals an ordinary march");
}

#[test]
fn extrapolated_temperatures_have_extrapolated_tangents() {
    let case = case("lcat-2259");
    let march = || RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)));
    let off = tangent_error(&mut march(), &mut march(), &plan(&case), &point(&case)).expect("the processor marches");
    assert!(off <= TANGENT_TOLERANCE, "{off:e}");
}

/// A faulty march: its tangents belong to a factor this many places earlier, or are missing.
struct Faulty {
    march: Box<dyn March>,
    places: Option<usize>,
}

impl March for Faulty {
    fn backend(&self) -> bondline::march::Backend {
        self.march.backend()
    }
    fn capacity(&self, plan: &Plan) -> usize {
        self.march.capacity(plan)
    }
    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        self.march.march(plan, ensemble, members)
    }
    fn tangents(&mut self, plan: &Plan, at: &Ensemble, factors: &[usize]) -> Result<Option<Traces>, MarchError> {
        let Some(places) = self.places else { return Ok(None) };
        let mut factors = factors.to_vec();
        factors.rotate_right(places);
        self.march.tangents(plan, at, &factors)
    }
}

#[test]
fn tangents_of_another_factor_and_missing_tangents_are_caught() {
    let case = case("lcat-2259");
    let faulty = |places| off(&mut Faulty { march: Box::new(Cpu::new(Precision::F64)), places }, &case);
    assert!(faulty(Some(0)) <= TANGENT_TOLERANCE);
    assert!(faulty(Some(1)) > 1e3 * TANGENT_TOLERANCE);
    assert_eq!(faulty(None), f64::INFINITY);
}

#[test]
fn tangents_of_a_diverged_member_have_its_status() {
    let case = case("lcat-2259");
    let mut far = point(&case);
    far[0] = 1e-6;
    far.iter_mut().skip(1).for_each(|factor| *factor *= 1e-9);
    let points = Ensemble::from_values(far.len(), [point(&case), far].concat());
    let on_cpu = tangents(&mut Cpu::new(Precision::F64), &plan(&case), &points, &[0, 1]);
    let on_device = tangents(&mut *locked(&SINGLE), &plan(&case), &points, &[0, 1]);
    for traces in [on_cpu, on_device] {
        assert!(traces.statuses[..3].iter().all(|status| *status == MemberStatus::Completed));
        assert!(traces.statuses[3] != MemberStatus::Completed);
        assert!(traces.statuses[3..].iter().all(|status| *status == traces.statuses[3]));
    }
}

/// Number of values that differ between a device and the CPU of the same precision, and the number of all values.
fn apart(gpu: &mut Gpu, precision: Precision, case: &bondline::Case) -> (usize, usize) {
    let (plan, factors) = (plan(case), (0..case.factors().len()).collect::<Vec<_>>());
    let points = Ensemble::from_values(factors.len(), point(case));
    let here = tangents(&mut Cpu::new(precision), &plan, &points, &factors);
    (differing(&tangents(gpu, &plan, &points, &factors), &here), all_numbers(&here).len())
}

/// A case without gas, a decomposing one and Darcy flow, or with `BONDLINE_ALL` every shipped case.
#[test]
fn tangents_are_bit_identical_on_device_and_cpu() {
    let some = || ["lcat-2259", "lcat-2259-pyrolysis", "permeation"].map(case).into();
    let chosen = if runs_all() { cases() } else { some() };
    for case in chosen.iter().filter(|case| !case.factors().is_empty()) {
        assert_eq!(apart(&mut locked(&SINGLE), Precision::F32, case).0, 0, "{}", case.id());
    }
}

/// Kernels in double precision take long to compile: a case without decomposition, and one with it if `BONDLINE_ALL`.
#[test]
fn tangents_in_double_precision_are_bit_identical_on_device_and_cpu() {
    for id in ["lcat-2259"].into_iter().chain(runs_all().then_some("lcat-2259-pyrolysis")) {
        assert_eq!(apart(&mut locked(&DOUBLE), Precision::F64, &case(id)).0, 0, "{id}");
    }
}

#[test]
fn tangents_on_the_device_equal_differences() {
    let case = case("lcat-2259");
    let (single, double) = (off(&mut *locked(&SINGLE), &case), off(&mut *locked(&DOUBLE), &case));
    assert!(single <= SINGLE_TANGENT_TOLERANCE, "{single:e} in f32");
    assert!(double <= TANGENT_TOLERANCE, "{double:e} in f64");
    let gpu = open(Precision::F32, true).into_inner().unwrap_or_else(PoisonError::into_inner);
    let mut faulty = Faulty { march: Box::new(gpu), places: Some(0) };
    let checked = off(&mut faulty, &case);
    assert!(checked <= SINGLE_TANGENT_TOLERANCE, "{checked:e} with the runtime's checks on");
    faulty.places = Some(1);
    assert!(off(&mut faulty, &case) > 1e3 * SINGLE_TANGENT_TOLERANCE, "tangents of another factor passed");
}
