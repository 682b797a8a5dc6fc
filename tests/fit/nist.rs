//! Certified answers of the Statistical Reference Datasets of the National Institute of Standards and Technology,
//! nonlinear regression (<https://www.itl.nist.gov/div898/strd/nls/nls_main.shtml>, public domain): eight of the sets,
//! of lower and average difficulty, from both of their starts but for one.

use super::{exact, free, minimum};
use bondline::fit::certainty;
use bondline::fit::interval::residual_variance;

/// Predictor and response, the law, and what is certified of it.
struct Set {
    name: &'static str,
    x: &'static [f64],
    y: &'static [f64],
    law: fn(&[f64], f64) -> f64,
    starts: &'static [&'static [f64]],
    estimates: &'static [f64],
    deviations: &'static [f64],
    residual_squares: f64,
}

const SETS: [Set; 8] = [
    Set {
        name: "Misra1a",
        x: &MISRA1_X,
        y: &MISRA1_Y,
        law: |b, x| b[0] * (1.0 - (-b[1] * x).exp()),
        starts: &[&[500.0, 0.0001], &[250.0, 0.0005]],
        estimates: &[238.94212918, 0.00055015643181],
        deviations: &[2.7070075241, 7.2668688436e-06],
        residual_squares: 0.12455138894,
    },
    Set {
        name: "Misra1b",
        x: &MISRA1_X,
        y: &MISRA1_Y,
        law: |b, x| b[0] * (1.0 - (1.0 + b[1] * x / 2.0).powi(-2)),
        starts: &[&[500.0, 0.0001], &[300.0, 0.0002]],
        estimates: &[337.99746163, 0.00039039091287],
        deviations: &[3.1643950207, 4.2547321834e-06],
        residual_squares: 0.075464681533,
    },
    Set {
        name: "Misra1c",
        x: &MISRA1_X,
        y: &MISRA1_Y,
        law: |b, x| b[0] * (1.0 - (1.0 + 2.0 * b[1] * x).powf(-0.5)),
        starts: &[&[500.0, 0.0001], &[600.0, 0.0002]],
        estimates: &[636.42725809, 0.00020813627256],
        deviations: &[4.6638326572, 1.7728423155e-06],
        residual_squares: 0.040966836971,
    },
    Set {
        name: "Misra1d",
        x: &MISRA1_X,
        y: &MISRA1_Y,
        law: |b, x| b[0] * b[1] * x / (1.0 + b[1] * x),
        starts: &[&[500.0, 0.0001], &[450.0, 0.0003]],
        estimates: &[437.36970754, 0.00030227324449],
        deviations: &[3.6489174345, 2.9334354479e-06],
        residual_squares: 0.056419295283,
    },
    Set {
        name: "DanWood",
        x: &DANWOOD_X,
        y: &DANWOOD_Y,
        law: |b, x| b[0] * x.powf(b[1]),
        starts: &[&[1.0, 5.0], &[0.7, 4.0]],
        estimates: &[0.76886226176, 3.8604055871],
        deviations: &[0.01828197386, 0.051726610913],
        residual_squares: 0.0043173084083,
    },
    Set {
        name: "Lanczos3",
        x: &LANCZOS3_X,
        y: &LANCZOS3_Y,
        law: |b, x| b[0] * (-b[1] * x).exp() + b[2] * (-b[3] * x).exp() + b[4] * (-b[5] * x).exp(),
        starts: &[&[1.2, 0.3, 5.6, 5.5, 6.5, 7.6], &[0.5, 0.7, 3.6, 4.2, 4.0, 6.3]],
        estimates: &[0.086816414977, 0.95498101505, 0.84400777463, 2.9515951832, 1.5825685901, 4.9863565084],
        deviations: &[0.017197908859, 0.097041624475, 0.041488663282, 0.10766312506, 0.058371576281, 0.034436403035],
        residual_squares: 1.6117193594e-08,
    },
    Set {
        name: "MGH17",
        x: &MGH17_X,
        y: &MGH17_Y,
        law: |b, x| b[0] + b[1] * (-x * b[3]).exp() + b[2] * (-x * b[4]).exp(),
        // From the first of its starts, a hundred times too far, both exponentials die out before the second point
        // and their rates can no longer be told.
        starts: &[&[0.5, 1.5, -1.0, 0.01, 0.02]],
        estimates: &[0.37541005211, 1.9358469127, -1.4646871366, 0.01286753464, 0.022122699662],
        deviations: &[0.0020723153551, 0.22031669222, 0.22175707739, 0.00044861358114, 0.00089471996575],
        residual_squares: 5.4648946975e-05,
    },
    Set {
        name: "Roszman1",
        x: &ROSZMAN1_X,
        y: &ROSZMAN1_Y,
        law: |b, x| b[0] - b[1] * x - (b[2] / (x - b[3])).atan() / std::f64::consts::PI,
        starts: &[&[0.1, -1e-05, 1000.0, -100.0], &[0.2, -5e-06, 1200.0, -150.0]],
        estimates: &[0.20196866396, -6.1953516256e-06, 1204.4556708, -181.34269537],
        deviations: &[0.019172666023, 3.2058931691e-06, 74.050983057, 49.573513849],
        residual_squares: 0.00049484847331,
    },
];

