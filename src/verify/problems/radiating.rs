//! Radiating faces, and benchmarks of standards.

use super::{CELSIUS_K, MOL};
use crate::case::air::air_enthalpy_j_kg;
use crate::case::{Emissivity, Face, OpenFace, Schedule};
use crate::verify::Group::{Codes, Exact};
use crate::verify::problem::{
    Check, ErrorScale, Problem, ProblemSetup, ReferencePoint, clamped_table, constant_properties, convective_face,
    held_face, insulated_face, material, points, with_temperatures,
};
use crate::verify::{exact, reference};
use std::f64::consts::PI;

pub(super) fn problems() -> Vec<Problem> {
    vec![
        cooling(),
        heating(),
        varying_films(),
        varying_recovery(),
        nafems_t2(),
        nafems_t3(),
        sfpe_case_1(),
        sfpe_case_2(),
        kaowool(),
    ]
}

/// Conductivity of lumped plates: the Biot number of a few millimetres is below 1e-6.
const LUMPED_W_M_K: f64 = 1e6;

fn plate(thickness_m: f64, capacity_j_m3_k: f64, start_k: f64, hot_face: OpenFace) -> ProblemSetup {
    ProblemSetup {
        plies: vec![(constant_properties(LUMPED_W_M_K, capacity_j_m3_k), thickness_m)],
        start_k,
        hot_face: Face::Open(hot_face),
        back_face: insulated_face(),
        cells: 4,
        first_step_s: 1e-4,
        step_growth: 0.002,
    }
}

const LUMPED_SOURCE: &str = "cells and steps refined to this tolerance; wide: f32 needs most of it";

/// A 2 mm plate at 1200 K between gases at 400 K, whose film coefficients rise and fall linearly: the exponent of the
/// decay is the integral of their sum.
fn varying_films() -> Problem {
    let (capacity_j_m2_k, start_k, gas_k, end_s) = (0.002 * 2700.0 * 900.0, 1200.0, 400.0, 100.0);
    let (hot_w_m2_k, back_w_m2_k) = ([20.0, 220.0], [80.0, 0.0]);
    let film = |values: [f64; 2]| OpenFace {
        film_w_m2_k: Schedule { times_s: vec![0.0, end_s], values: values.to_vec() },
        gas_k: Schedule::constant(gas_k),
        ..OpenFace::insulated()
    };
    let integral = |[start, end]: [f64; 2], time_s: f64| start * time_s + 0.5 * (end - start) / end_s * time_s * time_s;
    let form = |_: f64, time_s: f64| {
        let exponent = (integral(hot_w_m2_k, time_s) + integral(back_w_m2_k, time_s)) / capacity_j_m2_k;
        gas_k + (start_k - gas_k) * (-exponent).exp()
    };
    Problem::new(
        Exact,
        "plate, film coefficients that vary",
        ProblemSetup {
            back_face: Face::Open(film(back_w_m2_k)),
            ..plate(0.002, 2700.0 * 900.0, start_k, film(hot_w_m2_k))
        },
        vec![Check {
            reference: "exponential of the integral of the coefficients",
            quantity: "both faces, 1 to 100 s",
            points: points(&[0.0, 0.002], &[1.0, 10.0, 30.0, 60.0, 100.0], form),
            tolerance: 5e-6,
            measure: ErrorScale::RelativeTo(start_k),
            source_of_tolerance: LUMPED_SOURCE,
        }],
    )
}

/// A 2 mm plate under a film of an enthalpy difference, whose coefficient and recovery enthalpy vary: heated, then
/// cooled by a recovery enthalpy below that of the air at the wall.
fn varying_recovery() -> Problem {
    let (capacity_j_m2_k, start_k) = (0.002 * 2700.0 * 900.0, 300.0);
    let schedule = |values: [f64; 3]| Schedule { times_s: vec![0.0, 40.0, 80.0], values: values.to_vec() };
    let (film_kg_m2_s, recovery_j_kg) = (schedule([0.02, 0.2, 0.1]), schedule([2e6, 1e6, -1e5]));
    let rate_k_s = |time_s: f64, temperature_k: f64| {
        let difference_j_kg = recovery_j_kg.after(time_s) - air_enthalpy_j_kg(temperature_k);
        film_kg_m2_s.after(time_s) * difference_j_kg / capacity_j_m2_k
    };
    let open = OpenFace {
        enthalpy_film_kg_m2_s: Some(film_kg_m2_s.clone()),
        recovery_enthalpy_j_kg: Some(recovery_j_kg.clone()),
        ..OpenFace::insulated()
    };
    Problem::new(
        Exact,
        "plate, recovery enthalpy that varies",
        plate(0.002, 2700.0 * 900.0, start_k, open),
        vec![Check {
            reference: "lumped equation, Runge–Kutta",
            quantity: "1 to 80 s",
            points: points(&[0.0], &[1.0, 10.0, 25.0, 40.0, 60.0, 80.0], |_, time_s| {
                // Short steps: the heat capacity of air jumps at the nodes of its table.
                exact::runge_kutta([start_k], 0.0..time_s, 1e-3, |t, [temperature_k]| [rate_k_s(t, temperature_k)])[0]
            }),
            tolerance: 5e-6,
            measure: ErrorScale::RelativeTo(start_k),
            source_of_tolerance: LUMPED_SOURCE,
        }],
    )
}

