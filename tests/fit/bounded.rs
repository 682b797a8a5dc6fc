//! Bounds that are active at the solution.

use super::{exact, minimum};
use bondline::fit::Options;
use nalgebra::{DMatrix, DVector};

const WIDE: (f64, f64) = (-100.0, 100.0);

fn rosenbrock(x: &[f64]) -> Vec<f64> {
    vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]]
}

#[test]
fn rosenbrocks_function_ends_on_an_active_bound() {
    let fit = minimum(rosenbrock, &[-1.2, 1.0], &[(-2.0, 0.5), WIDE], &exact());
    assert!(fit.termination.converged(), "{}", fit.termination);
    assert_eq!(fit.point[0], 0.5);
    assert!((fit.point[1] - 0.25).abs() < 1e-7 && (fit.objective - 0.25).abs() < 1e-12);
}

/// Problem 2 of Hock & Schittkowski, *Test Examples for Nonlinear Programming Codes* (1981): Rosenbrock's function
/// with y ≥ 1.5, whose minimum is x = 2a cos(⅓ arccos(1/b)) with a² = 598/1200 and b = 400 a³.
#[test]
fn hock_and_schittkowskis_second_problem_ends_on_its_bound() {
    let a = (598.0f64 / 1200.0).sqrt();
    let x = 2.0 * a * ((1.0 / (400.0 * a.powi(3))).acos() / 3.0).cos();
    let fit = minimum(rosenbrock, &[0.5, 3.0], &[WIDE, (1.5, 100.0)], &exact());
    assert!(fit.termination.converged(), "{}", fit.termination);
    assert!((fit.point[0] - x).abs() < 1e-8 && fit.point[1] == 1.5, "{}", fit.point);
    assert!((fit.objective - 0.050_426_187_9).abs() < 1e-9, "{}", fit.objective);
}

#[test]
fn a_start_outside_the_bounds_is_moved_inside() {
    let fit = minimum(rosenbrock, &[-50.0, 50.0], &[(-2.0, 2.0), (-2.0, 2.0)], &exact());
    assert_eq!(fit.path[0].point.as_slice(), [-2.0, 2.0]);
    assert!((fit.point[0] - 1.0).abs() < 1e-9 && (fit.point[1] - 1.0).abs() < 1e-9);
}

#[test]
fn a_variable_with_equal_bounds_is_held_and_the_others_are_fitted() {
    let fit = minimum(rosenbrock, &[-1.2, 1.0], &[(0.8, 0.8), WIDE], &exact());
    assert!(fit.termination.converged(), "{}", fit.termination);
    assert!(fit.point[0] == 0.8 && (fit.point[1] - 0.64).abs() < 1e-9);
}

/// Sixty linear problems with nearly collinear columns and a box across their valleys: here steps that are only
/// truncated at the bounds stall.
#[test]
fn bounded_linear_problems_end_at_the_best_of_all_active_sets() {
    let mut bits = 1u64;
    let mut number = || {
        bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (bits >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    let mut on_bounds = 0;
    for _ in 0..60 {
        let common: Vec<f64> = (0..12).map(|_| number()).collect();
        let matrix = DMatrix::from_fn(12, 4, |i, _| common[i] + 0.03 * number());
        let target = DVector::from_fn(4, |_, _| 1.0 + 0.6 * number());
        let right = &matrix * target + DVector::from_fn(12, |_, _| 0.01 * number());
        let bounds = [(0.9, 1.1), (0.75, 1.25), (0.9, 1.1), (0.95, 1.05)];

        let residuals = |x: &[f64]| (&matrix * DVector::from_row_slice(x) - &right).as_slice().to_vec();
        let fit = minimum(residuals, &[1.0; 4], &bounds, &Options { tolerance_reduction: 1e-12, ..exact() });
        let best = least_of_all_active_sets(&matrix, &right, &bounds);
        assert!(fit.termination.converged(), "{}", fit.termination);
        assert!(fit.objective <= best * (1.0 + 1e-9), "{} against {best}", fit.objective);
        on_bounds += fit.point.iter().zip(bounds).filter(|&(&x, (low, high))| x == low || x == high).count();
    }
    assert!(on_bounds > 60, "expected more than 60 variables on bounds, found {on_bounds}");
}

/// The smallest feasible sum of squares over all combinations of variables on the low bound, on the high bound and
/// free.
fn least_of_all_active_sets(matrix: &DMatrix<f64>, right: &DVector<f64>, bounds: &[(f64, f64)]) -> f64 {
    let n = bounds.len();
    let mut least = f64::INFINITY;
    for set in 0..3usize.pow(n as u32) {
        let status = |j: usize| set / 3usize.pow(j as u32) % 3;
        let free: Vec<usize> = (0..n).filter(|&j| status(j) == 2).collect();
        let mut point = DVector::from_fn(n, |j, _| [bounds[j].0, bounds[j].1, 0.0][status(j)]);
        let rest = right - matrix * &point;
        let reduced = matrix.select_columns(&free);
        if !free.is_empty() {
            let solved =
                reduced.tr_mul(&reduced).lu().solve(&reduced.tr_mul(&rest)).expect("linearly independent columns");
            for (index, &j) in free.iter().enumerate() {
                point[j] = solved[index];
            }
        }
        if point.iter().zip(bounds).all(|(x, (low, high))| low <= x && x <= high) {
            least = least.min((matrix * point - right).norm_squared());
        }
    }
    least
}
