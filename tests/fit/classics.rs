//! Moré, Garbow & Hillstrom, "Testing unconstrained optimization software", ACM Trans. Math. Softw. 7 (1981), by their
//! numbers there; minima to more digits by minimising in extended precision.

use super::{exact, free, minimum};
use bondline::fit::{Fit, certainty};

fn fitted(residuals: impl Fn(&[f64]) -> Vec<f64>, start: &[f64]) -> Fit {
    let fit = minimum(residuals, start, &free(start.len()), &exact());
    assert!(fit.termination.converged(), "{}", fit.termination);
    fit
}

fn rosenbrock(x: &[f64]) -> Vec<f64> {
    vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]]
}

#[test]
fn rosenbrocks_valley_is_followed_to_its_end() {
    for (factor, turns) in [(1.0, 25), (10.0, 40)] {
        let fit = fitted(rosenbrock, &[-1.2 * factor, factor]);
        assert!(fit.point.iter().all(|x| (x - 1.0).abs() < 1e-8), "{}", fit.point);
        assert!(fit.path.len() <= turns, "{} turns from {factor}", fit.path.len());
    }
}

/// The Jacobian is singular at the minimum, which is then approached by halves.
#[test]
fn powells_singular_function_is_reduced_to_nothing() {
    let f = |x: &[f64]| {
        let (a, b) = (x[1] - 2.0 * x[2], x[0] - x[3]);
        vec![x[0] + 10.0 * x[1], 5f64.sqrt() * (x[2] - x[3]), a * a, 10f64.sqrt() * b * b]
    };
    for factor in [1.0, 10.0, 100.0] {
        let fit = fitted(f, &[3.0 * factor, -factor, 0.0, factor]);
        assert!(fit.objective < 1e-24 * fit.path[0].objective, "{}", fit.objective);
    }
}

#[test]
fn helical_valley_is_descended() {
    let f = |x: &[f64]| {
        let turn = (x[1] / x[0]).atan() / std::f64::consts::TAU + if x[0] < 0.0 { 0.5 } else { 0.0 };
        vec![10.0 * (x[2] - 10.0 * turn), 10.0 * (x[0].hypot(x[1]) - 1.0), x[2]]
    };
    let fit = fitted(f, &[-1.0, 0.0, 0.0]);
    assert!((fit.point[0] - 1.0).abs() < 1e-9 && fit.point[1].abs() < 1e-9 && fit.point[2].abs() < 1e-9);
}

/// From the standard start the local minimum is met, not the zero at (5, 4).
#[test]
fn freudenstein_and_roth_is_left_in_its_local_minimum() {
    let f = |x: &[f64]| {
        vec![-13.0 + x[0] + ((5.0 - x[1]) * x[1] - 2.0) * x[1], -29.0 + x[0] + ((x[1] + 1.0) * x[1] - 14.0) * x[1]]
    };
    let fit = fitted(f, &[0.5, -2.0]);
    assert!((fit.objective - 48.984_253_679_24).abs() < 1e-9, "{}", fit.objective);
}

#[test]
fn kowalik_and_osborne_is_met_at_its_minimum() {
    const U: [f64; 11] = [4.0, 2.0, 1.0, 0.5, 0.25, 0.167, 0.125, 0.1, 0.0833, 0.0714, 0.0625];
    const Y: [f64; 11] = [0.1957, 0.1947, 0.1735, 0.16, 0.0844, 0.0627, 0.0456, 0.0342, 0.0323, 0.0235, 0.0246];
    let f = |x: &[f64]| {
        let at = |u: f64, y: f64| y - x[0] * (u * u + u * x[1]) / (u * u + u * x[2] + x[3]);
        U.iter().zip(Y).map(|(&u, y)| at(u, y)).collect()
    };
    let fit = fitted(f, &[0.25, 0.39, 0.415, 0.39]);
    assert!((fit.objective / 3.075_056_038_492e-4 - 1.0).abs() < 1e-10, "{:e}", fit.objective);
    let expected = [0.192_806_934_579, 0.191_282_328_734, 0.123_056_506_926, 0.136_062_330_684];
    assert!(fit.point.iter().zip(expected).all(|(x, e)| (x - e).abs() < 1e-5), "{}", fit.point);
}

#[test]
fn bard_is_met_at_its_minimum() {
    const Y: [f64; 15] = [0.14, 0.18, 0.22, 0.25, 0.29, 0.32, 0.35, 0.39, 0.37, 0.58, 0.73, 0.96, 1.34, 2.10, 4.39];
    let f = |x: &[f64]| {
        let at = |u: f64, y: f64| y - (x[0] + u / ((16.0 - u) * x[1] + u.min(16.0 - u) * x[2]));
        Y.iter().enumerate().map(|(i, &y)| at(i as f64 + 1.0, y)).collect()
    };
    let fit = fitted(f, &[1.0, 1.0, 1.0]);
    assert!((fit.objective / 8.214_877_306_578_97e-3 - 1.0).abs() < 1e-10, "{:e}", fit.objective);
}

/// Residuals i Σ j xⱼ − 1: every variable acts through one sum. The least S is m (m − 1)/(2 (2m + 1)).
#[test]
fn a_linear_problem_of_rank_one_ends_at_its_minimum_and_owns_up_to_its_rank() {
    let f = |x: &[f64]| {
        let sum: f64 = x.iter().enumerate().map(|(j, x)| (j as f64 + 1.0) * x).sum();
        (1..=10).map(|i| f64::from(i) * sum - 1.0).collect()
    };
    let fit = fitted(f, &[1.0; 5]);
    assert!((fit.objective - 90.0 / 42.0).abs() < 1e-9, "{}", fit.objective);
    let found = certainty(&fit.jacobian, 1.0);
    assert_eq!(found.rank, 1);
    assert!(found.standard_errors.iter().all(|error| error.is_infinite()));
}
