//! Tests of the least-squares minimiser on problems with known solutions.

mod bounded;
mod certified;
mod endings;
mod intervals;
mod peers;
mod robust;

use bondline::fit::{Fit, LeastSquares, Options, minimize};
use nalgebra::{DMatrix, DVector};
use std::convert::Infallible;

/// Residuals as a function of a point, with a count of evaluated points.
struct Problem<F> {
    bounds: Vec<(f64, f64)>,
    residuals: F,
    evaluations: usize,
}

impl<F: Fn(&[f64]) -> Vec<f64>> LeastSquares for Problem<F> {
    type Error = Infallible;

    fn bounds(&self) -> &[(f64, f64)] {
        &self.bounds
    }

    fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, Infallible> {
        self.evaluations += points.ncols();
        let columns = points.column_iter().map(|point| DVector::from_vec((self.residuals)(point.as_slice())));
        Ok(DMatrix::from_columns(&columns.collect::<Vec<_>>()))
    }
}

/// Tight tolerances for problems that are exact to rounding. The difference step is about the cube root of the rounding
/// error, which balances it against the truncation error of a central difference.
fn exact() -> Options {
    Options {
        max_iterations: 200,
        tolerance_reduction: 1e-14,
        tolerance_gradient: 1e-10,
        tolerance_step: 1e-9,
        difference_step: 6e-6,
        derivative_error: 1e-9,
        ..Options::default()
    }
}

fn minimum(residuals: impl Fn(&[f64]) -> Vec<f64>, start: &[f64], bounds: &[(f64, f64)], options: &Options) -> Fit {
    let mut problem = Problem { bounds: bounds.to_vec(), residuals, evaluations: 0 };
    let Ok(fit) = minimize(&mut problem, &DVector::from_row_slice(start), options);
    assert_eq!(fit.evaluations, problem.evaluations);
    assert!(fit.path.windows(2).all(|pair| pair[1].objective < pair[0].objective));
    fit
}

fn free(variables: usize) -> Vec<(f64, f64)> {
    vec![(f64::NEG_INFINITY, f64::INFINITY); variables]
}
