//! Members that a workgroup carries, a block of cells a lane: as the processor carries them, whatever the blocks.

use super::layup::held_above_too;
use super::parity::spoiled;
use crate::support::{
    BALANCE, MASS, MASS_SINGLE, ROUNDING_K, SINGLE_K, SINGLE_REACTING_K, adapter, case, cases, changed, drawn,
};
use crate::support::{apart_k, differing, numbers};
use bondline::case::{Case, GasPath, Sensor};
use bondline::ensemble::Ensemble;
use bondline::march::cpu::Cpu;
use bondline::march::gpu::device::Device;
use bondline::march::gpu::{Gpu, LANES, shader};
use bondline::march::{March, Precision};
use bondline::plan::Plan;
use bondline::traces::{Arrival, Balance, Traces};
use std::sync::LazyLock;
use std::thread;

/// Lanes that cases have in turn, on some forty cells: blocks of two, of six and not by a power of two, of one cell with lanes that have none, of three.
const IN_TURN: [u32; 4] = [LANES, 7, 64, 16];

/// A case carried by workgroups.
struct Marched {
    case: Case,
    plan: Plan,
    ensemble: Ensemble,
    lanes: u32,
    precision: Precision,
    traces: Traces,
}

/// A case on few cells and long steps, at which one kernel is held against another as well as at any.
fn coarsened(case: Case) -> Case {
    changed(&case, |case| {
        case.resolution.cells = 40;
        case.resolution.growth = 0.2;
        case.resolution.largest_step_s = 2.0;
    })
}

/// A case whose gas leaves where it is made.
fn unhindered() -> Case {
    changed(&coarsened(case("lcat-2259-pyrolysis")), |case| {
        case.gas.as_mut().expect("it has gas").path = GasPath::Unhindered;
    })
}

fn gpu(precision: Precision, lanes: u32) -> Gpu {
    let device = Device::open(adapter(), false).expect("the device opens");
    Gpu::new(device, precision).expect("the device passes its self-tests").with_lanes(lanes)
}

fn carried(march: &mut dyn March, plan: &Plan, ensemble: &Ensemble) -> Traces {
    march.march(plan, ensemble, 0..ensemble.len()).expect("the march does not fail")
}

/// At both resolutions, of which the coarser has room to spare in the kernel of the finer.
fn marched(case: &Case, precision: Precision, lanes: u32) -> [Marched; 2] {
    let (plan, ensemble) = (Plan::new(case), drawn(case, 2));
    let mut gpu = gpu(precision, lanes);
    let carried_by = gpu.lanes(&plan, ensemble.len()).expect("the kernel compiles");
    assert_eq!(carried_by, lanes, "{}: no room in a workgroup", case.id());
    let coarse = plan.coarse.as_deref().expect("a plan has both resolutions").clone();
    [plan, coarse].map(|plan| {
        let traces = carried(&mut gpu, &plan, &ensemble);
        Marched { case: case.clone(), plan, ensemble: ensemble.clone(), lanes, precision, traces }
    })
}

/// Every shipped case in double precision, with what they lack: a holder, a contact and depths in doubt, and gas that leaves where it is made; and
/// one of each kind in single precision. In two threads, as compiling takes longest.
static MARCHED: LazyLock<Vec<Marched>> = LazyLock::new(|| {
    let every = cases().into_iter().map(coarsened).chain([held_above_too(), unhindered()]);
    let double = every.zip(IN_TURN.into_iter().cycle()).map(|(case, lanes)| (case, Precision::F64, lanes));
    let kinds = [held_above_too(), coarsened(case("permeation"))];
    let asked = double.chain(kinds.map(|case| (case, Precision::F32, LANES)));
    let (even, odd): (Vec<_>, Vec<_>) = asked.enumerate().partition(|(place, _)| place % 2 == 0);
    let march = |asked: Vec<(usize, (Case, Precision, u32))>| -> Vec<Marched> {
        asked.into_iter().flat_map(|(_, (case, precision, lanes))| marched(&case, precision, lanes)).collect()
    };
    thread::scope(|scope| {
        let odd = scope.spawn(move || march(odd));
        let mut all = march(even);
        all.extend(odd.join().expect("the device carries every case"));
        all
    })
});

fn of(precision: Precision) -> impl Iterator<Item = &'static Marched> {
    MARCHED.iter().filter(move |marched| marched.precision == precision)
}

/// How far all numbers of two marches are apart at most, each as a share of one more than it is: kelvins of temperatures near nothing, shares of heats.
fn apart(one: &Traces, other: &Traces) -> f64 {
    if one.arrivals != other.arrivals {
        return f64::INFINITY;
    }
    let (one, other) = (numbers(one), numbers(other));
    assert_eq!(one.len(), other.len());
    let pairs = one.iter().zip(&other).map(|(a, b)| (a - b).abs() / (1.0 + b.abs()));
    pairs.fold(0.0, |worst, off| if off.is_nan() { f64::INFINITY } else { off.max(worst) })
}

