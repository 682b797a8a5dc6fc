//! Does the minimiser of [`fit`](crate::fit) find what it says it finds? Problems that know no heat and whose answers
//! are known.
//!
//! Each law is written in complex numbers, so that one text gives its values and, by a step along the imaginary axis
//! that is too small to be seen in them, its derivatives to rounding: `∂r/∂P = Im r(P + ih)/h` (Squire & Trapp, SIAM
//! Rev. 40, 1998).

mod classics;
mod nist;
mod rows;

pub use classics::classics;
pub use nist::nist;
pub(super) use rows::rows;

use crate::fit::{LeastSquares, Tangent};
use nalgebra::{DMatrix, DVector};
use std::convert::Infallible;

/// A complex number: derivatives by a complex step.
pub type Complex = nalgebra::Complex<f64>;

/// A sum of squares and its answer.
pub struct Known {
    /// Its name in the reference.
    pub name: String,
    /// The standard start; of a set of NIST's, the one far from the answer and the one near it.
    pub starts: Vec<Vec<f64>>,
    /// Sums of squares at its minima, the least first where no start leads astray.
    pub minima: Vec<f64>,
    /// The certified answer, where there is one.
    pub certified: Option<Certified>,
    residuals: Law,
}

/// Residuals at a point.
type Law = Box<dyn Fn(&[Complex]) -> Vec<Complex> + Send + Sync>;

/// What NIST certifies of a minimum besides its sum of squares.
pub struct Certified {
    /// One a variable.
    pub estimates: Vec<f64>,
    /// Standard deviations of the estimates.
    pub deviations: Vec<f64>,
}

/// The step along the imaginary axis: its square vanishes beside any number.
const STEP: f64 = 1e-100;

impl Known {
    /// Every start with its name: of a set of NIST's the one far from the answer and the one near it; else the standard
    /// start, and ones ten and a hundred times as far from zero. One at zero is moved to ten and a hundred.
    pub fn every_start(&self) -> Vec<(String, Vec<f64>)> {
        if let [far, near] = &self.starts[..] {
            return vec![("far".to_owned(), far.clone()), ("near".to_owned(), near.clone())];
        }
        let standard = &self.starts[0];
        let is_zero = standard.iter().all(|&value| value == 0.0);
        [1.0, 10.0, 100.0]
            .map(|factor| {
                let moved = |&value: &f64| if is_zero && factor > 1.0 { factor } else { factor * value };
                (format!("× {factor}"), standard.iter().map(moved).collect())
            })
            .to_vec()
    }

    /// The residuals at a point.
    pub fn residuals(&self, point: &[f64]) -> DVector<f64> {
        let point: Vec<Complex> = point.iter().map(|&value| real(value)).collect();
        let found = (self.residuals)(&point);
        DVector::from_iterator(found.len(), found.iter().map(|value| value.re))
    }

    /// The residuals and their derivatives at a point.
    pub fn tangent(&self, point: &[f64]) -> Tangent {
        let mut at: Vec<Complex> = point.iter().map(|&value| real(value)).collect();
        let columns: Vec<DVector<f64>> = (0..point.len())
            .map(|j| {
                at[j].im = STEP;
                let moved = (self.residuals)(&at);
                at[j].im = 0.0;
                DVector::from_iterator(moved.len(), moved.iter().map(|value| value.im / STEP))
            })
            .collect();
        Tangent { residuals: self.residuals(point), jacobian: DMatrix::from_columns(&columns) }
    }
}

/// A problem that is asked, and how often it was.
pub struct Asked<'a> {
    known: &'a Known,
    bounds: Vec<(f64, f64)>,
    /// Whether it tells its derivatives, or has them found by differences.
    tells: bool,
    /// Points at which residuals were computed; a point with derivatives is one.
    pub residuals: usize,
    /// Points at which derivatives were told.
    pub tangents: usize,
}

impl<'a> Asked<'a> {
    /// A problem for the minimiser, with or without its derivatives.
    pub fn new(known: &'a Known, tells: bool) -> Self {
        let bounds = vec![(f64::NEG_INFINITY, f64::INFINITY); known.starts[0].len()];
        Self { known, bounds, tells, residuals: 0, tangents: 0 }
    }
}

impl LeastSquares for Asked<'_> {
    type Error = Infallible;

    fn bounds(&self) -> &[(f64, f64)] {
        &self.bounds
    }

    fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, Infallible> {
        self.residuals += points.ncols();
        let columns: Vec<_> = points.column_iter().map(|point| self.known.residuals(point.as_slice())).collect();
        Ok(DMatrix::from_columns(&columns))
    }

    fn tangents(&mut self, points: &DMatrix<f64>) -> Result<Option<Vec<Tangent>>, Infallible> {
        if !self.tells {
            return Ok(None);
        }
        self.tangents += points.ncols();
        Ok(Some(points.column_iter().map(|point| self.known.tangent(point.as_slice())).collect()))
    }
}

fn real(value: f64) -> Complex {
    Complex::new(value, 0.0)
}

/// The arctangent for an imaginary part too small to be seen, which the library's, by logarithms, would lose.
fn arctangent(z: Complex) -> Complex {
    Complex::new(z.re.atan(), z.im / (1.0 + z.re * z.re))
}
