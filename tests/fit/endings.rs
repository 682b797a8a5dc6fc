//! Terminations of difficult minimisations.

use super::{exact, free, minimum};
use bondline::fit::{DampingStrategy, LeastSquares, Options, Tangent, Termination, covariance_summary, minimize};
use nalgebra::{DMatrix, DVector};
use std::convert::Infallible;

/// ln x = 1, undefined below zero; from ten the undamped step leads to −3.
fn logarithm(x: &[f64]) -> Vec<f64> {
    vec![if x[0] > 0.0 { x[0].ln() - 1.0 } else { f64::NAN }]
}

#[test]
fn a_failed_trial_shortens_the_step() {
    let fit = minimum(logarithm, &[10.0], &free(1), &exact());
    assert!(fit.termination.converged(), "{}", fit.termination);
    assert!((fit.point[0] - std::f64::consts::E).abs() < 1e-9);
}

/// atan(x − 2) = 0 with NaN derivatives below 1.5; from 3.2 the undamped step leads to 1.06.
struct Blind;

impl LeastSquares for Blind {
    type Error = Infallible;

    fn bounds(&self) -> &[(f64, f64)] {
        &[(-9.0, 9.0)]
    }

    fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, Infallible> {
        Ok(points.map(|x| (x - 2.0).atan()))
    }

    fn tangents(&mut self, points: &DMatrix<f64>) -> Result<Option<Vec<Tangent>>, Infallible> {
        let slope = |x: f64| if x < 1.5 { f64::NAN } else { 1.0 / (1.0 + (x - 2.0).powi(2)) };
        let tangent = |&x: &f64| Tangent {
            residuals: DVector::from_element(1, (x - 2.0).atan()),
            jacobian: DMatrix::from_element(1, 1, slope(x)),
        };
        Ok(Some(points.iter().map(tangent).collect()))
    }
}

#[test]
fn a_lower_point_without_finite_derivatives_is_rejected_for_a_shorter_step() {
    let paper = DampingStrategy::Paper {
        initial_damping: 1e-3,
        tolerance_objective: 1e-20,
        tolerance_gradient: 1e-12,
        tolerance_step: 1e-12,
    };
    for rules in [DampingStrategy::TrustRegion, paper] {
        let options = Options { damping_strategy: rules, trials: 1, ..exact() };
        let Ok(fit) = minimize(&mut Blind, &DVector::from_element(1, 3.2), &options);
        assert!(fit.termination.converged(), "{rules:?}: {}", fit.termination);
        assert!((fit.point[0] - 2.0).abs() < 1e-9 && fit.path.iter().all(|iterate| iterate.point[0] >= 1.5));
        assert!(fit.tangent_evaluations > fit.path.len(), "{rules:?}: expected a failed derivative");
    }
}

#[test]
fn a_start_that_cannot_be_computed_is_reported() {
    let fit = minimum(logarithm, &[-1.0], &free(1), &exact());
    assert_eq!(fit.termination, Termination::NotFinite);
    assert!(!fit.termination.converged());
}

#[test]
fn an_optimal_start_is_recognised_without_a_step() {
    let line = |x: &[f64]| vec![x[0] - 1.0, x[0] - 3.0];
    let fit = minimum(line, &[2.0], &free(1), &exact());
    assert_eq!((fit.termination, fit.path.len(), fit.evaluations), (Termination::Gradient, 1, 3));
    let zero = |x: &[f64]| vec![x[0] - 2.0, 2.0 * (x[0] - 2.0)];
    assert_eq!(minimum(zero, &[2.0], &free(1), &exact()).termination, Termination::ResidualsZero);
}

#[test]
fn the_iteration_limit_is_reported() {
    let rosenbrock = |x: &[f64]| vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]];
    let fit = minimum(rosenbrock, &[-1.2, 1.0], &free(2), &Options { max_iterations: 3, ..exact() });
    assert_eq!(fit.termination, Termination::MaxIterations);
    assert!(fit.path.len() <= 4);
}

/// A straight line with derivatives of the wrong sign.
struct Uphill;

impl LeastSquares for Uphill {
    type Error = Infallible;

    fn bounds(&self) -> &[(f64, f64)] {
        &[(-9.0, 9.0)]
    }

    fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, Infallible> {
        Ok(points.map(|x| x - 1.0))
    }

    fn tangents(&mut self, points: &DMatrix<f64>) -> Result<Option<Vec<Tangent>>, Infallible> {
        let tangent = |point: &f64| Tangent {
            residuals: DVector::from_element(1, point - 1.0),
            jacobian: DMatrix::from_element(1, 1, -1.0),
        };
        Ok(Some(points.iter().map(tangent).collect()))
    }
}

#[test]
fn wrong_derivatives_end_as_stalled_and_not_as_converged() {
    let Ok(fit) = minimize(&mut Uphill, &DVector::from_vec(vec![4.0]), &Options::default());
    assert_eq!(fit.termination, Termination::Stalled);
    assert_eq!(fit.point[0], 4.0);
}

/// Two variables that act only through their product: every point of the valley is a minimum, and the nearest is
/// expected.
#[test]
fn an_undetermined_direction_causes_no_drift_along_the_valley() {
    let product = |x: &[f64]| (1..=20).map(|i| f64::from(i) * (x[0] * x[1] - 0.9) + 0.1 * f64::from(i % 3)).collect();
    let fit = minimum(product, &[1.0, 1.0], &[(0.5, 1.5), (0.5, 1.5)], &Options::default());
    assert!(fit.termination.converged(), "{}", fit.termination);
    assert!((fit.point[0] - fit.point[1]).abs() < 1e-3, "{}", fit.point);
    let found = covariance_summary(&fit.jacobian, 1.0);
    assert!(found.rank == 1 && found.correlation[(0, 1)] < -0.999);
}

/// Residuals with a relative error of 1e-7, as in single precision.
#[test]
fn residuals_in_single_precision_converge_with_a_larger_difference_step() {
    let decay = |x: &[f64]| -> Vec<f64> {
        let noise = |t: f64, u: f64| (1e6 * (x[0] * t + 13.0 * x[1] * u)).sin();
        (0..80)
            .map(|i| {
                let t = f64::from(i) / 80.0;
                let value = 600.0 * (1.0 - (-3.0 * x[0] * t).exp()) + 80.0 * x[1] * t * t;
                let truth = 600.0 * (1.0 - (-3.0 * 0.93 * t).exp()) + 80.0 * 1.07 * t * t;
                value * (1.0 + 1e-7 * noise(t, t * t)) - truth
            })
            .collect()
    };
    let options = Options { difference_step: 1e-3, ..Options::default() };
    let fit = minimum(decay, &[1.0, 1.0], &[(0.5, 1.5), (0.5, 1.5)], &options);
    assert!(fit.termination.converged(), "{} after {:?}", fit.termination, fit.path);
    assert!((fit.point[0] - 0.93).abs() < 1e-6 && (fit.point[1] - 1.07).abs() < 1e-5, "{}", fit.point);
}
