//! One layer of constant properties.

use super::{CARSLAW_3_3, CARSLAW_3_8, CARSLAW_3_10, CELSIUS_K, CODES_WITHIN_1_K, REFINED};
use crate::case::{Face, OpenFace, Schedule};
use crate::verify::Group::{Codes, Exact};
use crate::verify::problem::{
    Check, ErrorScale, Problem, ProblemSetup, constant_properties, convective_face, heated_face, held_face,
    insulated_face, points, with_temperatures,
};
use crate::verify::{exact, reference};

const DIFFUSIVITY_M2_S: f64 = 1e-6;
const CONDUCTIVITY_W_M_K: f64 = 0.5;
const THICKNESS_M: f64 = 0.02;
const START_K: f64 = 300.0;
const STEP_K: f64 = 1200.0;
const TIMES_S: [f64; 8] = [1.0, 5.0, 20.0, 60.0, 120.0, 300.0, 600.0, 1200.0];

pub(super) fn problems() -> Vec<Problem> {
    let mut problems = slabs();
    problems.extend(half_spaces());
    problems.push(triangular_flux());
    problems.extend(exactpack());
    problems.extend(fds_convection());
    problems.push(fds_cooling());
    problems.extend(tmap8());
    problems
}

/// The slab of this module, resolved to 1e-6 from the first second on.
fn setting(hot_face: Face, back_face: Face) -> ProblemSetup {
    ProblemSetup {
        plies: vec![(constant_properties(CONDUCTIVITY_W_M_K, CONDUCTIVITY_W_M_K / DIFFUSIVITY_M2_S), THICKNESS_M)],
        start_k: START_K,
        hot_face,
        back_face,
        cells: 4000,
        first_step_s: 1e-4,
        step_growth: 0.004,
    }
}

/// A closed form of Fourier number and relative depth, at 11 depths and [`TIMES_S`].
fn closed_form(reference: &'static str, driving_k: f64, rise: impl Fn(f64, f64) -> f64) -> Check {
    let depths_m: Vec<f64> = (0..=10).map(|i| THICKNESS_M * f64::from(i) / 10.0).collect();
    let temperature_k = |depth_m: f64, time_s: f64| {
        START_K + driving_k * rise(DIFFUSIVITY_M2_S * time_s / (THICKNESS_M * THICKNESS_M), depth_m / THICKNESS_M)
    };
    Check {
        reference,
        quantity: "11 depths, 1 to 1200 s",
        points: points(&depths_m, &TIMES_S, temperature_k),
        tolerance: 1e-6,
        measure: ErrorScale::RelativeTo(driving_k),
        source_of_tolerance: REFINED,
    }
}

fn slabs() -> Vec<Problem> {
    // Half of the flux of the tables: with all of it the slab would exceed the 4000 K of the march.
    let flux_w_m2 = 25e3;
    let film_w_m2_k = 100.0;
    let biot = film_w_m2_k * THICKNESS_M / CONDUCTIVITY_W_M_K;
    let flux_k = flux_w_m2 * THICKNESS_M / CONDUCTIVITY_W_M_K;
    let gas_k = START_K + STEP_K;
    vec![
        Problem::new(
            Exact,
            "slab, step of temperature",
            setting(held_face(gas_k), insulated_face()),
            vec![closed_form(CARSLAW_3_3, STEP_K, exact::face_temperature_step)],
        ),
        Problem::new(
            Exact,
            "slab, constant flux",
            setting(heated_face(flux_w_m2), insulated_face()),
            vec![closed_form(CARSLAW_3_8, flux_k, exact::constant_flux)],
        ),
        Problem::new(
            Exact,
            "slab, convection",
            setting(convective_face(film_w_m2_k, gas_k), insulated_face()),
            vec![closed_form(CARSLAW_3_10, STEP_K, |fourier, depth| exact::convection(biot, fourier, depth))],
        ),
    ]
}