/// A 2 mm plate of 2700 kg/m³ and 900 J/kg/K at 1200 K in surroundings at 300 K.
fn cooling() -> Problem {
    let (emissivity, surroundings_k, start_k) = (0.9, 300.0, 1200.0);
    let radiating = OpenFace {
        emissivity: Emissivity::Constant(emissivity),
        surroundings_k: Schedule::constant(surroundings_k),
        ..OpenFace::insulated()
    };
    let reached = |temperature_k: f64| {
        let time_s = exact::cooling_time_s(4860.0, emissivity, surroundings_k, start_k, temperature_k);
        ReferencePoint::at(0.0, time_s, temperature_k)
    };
    Problem::new(
        Exact,
        "plate, cooling by radiation",
        plate(0.002, 2700.0 * 900.0, start_k, radiating),
        vec![Check {
            reference: "integral of dT/(T⁴ − T_s⁴)",
            quantity: "1199 to 301 K",
            points: [1199.0, 1100.0, 1000.0, 800.0, 600.0, 500.0, 400.0, 350.0, 310.0, 301.0].map(reached).to_vec(),
            tolerance: 5e-6,
            measure: ErrorScale::RelativeTo(start_k),
            source_of_tolerance: LUMPED_SOURCE,
        }],
    )
}

/// The same plate at 300 K under 50 kW/m² absorbed, with surroundings at 0 K.
fn heating() -> Problem {
    let (emissivity, flux_w_m2, start_k) = (0.9, 50e3, 300.0);
    let radiating = OpenFace {
        flux_w_m2: Schedule::constant(flux_w_m2),
        emissivity: Emissivity::Constant(emissivity),
        surroundings_k: Schedule::constant(0.0),
        ..OpenFace::insulated()
    };
    let reached = |temperature_k: f64| {
        let time_s = exact::heating_time_s(4860.0, emissivity, flux_w_m2, start_k, temperature_k);
        ReferencePoint::at(0.0, time_s, temperature_k)
    };
    Problem::new(
        Exact,
        "plate, heating against radiation",
        plate(0.002, 2700.0 * 900.0, start_k, radiating),
        vec![Check {
            reference: "integral of dT/(T_e⁴ − T⁴)",
            quantity: "310 to 990 K",
            points: [310.0, 400.0, 500.0, 600.0, 700.0, 800.0, 900.0, 950.0, 980.0, 990.0].map(reached).to_vec(),
            tolerance: 5e-6,
            measure: ErrorScale::RelativeTo(start_k),
            source_of_tolerance: LUMPED_SOURCE,
        }],
    )
}

/// Steady bar of 0.1 m between a face held at 1000 K and one that radiates to 300 K; the heat capacity is free.
fn nafems_t2() -> Problem {
    let (conductivity_w_m_k, thickness_m, held_k, emissivity, surroundings_k) = (55.6, 0.1, 1000.0, 0.98, 300.0);
    let end = |temperature_k| vec![ReferencePoint::at(thickness_m, 30e3, temperature_k)];
    let end_k = exact::steady_radiating_face_k(conductivity_w_m_k / thickness_m, held_k, emissivity, surroundings_k);
    let check = |reference, temperature_k, tolerance, source_of_tolerance| Check {
        reference,
        quantity: "radiating end, steady",
        points: end(temperature_k),
        tolerance,
        measure: ErrorScale::Absolute,
        source_of_tolerance,
    };
    Problem::new(
        Codes,
        "NAFEMS T2, radiating bar",
        ProblemSetup {
            plies: vec![(constant_properties(conductivity_w_m_k, 3.6e6), thickness_m)],
            start_k: held_k,
            hot_face: held_face(held_k),
            back_face: Face::Open(OpenFace {
                emissivity: Emissivity::Constant(emissivity),
                surroundings_k: Schedule::constant(surroundings_k),
                ..OpenFace::insulated()
            }),
            cells: 50,
            first_step_s: 1.0,
            step_growth: 0.02,
        },
        vec![
            check(
                "NAFEMS benchmarks, Rev. 3, 1990",
                927.0,
                0.05,
                "the target is printed to 0.1 K; wide: half of the last digit",
            ),
            check(
                "root of the heat balance of the end",
                end_k,
                1e-5,
                "a finite-volume scheme is exact in the steady state; wide: two f32 words resolve 1e-6 K",
            ),
        ],
    )
}

