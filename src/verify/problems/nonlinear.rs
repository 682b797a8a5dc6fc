//! Temperature-dependent properties.

use super::{CARSLAW_3_3, CARSLAW_3_8, CELSIUS_K, MOL, REFINED};
use crate::case::{Emissivity, Face, Material, OpenFace, Schedule};
use crate::verify::Group::{Codes, Exact};
use crate::verify::problem::{
    Check, ErrorScale, Problem, ProblemSetup, clamped_table, convective_face, heated_face, held_face, insulated_face,
    material, points,
};
use crate::verify::{exact, reference};
use std::sync::Arc;

/// The problems of this module.
pub fn problems() -> Vec<Problem> {
    let mut problems = kirchhoff();
    problems.extend([thermal_wave(), heating_code(), power_law(), tacot()]);
    problems
}

/// Relative slope of k and of ρc, 1/K.
pub const KIRCHHOFF_SLOPE_1_K: f64 = 0.002;
/// Diffusivity of the Kirchhoff problems.
pub const KIRCHHOFF_DIFFUSIVITY_M2_S: f64 = 1e-6;
/// Initial temperature of the Kirchhoff problems.
pub const KIRCHHOFF_START_K: f64 = 300.0;
const KIRCHHOFF_CONDUCTIVITY_W_M_K: f64 = 0.05;

/// k = k₀ (1 + b (T − 300 K)) and ρc in proportion: three times as large at 1300 K, at constant diffusivity.
pub fn kirchhoff_material() -> Arc<Material> {
    let rising = |at_start: f64| {
        clamped_table(vec![300.0, 2000.0], vec![at_start, at_start * (1.0 + KIRCHHOFF_SLOPE_1_K * 1700.0)])
    };
    let capacity_j_m3_k = KIRCHHOFF_CONDUCTIVITY_W_M_K / KIRCHHOFF_DIFFUSIVITY_M2_S;
    material(50.0, rising(capacity_j_m3_k / 50.0), rising(KIRCHHOFF_CONDUCTIVITY_W_M_K))
}

fn kirchhoff() -> Vec<Problem> {
    let thickness_m = 0.02;
    let flux_w_m2 = 3e3;
    let check = |reference, driving_k: f64, theta_k: f64, rise: fn(f64, f64) -> f64| {
        let depths_m: Vec<f64> = (0..=10).map(|i| thickness_m * f64::from(i) / 10.0).collect();
        let times_s = [5.0, 20.0, 60.0, 120.0, 300.0, 600.0, 1200.0];
        let temperature_k = |depth_m: f64, time_s: f64| {
            let fourier = KIRCHHOFF_DIFFUSIVITY_M2_S * time_s / (thickness_m * thickness_m);
            let theta_k = theta_k * rise(fourier, depth_m / thickness_m);
            KIRCHHOFF_START_K + exact::inverse_kirchhoff_k(theta_k, KIRCHHOFF_SLOPE_1_K)
        };
        Check {
            reference,
            quantity: "11 depths, 5 to 1200 s",
            points: points(&depths_m, &times_s, temperature_k),
            tolerance: 1e-6,
            measure: ErrorScale::RelativeTo(driving_k),
            source_of_tolerance: REFINED,
        }
    };
    let setting = |hot_face| ProblemSetup {
        plies: vec![(kirchhoff_material(), thickness_m)],
        start_k: KIRCHHOFF_START_K,
        hot_face,
        back_face: insulated_face(),
        cells: 4000,
        // The jump of 1000 K needs first steps that are shorter than the diffusion time of a cell.
        first_step_s: 3e-6,
        step_growth: 0.003,
    };
    let step_k = 1000.0;
    let step_theta_k = step_k + 0.5 * KIRCHHOFF_SLOPE_1_K * step_k * step_k;
    let flux_theta_k = flux_w_m2 * thickness_m / KIRCHHOFF_CONDUCTIVITY_W_M_K;
    vec![
        Problem::new(
            Exact,
            "k(T), c(T), step of temperature",
            setting(held_face(KIRCHHOFF_START_K + step_k)),
            vec![check(CARSLAW_3_3, step_k, step_theta_k, exact::face_temperature_step)],
        ),
        Problem::new(
            Exact,
            "k(T), c(T), constant flux",
            setting(heated_face(flux_w_m2)),
            vec![check(CARSLAW_3_8, flux_theta_k, flux_theta_k, exact::constant_flux)],
        ),
    ]
}