/// A slab so thick that it acts as a half space: erfc at its back stays below 1e-8.
fn half_spaces() -> Vec<Problem> {
    let flux_w_m2 = 50e3;
    let film_w_m2_k = 100.0;
    let form = |reference, driving_k: f64, rise_k: &dyn Fn(f64, f64) -> f64| Check {
        reference,
        quantity: "6 depths, 5 to 120 s",
        points: points(&[0.0, 0.001, 0.002, 0.005, 0.01, 0.02], &[5.0, 20.0, 60.0, 120.0], |depth_m, time_s| {
            START_K + rise_k(depth_m, (DIFFUSIVITY_M2_S * time_s).sqrt())
        }),
        tolerance: 1e-6,
        measure: ErrorScale::RelativeTo(driving_k),
        source_of_tolerance: REFINED,
    };
    let thick = |hot_face| ProblemSetup {
        plies: vec![(constant_properties(CONDUCTIVITY_W_M_K, CONDUCTIVITY_W_M_K / DIFFUSIVITY_M2_S), 0.09)],
        cells: 9000,
        first_step_s: 1e-3,
        ..setting(hot_face, insulated_face())
    };
    let gradient_k_m = flux_w_m2 / CONDUCTIVITY_W_M_K;
    let step = |depth_m: f64, reach_m: f64| STEP_K * exact::erfc(depth_m / (2.0 * reach_m));
    let flux = |depth_m: f64, reach_m: f64| exact::half_space_flux(gradient_k_m, depth_m, reach_m);
    let film = |depth_m: f64, reach_m: f64| {
        STEP_K * exact::half_space_convection(film_w_m2_k / CONDUCTIVITY_W_M_K, depth_m, reach_m)
    };
    vec![
        Problem::new(
            Exact,
            "half space, step of temperature",
            thick(held_face(START_K + STEP_K)),
            vec![form("Carslaw and Jaeger 1959, §2.5", STEP_K, &step)],
        ),
        Problem::new(
            Exact,
            "half space, constant flux",
            thick(heated_face(flux_w_m2)),
            vec![form("Carslaw and Jaeger 1959, §2.9", 1000.0, &flux)],
        ),
        Problem::new(
            Exact,
            "half space, convection",
            thick(convective_face(film_w_m2_k, START_K + STEP_K)),
            vec![form("Carslaw and Jaeger 1959, §2.7", STEP_K, &film)],
        ),
    ]
}

/// The benchmark of inverse conduction: unit thickness and properties, and a flux that rises for 0.6 and falls for 0.6,
/// scaled by 1000 against rounding at 300 K.
fn triangular_flux() -> Problem {
    let unit_k = 1000.0;
    let triangle = |t: f64, depth: f64| {
        exact::ramped_flux(t, depth) - 2.0 * exact::ramped_flux(t - 0.6, depth) + exact::ramped_flux(t - 1.2, depth)
    };
    let flux_w_m2 = Schedule { times_s: vec![0.0, 0.6, 1.2], values: vec![0.0, 0.6 * unit_k, 0.0] };
    Problem::new(
        Exact,
        "slab, triangular flux",
        ProblemSetup {
            plies: vec![(constant_properties(1.0, 1.0), 1.0)],
            start_k: START_K,
            hot_face: Face::Open(OpenFace { flux_w_m2, ..OpenFace::insulated() }),
            back_face: insulated_face(),
            cells: 1000,
            first_step_s: 1e-5,
            step_growth: 0.01,
        },
        vec![Check {
            reference: "Beck, Blackwell and St. Clair 1985",
            quantity: "faces and middle, 0.06 to 1.8",
            points: points(&[0.0, 0.5, 1.0], &[0.06, 0.3, 0.6, 0.66, 0.9, 1.2, 1.26, 1.8], |depth, time| {
                START_K + unit_k * triangle(time, depth)
            }),
            tolerance: 1e-6,
            measure: ErrorScale::RelativeTo(unit_k),
            source_of_tolerance: REFINED,
        }],
    )
}

fn exactpack() -> Vec<Problem> {
    const FILE: &str = include_str!("../../../data/verification/exactpack_planar.csv");
    let check = |series, shift_k, driving_k| Check {
        reference: "ExactPack 9bacc477 (LANL)",
        quantity: "11 depths, 1 to 300 s",
        points: reference::points(FILE, series, shift_k),
        tolerance: 1e-6,
        measure: ErrorScale::RelativeTo(driving_k),
        source_of_tolerance: REFINED,
    };
    let flux_w_m2 = 1e5 * CONDUCTIVITY_W_M_K;
    // The back face falls to 700 K below zero; the equation is linear, so all temperatures are raised.
    let shift_k = 1000.0;
    vec![
        Problem::new(
            Codes,
            "slab, both faces held",
            setting(held_face(1500.0), held_face(START_K)),
            vec![check("both faces held", 0.0, STEP_K)],
        ),
        Problem::new(
            Codes,
            "slab, held and insulated",
            setting(held_face(1500.0), insulated_face()),
            vec![check("held and insulated", 0.0, STEP_K)],
        ),
        Problem::new(
            Codes,
            "slab, flux through",
            ProblemSetup { start_k: START_K + shift_k, ..setting(heated_face(flux_w_m2), heated_face(-flux_w_m2)) },
            vec![check("flux through", shift_k, flux_w_m2 * THICKNESS_M / CONDUCTIVITY_W_M_K)],
        ),
    ]
}

