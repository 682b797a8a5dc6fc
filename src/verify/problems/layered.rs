//! Layers of constant properties, in perfect contact and with contact resistances.

use super::{CELSIUS_K, CODES_WITHIN_1_K, REFINED, TALBOT};
use crate::verify::Group::{Codes, Exact};
use crate::verify::problem::{
    Check, ErrorScale, Observable, Problem, ProblemSetup, ReferencePoint, constant_properties, convective_face,
    heated_face, held_face, insulated_face, points,
};
use crate::verify::{exact, reference};

pub(super) fn problems() -> Vec<Problem> {
    vec![
        three_layers(),
        three_layers_in_contact(),
        two_slabs_in_contact(),
        copper_on_iron(),
        insulated_steel(),
        insulated_steel_at_rest(),
    ]
}

/// Source of the tolerance of profiles by numerical Laplace inversion, which are stated to 1e-4 relative.
const RELATIVE: &str = "1e-4 of the driving value, the reference's own acceptance; wide: the profile agrees better";
/// Source of the tolerance where only the discretisation error, relative to the driving value, matters.
const RESOLVED: &str = "the inversion has ten digits; cells and steps refined to this tolerance";

fn three_layers() -> Problem {
    const FILE: &str = include_str!("../../../data/verification/three_layers_flux.csv");
    Problem::new(
        Exact,
        "three layers, constant flux",
        ProblemSetup {
            plies: vec![
                (constant_properties(0.15, 1.36e6), 0.00102),
                (constant_properties(0.035, 1.1e5), 0.0254),
                (constant_properties(0.2, 1.6e6), 0.0005),
            ],
            start_k: 300.0,
            hot_face: heated_face(5e3),
            back_face: insulated_face(),
            cells: 1500,
            first_step_s: 1e-3,
            step_growth: 0.01,
        },
        vec![Check {
            reference: TALBOT,
            quantity: "6 depths, 1 to 1200 s",
            points: reference::points(FILE, "Talbot", 0.0),
            tolerance: 5e-6,
            measure: ErrorScale::RelativeTo(1942.0),
            source_of_tolerance: RESOLVED,
        }],
    )
}

/// The same cloth and gas barrier on a thinner felt, with contact resistances that take a large part of the temperature
/// difference.
fn three_layers_in_contact() -> Problem {
    const FILE: &str = include_str!("../../../data/verification/three_layers_contacts.csv");
    let mut problem = Problem::new(
        Exact,
        "three layers with contacts, constant flux",
        ProblemSetup {
            plies: vec![
                (constant_properties(0.15, 1.36e6), 0.00102),
                (constant_properties(0.035, 1.1e5), 0.01),
                (constant_properties(0.2, 1.6e6), 0.0005),
            ],
            start_k: 300.0,
            hot_face: heated_face(5e3),
            back_face: insulated_face(),
            cells: 1500,
            first_step_s: 1e-3,
            step_growth: 0.01,
        },
        vec![Check {
            reference: TALBOT,
            quantity: "7 depths, 0.5 to 300 s",
            points: reference::points(FILE, "Talbot", 0.0),
            tolerance: 5e-6,
            measure: ErrorScale::RelativeTo(692.0),
            source_of_tolerance: RESOLVED,
        }],
    );
    problem.case.layup.contacts_w_m2_k = vec![Some(200.0), Some(100.0)];
    problem
}

/// Two equal slabs at 300 and 900 K in contact from the start, with contact conductance h. By symmetry each slab sees a
/// convective coefficient of 2h to the mean temperature.
fn two_slabs_in_contact() -> Problem {
    let (conductivity_w_m_k, capacity_j_m3_k, thickness_m, contact_w_m2_k) = (0.5, 5e5, 0.01, 100.0);
    let (cold_k, hot_k) = (300.0, 900.0);
    let biot = 2.0 * contact_w_m2_k * thickness_m / conductivity_w_m_k;
    let temperature_k = |depth_m: f64, time_s: f64| {
        let fourier = conductivity_w_m_k / capacity_j_m3_k * time_s / (thickness_m * thickness_m);
        let gone = |from_contact_m: f64| {
            0.5 * (hot_k - cold_k) * exact::convection(biot, fourier, from_contact_m / thickness_m)
        };
        if depth_m < thickness_m { hot_k - gone(thickness_m - depth_m) } else { cold_k + gone(depth_m - thickness_m) }
    };
    let depths_m = [0.0, 0.005, 0.008, 0.0095, 0.0105, 0.012, 0.015, 0.02];
    let slab = constant_properties(conductivity_w_m_k, capacity_j_m3_k);
    let mut problem = Problem::new(
        Exact,
        "two slabs brought into contact",
        ProblemSetup {
            plies: vec![(slab.clone(), thickness_m), (slab, thickness_m)],
            start_k: hot_k,
            hot_face: insulated_face(),
            back_face: insulated_face(),
            cells: 4000,
            first_step_s: 1e-4,
            step_growth: 0.004,
        },
        vec![Check {
            reference: "Carslaw and Jaeger 1959, §3.10, by symmetry",
            quantity: "8 depths, 1 to 300 s",
            points: points(&depths_m, &[1.0, 5.0, 20.0, 60.0, 120.0, 300.0], temperature_k),
            tolerance: 1e-6,
            measure: ErrorScale::RelativeTo(hot_k - cold_k),
            source_of_tolerance: REFINED,
        }],
    );
    problem.case.layup.contacts_w_m2_k = vec![Some(contact_w_m2_k)];
    let back_m = problem.case.layup.back_m();
    problem.case.exposure.initial_k = vec![(0.0, hot_k), (thickness_m, hot_k), (thickness_m, cold_k), (back_m, cold_k)];
    problem
}

