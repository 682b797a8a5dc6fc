//! Nonlinear least squares between bounds: the paper's Levenberg-Marquardt method (Eqs 3 to 12), with a trust region
//! and an active set against stalling.
//!
//! The solver minimises `S(P) = rᵀr` over `P` between bounds. Near a point the residuals are linearised, `r + J ΔP`,
//! and the step solves
//!
//! ```text
//! (JᵀJ + μΩ) ΔP = −Jᵀr,   Ω = diag(JᵀJ)
//! ```
//!
//! This is the least-squares solution of the augmented system
//!
//! ```text
//! [   J   ]        [ r ]
//! [ √(μΩ) ] ΔP = − [ 0 ]
//! ```
//!
//! which is solved by orthogonal factorisation: normal equations would square the condition number of problems that are
//! already ill-conditioned.
//!
//! **Bounds** are part of the linear subproblem, by an active set. Steps are not truncated at bounds afterwards, so the
//! iteration does not stall, and a variable can lie exactly on its bound. Reflective methods (Coleman & Li, SIAM J.
//! Optim. 6, 1996; SciPy's `trf`) stay strictly inside and scale steps by the distance to the bounds: they converge
//! slowly to a solution on a bound, never report the bound as active, and distort every step near a bound. They are
//! made for thousands of variables, where an active-set search is expensive. Here there are about a dozen variables,
//! and the search costs less than the residuals of one sample.
//!
//! **Damping** follows from a trust-region radius (Moré 1978): the ratio of actual to predicted reduction lengthens or
//! shortens it. The paper's rule, μ tenfold after a failure and a tenth after a success, is an option
//! ([`DampingStrategy::Paper`]). In a narrow valley it needs many iterations to reach the μ that a radius gives at
//! once, and from a distant start its steps can leave the valley. Each entry of Ω is the largest column norm so far,
//! with a slow decay, so that a variable that loses its effect during the iteration is not undamped at once.
//!
//! A device evaluates many points in the time of one. So several radii are tried at once ([`Options::trials`]), and
//! many starts run together ([`minimize_all`]): one iteration of all of them takes one or two ensembles. A trial point
//! that cannot be computed shortens the step; only a start that cannot be computed ends a run.
//!
//! Sources: Levenberg, Q. Appl. Math. 2 (1944); Marquardt, J. SIAM 11 (1963); Moré, Lect. Notes Math. 630 (1978);
//! Transtrum & Sethna, arXiv:1201.5885 (2012), for geodesic acceleration; Nocedal & Wright, *Numerical Optimization*
//! (2006); Özışık & Orlande, *Inverse Heat Transfer* (2000).

mod bounds;
pub mod chain_diagnostics;
pub mod ensemble_mcmc;
pub mod finite_differences;
pub mod goodness_of_fit;
pub mod identifiability;
pub mod interval;
mod levenberg_marquardt;
mod linear_model;
mod linearized_posterior;
pub mod loss;
pub mod noise_model;
pub mod optimal_design;
pub mod prior;
pub mod proportion;
mod quadratic;
pub mod reliability;
pub mod subset;
pub mod termination;
mod trust_region;

pub use chain_diagnostics::ChainDiagnostics;
pub(crate) use ensemble_mcmc::{ChainState, ensemble_mcmc_from};
pub use ensemble_mcmc::{EnsembleChains, ensemble_mcmc};
pub use finite_differences::finite_difference_tangent;
pub use goodness_of_fit::GoodnessOfFit;
pub(crate) use identifiability::ILL_CONDITIONED;
pub use identifiability::{CovarianceSummary, covariance_summary};
pub use linearized_posterior::LinearizedPosterior;
pub use loss::{RobustLoss, RobustProblem};
pub use noise_model::{NoiseProcess, WARNED_CORRELATION};
pub use prior::{LinearizedPrior, Prior, WeightedProblem, WithPriors};
pub use subset::{DropReason, Dropped, Subset, SubsetLimits, identifiable_subset};
pub use termination::Termination;

use levenberg_marquardt::LevenbergMarquardt;
use nalgebra::{DMatrix, DVector};

/// A bounded least-squares problem. Evaluations come in batches: the points of a finite-difference stencil and the
/// trial points of an iteration are columns of one matrix.
pub trait LeastSquares {
    /// Error of an evaluation.
    type Error;

    /// Low and high bound of every variable; infinite where there is none.
    fn bounds(&self) -> &[(f64, f64)];

    /// Residuals at many points: column j of the result belongs to column j of `points`. Residuals are divided by their
    /// standard deviations where weights are wanted. A column with a NaN marks a point that cannot be computed; that is
    /// not an error.
    ///
    /// # Errors
    /// When the evaluation as a whole fails.
    fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, Self::Error>;

