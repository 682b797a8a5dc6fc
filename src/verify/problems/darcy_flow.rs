//! Darcy flow through an isothermal 50 mm slab, and conduction against a steady gas flow.

use super::REFINED;
use crate::case::{Face, GasFlowModel, Material, Pores, ReactionScheme, Schedule, Table};
use crate::traces::Gauge;
use crate::verify::Group::Exact;
use crate::verify::exact;
use crate::verify::exact::darcy::DarcySlab;
use crate::verify::exact::kinetics::Arrhenius;
use crate::verify::problem::{
    Check, ErrorScale, Problem, ProblemSetup, constant_properties, gauge_points, held_face, material, points,
};
use crate::verify::problem_materials::{
    constant_gas, decomposition, reaction, unchanged_residue, with_decomposition, with_pores,
};
use std::sync::Arc;

pub(super) fn problems() -> Vec<Problem> {
    let mut problems = vec![
        uniform_source(0.0),
        uniform_source(20.0),
        pressure_step(),
        travelling_wave(),
        front_into_vacuum(),
        enclosed_gas(),
    ];
    problems.extend([steady_flow(0.0, 0.0), steady_flow(10.0, 0.0), steady_flow(0.0, 1e7)]);
    problems.extend([GasFlowModel::QuasiSteady, GasFlowModel::Darcy].map(conduction_against_gas));
    problems
}

const THICKNESS_M: f64 = 0.05;
const TEMPERATURE_K: f64 = 1000.0;
const FACE_PA: f64 = 101_325.0;

/// The gas of [`constant_gas`] in a slab of porosity 0.85.
const DARCY_SLAB: DarcySlab = DarcySlab {
    molar_mass_kg_mol: 0.022,
    viscosity_pa_s: 3e-5,
    temperature_k: TEMPERATURE_K,
    permeability_m2: 2e-11,
    porosity: 0.85,
    slip_pa: 0.0,
    forchheimer_1_m: 0.0,
};

fn pores(seeping: &DarcySlab) -> Pores {
    Pores {
        porosity: seeping.porosity,
        permeability_m2: seeping.permeability_m2,
        slip_pa_k: seeping.slip_pa / TEMPERATURE_K,
        forchheimer_1_m: seeping.forchheimer_1_m,
    }
}

/// A slab of so high a conductivity that it stays at the temperature of its faces.
fn isothermal_material(seeping: &DarcySlab) -> Material {
    with_pores(&constant_properties(1e3, 1e5), pores(seeping))
}

/// A slab with a constant gas source: a reaction of order zero, of which a small part proceeds.
fn with_gas_source(virgin: &Material, source_kg_m3_s: f64, duration_s: f64) -> Arc<Material> {
    let rate_1_s = 1e-3 / duration_s;
    let virgin = Material { density_kg_m3: source_kg_m3_s / (0.5 * rate_1_s), ..virgin.clone() };
    let steady = Arrhenius { rate_1_s, activation_energy_j_mol: 0.0, order: 0.0, onset_k: 0.0 };
    with_decomposition(
        &virgin,
        decomposition(ReactionScheme::Parallel, vec![reaction(0.5, steady, 0.0)], vec![unchanged_residue(&virgin)]),
    )
}

fn setting(material: Arc<Material>, cells: usize) -> ProblemSetup {
    ProblemSetup {
        plies: vec![(material, THICKNESS_M)],
        start_k: TEMPERATURE_K,
        hot_face: held_face(TEMPERATURE_K),
        back_face: held_face(TEMPERATURE_K),
        cells,
        first_step_s: 1e-6,
        step_growth: 0.02,
    }
}

/// A problem of gas flow without heat: pressure at the hot face and, for an open back, at the back face.
fn darcy_problem(
    name: &str,
    setting: ProblemSetup,
    face_pa: Schedule,
    back_pa: Option<Schedule>,
    checks: Vec<Check>,
) -> Problem {
    let mut problem = Problem::new(Exact, name, setting, checks).with_gas_flow(GasFlowModel::Darcy, constant_gas(0.0));
    problem.case.exposure.pressure_pa = face_pa;
    problem.case.exposure.back_pressure_pa = back_pa;
    problem
}