/// Bar of 0.1 m from 0 °C, one end at 100 sin(πt/40 s) °C and the other at 0 °C.
fn nafems_t3() -> Problem {
    let (thickness_m, amplitude_k, frequency_1_s) = (0.1, 100.0, PI / 40.0);
    let (conductivity_w_m_k, capacity_j_m3_k) = (35.0, 7200.0 * 440.5);
    let per_second = conductivity_w_m_k / capacity_j_m3_k / (thickness_m * thickness_m);
    let times_s: Vec<f64> = (0..=4000).map(|i| 0.02 * f64::from(i)).collect();
    let face_k = times_s.iter().map(|t| CELSIUS_K + amplitude_k * (frequency_1_s * t).sin()).collect();
    let series_k = |depth_m: f64, time_s: f64| {
        let wave =
            exact::sinusoidal_face_temperature(frequency_1_s / per_second, per_second * time_s, depth_m / thickness_m);
        CELSIUS_K + amplitude_k * wave
    };
    Problem::new(
        Codes,
        "NAFEMS T3, sinusoidal face",
        ProblemSetup {
            plies: vec![(constant_properties(conductivity_w_m_k, capacity_j_m3_k), thickness_m)],
            start_k: CELSIUS_K,
            hot_face: Face::Held(Schedule { times_s, values: face_k }),
            back_face: held_face(CELSIUS_K),
            cells: 3000,
            first_step_s: 0.02,
            step_growth: 0.1,
        },
        vec![
            Check {
                reference: "NAFEMS benchmarks, Rev. 3, 1990",
                quantity: "20 mm, 32 s",
                points: vec![ReferencePoint::at(0.02, 32.0, CELSIUS_K + 36.60)],
                tolerance: 0.005,
                measure: ErrorScale::Absolute,
                source_of_tolerance: "the target is printed to 0.01 °C",
            },
            Check {
                reference: "Duhamel's series",
                quantity: "6 depths, 8 to 80 s",
                points: points(&[0.01, 0.02, 0.03, 0.05, 0.07, 0.09], &[8.0, 16.0, 24.0, 32.0, 40.0, 80.0], series_k),
                tolerance: 1e-6,
                measure: ErrorScale::RelativeTo(amplitude_k),
                source_of_tolerance: "0.02 s segments follow the sine to 3e-7; cells and steps refined to 1e-6",
            },
        ],
    )
}

const SFPE_SOURCE: &str = "values printed to 0.1 °C, up to 0.1 °C above the lumped equation";

/// Checks of a lumped steel plate: values of the standard, and the integrated lumped equation.
fn sfpe_checks(series: &str, start_k: f64, rate_k_s: impl Fn(f64, f64) -> f64) -> Vec<Check> {
    const FILE: &str = include_str!("../../../data/verification/sfpe_s02.csv");
    let printed = reference::points(FILE, series, CELSIUS_K);
    let integrated = with_temperatures(&printed, |_, time_s| exact::lumped_k(start_k, time_s, &rate_k_s));
    let check = |reference, points, tolerance, source_of_tolerance| Check {
        reference,
        quantity: "plate",
        points,
        tolerance,
        measure: ErrorScale::Absolute,
        source_of_tolerance,
    };
    vec![
        check("SFPE S.02", printed, 0.15, SFPE_SOURCE),
        check(
            "lumped equation, Runge–Kutta",
            integrated,
            1e-2,
            "the lumped equation to 0.01 °C; wide: it is rounded to that digit",
        ),
    ]
}