/// A thermal wave for k ∝ (T − 300 K)³ that travels at constant speed U into a material of zero conductivity:
/// `T − 300 K = (3 U ρc (U t − x)/K)^(1/3)` (Zel'dovich and Barenblatt). Harmonic means of k would stall the front.
fn thermal_wave() -> Problem {
    let (capacity_j_m3_k, coefficient, speed_m_s, base_k) = (2e5, 1e-7, 2e-4, 300.0);
    let rise_k = |ahead_m: f64| (3.0 * speed_m_s * capacity_j_m3_k / coefficient * ahead_m.max(0.0)).cbrt();
    let temperatures_k: Vec<f64> = (0..=60).map(|i| base_k + 5.0 * f64::from(i)).collect();
    // A floor of 1e-7 of the peak conductivity avoids a division by zero at the foot of the front.
    let conductivities = temperatures_k.iter().map(|t| coefficient * (t - base_k).powi(3).max(1.0)).collect();
    let times_s: Vec<f64> = (0..=400).map(|i| 0.25 * f64::from(i)).collect();
    let face_k = times_s.iter().map(|t| base_k + rise_k(speed_m_s * t)).collect();
    let ahead = |depth_m: f64, time_s: f64| base_k + rise_k(speed_m_s * time_s - depth_m);
    Problem::new(
        Exact,
        "travelling front, k ~ T³",
        ProblemSetup {
            plies: vec![(
                material(
                    1.0,
                    clamped_table(vec![300.0], vec![capacity_j_m3_k]),
                    clamped_table(temperatures_k, conductivities),
                ),
                0.025,
            )],
            start_k: base_k,
            hot_face: Face::Held(Schedule { times_s, values: face_k }),
            back_face: insulated_face(),
            cells: 500,
            first_step_s: 0.01,
            step_growth: 0.1,
        },
        vec![Check {
            reference: "Zel'dovich and Barenblatt's front",
            quantity: "11 depths, 15 to 95 s",
            points: points(
                &[0.0, 0.002, 0.004, 0.006, 0.008, 0.01, 0.012, 0.014, 0.016, 0.018, 0.02],
                &[15.0, 45.0, 65.0, 85.0, 95.0],
                ahead,
            ),
            tolerance: 0.002,
            measure: ErrorScale::RelativeTo(288.45),
            source_of_tolerance: "the front moves cell by cell; a stalled front is off by more than half of the peak",
        }],
    )
}

/// The slab of HEATING's three bodies; cylinders and spheres are out of scope.
fn heating_code() -> Problem {
    const FILE: &str = include_str!("../../../data/verification/heating_slab.csv");
    let at_k = || vec![CELSIUS_K, CELSIUS_K + 100.0, CELSIUS_K + 200.0];
    Problem::new(
        Codes,
        "k(T), c(T), convection",
        ProblemSetup {
            plies: vec![(
                material(
                    10_000.0,
                    clamped_table(at_k(), vec![1000.0, 1200.0, 1000.0]),
                    clamped_table(at_k(), vec![0.10, 0.15, 0.20]),
                ),
                0.01,
            )],
            start_k: CELSIUS_K,
            hot_face: convective_face(10.0, CELSIUS_K + 700.0),
            back_face: convective_face(10.0, CELSIUS_K),
            cells: 400,
            first_step_s: 1e-2,
            step_growth: 0.01,
        },
        vec![Check {
            reference: "HEATING (ORNL)",
            quantity: "both faces, 50 to 999 s",
            points: reference::points(FILE, "HEATING", CELSIUS_K),
            tolerance: 0.1,
            measure: ErrorScale::Absolute,
            source_of_tolerance: "HEATING is within 0.07 K of a converged solution",
        }],
    )
}