const STEADY_STATE: &str = "a finite-volume scheme in p² is exact in the steady state; wide: f32 rounds to 1e-7";

fn uniform_source(slip_pa_k: f64) -> Problem {
    let seeping = DarcySlab { slip_pa: slip_pa_k * TEMPERATURE_K, ..DARCY_SLAB };
    let (source_kg_m3_s, duration_s) = (0.5, 2.0);
    let check = |quantity, gauge, value: f64| Check {
        reference: "steady Darcy flow (Muskat 1937)",
        quantity,
        points: gauge_points(gauge, &[duration_s], |_| value),
        tolerance: 1e-6,
        measure: ErrorScale::Relative,
        source_of_tolerance: STEADY_STATE,
    };
    let back_pa = seeping.sealed_back_pressure_pa(FACE_PA, source_kg_m3_s, THICKNESS_M);
    let material = with_gas_source(&isothermal_material(&seeping), source_kg_m3_s, duration_s);
    darcy_problem(
        &format!("uniform gas source, slip {slip_pa_k} Pa/K"),
        setting(material, 100),
        Schedule::constant(FACE_PA),
        None,
        vec![
            check("pressure at the back", Gauge::BackPressure, back_pa),
            check("largest pressure", Gauge::PeakPressure, back_pa),
            check("gas flux", Gauge::GasFlux, source_kg_m3_s * THICKNESS_M),
        ],
    )
}

/// The pressure at the face drops by 100 Pa: little enough for the linearised equation.
fn pressure_step() -> Problem {
    let step_pa = 100.0;
    let per_second = DARCY_SLAB.diffusivity_m2_s(FACE_PA) / (THICKNESS_M * THICKNESS_M);
    let check = Check {
        reference: "Carslaw and Jaeger 1959, §3.3, linearised",
        quantity: "pressure at the back, 1 to 200 ms",
        points: gauge_points(Gauge::BackPressure, &[1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2], |time_s| {
            FACE_PA + step_pa * (1.0 - exact::face_temperature_step(per_second * time_s, 1.0))
        }),
        tolerance: 0.1,
        measure: ErrorScale::Absolute,
        source_of_tolerance: "the equation is linear to 1e-3 of the step",
    };
    let face_pa = Schedule { times_s: vec![0.0, 1e-7], values: vec![FACE_PA + step_pa, FACE_PA] };
    darcy_problem(
        "a small step of pressure",
        setting(Arc::new(isothermal_material(&DARCY_SLAB)), 200),
        face_pa,
        None,
        vec![check],
    )
}

/// A travelling pressure wave driven into the slab by a rising pressure at its face.
fn travelling_wave() -> Problem {
    let seeping = DarcySlab { permeability_m2: 2e-13, ..DARCY_SLAB };
    let (ahead_pa, speed_m_s, foot, duration_s, step_s) = (1e4, 0.0157, 1e-7, 8.0, 4e-3);
    let pressure_pa =
        |time_s: f64, depth_m: f64| seeping.travelling_wave_pa(speed_m_s, ahead_pa, foot, speed_m_s * time_s - depth_m);
    let schedule = |depth_m: f64| {
        let times_s: Vec<f64> = (0..=(duration_s / step_s) as u32).map(|i| step_s * f64::from(i)).collect();
        let values = times_s.iter().map(|&time_s| pressure_pa(time_s, depth_m)).collect();
        Schedule { times_s, values }
    };
    let flux = |time_s| -seeping.travelling_wave_flux_kg_m2_s(speed_m_s, ahead_pa, pressure_pa(time_s, 0.0));
    let check = Check {
        reference: "travelling wave of p ∂p/∂x",
        quantity: "gas flux, 5 to 8 s",
        points: gauge_points(Gauge::GasFlux, &[5.0, 5.5, 6.0, 6.5, 7.0, 7.5, 8.0], flux),
        tolerance: 5e-5,
        measure: ErrorScale::RelativeTo(flux(duration_s).abs()),
        source_of_tolerance: "cells and steps refined to 5e-5 of the flux",
    };
    let setting = setting(Arc::new(isothermal_material(&seeping)), 400);
    darcy_problem("gas driven in", setting, schedule(0.0), Some(schedule(THICKNESS_M)), vec![check])
        // One step between corners of the schedules; the margin prevents a second step by rounding.
        .with_equal_steps(1.001 * step_s)
}

