//! Tridiagonal systems cut into blocks, one a thread, against the Thomas algorithm.

use super::super::device::Device;
use super::super::layout::{DispatchParameters, plan_bytes};
use super::super::{COOPERATIVE_THREADS, shader};
use super::{Uniform, device};
use crate::case::Case;
use crate::march::Precision;
use crate::physics::tridiagonal::{factorise, substitute};
use crate::plan::Plan;
use bytemuck::Zeroable;

/// Allowed rounding error in double precision, relative to the largest unknown.
const ROUNDING: f64 = 1e-9;

/// Tridiagonal systems, four words a cell, and their solutions by the Thomas algorithm.
fn systems(cells: usize, count: usize) -> (Vec<f64>, Vec<f64>) {
    let mut uniform = Uniform::new(2026);
    let (mut rows, mut solutions) = (vec![], vec![]);
    for _ in 0..count {
        let conductances: Vec<f64> = (0..=cells).map(|_| 10_f64.powf(uniform.between(-2.0, 3.0))).collect();
        let inner = |face: usize| if face == 0 || face == cells { 0.0 } else { -conductances[face] };
        let mut lower: Vec<f64> = (0..cells).map(inner).collect();
        let mut upper: Vec<f64> = (1..=cells).map(inner).collect();
        let mut diagonal: Vec<f64> = (0..cells).map(|i| uniform.between(0.01, 1.0) - lower[i] - upper[i]).collect();
        let mut rhs: Vec<f64> = (0..cells).map(|_| uniform.between(-1.0, 1.0)).collect();
        rows.extend((0..cells).flat_map(|i| [lower[i], diagonal[i], upper[i], rhs[i]]));
        factorise(&mut lower, &mut diagonal, &mut upper);
        substitute(&lower, &diagonal, &upper, &mut rhs);
        solutions.extend(rhs);
    }
    (rows, solutions)
}

/// Solves systems with the kernel's code for pressures.
const SOLVE: (&str, &str) = (
    "solve",
    "@group(0) @binding(30) var<storage, read> systems: array<real>;
     @group(0) @binding(31) var<storage, read_write> solutions: array<real>;
     @compute @workgroup_size(WORKGROUP)
     fn solve(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
         one = real(run.one);
         assign_block(thread);
         let system = group.x;
         for (var i = first_cell(); i < end_cell(); i++) {
             let place = 4u * (system * CELLS + i);
             pressure_lower[i] = systems[place];
             pressure_diagonal[i] = systems[place + 1u];
             pressure_upper[i] = systems[place + 2u];
             pressure_unknowns[i] = systems[place + 3u];
         }
         factorise();
         substitute();
         for (var i = first_cell(); i < end_cell(); i++) {
             solutions[system * CELLS + i] = pressure_unknowns[i];
         }
     }",
);

/// Largest error of the solutions with so many threads, relative to the largest unknown of each system.
fn largest_error(device: &Device, plan: &Plan, lanes: u32, change: impl Fn(String) -> String) -> f64 {
    const COUNT: usize = 8;
    let cells = plan.cells();
    let (rows, expected) = systems(cells, COUNT);
    let text = change(shader::kernel(plan, Precision::F64, false, lanes, SOLVE));
    let kernel = device.kernel(text).expect("the kernel compiles");
    let run =
        DispatchParameters { one: 1.0, threads_per_member: lanes, cells: cells as u32, ..DispatchParameters::zeroed() };
    let run = device.uniform("run", &[run]).expect("uniform buffer fits");
    let plan = device.uniform("plan", &plan_bytes(plan, &plan.rows.data)).expect("uniform buffer fits");
    let (rows, solutions) = (device.upload("systems", &rows), device.upload("solutions", &vec![0.0; COUNT * cells]));
    let bound = [(0, &run), (2, &plan), (30, &rows), (31, &solutions)];
    let bound = bound.map(|(binding, buffer)| (binding, buffer.as_entire_binding()));
    let found: Vec<f64> = device.probe(&kernel, "solve", COUNT as u32, bound, &solutions).expect("the probe runs");
    let each = found.chunks_exact(cells).zip(expected.chunks_exact(cells)).map(|(found, expected)| {
        let largest = expected.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let apart = found.iter().zip(expected).map(|(a, b)| (a - b).abs() / largest);
        apart.fold(0.0, |worst, off| if off.is_nan() { f64::INFINITY } else { off.max(worst) })
    });
    each.fold(0.0, f64::max)
}

#[test]
fn a_system_cut_into_blocks_has_the_solution_of_the_thomas_algorithm_and_needs_every_exchanged_term() {
    let device = device(false);
    let mut case = Case::load("cases/permeation".as_ref()).expect("a shipped case");
    case.resolution.cells = 40;
    let plan = Plan::new(&case);
    let cells = plan.cells() as u32;
    for lanes in [7, COOPERATIVE_THREADS, cells] {
        let error = largest_error(&device, &plan, lanes, |text| text);
        assert!(error <= ROUNDING, "{cells} cells on {lanes} threads: {error:.1e}");
    }
    let changes = [
        ("var coupling = around[0];", "var coupling = real(0.0);"),
        ("block.last_above * scale,", "block.last_above * scale * select(real(1.0), real(1.000001), thread == 3u),"),
        ("row.upper * below.rhs", "row.upper * below.rhs * select(real(1.0), real(1.000001), thread == 3u)"),
        ("next.upper * last_unknowns[thread + 1u]", "real(0.0)"),
    ];
    for (original, wrong) in changes {
        let error = largest_error(&device, &plan, COOPERATIVE_THREADS, |text| {
            assert!(text.contains(original), "nothing was changed: {original}");
            text.replace(original, wrong)
        });
        assert!(error > ROUNDING, "{wrong}: {error:.1e}");
    }
}
