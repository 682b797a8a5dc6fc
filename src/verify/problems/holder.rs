//! Heat lost sideways to a holder.

use super::REFINED;
use crate::case::{Holder, Schedule};
use crate::verify::Group::Exact;
use crate::verify::problem::{
    Check, ErrorScale, Problem, ProblemSetup, constant_properties, held_face, insulated_face, points,
};

const CONDUCTANCE_W_M3_K: f64 = 5e3;
const HOLDER_K: f64 = 300.0;
const CAPACITY_J_M3_K: f64 = 5e5;

pub(super) fn problems() -> Vec<Problem> {
    vec![relaxation(), ramped_holder(), steady_fin()]
}

fn with_holder(mut problem: Problem, temperature_k: Schedule) -> Problem {
    problem.case.exposure.holder = Some(Holder { conductance_w_m3_k: CONDUCTANCE_W_M3_K, temperature_k });
    problem
}

/// A slab between insulated faces that starts 900 K above the holder.
fn slab(start_k: f64) -> ProblemSetup {
    ProblemSetup {
        plies: vec![(constant_properties(0.5, CAPACITY_J_M3_K), 0.02)],
        start_k,
        hot_face: insulated_face(),
        back_face: insulated_face(),
        cells: 8,
        first_step_s: 0.02,
        step_growth: 0.002,
    }
}

fn check(
    reference: &'static str,
    quantity: &'static str,
    rise_k: f64,
    temperature_k: &dyn Fn(f64, f64) -> f64,
) -> Check {
    Check {
        reference,
        quantity,
        points: points(&[0.0, 0.005, 0.02], &[1.0, 10.0, 100.0, 200.0, 400.0], temperature_k),
        tolerance: 1e-6,
        measure: ErrorScale::RelativeTo(rise_k),
        source_of_tolerance: REFINED,
    }
}

/// Uniform relaxation: `T = T_h + (T₀ − T_h) exp(−g t/(ρ c))`.
fn relaxation() -> Problem {
    let rise_k = 900.0;
    let decay_1_s = CONDUCTANCE_W_M3_K / CAPACITY_J_M3_K;
    let form = |_: f64, time_s: f64| HOLDER_K + rise_k * (-decay_1_s * time_s).exp();
    let checks = vec![check("exp(−g t/(ρ c))", "3 depths, 1 to 400 s", rise_k, &form)];
    with_holder(
        Problem::new(Exact, "slab, relaxing to the holder", slab(HOLDER_K + rise_k), checks),
        Schedule::constant(HOLDER_K),
    )
}

/// The holder warms by 1 K/s; the slab follows with a first-order lag.
fn ramped_holder() -> Problem {
    let time_constant_s = CAPACITY_J_M3_K / CONDUCTANCE_W_M3_K;
    let form = |_: f64, time_s: f64| HOLDER_K + time_s - time_constant_s * (1.0 - (-time_s / time_constant_s).exp());
    let checks = vec![check("first-order lag behind a ramp", "3 depths, 1 to 400 s", 400.0, &form)];
    let ramp = Schedule { times_s: vec![0.0, 400.0], values: vec![HOLDER_K, HOLDER_K + 400.0] };
    with_holder(Problem::new(Exact, "slab, following the holder", slab(HOLDER_K), checks), ramp)
}

/// Steady state between a held face and an insulated one, as in a fin: `cosh(m (L − x))/cosh(m L)`, `m² = g/k`.
fn steady_fin() -> Problem {
    let (conductivity_w_m_k, thickness_m, rise_k) = (0.5, 0.02, 900.0);
    let (slope_1_m, reach) = ((CONDUCTANCE_W_M3_K / conductivity_w_m_k).sqrt(), thickness_m);
    let form =
        |depth_m: f64, _: f64| HOLDER_K + rise_k * (slope_1_m * (reach - depth_m)).cosh() / (slope_1_m * reach).cosh();
    let setting = ProblemSetup {
        plies: vec![(constant_properties(conductivity_w_m_k, CAPACITY_J_M3_K), thickness_m)],
        start_k: HOLDER_K,
        hot_face: held_face(HOLDER_K + rise_k),
        back_face: insulated_face(),
        cells: 1600,
        first_step_s: 1e-2,
        step_growth: 0.05,
    };
    let checks = vec![Check {
        reference: "cosh of a fin with an insulated end",
        quantity: "5 depths, steady",
        points: points(&[0.0, 0.005, 0.01, 0.015, 0.02], &[10e3], form),
        tolerance: 1e-6,
        measure: ErrorScale::RelativeTo(rise_k),
        source_of_tolerance: REFINED,
    }];
    with_holder(Problem::new(Exact, "slab with holder, steady", setting, checks), Schedule::constant(HOLDER_K))
}