/// A gas front that travels at constant speed into a nearly empty slab: p = (U μ ε/K)(U t − x). It passes less than
/// half a cell per step; at several cells per step the march does not follow it.
fn front_into_vacuum() -> Problem {
    let (speed_m_s, empty_pa) = (0.05, 1.0);
    let slope_pa_m = speed_m_s * DARCY_SLAB.viscosity_pa_s * DARCY_SLAB.porosity / DARCY_SLAB.permeability_m2;
    let times_s: Vec<f64> = (1..=9).map(|i| 0.1 * f64::from(i)).collect();
    let flux = |time_s: f64| -DARCY_SLAB.travelling_wave_flux_kg_m2_s(speed_m_s, 0.0, slope_pa_m * speed_m_s * time_s);
    let check = |quantity, points, tolerance, measure, source_of_tolerance| Check {
        reference: "travelling front of p ∂p/∂x",
        quantity,
        points,
        tolerance,
        measure,
        source_of_tolerance,
    };
    let face_pa = Schedule { times_s: vec![0.0, 1.0], values: vec![empty_pa, slope_pa_m * speed_m_s] };
    darcy_problem(
        "gas driven into near vacuum",
        setting(Arc::new(isothermal_material(&DARCY_SLAB)), 400),
        face_pa,
        None,
        vec![
            check(
                "gas flux, 0.1 to 0.9 s",
                gauge_points(Gauge::GasFlux, &times_s, flux),
                0.002,
                ErrorScale::RelativeTo(flux(0.9).abs()),
                "the gas ahead of the front has 1e-3 of the pressure and moves too",
            ),
            check(
                "pressure at the back, 0.1 to 0.9 s",
                gauge_points(Gauge::BackPressure, &times_s, |_| empty_pa),
                1e-3,
                ErrorScale::Absolute,
                "1e-3 of the pressure there; wide: a premature front is off by pascals",
            ),
        ],
    )
    .with_equal_steps(1e-3)
}

/// A slab under an impermeable cover: the enclosed gas is heated at constant `p/T`.
fn enclosed_gas() -> Problem {
    let (start_k, rise_k_s) = (300.0, 30.0);
    let porous_ply = Arc::new(isothermal_material(&DARCY_SLAB));
    let cover = Arc::new(with_pores(&porous_ply, Pores { permeability_m2: 0.0, ..pores(&DARCY_SLAB) }));
    let face_k = Schedule { times_s: vec![0.0, 20.0], values: vec![start_k, start_k + 20.0 * rise_k_s] };
    let times_s: Vec<f64> = (1..=10).map(|i| 2.0 * f64::from(i)).collect();
    let check = Check {
        reference: "constant p/T of enclosed gas",
        quantity: "pressure at the back, 2 to 20 s",
        points: gauge_points(Gauge::BackPressure, &times_s, |time_s| FACE_PA * (start_k + rise_k_s * time_s) / start_k),
        tolerance: 1e-6,
        measure: ErrorScale::Relative,
        source_of_tolerance: REFINED,
    };
    // So high a conductivity that the inside has the temperature of the faces to 1e-6.
    let conductive = |material: &Material| {
        Arc::new(Material { conductivity: constant_properties(1e9, 1.0).conductivity.clone(), ..material.clone() })
    };
    let setting = ProblemSetup {
        plies: vec![(conductive(&cover), 0.01), (conductive(&porous_ply), 0.01)],
        start_k,
        hot_face: Face::Held(face_k.clone()),
        back_face: Face::Held(face_k),
        cells: 20,
        first_step_s: 1e-2,
        step_growth: 1.0,
    };
    darcy_problem("enclosed gas, heated", setting, Schedule::constant(FACE_PA), None, vec![check])
        .with_equal_steps(0.01)
}

