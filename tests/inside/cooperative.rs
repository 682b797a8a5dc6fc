//! Cooperative kernels, a block of cells a thread, against the processor, for several block sizes.

use super::layup::with_holder_and_held_face;
use super::parity::with_scaled_conductivities;
use crate::support::{
    BALANCE, MASS, MASS_SINGLE, ROUNDING_K, SINGLE_K, SINGLE_REACTING_K, adapter, case, cases_of_each_kind, modified,
    nominal_and_random, runs_all,
};
use crate::support::{all_numbers, count_differences, max_difference_k};
use bondline::case::{Case, GasFlowModel, Sensor};
use bondline::ensemble::Ensemble;
use bondline::march::cpu::Cpu;
use bondline::march::fallback::FallbackMarch;
use bondline::march::gpu::device::Device;
use bondline::march::gpu::{COOPERATIVE_THREADS, Gpu, shader};
use bondline::march::{March, Precision};
use bondline::plan::Plan;
use bondline::traces::{Balance, MemberStatus, Traces};
use std::sync::LazyLock;
use std::thread;

/// Threads a member, in turn, on some forty cells: blocks of two; of six, with a number of threads that is not a power
/// of two; of one cell, with idle threads; of three.
const THREADS_IN_TURN: [u32; 4] = [COOPERATIVE_THREADS, 7, 64, 16];

/// A case marched by cooperative kernels.
struct Marched {
    case: Case,
    plan: Plan,
    ensemble: Ensemble,
    lanes: u32,
    precision: Precision,
    traces: Traces,
}

/// A case on few cells and long steps, which compare kernels as well as any.
fn coarsened(case: Case) -> Case {
    modified(&case, |case| {
        case.resolution.cells = 40;
        case.resolution.step_growth = 0.2;
        case.resolution.max_step_s = 2.0;
    })
}

/// A case whose gas leaves where it is released.
fn unhindered() -> Case {
    modified(&coarsened(case("lcat-2259-pyrolysis")), |case| {
        case.gas.as_mut().expect("it has gas").model = GasFlowModel::Instantaneous;
    })
}

fn gpu(precision: Precision, lanes: u32) -> Gpu {
    let device = Device::open(adapter(), false).expect("the device opens");
    Gpu::new(device, precision).expect("the device passes its self-tests").with_threads_per_member(lanes)
}

fn traces_of(march: &mut dyn March, plan: &Plan, ensemble: &Ensemble) -> Traces {
    march.march(plan, ensemble, 0..ensemble.len()).expect("the march does not fail")
}

/// At both resolutions; the coarse one runs in the kernel of the fine one, whose columns are longer.
fn marched(case: &Case, precision: Precision, lanes: u32) -> [Marched; 2] {
    let (plan, ensemble) = (Plan::new(case), nominal_and_random(case, 2));
    let mut gpu = gpu(precision, lanes);
    let threads = gpu.threads_per_member(&plan, ensemble.len()).expect("the kernel compiles");
    assert_eq!(threads, lanes, "{}: too large for workgroup memory", case.id());
    let coarse = plan.coarse.as_deref().expect("a plan has both resolutions").clone();
    [plan, coarse].map(|plan| {
        let traces = traces_of(&mut gpu, &plan, &ensemble);
        Marched { case: case.clone(), plan, ensemble: ensemble.clone(), lanes, precision, traces }
    })
}

/// In double precision a case without gas, a decomposing one, Darcy flow, and what they lack: holder, contact and depth
/// factors. In single precision the last of these. With `BONDLINE_ALL` all shipped cases, unhindered gas, and Darcy
/// flow in single precision. In two threads, as compiling takes longest.
static MARCHED: LazyLock<Vec<Marched>> = LazyLock::new(|| {
    let (shipped, more) = if runs_all() {
        (cases_of_each_kind(), vec![unhindered()])
    } else {
        (["lcat-2259", "lcat-2259-pyrolysis", "permeation"].map(case).into(), Vec::new())
    };
    let every = shipped.into_iter().map(coarsened).chain([with_holder_and_held_face()]).chain(more);
    let double = every.zip(THREADS_IN_TURN.into_iter().cycle()).map(|(case, lanes)| (case, Precision::F64, lanes));
    let single = [with_holder_and_held_face()].into_iter().chain(runs_all().then(|| coarsened(case("permeation"))));
    let inputs = double.chain(single.map(|case| (case, Precision::F32, COOPERATIVE_THREADS)));
    let (even, odd): (Vec<_>, Vec<_>) = inputs.enumerate().partition(|(place, _)| place % 2 == 0);
    let march = |inputs: Vec<(usize, (Case, Precision, u32))>| -> Vec<Marched> {
        inputs.into_iter().flat_map(|(_, (case, precision, lanes))| marched(&case, precision, lanes)).collect()
    };
    thread::scope(|scope| {
        let odd = scope.spawn(move || march(odd));
        let mut all = march(even);
        all.extend(odd.join().expect("the device marches every case"));
        all
    })
});

