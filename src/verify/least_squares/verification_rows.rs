//! Verification rows of the minimiser.

use super::{CountedProblem, TestProblem, more_garbow_hillstrom, nist_strd};
use crate::fit::interval::residual_variance;
use crate::fit::{Fit, Options, covariance_summary, minimize, minimize_all};
use crate::verify::{Group, VerificationRow};
use nalgebra::{DMatrix, DVector};

/// Derivatives are exact to rounding; tolerances are so tight that no further reduction is possible.
fn options() -> Options {
    Options {
        max_iterations: 5000,
        tolerance_reduction: 1e-15,
        tolerance_gradient: 1e-12,
        tolerance_step: 1e-15,
        derivative_error: 1e-12,
        ..Options::default()
    }
}

/// Tolerances of NIST's estimates and of their standard deviations.
const ESTIMATE_TOLERANCE: f64 = 1e-6;
const DEVIATION_TOLERANCE: f64 = 1e-4;
/// Tolerance of the standard deviations of Lanczos1, whose residuals are 1e-13 with values of one: double precision
/// resolves them, and so their variance, to a few digits only.
const LANCZOS1_DEVIATION_TOLERANCE: f64 = 0.01;
/// Tolerance of a sum of squares, relative to it, or to that at the start where the minimum is zero.
const OBJECTIVE_TOLERANCE: f64 = 1e-6;
/// Largest fraction of starts ten times away that reach no known minimum.
const MAX_ASTRAY_FRACTION: f64 = 0.2;

pub(in crate::verify) fn verification_rows() -> Vec<VerificationRow> {
    let mut rows: Vec<VerificationRow> = nist_strd().iter().flat_map(certified).collect();
    let classics = more_garbow_hillstrom();
    rows.extend(classics.iter().map(|problem| {
        let (_, start) = &problem.all_starts()[0];
        let error = problem.relative_error(&minimum(problem, start), start);
        verification_row(
            &problem.name,
            "Moré, Garbow and Hillstrom",
            "sum of squares from the standard start",
            error,
            OBJECTIVE_TOLERANCE,
            "six digits; wide: further digits depend on rounding and differ between machines",
        )
    }));
    let far = |problem: &&TestProblem| {
        let (_, start) = &problem.all_starts()[1];
        let error = problem.relative_error(&minimum(problem, start), start);
        error.is_nan() || error > OBJECTIVE_TOLERANCE
    };
    let astray = classics.iter().filter(far).count() as f64 / classics.len() as f64;
    let quantity = format!("fraction of {} starts ten times away that reach no known minimum", classics.len());
    let source = "one in five, as distant starts can lead to other local minima";
    rows.push(verification_row(
        "all of the above",
        "Moré, Garbow and Hillstrom",
        &quantity,
        astray,
        MAX_ASTRAY_FRACTION,
        source,
    ));
    rows
}

fn minimum(problem: &TestProblem, start: &[f64]) -> Fit {
    let Ok(fit) = minimize(&mut CountedProblem::new(problem, true), &DVector::from_row_slice(start), &options());
    fit
}

/// Rows of a NIST problem: the larger error of both starts, in the estimates and in their standard deviations.
fn certified(problem: &TestProblem) -> Vec<VerificationRow> {
    let Some(certified) = &problem.certified else { return Vec::new() };
    let starts: Vec<DVector<f64>> = problem.starts.iter().map(|start| DVector::from_row_slice(start)).collect();
    let Ok(fits) = minimize_all(&mut CountedProblem::new(problem, true), &DMatrix::from_columns(&starts), &options());
    let worst = |error: &dyn Fn(&Fit) -> f64| fits.iter().map(error).fold(0.0, f64::max);
    let estimates = worst(&|fit| max_relative_error(fit.point.as_slice(), &certified.estimates));
    let deviations = worst(&|fit| max_relative_error(&deviations(fit), &certified.standard_deviations));
    let (tolerance, source) = if problem.name == "Lanczos1" {
        (LANCZOS1_DEVIATION_TOLERANCE, "two digits; residuals of 1e-13 are near the rounding error of values of one")
    } else {
        (DEVIATION_TOLERANCE, "four digits; wide: further digits depend on rounding and differ between machines")
    };
    let name = format!("NIST StRD {}", problem.name);
    let reference = "eleven certified digits, from both starts";
    vec![
        verification_row(
            &name,
            reference,
            "estimates",
            estimates,
            ESTIMATE_TOLERANCE,
            "six digits; wide: further digits depend on rounding and differ between machines",
        ),
        verification_row(&name, reference, "standard deviations", deviations, tolerance, source),
    ]
}

fn deviations(fit: &Fit) -> Vec<f64> {
    let variance = residual_variance(fit.objective, fit.residuals.len(), fit.point.len());
    covariance_summary(&fit.jacobian, variance).standard_errors
}

/// Largest relative difference; NaN counts as infinite.
fn max_relative_error(found: &[f64], certified: &[f64]) -> f64 {
    let error = found.iter().zip(certified).map(|(found, certified)| (found / certified - 1.0).abs());
    error.fold(0.0, |worst, error| if error.is_nan() { f64::INFINITY } else { error.max(worst) })
}

impl TestProblem {
    /// Error of the fit's sum of squares relative to the nearest known minimum, or to the value at the start where that
    /// minimum is zero.
    pub fn relative_error(&self, fit: &Fit, start: &[f64]) -> f64 {
        let first = self.residuals(start).norm_squared();
        let scale = |least: f64| if least > 0.0 { least } else { first };
        let error = self.minima.iter().map(|&least| (fit.objective - least).abs() / scale(least));
        error.fold(f64::INFINITY, f64::min)
    }
}

fn verification_row(
    case: &str,
    reference: &str,
    quantity: &str,
    difference: f64,
    tolerance: f64,
    source: &str,
) -> VerificationRow {
    VerificationRow {
        group: Group::Fit,
        case: case.to_owned(),
        reference: reference.to_owned(),
        quantity: quantity.to_owned(),
        difference,
        tolerance,
        unit: "relative".to_owned(),
        source_of_tolerance: source.to_owned(),
    }
}