/// TMAP8 ver-1fc. The original starts at 0 K; the equation is linear, so all temperatures are raised by 300 K.
fn copper_on_iron() -> Problem {
    const EXACT_PROFILE: &str = include_str!("../../../data/verification/copper_iron_exact_profile.csv");
    const CODES_PROFILE: &str = include_str!("../../../data/verification/copper_iron_codes_profile.csv");
    const TRACE: &str = include_str!("../../../data/verification/copper_iron_trace.csv");
    let start_k = 300.0;
    let check = |reference, quantity, points| Check {
        reference,
        quantity,
        points,
        tolerance: 1.0,
        measure: ErrorScale::Absolute,
        source_of_tolerance: CODES_WITHIN_1_K,
    };
    let exact = |quantity, points| Check {
        tolerance: 1e-4,
        measure: ErrorScale::RelativeTo(600.0),
        source_of_tolerance: RELATIVE,
        ..check(TALBOT, quantity, points)
    };
    Problem::new(
        Codes,
        "copper on iron, faces held",
        ProblemSetup {
            plies: vec![(constant_properties(401.0, 3.4392e6), 0.4), (constant_properties(80.2, 3.5179e6), 0.4)],
            start_k,
            hot_face: held_face(start_k + 600.0),
            back_face: held_face(start_k),
            cells: 1200,
            first_step_s: 1e-2,
            step_growth: 0.01,
        },
        vec![
            exact("15 depths, 150 s", reference::points(EXACT_PROFILE, "Talbot", start_k)),
            exact("9 cm, 5 to 150 s", reference::points(TRACE, "Talbot", start_k)),
            check("TMAP7 or ABAQUS, first", "19 depths, 150 s", reference::points(CODES_PROFILE, "first", start_k)),
            check("TMAP7 or ABAQUS, second", "19 depths, 150 s", reference::points(CODES_PROFILE, "second", start_k)),
            check("TMAP7", "9 cm, 70 to 150 s", reference::points(TRACE, "TMAP7", start_k)),
            check("ABAQUS", "9 cm, 70 to 150 s", reference::points(TRACE, "ABAQUS", start_k)),
        ],
    )
}

/// 10 mm of steel between two 20 mm layers of insulation; gas at 480 °C in front and 20 °C behind.
fn steel_setting(step_growth: f64) -> ProblemSetup {
    let insulation = constant_properties(0.2, 200.0 * 1000.0);
    ProblemSetup {
        plies: vec![(insulation.clone(), 0.02), (constant_properties(50.0, 7500.0 * 500.0), 0.01), (insulation, 0.02)],
        start_k: CELSIUS_K + 20.0,
        hot_face: convective_face(10.0, CELSIUS_K + 480.0),
        back_face: convective_face(10.0, CELSIUS_K + 20.0),
        cells: 400,
        first_step_s: 1.0,
        step_growth,
    }
}

fn insulated_steel() -> Problem {
    // Without the values on the two interfaces, which FDS prints 1.9 °C off the line through all its other values.
    let is_within_a_layer = |point: &ReferencePoint| ![0.02, 0.03].map(Observable::Depth).contains(&point.observable);
    const FILE: &str = include_str!("../../../data/verification/fds_insulated_steel_plate.csv");
    Problem::new(
        Codes,
        "insulated steel plate, 10 h",
        steel_setting(0.01),
        vec![Check {
            reference: "FDS insulated_steel_plate (NIST)",
            quantity: "16 depths, 36000 s",
            points: reference::points(FILE, "FDS", CELSIUS_K).into_iter().filter(is_within_a_layer).collect(),
            tolerance: 0.02,
            measure: ErrorScale::Absolute,
            source_of_tolerance: "0.02 °C, the error of FDS in the steady state; wide: at 10 h it is smaller",
        }],
    )
}

/// 460 K over two films of 0.1, two layers of insulation of 0.1 and a plate of 0.0002 m²K/W.
fn insulated_steel_at_rest() -> Problem {
    let flux_w_m2 = 460.0 / 0.4002;
    let after = |depth_m: f64, resistance_m2_k_w: f64| {
        ReferencePoint::at(depth_m, 200e3, CELSIUS_K + 480.0 - flux_w_m2 * resistance_m2_k_w)
    };
    Problem::new(
        Exact,
        "insulated steel plate, steady",
        steel_setting(0.05),
        vec![Check {
            reference: "resistances in series",
            quantity: "faces and interfaces",
            points: vec![after(0.0, 0.1), after(0.02, 0.2), after(0.03, 0.2002), after(0.05, 0.3002)],
            tolerance: 1e-6,
            measure: ErrorScale::RelativeTo(460.0),
            source_of_tolerance: "a finite-volume scheme is exact in the steady state; wide: f32 rounds to 1e-7",
        }],
    )
}