const MISRA1_X: [f64; 14] =
    [77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0];
const MISRA1_Y: [f64; 14] =
    [10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.4, 75.47, 81.78];
const DANWOOD_X: [f64; 6] = [1.309, 1.471, 1.49, 1.565, 1.611, 1.68];
const DANWOOD_Y: [f64; 6] = [2.138, 3.421, 3.597, 4.34, 4.882, 5.66];
const LANCZOS3_X: [f64; 24] = [
    0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95, 1.0,
    1.05, 1.1, 1.15,
];
const LANCZOS3_Y: [f64; 24] = [
    2.5134, 2.0443, 1.6684, 1.3664, 1.1232, 0.9269, 0.7679, 0.6389, 0.5338, 0.4479, 0.3776, 0.3197, 0.272, 0.2325,
    0.1997, 0.1723, 0.1493, 0.1301, 0.1138, 0.1, 0.0883, 0.0783, 0.0698, 0.0624,
];
const ROSZMAN1_X: [f64; 25] = [
    -4868.68, -4868.09, -4867.41, -3375.19, -3373.14, -3372.03, -2473.74, -2472.35, -2469.45, -1894.65, -1893.4,
    -1497.24, -1495.85, -1493.41, -1208.68, -1206.18, -1206.04, -997.92, -996.61, -996.31, -834.94, -834.66, -710.03,
    -530.16, -464.17,
];
const ROSZMAN1_Y: [f64; 25] = [
    0.252429, 0.252141, 0.251809, 0.297989, 0.296257, 0.295319, 0.339603, 0.337731, 0.33382, 0.38951, 0.386998,
    0.438864, 0.434887, 0.427893, 0.471568, 0.461699, 0.461144, 0.513532, 0.506641, 0.505062, 0.535648, 0.533726,
    0.568064, 0.612886, 0.624169,
];
const MGH17_X: [f64; 33] = [
    0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0, 100.0, 110.0, 120.0, 130.0, 140.0, 150.0, 160.0, 170.0,
    180.0, 190.0, 200.0, 210.0, 220.0, 230.0, 240.0, 250.0, 260.0, 270.0, 280.0, 290.0, 300.0, 310.0, 320.0,
];
const MGH17_Y: [f64; 33] = [
    0.844, 0.908, 0.932, 0.936, 0.925, 0.908, 0.881, 0.85, 0.818, 0.784, 0.751, 0.718, 0.685, 0.658, 0.628, 0.603,
    0.58, 0.558, 0.538, 0.522, 0.506, 0.49, 0.478, 0.467, 0.457, 0.448, 0.438, 0.431, 0.424, 0.42, 0.414, 0.411, 0.406,
];

/// To how many digits a number agrees with a certified one: minus the logarithm of the relative error, which is what
/// NIST asks for. The certified numbers have eleven.
fn digits(found: f64, certified: f64) -> f64 {
    -((found - certified).abs() / certified.abs()).max(1e-11).log10()
}

fn fewest_digits(found: &[f64], certified: &[f64]) -> f64 {
    assert_eq!(found.len(), certified.len());
    found.iter().zip(certified).map(|(&found, &certified)| digits(found, certified)).fold(f64::INFINITY, f64::min)
}

/// Fewest digits of the estimates, of their standard deviations and of the sum of squares.
fn agreement(set: &Set, start: &[f64]) -> [f64; 3] {
    let residuals = |b: &[f64]| set.x.iter().zip(set.y).map(|(&x, y)| (set.law)(b, x) - y).collect();
    let fit = minimum(residuals, start, &free(start.len()), &exact());
    assert!(fit.termination.converged(), "{}: {}", set.name, fit.termination);
    let variance = residual_variance(fit.objective, set.x.len(), start.len());
    let errors = certainty(&fit.jacobian, variance).standard_errors;
    [
        fewest_digits(fit.point.as_slice(), set.estimates),
        fewest_digits(&errors, set.deviations),
        digits(fit.objective, set.residual_squares),
    ]
}

#[test]
fn certified_estimates_and_their_deviations_are_met_from_every_start() {
    for set in &SETS {
        for &start in set.starts {
            let [estimates, deviations, squares] = agreement(set, start);
            assert!(estimates > 6.0, "{} from {start:?}: {estimates:.1} digits of the estimates", set.name);
            assert!(deviations > 4.0, "{} from {start:?}: {deviations:.1} digits of the deviations", set.name);
            assert!(squares > 7.0, "{} from {start:?}: {squares:.1} digits of the squares", set.name);
        }
    }
}

#[test]
fn a_certified_estimate_wrong_in_its_sixth_digit_is_noticed() {
    for set in &SETS {
        let mut spoiled = set.estimates.to_vec();
        spoiled[1] *= 1.0 + 2e-6;
        assert!(fewest_digits(set.estimates, &spoiled) < 6.0);
        let mut spoiled = Set { ..*set };
        spoiled.residual_squares *= 1.0 + 1e-6;
        assert!(agreement(&spoiled, set.starts[set.starts.len() - 1])[2] < 7.0, "{}", set.name);
    }
}