/// FDS heat_conduction_a to d: Biot numbers 100, 10, 1 and 0.1.
fn fds_convection() -> Vec<Problem> {
    const FILE: &str = include_str!("../../../data/verification/fds_slab_convection.csv");
    let cases = [("A", 0.1, 1e5, 100.0), ("B", 0.1, 1e5, 10.0), ("C", 1.0, 1e6, 10.0), ("D", 10.0, 1e7, 10.0)];
    let problem = |(series, conductivity_w_m_k, capacity_j_m3_k, film_w_m2_k)| {
        let thickness_m = 0.1;
        let biot = film_w_m2_k * thickness_m / conductivity_w_m_k;
        let printed = reference::points(FILE, series, CELSIUS_K);
        let formula = with_temperatures(&printed, |depth_m, time_s| {
            let fourier = DIFFUSIVITY_M2_S * time_s / (thickness_m * thickness_m);
            CELSIUS_K + 20.0 + 100.0 * exact::convection(biot, fourier, depth_m / thickness_m)
        });
        Problem::new(
            Codes,
            &format!("slab, convection, Bi {biot}"),
            ProblemSetup {
                plies: vec![(constant_properties(conductivity_w_m_k, capacity_j_m3_k), thickness_m)],
                start_k: CELSIUS_K + 20.0,
                hot_face: convective_face(film_w_m2_k, CELSIUS_K + 120.0),
                back_face: insulated_face(),
                cells: 3000,
                first_step_s: 1e-2,
                step_growth: 0.004,
            },
            vec![
                Check {
                    reference: "FDS heat_conduction_a to d (NIST)",
                    quantity: "6 depths",
                    points: printed,
                    tolerance: 0.005,
                    measure: ErrorScale::Absolute,
                    source_of_tolerance: "the table is printed to 0.01 °C",
                },
                Check {
                    reference: CARSLAW_3_10,
                    quantity: "6 depths",
                    points: formula,
                    tolerance: 1e-6,
                    measure: ErrorScale::RelativeTo(100.0),
                    source_of_tolerance: REFINED,
                },
            ],
        )
    };
    cases.into_iter().map(problem).collect()
}

fn fds_cooling() -> Problem {
    const FILE: &str = include_str!("../../../data/verification/fds_convective_cooling.csv");
    let printed = reference::points(FILE, "FDS", CELSIUS_K);
    let formula = with_temperatures(&printed, |depth_m, time_s| {
        CELSIUS_K + 1000.0 * (1.0 - exact::convection(1.0, 1e-3 * time_s, depth_m))
    });
    Problem::new(
        Codes,
        "slab, cooled by convection",
        ProblemSetup {
            plies: vec![(constant_properties(1.0, 1000.0), 1.0)],
            start_k: CELSIUS_K + 1000.0,
            hot_face: convective_face(1.0, CELSIUS_K),
            back_face: insulated_face(),
            cells: 2000,
            first_step_s: 1e-2,
            step_growth: 0.004,
        },
        vec![
            Check {
                reference: "FDS convective_cooling (NIST)",
                quantity: "back face",
                points: printed,
                tolerance: 0.05,
                measure: ErrorScale::Absolute,
                source_of_tolerance: "the table is printed to 0.1 °C",
            },
            Check {
                reference: CARSLAW_3_10,
                quantity: "back face",
                points: formula,
                tolerance: 1e-6,
                measure: ErrorScale::RelativeTo(1000.0),
                source_of_tolerance: REFINED,
            },
        ],
    )
}

fn tmap8() -> Vec<Problem> {
    const SLAB: &str = include_str!("../../../data/verification/tmap8_slab.csv");
    const CONVECTION: &str = include_str!("../../../data/verification/tmap8_convection.csv");
    let check = |reference, quantity, file| Check {
        reference,
        quantity,
        points: reference::points(file, "TMAP8", 0.0),
        tolerance: 1.0,
        measure: ErrorScale::Absolute,
        source_of_tolerance: CODES_WITHIN_1_K,
    };
    vec![
        Problem::new(
            Codes,
            "slab of 4 m, faces held",
            ProblemSetup {
                plies: vec![(constant_properties(10.0, 10.0), 4.0)],
                start_k: 300.0,
                hot_face: held_face(400.0),
                back_face: held_face(300.0),
                cells: 400,
                first_step_s: 1e-4,
                step_growth: 0.02,
            },
            vec![check("TMAP8 ver-1fb", "10 depths, 1 and 5 s", SLAB)],
        ),
        Problem::new(
            Codes,
            "copper under a gas",
            ProblemSetup {
                plies: vec![(constant_properties(401.0, 3.439e6), 3.2)],
                start_k: 100.0,
                hot_face: convective_face(200.0, 500.0),
                back_face: insulated_face(),
                cells: 1000,
                first_step_s: 1e-2,
                step_growth: 0.02,
            },
            vec![check("TMAP8 ver-1fd", "5 cm, 12 to 1332 s", CONVECTION)],
        ),
    ]
}