/// Steady gas flow from the back to the hot face.
fn steady_flow(slip_pa_k: f64, forchheimer_1_m: f64) -> Problem {
    let seeping = DarcySlab { slip_pa: slip_pa_k * TEMPERATURE_K, forchheimer_1_m, ..DARCY_SLAB };
    let (low_pa, high_pa, duration_s) = (1e4, 3e4, 5.0);
    let check = Check {
        reference: "flux of p² (Muskat 1937), Klinkenberg, Forchheimer",
        quantity: "steady gas flux",
        points: gauge_points(Gauge::GasFlux, &[duration_s], |_| {
            seeping.steady_flux_kg_m2_s(high_pa, low_pa, THICKNESS_M)
        }),
        tolerance: 1e-6,
        measure: ErrorScale::Relative,
        source_of_tolerance: STEADY_STATE,
    };
    darcy_problem(
        &format!("steady gas flow, slip {slip_pa_k} Pa/K, inertia {forchheimer_1_m:e} 1/m"),
        setting(Arc::new(isothermal_material(&seeping)), 100),
        Schedule::constant(low_pa),
        Some(Schedule { times_s: vec![0.0, 0.1], values: vec![low_pa, high_pa] }),
        vec![check],
    )
}

/// Conduction through 10 mm against gas from a source at the back. Steady state:
/// `T = T_h − (T_h − T_b) (1 − e^(−Pe x/L))/(1 − e^(−Pe))`, Pe = ṁ c L/k.
fn conduction_against_gas(path: GasFlowModel) -> Problem {
    let (length_m, conductivity_w_m_k, peclet, capacity_j_kg_k) = (0.01, 0.5, 2.0, 1000.0);
    let (hot_k, back_k, duration_s) = (1300.0, 500.0, 400.0);
    let flux_kg_m2_s = peclet * conductivity_w_m_k / (capacity_j_kg_k * length_m);
    let source_m = 1e-3;
    let passed = with_pores(&constant_properties(conductivity_w_m_k, 1e5), pores(&DARCY_SLAB));
    let maker = with_pores(&material(1.0, Table::constant(1.0), Table::constant(1e6)), pores(&DARCY_SLAB));
    let maker = with_gas_source(&maker, flux_kg_m2_s / source_m, duration_s);
    let temperature_k = |depth_m: f64, _| {
        let share = (-peclet * depth_m / length_m).exp_m1() / (-peclet).exp_m1();
        hot_k - (hot_k - back_k) * share
    };
    let depths_m: Vec<f64> = (1..10).map(|i| 0.1 * length_m * f64::from(i)).collect();
    let check = Check {
        reference: "conduction against gas flow, steady",
        quantity: "9 depths",
        points: points(&depths_m, &[duration_s], temperature_k),
        tolerance: 3e-6,
        measure: ErrorScale::RelativeTo(hot_k - back_k),
        source_of_tolerance: "second order on 100 or more cells between two depths; upwind differences miss it by 1e-3",
    };
    let setting = ProblemSetup {
        plies: vec![(Arc::new(passed), length_m), (maker, source_m)],
        start_k: back_k,
        hot_face: Face::Held(Schedule { times_s: vec![0.0, 10.0], values: vec![back_k, hot_k] }),
        back_face: held_face(back_k),
        cells: 1000,
        first_step_s: 1e-3,
        step_growth: 0.02,
    };
    let name = match path {
        GasFlowModel::Instantaneous | GasFlowModel::QuasiSteady => "conduction against quasi-steady gas",
        GasFlowModel::Darcy => "conduction against Darcy flow",
    };
    Problem::new(Exact, name, setting, vec![check]).with_gas_flow(path, constant_gas(capacity_j_kg_k))
}