/// Half of a 40 mm steel plate in the ISO 834 fire, with convection and radiation from the gas.
fn sfpe_case_1() -> Problem {
    let (thickness_m, capacity_j_m3_k, emissivity, film_w_m2_k) = (0.02, 7850.0 * 520.0, 0.7, 25.0);
    let start_k = CELSIUS_K + 20.0;
    let gas_k = |time_s: f64| start_k + 345.0 * (8.0 * time_s / 60.0 + 1.0).log10();
    let times_s: Vec<f64> = (0..=3600).map(|i| 0.5 * f64::from(i)).collect();
    let schedule = |value: &dyn Fn(f64) -> f64| Schedule {
        times_s: times_s.clone(),
        values: times_s.iter().map(|&t| value(t)).collect(),
    };
    let fire = OpenFace {
        film_w_m2_k: Schedule::constant(film_w_m2_k),
        gas_k: schedule(&gas_k),
        emissivity: Emissivity::Constant(emissivity),
        surroundings_k: schedule(&gas_k),
        ..OpenFace::insulated()
    };
    let rate_k_s = |time_s: f64, temperature_k: f64| {
        let radiated_w_m2 = exact::blackbody_w_m2(gas_k(time_s)) - exact::blackbody_w_m2(temperature_k);
        (film_w_m2_k * (gas_k(time_s) - temperature_k) + emissivity * radiated_w_m2) / (capacity_j_m3_k * thickness_m)
    };
    Problem::new(
        Codes,
        "SFPE S.02 case 1, plate in a fire",
        ProblemSetup { first_step_s: 0.5, ..plate(thickness_m, capacity_j_m3_k, start_k, fire) },
        sfpe_checks("case 1", start_k, rate_k_s),
    )
}

/// A 10 mm steel plate under 50 kW/m², adiabatic on the other side, with surroundings at 0 K.
fn sfpe_case_2() -> Problem {
    let (thickness_m, capacity_j_m3_k, emissivity, film_w_m2_k) = (0.01, 7850.0 * 560.0, 0.9, 12.0);
    let (incident_w_m2, start_k) = (50e3, CELSIUS_K + 20.0);
    let heated = OpenFace {
        radiant_w_m2: Schedule::constant(incident_w_m2),
        film_w_m2_k: Schedule::constant(film_w_m2_k),
        gas_k: Schedule::constant(start_k),
        emissivity: Emissivity::Constant(emissivity),
        surroundings_k: Schedule::constant(0.0),
        ..OpenFace::insulated()
    };
    let rate_k_s = |_, temperature_k: f64| {
        let radiated_w_m2 = incident_w_m2 - exact::blackbody_w_m2(temperature_k);
        (emissivity * radiated_w_m2 + film_w_m2_k * (start_k - temperature_k)) / (capacity_j_m3_k * thickness_m)
    };
    Problem::new(
        Codes,
        "SFPE S.02 case 2, plate under a flux",
        plate(thickness_m, capacity_j_m3_k, start_k, heated),
        sfpe_checks("case 2", start_k, rate_k_s),
    )
}

/// A 28.6 mm ceramic-fibre board under a cone heater, with the manufacturer's properties and the measured flux.
fn kaowool() -> Problem {
    const FILE: &str = include_str!("../../../data/verification/kaowool_nominal.csv");
    let celsius = |degrees: &[f64]| degrees.iter().map(|t| CELSIUS_K + t).collect::<Vec<_>>();
    let board = material(
        256.0,
        clamped_table(celsius(&[26.85, 226.85, 526.85, 626.85, 1326.85]), vec![765.3, 1021.1, 1212.8, 1171.1, 1283.4]),
        clamped_table(celsius(&[260.0, 538.0, 816.0, 1093.0]), vec![0.0576, 0.085, 0.125, 0.183]),
    );
    let shares = [0.940, 0.960, 0.983, 0.995, 0.999, 1.0];
    let starts_s = [0.0, 10.0, 60.0, 120.0, 180.0, 240.0];
    let ends_s = [10.0, 60.0, 120.0, 180.0, 240.0, 1200.0];
    let radiant_w_m2 = Schedule {
        times_s: starts_s.iter().zip(&ends_s).flat_map(|(&start_s, &end_s)| [start_s, end_s]).collect(),
        values: shares.iter().flat_map(|share| [50e3 * share; 2]).collect(),
    };
    let room_k = 293.0;
    Problem::new(
        Codes,
        "Kaowool PM, 50 kW/m²",
        ProblemSetup {
            plies: vec![(board, 0.0286)],
            start_k: room_k,
            hot_face: Face::Open(OpenFace {
                radiant_w_m2,
                film_w_m2_k: Schedule::constant(8.0),
                gas_k: Schedule::constant(room_k),
                emissivity: Emissivity::Constant(0.95),
                surroundings_k: Schedule::constant(room_k),
                ..OpenFace::insulated()
            }),
            back_face: convective_face(10.0, room_k),
            cells: 300,
            first_step_s: 1e-2,
            step_growth: 0.02,
        },
        vec![Check {
            reference: MOL,
            quantity: "5.72 and 11.44 mm, 1200 s",
            points: reference::points(FILE, "converged", 0.0),
            tolerance: 0.5,
            measure: ErrorScale::Absolute,
            source_of_tolerance: "0.3 K between ambient temperatures of 290 and 293 K; printed to 0.1 K",
        }],
    )
}