fn power_law() -> Problem {
    const FILE: &str = include_str!("../../../data/verification/power_law_slab.csv");
    let temperatures_k: Vec<f64> = (0..=160).map(|i| 300.0 + 5.0 * f64::from(i)).collect();
    let power = |at_300_k: f64, exponent: f64| {
        clamped_table(
            temperatures_k.clone(),
            temperatures_k.iter().map(|t| at_300_k * (t / 300.0).powf(exponent)).collect(),
        )
    };
    let check = |reference, series, tolerance, source_of_tolerance| Check {
        reference,
        quantity: "6 depths",
        points: reference::points(FILE, series, 0.0),
        tolerance,
        measure: ErrorScale::Absolute,
        source_of_tolerance,
    };
    Problem::new(
        Codes,
        "power laws, radiating",
        ProblemSetup {
            plies: vec![(material(100.0, power(1000.0, 0.3), power(0.05, 1.5)), 0.025)],
            start_k: 300.0,
            hot_face: Face::Open(OpenFace {
                flux_w_m2: Schedule::constant(0.9 * 50e3),
                film_w_m2_k: Schedule::constant(10.0),
                emissivity: Emissivity::Constant(0.9),
                ..OpenFace::insulated()
            }),
            back_face: insulated_face(),
            cells: 1000,
            first_step_s: 1e-3,
            step_growth: 0.01,
        },
        vec![
            check(MOL, "converged", 0.05, "600 graded cells at 1e-9, accepted at 0.05 K"),
            check("gpyro 0.8200", "gpyro", 0.5, "gpyro is within 0.36 K of the converged solution from 5 s on"),
            check("CalculiX", "CalculiX", 0.34, "CalculiX is within 0.24 K of it from 60 s on; 0.1 K is added"),
        ],
    )
}

fn tacot() -> Problem {
    const FILE: &str = include_str!("../../../data/verification/tacot_conduction.csv");
    const VIRGIN: &str = include_str!("../../../data/verification/tacot_virgin.csv");
    let [temperatures_k, heat_capacity, conductivity] =
        <[Vec<f64>; 3]>::try_from(reference::columns(VIRGIN)).expect("the file has a column each");
    let virgin = material(
        280.0,
        clamped_table(temperatures_k.clone(), heat_capacity),
        clamped_table(temperatures_k, conductivity),
    );
    let surface_k =
        Schedule { times_s: vec![0.0, 0.1, 60.0, 60.1, 120.0], values: vec![298.0, 1644.0, 1644.0, 298.0, 298.0] };
    let check = |reference, series, tolerance, source_of_tolerance| Check {
        reference,
        quantity: "9 depths",
        points: reference::points(FILE, series, 0.0),
        tolerance,
        measure: ErrorScale::Absolute,
        source_of_tolerance,
    };
    Problem::new(
        Codes,
        "TACOT, surface held by a schedule",
        ProblemSetup {
            plies: vec![(virgin, 0.05)],
            start_k: 298.0,
            hot_face: Face::Held(surface_k),
            back_face: insulated_face(),
            cells: 1000,
            first_step_s: 1e-3,
            step_growth: 0.01,
        },
        vec![
            check(MOL, "converged", 0.5, "600 cells; doubling from 300 changes it by 0.06 K; accepted at 0.5 K"),
            check("PATO 3.1", "PATO", 3.0, "PATO is first order in time: 2.7 K off at 5 s, 2 K at 70 s"),
        ],
    )
}