#[test]
fn a_member_cut_into_blocks_is_the_processors_but_for_rounding_in_every_case_whatever_the_blocks() {
    for Marched { case, plan, ensemble, lanes, traces, .. } in of(Precision::F64) {
        let processor = carried(&mut Cpu::new(Precision::F64), plan, ensemble);
        assert!(traces.arrivals.iter().all(|arrival| *arrival == Arrival::Done), "{}: not all arrive", case.id());
        let off_k = apart_k(traces, &processor);
        assert!(off_k <= ROUNDING_K, "{} on {lanes} lanes: {off_k:.1e} K", case.id());
        let off = apart(traces, &processor);
        assert!(off <= ROUNDING_K, "{} on {lanes} lanes: {off:.1e} of any number", case.id());
        let spoiled_k = apart_k(traces, &carried(&mut Cpu::new(Precision::F64), &spoiled(plan, 1e-6), ensemble));
        assert!(spoiled_k > ROUNDING_K, "{}: a conductivity off by a millionth passed", case.id());
    }
}

#[test]
fn single_precision_suffices_where_a_workgroup_carries_a_member() {
    for Marched { case, plan, ensemble, lanes, traces, .. } in of(Precision::F32) {
        let processor = |plan: &Plan| carried(&mut Cpu::new(Precision::F64), plan, ensemble);
        let allowed_k = if plan.reactions > 0 { SINGLE_REACTING_K } else { SINGLE_K };
        let off_k = apart_k(traces, &processor(plan));
        assert!(off_k <= allowed_k, "{} on {lanes} lanes: {off_k:.1e} K", case.id());
        let spoiled_k = apart_k(traces, &processor(&spoiled(plan, 1e-3)));
        assert!(spoiled_k > allowed_k, "{}: a conductivity off by a thousandth passed", case.id());
    }
}

/// Heat within what the processor in double precision leaves at steps as long.
#[test]
fn heat_and_mass_are_accounted_for_across_the_lanes() {
    for Marched { case, plan, ensemble, traces, precision, .. } in MARCHED.iter() {
        let allowed = if *precision == Precision::F32 { MASS_SINGLE } else { MASS };
        let processor = carried(&mut Cpu::new(Precision::F64), plan, ensemble);
        for (balance, expected) in traces.balances.iter().zip(&processor.balances) {
            let mass = balance.mass_residual().abs();
            assert!(mass <= allowed, "{} in {precision:?}: mass {mass:.1e}", case.id());
            let unlike = |balance: &Balance| (balance.residual() - expected.residual()).abs();
            assert!(unlike(balance) <= BALANCE, "{} in {precision:?}: heat {:.1e}", case.id(), unlike(balance));
            let mut leaking = *balance;
            leaking.stored_j_m2 += 5.0 * BALANCE * balance.hot_in_j_m2;
            assert!(balance.hot_in_j_m2 == 0.0 || unlike(&leaking) > BALANCE, "{}: heat to nowhere passed", case.id());
        }
    }
}

#[test]
fn a_plan_too_large_for_a_workgroup_has_an_invocation_a_member_even_where_more_are_asked_for() {
    let plan = Plan::new(&coarsened(case("slab")));
    let text = shader::kernel(&plan, Precision::F64, false, LANES, shader::MARCH);
    let device = Device::open(adapter(), false).expect("the device opens");
    let bytes = device.kernel(text).expect("the text is sound").workgroup_bytes();
    for (room_bytes, expected) in [(bytes, LANES), (bytes - 1, 1)] {
        let mut device = device.clone();
        device.limits.max_compute_workgroup_storage_size = room_bytes;
        let mut gpu = Gpu::new(device, Precision::F64).expect("the device passes its self-tests").with_lanes(LANES);
        assert_eq!(gpu.lanes(&plan, 1).expect("the kernel compiles"), expected, "{room_bytes} of {bytes} bytes");
    }
}

/// More sensors make steps longer in loop turns, and dispatches shorter in steps.
#[test]
fn a_member_put_down_and_taken_up_at_other_steps_reads_the_same_to_the_bit() {
    let whole = of(Precision::F32).find(|marched| marched.case.id() == "permeation").expect("it is among the kinds");
    let case = changed(&whole.case, |case| {
        let first = case.sensors[0].clone();
        case.sensors.extend((0..40).map(|added| Sensor { name: format!("MORE{added}"), ..first.clone() }));
    });
    let plan = Plan::new(&case);
    let steps = |plan: &Plan| shader::steps_a_dispatch(plan, LANES, true) as usize;
    assert!(steps(&plan) < steps(&whole.plan) && steps(&plan) < plan.steps(), "dispatches are cut alike");
    let cut = carried(&mut gpu(Precision::F32, LANES), &plan, &whole.ensemble);
    for member in 0..whole.ensemble.len() {
        for sensor in 0..whole.case.sensors().len() {
            assert_eq!(
                cut.trace(member, sensor),
                whole.traces.trace(member, sensor),
                "member {member}, sensor {sensor}"
            );
        }
    }
    assert_eq!(cut.gauges, whole.traces.gauges);
    assert_eq!(cut.extremes_k, whole.traces.extremes_k);
    assert_ne!(differing(&cut, &whole.traces), 0, "the sensors added read something");
}