fn of(precision: Precision) -> impl Iterator<Item = &'static Marched> {
    MARCHED.iter().filter(move |marched| marched.precision == precision)
}

/// Largest difference of all numbers of two marches, relative to one plus the number.
fn largest_relative_difference(one: &Traces, other: &Traces) -> f64 {
    if one.statuses != other.statuses {
        return f64::INFINITY;
    }
    let (one, other) = (all_numbers(one), all_numbers(other));
    assert_eq!(one.len(), other.len());
    let pairs = one.iter().zip(&other).map(|(a, b)| (a - b).abs() / (1.0 + b.abs()));
    pairs.fold(0.0, |worst, off| if off.is_nan() { f64::INFINITY } else { off.max(worst) })
}

#[test]
fn cooperative_kernels_agree_with_the_processor_within_rounding_for_every_block_size() {
    for Marched { case, plan, ensemble, lanes, traces, .. } in of(Precision::F64) {
        let processor = traces_of(&mut Cpu::new(Precision::F64), plan, ensemble);
        assert!(
            traces.statuses.iter().all(|status| *status == MemberStatus::Completed),
            "{}: not all members complete",
            case.id()
        );
        let off_k = max_difference_k(traces, &processor);
        assert!(off_k <= ROUNDING_K, "{} on {lanes} threads: {off_k:.1e} K", case.id());
        let off = largest_relative_difference(traces, &processor);
        assert!(off <= ROUNDING_K, "{} on {lanes} threads: {off:.1e} of any number", case.id());
        let perturbed_k = max_difference_k(
            traces,
            &traces_of(&mut Cpu::new(Precision::F64), &with_scaled_conductivities(plan, 1e-6), ensemble),
        );
        assert!(perturbed_k > ROUNDING_K, "{}: a conductivity changed by 1e-6 passed", case.id());
    }
}

#[test]
fn cooperative_kernels_are_accurate_in_single_precision() {
    for Marched { case, plan, ensemble, lanes, traces, .. } in of(Precision::F32) {
        let processor = |plan: &Plan| traces_of(&mut Cpu::new(Precision::F64), plan, ensemble);
        let allowed_k = if plan.rows.max_reactions > 0 { SINGLE_REACTING_K } else { SINGLE_K };
        let off_k = max_difference_k(traces, &processor(plan));
        assert!(off_k <= allowed_k, "{} on {lanes} threads: {off_k:.1e} K", case.id());
        let perturbed_k = max_difference_k(traces, &processor(&with_scaled_conductivities(plan, 1e-3)));
        assert!(perturbed_k > allowed_k, "{}: a conductivity changed by 1e-3 passed", case.id());
    }
}

/// Heat: within the imbalance of the processor in double precision at the same steps.
#[test]
fn cooperative_kernels_close_the_heat_and_mass_balances() {
    for Marched { case, plan, ensemble, traces, precision, .. } in MARCHED.iter() {
        let allowed = if *precision == Precision::F32 { MASS_SINGLE } else { MASS };
        let processor = traces_of(&mut Cpu::new(Precision::F64), plan, ensemble);
        for (balance, expected) in traces.balances.iter().zip(&processor.balances) {
            let mass = balance.mass_residual().abs();
            assert!(mass <= allowed, "{} in {precision:?}: mass {mass:.1e}", case.id());
            let imbalance = |balance: &Balance| (balance.residual() - expected.residual()).abs();
            assert!(imbalance(balance) <= BALANCE, "{} in {precision:?}: heat {:.1e}", case.id(), imbalance(balance));
            let mut leaking = *balance;
            leaking.stored_j_m2 += 5.0 * BALANCE * balance.hot_in_j_m2;
            assert!(
                balance.hot_in_j_m2 == 0.0 || imbalance(&leaking) > BALANCE,
                "{}: an energy imbalance passed",
                case.id()
            );
        }
    }
}

