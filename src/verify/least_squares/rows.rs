//! The minimiser's rows.

use super::{Asked, Known, classics, nist};
use crate::fit::interval::residual_variance;
use crate::fit::{Fit, Options, certainty, minimize, minimize_all};
use crate::verify::{Group, Row};
use nalgebra::{DMatrix, DVector};

/// Derivatives are told to rounding, and waited for until nothing more is to be gained.
fn options() -> Options {
    Options {
        patience: 5000,
        tolerance_reduction: 1e-15,
        tolerance_gradient: 1e-12,
        tolerance_step: 1e-15,
        derivative_error: 1e-12,
        ..Options::default()
    }
}

/// Digits asked of NIST's estimates and of their deviations.
const ESTIMATES: f64 = 1e-6;
const DEVIATIONS: f64 = 1e-4;
/// The same of the deviations of Lanczos1, whose residuals are of 1e-13 beside values of one: in double precision they are
/// known to a few digits only, and with them their variance.
const DEVIATIONS_OF_NOTHING: f64 = 0.01;
/// Digits asked of a sum of squares, or for one of zero the share that may be left of it.
const SQUARES: f64 = 1e-6;
/// The share of starts ten times away that may lead astray.
const ASTRAY: f64 = 0.2;

pub(in crate::verify) fn rows() -> Vec<Row> {
    let mut rows: Vec<Row> = nist().iter().flat_map(certified).collect();
    let classics = classics();
    rows.extend(classics.iter().map(|known| {
        let (_, start) = &known.every_start()[0];
        let off = known.off(&minimum(known, start), start);
        row(
            &known.name,
            "Moré, Garbow and Hillstrom",
            "sum of squares from the standard start",
            off,
            SQUARES,
            "six digits; wide: digits beyond are those of rounding, which machines differ in",
        )
    }));
    let far = |known: &&Known| {
        let (_, start) = &known.every_start()[1];
        let off = known.off(&minimum(known, start), start);
        off.is_nan() || off > SQUARES
    };
    let astray = classics.iter().filter(far).count() as f64 / classics.len() as f64;
    let quantity = format!("share of {} starts ten times away that lead to no known minimum", classics.len());
    let source = "one in five, as a start that far off may lie in another valley";
    rows.push(row("all of these", "Moré, Garbow and Hillstrom", &quantity, astray, ASTRAY, source));
    rows
}

fn minimum(known: &Known, start: &[f64]) -> Fit {
    let Ok(fit) = minimize(&mut Asked::new(known, true), &DVector::from_row_slice(start), &options());
    fit
}

/// The farther of the two starts, in the estimates and in their deviations.
fn certified(known: &Known) -> Vec<Row> {
    let Some(certified) = &known.certified else { return Vec::new() };
    let starts: Vec<DVector<f64>> = known.starts.iter().map(|start| DVector::from_row_slice(start)).collect();
    let Ok(fits) = minimize_all(&mut Asked::new(known, true), &DMatrix::from_columns(&starts), &options());
    let worst = |off: &dyn Fn(&Fit) -> f64| fits.iter().map(off).fold(0.0, f64::max);
    let estimates = worst(&|fit| farthest(fit.point.as_slice(), &certified.estimates));
    let deviations = worst(&|fit| farthest(&deviations(fit), &certified.deviations));
    let (tolerance, source) = if known.name == "Lanczos1" {
        (DEVIATIONS_OF_NOTHING, "residuals of 1e-13, which doubles of size one hardly resolve")
    } else {
        (DEVIATIONS, "four digits; wide: digits beyond are those of rounding, which machines differ in")
    };
    let name = format!("NIST StRD {}", known.name);
    let reference = "eleven certified digits, from both starts";
    vec![
        row(
            &name,
            reference,
            "estimates",
            estimates,
            ESTIMATES,
            "six digits; wide: digits beyond are those of rounding, which machines differ in",
        ),
        row(&name, reference, "standard deviations", deviations, tolerance, source),
    ]
}

fn deviations(fit: &Fit) -> Vec<f64> {
    let variance = residual_variance(fit.objective, fit.residuals.len(), fit.point.len());
    certainty(&fit.jacobian, variance).standard_errors
}

/// The largest relative difference; what is no number counts as infinite.
fn farthest(found: &[f64], known: &[f64]) -> f64 {
    let off = found.iter().zip(known).map(|(found, known)| (found / known - 1.0).abs());
    off.fold(0.0, |worst, off| if off.is_nan() { f64::INFINITY } else { off.max(worst) })
}

impl Known {
    /// How far a fit from a start is from the nearest of the minima, relative to it, or to the start where it is zero.
    pub fn off(&self, fit: &Fit, start: &[f64]) -> f64 {
        let first = self.residuals(start).norm_squared();
        let scale = |least: f64| if least > 0.0 { least } else { first };
        let off = self.minima.iter().map(|&least| (fit.objective - least).abs() / scale(least));
        off.fold(f64::INFINITY, f64::min)
    }
}

fn row(case: &str, reference: &str, quantity: &str, difference: f64, tolerance: f64, source: &str) -> Row {
    Row {
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
