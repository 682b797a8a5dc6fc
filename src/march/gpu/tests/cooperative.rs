//! Systems cut into blocks, one a thread of a workgroup, against their elimination in one go.

use super::super::device::Device;
use super::super::layout::{Run, plan_bytes};
use super::super::{LANES, shader};
use super::{Uniform, device};
use crate::case::Case;
use crate::march::Precision;
use crate::physics::tridiagonal::{factorise, substitute};
use crate::plan::Plan;
use bytemuck::Zeroable;

/// Solutions of whole systems and of systems that are cut, in double precision, of the largest unknown: rounding.
const ROUNDING: f64 = 1e-9;

/// Systems with one neighbour on each side, four words a cell, and their solutions by elimination in one go.
fn systems(cells: usize, count: usize) -> (Vec<f64>, Vec<f64>) {
    let mut uniform = Uniform::new(2026);
    let (mut rows, mut solutions) = (vec![], vec![]);
    for _ in 0..count {
        let coupled: Vec<f64> = (0..=cells).map(|_| 10_f64.powf(uniform.between(-2.0, 3.0))).collect();
        let inner = |link: usize| if link == 0 || link == cells { 0.0 } else { -coupled[link] };
        let mut lower: Vec<f64> = (0..cells).map(inner).collect();
        let mut upper: Vec<f64> = (1..=cells).map(inner).collect();
        let mut diagonal: Vec<f64> = (0..cells).map(|i| uniform.between(0.01, 1.0) - lower[i] - upper[i]).collect();
        let mut side: Vec<f64> = (0..cells).map(|_| uniform.between(-1.0, 1.0)).collect();
        rows.extend((0..cells).flat_map(|i| [lower[i], diagonal[i], upper[i], side[i]]));
        factorise(&mut lower, &mut diagonal, &mut upper);
        substitute(&lower, &diagonal, &upper, &mut side);
        solutions.extend(side);
    }
    (rows, solutions)
}

/// Solves systems by the kernel's own text: those of the pressures.
const SOLVE: (&str, &str) = (
    "solve",
    "@group(0) @binding(30) var<storage, read> systems: array<real>;
     @group(0) @binding(31) var<storage, read_write> solutions: array<real>;
     @compute @workgroup_size(WORKGROUP)
     fn solve(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
         one = real(run.one);
         stand(thread);
         let system = group.x;
         for (var i = first_cell(); i < end_cell(); i++) {
             let place = 4u * (system * CELLS + i);
             pressure_lower[i] = systems[place];
             pressure_diagonal[i] = systems[place + 1u];
             pressure_upper[i] = systems[place + 2u];
             pressed_second[i] = systems[place + 3u];
         }
         factorise();
         substitute();
         for (var i = first_cell(); i < end_cell(); i++) {
             solutions[system * CELLS + i] = pressed_second[i];
         }
     }",
);

/// How far the solutions of systems cut over so many lanes are from those of whole ones, of the largest of each.
fn off(device: &Device, plan: &Plan, lanes: u32, spoil: impl Fn(String) -> String) -> f64 {
    const COUNT: usize = 8;
    let cells = plan.cells();
    let (rows, expected) = systems(cells, COUNT);
    let text = spoil(shader::kernel(plan, Precision::F64, false, lanes, SOLVE));
    let kernel = device.kernel(text).expect("the text is sound");
    let run = Run { one: 1.0, lanes, cells: cells as u32, ..Run::zeroed() };
    let run = device.uniform("run", &[run]).expect("it is small");
    let plan = device.uniform("plan", &plan_bytes(plan, &plan.rows)).expect("it is small");
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
fn a_system_cut_over_lanes_has_the_solution_of_the_whole_and_not_without_what_they_hand_over() {
    let device = device(false);
    let mut case = Case::load("cases/permeation".as_ref()).expect("a shipped case");
    case.resolution.cells = 40;
    let plan = Plan::new(&case);
    let cells = plan.cells() as u32;
    for lanes in [7, LANES, cells] {
        let off = off(&device, &plan, lanes, |text| text);
        assert!(off <= ROUNDING, "{cells} cells on {lanes} lanes: {off:.1e}");
    }
    let spoils = [
        ("var carried = around[0];", "var carried = real(0.0);"),
        ("joint.last_above * scale,", "joint.last_above * scale * select(real(1.0), real(1.000001), lane == 3u),"),
        ("row.upper * under.side", "row.upper * under.side * select(real(1.0), real(1.000001), lane == 3u)"),
        ("next.upper * lasts[lane + 1u]", "real(0.0)"),
    ];
    for (sound, spoilt) in spoils {
        let off = off(&device, &plan, LANES, |text| {
            assert!(text.contains(sound), "nothing was spoiled: {sound}");
            text.replace(sound, spoilt)
        });
        assert!(off > ROUNDING, "{spoilt}: {off:.1e}");
    }
}