    /// Residuals and Jacobians at many points, one point per column, where the problem supplies derivatives. With
    /// `None` they come from finite differences of [`residuals`](Self::residuals).
    ///
    /// # Errors
    /// When the evaluation as a whole fails.
    fn tangents(&mut self, _points: &DMatrix<f64>) -> Result<Option<Vec<Tangent>>, Self::Error> {
        Ok(None)
    }

    /// Weight of each row of the Jacobian J in the curvature of S at these residuals: half of the Hessian of S is
    /// `Jᵀ W J` with W diagonal, without the second derivatives of the prediction. `None` where every weight is one,
    /// as in a plain sum of squares. Weights lie between zero and one.
    fn curvature_weights(&self, _residuals: &DVector<f64>) -> Option<DVector<f64>> {
        None
    }
}

impl<P: LeastSquares> LeastSquares for &mut P {
    type Error = P::Error;

    fn bounds(&self) -> &[(f64, f64)] {
        (**self).bounds()
    }

    fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, P::Error> {
        (**self).residuals(points)
    }

    fn tangents(&mut self, points: &DMatrix<f64>) -> Result<Option<Vec<Tangent>>, P::Error> {
        (**self).tangents(points)
    }

    fn curvature_weights(&self, residuals: &DVector<f64>) -> Option<DVector<f64>> {
        (**self).curvature_weights(residuals)
    }
}

/// Residuals at a point and their derivatives.
#[derive(Clone, Debug)]
pub struct Tangent {
    /// The residuals.
    pub residuals: DVector<f64>,
    /// Residual × variable: `∂rᵢ/∂Pⱼ`.
    pub jacobian: DMatrix<f64>,
}

impl Tangent {
    /// Whether the squared norms of residuals and derivatives are finite.
    fn is_finite(&self) -> bool {
        self.residuals.norm_squared().is_finite() && self.jacobian.norm_squared().is_finite()
    }
}

/// How the damping is controlled, and which tolerances end a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DampingStrategy {
    /// Damping from a trust-region radius that follows the reduction of each step; the tolerances of [`Options`] apply.
    TrustRegion,
    /// The paper's rule with bounds added: one trial per iteration, μ tenfold after a failure and a tenth after a
    /// success, Ω of the current point alone. The tolerances have the units of residuals and variables.
    Paper {
        /// Initial μ.
        initial_damping: f64,
        /// ε₁: converged when an iteration changes S by less.
        tolerance_objective: f64,
        /// ε₂: converged when `|Jᵀr|` is less, variables at active bounds excluded.
        tolerance_gradient: f64,
        /// ε₃: converged when a step is shorter.
        tolerance_step: f64,
    },
}

/// Finite-difference scheme.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DifferenceScheme {
    /// Central: second order in the step, two points per variable.
    Central,
    /// One-sided, towards the more distant bound: first order, one point per variable. For problems that are evaluated
    /// one point at a time.
    OneSided,
}

/// Options of a minimisation. The tolerances do not depend on the units of residuals or variables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// How steps are damped and accepted.
    pub damping_strategy: DampingStrategy,
    /// Trial steps per iteration with [`DampingStrategy::TrustRegion`], each shorter and more damped than the one
    /// before. One trial needs the fewest points, several need the fewest ensembles.
    pub trials: usize,
    /// Whether steps are corrected for the second derivative of the residuals along them (geodesic acceleration): one
    /// extra point per trial, in an ensemble of its own. Useful in long narrow valleys. Not used while the model has
    /// [curvature weights](LeastSquares::curvature_weights).
    pub geodesic_acceleration: bool,
    /// Maximum number of iterations, accepted or not.
    pub max_iterations: usize,
    /// ε₁ of the paper, relative to S: converged when neither the predicted nor the actual reduction of the last step
    /// is larger, or when the predicted reduction of the undamped step is not.
    pub tolerance_reduction: f64,
    /// ε₂ of the paper as a cosine: converged when no cosine of the angle between the residuals and a column of the
    /// Jacobian is larger. Variables at active bounds are excluded.
    pub tolerance_gradient: f64,
    /// ε₃ of the paper, relative: converged when the undamped step is no longer than this fraction of the point's
    /// distance from zero, both in variables scaled by their column norms.
    pub tolerance_step: f64,
    /// Finite-difference scheme where the problem supplies no derivatives.
    pub difference_scheme: DifferenceScheme,
    /// Finite-difference step relative to the size of the variable. The size is the absolute value, but at least half
    /// of the size at the previous accepted point, as a variable can pass zero; it is one at a start of zero. Choose a
    /// step that changes the residuals by much more than their own error.
    pub difference_step: f64,
    /// Relative error of the derivatives, supplied or by finite differences. The step is damped in directions in which
    /// the Jacobian with unit columns is weaker than this, as they are dominated by the error.
    pub derivative_error: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            damping_strategy: DampingStrategy::TrustRegion,
            trials: 4,
            geodesic_acceleration: false,
            max_iterations: 50,
            tolerance_reduction: 1e-9,
            tolerance_gradient: 1e-8,
            tolerance_step: 1e-6,
            difference_scheme: DifferenceScheme::Central,
            difference_step: 1e-4,
            derivative_error: 1e-5,
        }
    }
}

