//! Robust losses and priors, from outside.

use super::exact;
use bondline::fit::interval::residual_variance;
use bondline::fit::{Fit, LeastSquares, Loss, Prior, Robust, WithPriors, certainty, minimize};
use nalgebra::{DMatrix, DVector};
use std::convert::Infallible;

/// Offset and slope of a straight line through readings at 0 … 1.
struct Line(Vec<f64>);

impl LeastSquares for Line {
    type Error = Infallible;

    fn bounds(&self) -> &[(f64, f64)] {
        &[(f64::NEG_INFINITY, f64::INFINITY); 2]
    }

    fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, Infallible> {
        let at = |i: usize| i as f64 / (self.0.len() - 1) as f64;
        Ok(DMatrix::from_fn(self.0.len(), points.ncols(), |i, column| {
            points[(0, column)] + points[(1, column)] * at(i) - self.0[i]
        }))
    }
}

/// Evenly from nought to one.
fn even(bits: &mut u64) -> f64 {
    *bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*bits >> 11) as f64 / (1u64 << 53) as f64
}

/// 5 − 3 t with normal noise of one, by the sum of twelve even numbers, and one reading in ten 40 too high.
fn readings(bits: &mut u64, outliers: bool) -> Vec<f64> {
    let mut reading = |i: usize| {
        let noise = (0..12).map(|_| even(bits)).sum::<f64>() - 6.0;
        let outlier = if outliers && even(bits) < 0.1 { 40.0 } else { 0.0 };
        5.0 - 3.0 * i as f64 / 59.0 + noise + outlier
    };
    (0..60).map(&mut reading).collect()
}

fn robust(readings: Vec<f64>, loss: Loss) -> Fit {
    let mut problem = Robust { problem: Line(readings), loss };
    let Ok(fit) = minimize(&mut problem, &DVector::from_vec(vec![1.0, 1.0]), &exact());
    assert!(fit.termination.converged(), "{}", fit.termination);
    fit
}

const LOSSES: [Loss; 2] = [Loss::SoftL1 { width: 1.0 }, Loss::Huber { width: 1.345 }];

#[test]
fn readings_that_are_far_off_spoil_least_squares_and_not_a_robust_fit() {
    let mut bits = 7;
    let spoiled = readings(&mut bits, true);
    let Ok(plain) = minimize(&mut Line(spoiled.clone()), &DVector::from_vec(vec![1.0, 1.0]), &exact());
    assert!(plain.point[0] > 7.0, "{}", plain.point);
    for loss in LOSSES {
        let fit = robust(spoiled.clone(), loss);
        assert!((fit.point[0] - 5.0).abs() < 1.0 && (fit.point[1] + 3.0).abs() < 1.5, "{loss:?}: {}", fit.point);
    }
}

/// Over 400 data sets the estimates scatter by the standard errors that each fit tells of itself, within what 400 and the
/// limit of many samples allow; the bent problem, judged as if it were straight, is off by more.
#[test]
fn robust_standard_errors_are_the_scatter_of_the_estimates() {
    for outliers in [false, true] {
        for loss in LOSSES {
            let mut bits = 2026;
            let (mut offsets, mut told, mut bent) = (Vec::new(), 0.0, 0.0);
            for _ in 0..400 {
                let fit = robust(readings(&mut bits, outliers), loss);
                let straight = loss.straightened(&fit.residuals, &fit.jacobian);
                let variance = loss.variance(&straight.residuals, 2.0);
                told += certainty(&straight.jacobian, variance).standard_errors[0] / 400.0;
                let variance = residual_variance(fit.objective, fit.residuals.len(), 2);
                bent += certainty(&fit.jacobian, variance).standard_errors[0] / 400.0;
                offsets.push(fit.point[0]);
            }
            let scatter = DVector::from_vec(offsets).variance().sqrt();
            assert!((told / scatter - 1.0).abs() < 0.12, "{loss:?}, outliers {outliers}: {told} told, {scatter} met");
            if outliers {
                assert!(bent / scatter > 1.5, "{loss:?}: {bent} would be told, {scatter} met");
            }
        }
    }
}

/// Offset and slope of a trace that hardly begins cannot be told apart; what is known of one settles both.
#[test]
fn a_prior_settles_what_the_data_leave_open() {
    let mut bits = 11;
    let readings: Vec<f64> = readings(&mut bits, false);
    let prior = Prior { variable: 1, mean: -3.0, deviation: 1e-3 };
    let inner = Robust { problem: Line(readings), loss: Loss::Huber { width: 1.345 } };
    let mut problem = WithPriors { problem: inner, priors: vec![prior] };
    let Ok(fit) = minimize(&mut problem, &DVector::from_vec(vec![1.0, 1.0]), &exact());
    assert!(fit.termination.converged(), "{}", fit.termination);
    assert!((fit.point[1] + 3.0).abs() < 5e-3 && (fit.point[0] - 5.0).abs() < 0.5, "{}", fit.point);
}