#[test]
fn a_plan_too_large_for_workgroup_memory_takes_one_thread_a_member() {
    let plan = Plan::new(&coarsened(case("slab")));
    let text = shader::kernel(&plan, Precision::F64, false, COOPERATIVE_THREADS, shader::MARCH);
    let device = Device::open(adapter(), false).expect("the device opens");
    let bytes = device.kernel(text).expect("the kernel compiles").workgroup_bytes();
    for (room_bytes, expected) in [(bytes, COOPERATIVE_THREADS), (bytes - 1, 1)] {
        let mut device = device.clone();
        device.limits.max_compute_workgroup_storage_size = room_bytes;
        let mut gpu = Gpu::new(device, Precision::F64)
            .expect("the device passes its self-tests")
            .with_threads_per_member(COOPERATIVE_THREADS);
        assert_eq!(
            gpu.threads_per_member(&plan, 1).expect("the kernel compiles"),
            expected,
            "{room_bytes} of {bytes} bytes"
        );
    }
}

#[test]
fn a_plan_too_large_for_the_memory_of_a_thread_takes_a_workgroup_a_member_and_is_differentiated_by_the_processor() {
    let case = coarsened(case("lcat-2259"));
    let (plan, ensemble) = (Plan::new(&case), nominal_and_random(&case, 2));
    let device = |threads, room_bytes| {
        let mut device = Device::open(adapter(), false).expect("the device opens");
        device.max_private_bytes = room_bytes;
        Gpu::new(device, Precision::F32).expect("the device passes its self-tests").with_threads_per_member(threads)
    };
    let kernel = Device::open(adapter(), false)
        .and_then(|device| device.kernel(shader::kernel(&plan, Precision::F32, true, 1, shader::MARCH)))
        .expect("the kernel compiles");
    // Columns are longer than the plan by less than 64 cells.
    let room = |cells: usize| kernel.private_bytes() * (plan.cells() + cells) as u32 / plan.cells() as u32;
    let chosen = [(room(64), 1), (room(0) - 1, COOPERATIVE_THREADS)].map(|(room_bytes, expected)| {
        let mut gpu = device(1, room_bytes);
        assert_eq!(gpu.threads_per_member(&plan, 3).expect("a kernel fits"), expected, "{room_bytes} bytes");
        gpu
    });
    let [mut roomy, mut narrow] = chosen;
    let points = Ensemble::from_values(case.factors().len(), ensemble.member(0).to_vec());
    assert!(roomy.tangents(&plan, &points, &[0]).expect("the device marches").is_none(), "twice the columns fit");
    assert!(narrow.tangents(&plan, &points, &[0]).expect("the device marches").is_none(), "the columns fit");
    let reserve = || Box::new(Cpu::new(Precision::F32));
    let tangents =
        FallbackMarch::new(Box::new(narrow), reserve()).tangents(&plan, &points, &[0]).expect("the processor marches");
    let expected = reserve().tangents(&plan, &points, &[0]).expect("the processor marches");
    let values = |of: Option<Traces>| of.expect("the processor differentiates").temperatures_k;
    assert_eq!(values(tangents), values(expected));
    let mut device = Device::open(adapter(), false).expect("the device opens");
    device.max_private_bytes = 100;
    device.limits.max_compute_workgroup_storage_size = 100;
    let refused =
        Gpu::new(device, Precision::F32).expect("the device passes its self-tests").march(&plan, &ensemble, 0..1);
    let message = refused.err().map(|error| error.to_string()).unwrap_or_default();
    assert!(message.contains("fit neither the 100 bytes of a thread"), "{message}");
}

/// More sensors mean more loop turns a step, and fewer steps a dispatch.
#[test]
fn cutting_dispatches_at_other_steps_changes_no_bit() {
    let fine = of(Precision::F32).filter(|marched| marched.plan.coarse.is_some());
    let whole = fine.last().expect("a case is marched in single precision");
    let case = modified(&whole.case, |case| {
        let first = case.sensors[0].clone();
        case.sensors.extend((0..40).map(|added| Sensor { name: format!("MORE{added}"), ..first.clone() }));
    });
    let plan = Plan::new(&case);
    let steps = |plan: &Plan| shader::steps_per_dispatch(plan, COOPERATIVE_THREADS, true) as usize;
    assert!(steps(&plan) < steps(&whole.plan) && steps(&plan) < plan.steps(), "dispatches have the same length");
    let cut = traces_of(&mut gpu(Precision::F32, COOPERATIVE_THREADS), &plan, &whole.ensemble);
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
    assert_ne!(count_differences(&cut, &whole.traces), 0, "the sensors added read something");
}
