//! Verification of the minimiser of [`fit`](crate::fit) on test problems with known solutions, without any heat
//! transfer.
//!
//! Each residual function is written for complex numbers, so that the same code gives values and, by the complex-step
//! method, derivatives to rounding: `∂r/∂P = Im r(P + ih)/h` (Squire & Trapp, SIAM Rev. 40, 1998).

mod more_garbow_hillstrom;
mod nist_strd;
mod verification_rows;

pub use more_garbow_hillstrom::more_garbow_hillstrom;
pub use nist_strd::nist_strd;
pub(super) use verification_rows::verification_rows;

use crate::fit::{LeastSquares, Tangent};
use nalgebra::{DMatrix, DVector};
use std::convert::Infallible;

/// A complex number, for derivatives by the complex-step method.
pub type Complex = nalgebra::Complex<f64>;

/// A least-squares test problem with its known solution.
pub struct TestProblem {
    /// Name in the reference.
    pub name: String,
    /// The standard start; for NIST problems the distant and the near start.
    pub starts: Vec<Vec<f64>>,
    /// Sums of squares at the known minima, the lowest first.
    pub minima: Vec<f64>,
    /// The certified solution, where there is one.
    pub certified: Option<CertifiedValues>,
    residuals: ResidualFunction,
}

/// Residuals at a point.
type ResidualFunction = Box<dyn Fn(&[Complex]) -> Vec<Complex> + Send + Sync>;

/// Values certified by NIST at the minimum.
pub struct CertifiedValues {
    /// Estimates, one per variable.
    pub estimates: Vec<f64>,
    /// Standard deviations of the estimates.
    pub standard_deviations: Vec<f64>,
}

/// Complex step: its square is negligible relative to any residual.
const COMPLEX_STEP: f64 = 1e-100;

impl TestProblem {
    /// All starts with their names: for NIST problems the distant and the near one; else the standard start, and starts
    /// ten and a hundred times as far from zero. A standard start at zero is replaced by ten and a hundred.
    pub fn all_starts(&self) -> Vec<(String, Vec<f64>)> {
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
                at[j].im = COMPLEX_STEP;
                let moved = (self.residuals)(&at);
                at[j].im = 0.0;
                DVector::from_iterator(moved.len(), moved.iter().map(|value| value.im / COMPLEX_STEP))
            })
            .collect();
        Tangent { residuals: self.residuals(point), jacobian: DMatrix::from_columns(&columns) }
    }
}

/// A test problem for the minimiser that counts its evaluations.
pub struct CountedProblem<'a> {
    problem: &'a TestProblem,
    bounds: Vec<(f64, f64)>,
    /// Whether the problem supplies derivatives; else the minimiser uses finite differences.
    supplies_derivatives: bool,
    /// Number of points at which residuals were computed; a point with derivatives counts as a tangent only.
    pub residual_evaluations: usize,
    /// Number of points at which derivatives were computed.
    pub tangent_evaluations: usize,
}

impl<'a> CountedProblem<'a> {
    /// The problem with or without its derivatives.
    pub fn new(problem: &'a TestProblem, supplies_derivatives: bool) -> Self {
        let bounds = vec![(f64::NEG_INFINITY, f64::INFINITY); problem.starts[0].len()];
        Self { problem, bounds, supplies_derivatives, residual_evaluations: 0, tangent_evaluations: 0 }
    }
}

impl LeastSquares for CountedProblem<'_> {
    type Error = Infallible;

    fn bounds(&self) -> &[(f64, f64)] {
        &self.bounds
    }

    fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, Infallible> {
        self.residual_evaluations += points.ncols();
        let columns: Vec<_> = points.column_iter().map(|point| self.problem.residuals(point.as_slice())).collect();
        Ok(DMatrix::from_columns(&columns))
    }

    fn tangents(&mut self, points: &DMatrix<f64>) -> Result<Option<Vec<Tangent>>, Infallible> {
        if !self.supplies_derivatives {
            return Ok(None);
        }
        self.tangent_evaluations += points.ncols();
        Ok(Some(points.column_iter().map(|point| self.problem.tangent(point.as_slice())).collect()))
    }
}

fn real(value: f64) -> Complex {
    Complex::new(value, 0.0)
}

/// Arctangent for a very small imaginary part, which the library's logarithms would lose.
fn arctangent(z: Complex) -> Complex {
    Complex::new(z.re.atan(), z.im / (1.0 + z.re * z.re))
}