/// Result of a minimisation.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The variables at the end.
    pub point: DVector<f64>,
    /// S, the sum of squared residuals.
    pub objective: f64,
    /// The residuals at the point.
    pub residuals: DVector<f64>,
    /// Residual × variable, at the point.
    pub jacobian: DMatrix<f64>,
    /// The accepted points, the start first; S decreases from each to the next.
    pub path: Vec<Iterate>,
    /// Number of points at which residuals were computed, finite differences included.
    pub evaluations: usize,
    /// Number of points at which the problem supplied derivatives.
    pub tangent_evaluations: usize,
    /// The criterion that ended the run.
    pub termination: Termination,
}

/// An accepted point.
#[derive(Clone, Debug, PartialEq)]
pub struct Iterate {
    /// The variables.
    pub point: DVector<f64>,
    /// S at the point.
    pub objective: f64,
    /// μ of the step to this point; at the start zero, or the initial μ of the paper's rule.
    pub damping: f64,
}

/// Minimises the sum of squares between the bounds from one start. A start outside the bounds is moved to the nearest
/// point between them. Every kind of termination is a value in the [`Fit`], never an error.
///
/// # Errors
/// Errors of the problem.
pub fn minimize<P: LeastSquares>(problem: &mut P, start: &DVector<f64>, options: &Options) -> Result<Fit, P::Error> {
    let starts = DMatrix::from_column_slice(start.len(), 1, start.as_slice());
    let mut fits = minimize_all(problem, &starts, options)?;
    Ok(fits.pop().expect("one fit per start"))
}

/// [`minimize`] from many starts, one per column, whose evaluations share ensembles. The fits are in the order of the
/// starts; none depends on the others.
///
/// # Errors
/// Errors of the problem.
pub fn minimize_all<P: LeastSquares>(
    problem: &mut P,
    starts: &DMatrix<f64>,
    options: &Options,
) -> Result<Vec<Fit>, P::Error> {
    let bounds = vec![problem.bounds().to_vec(); starts.ncols()];
    minimize_within(problem, starts, &bounds, options)
}

/// [`minimize_all`] with separate bounds for each start in place of the problem's. A variable with equal bounds is held
/// there, as in a profile likelihood.
///
/// # Errors
/// Errors of the problem.
pub fn minimize_within<P: LeastSquares>(
    problem: &mut P,
    starts: &DMatrix<f64>,
    bounds: &[Vec<(f64, f64)>],
    options: &Options,
) -> Result<Vec<Fit>, P::Error> {
    let mut runs: Vec<LevenbergMarquardt> = starts
        .column_iter()
        .zip(bounds)
        .map(|(start, bounds)| LevenbergMarquardt::new(&start.into_owned(), bounds, options))
        .collect();
    loop {
        let mut without_tangent: Vec<&mut LevenbergMarquardt> =
            runs.iter_mut().filter_map(LevenbergMarquardt::awaiting_tangent).collect();
        if !without_tangent.is_empty() {
            let points: Vec<DVector<f64>> = without_tangent.iter().map(|run| run.tangent_point().clone()).collect();
            if let Some(tangents) = problem.tangents(&DMatrix::from_columns(&points))? {
                without_tangent
                    .iter_mut()
                    .zip(tangents)
                    .for_each(|(run, tangent)| run.receive_tangent(tangent, &*problem));
            }
        }

        let requested: Vec<DMatrix<f64>> = runs.iter().map(LevenbergMarquardt::requested_points).collect();
        let columns: Vec<_> = requested.iter().flat_map(|points| points.column_iter()).collect();
        if columns.is_empty() {
            break;
        }
        let computed = problem.residuals(&DMatrix::from_columns(&columns))?;
        let mut first = 0;
        for (run, points) in runs.iter_mut().zip(&requested).filter(|(_, points)| points.ncols() > 0) {
            run.receive_residuals(computed.columns(first, points.ncols()).into_owned(), &*problem);
            first += points.ncols();
        }
    }
    Ok(runs.into_iter().map(LevenbergMarquardt::into_fit).collect())
}
