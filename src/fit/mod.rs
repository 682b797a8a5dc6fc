//! Least squares between side constraints: Levenberg-Marquardt as the paper has it (Eqs 3 to 12), made not to stall.
//!
//! Sought is the point `P`, between bounds, at which `S(P) = rᵀr` is least. About a point the residuals are taken as
//! straight, `r + J ΔP`, and the step solves
//!
//! ```text
//! (JᵀJ + μΩ) ΔP = −Jᵀr,   Ω = diag(JᵀJ)
//! ```
//!
//! which is the least-squares solution of the augmented system
//!
//! ```text
//! [   J   ]        [ r ]
//! [ √(μΩ) ] ΔP = − [ 0 ]
//! ```
//!
//! and is found as such, by orthogonal factors: normal equations would square the condition number, and the problems
//! here are ill-conditioned before that.
//!
//! **Bounds** belong to the system that is solved, by an active set: a step is not cut off at them afterwards, so none
//! stalls there, and a variable stands on its bound exactly. Reflective methods (Coleman & Li, SIAM J. Optim. 6, 1996;
//! SciPy's `trf`) keep strictly inside instead and scale steps by the distance to the bounds: they slow down where the
//! answer lies on one, never say that it does, and pay with a scaling that bends every step near a bound. They are made for
//! thousands of variables, among which searching for active ones is dear; here there are a dozen, and a search costs less
//! than the residuals of one sample.
//!
//! **Damping** follows from a radius within which straight residuals have proved good (Moré 1978): the ratio of what a
//! step gained to what it promised lengthens or shortens it. The paper's rules, μ tenfold after a failure and a tenth
//! after a success, are an option ([`Rules::Paper`]); where a valley is narrow they take many turns to reach a μ that a
//! radius gives at once, and at a start that is far off they can leap out of the valley. Ω is, column by column, the
//! longest that was met, forgotten slowly, so that a variable whose effect fades on the way is not let loose at once.
//!
//! A device carries many points in the time of one, so a ladder of radii is tried at once ([`Options::trials`]), and many
//! starts go down side by side ([`minimize_all`]): each turn of all of them is one or two ensembles. A point that cannot be
//! computed shortens the step; only a start that cannot be computed ends a run.
//!
//! Sources: Levenberg, Q. Appl. Math. 2 (1944); Marquardt, J. SIAM 11 (1963); Moré, Lect. Notes Math. 630 (1978);
//! Transtrum & Sethna, arXiv:1201.5885 (2012), of acceleration; Nocedal & Wright, *Numerical Optimization* (2006);
//! Özışık & Orlande, *Inverse Heat Transfer* (2000).

mod bounds;
mod descent;
pub mod difference;
pub mod identify;
pub mod interval;
mod linearized_posterior;
pub mod loss;
pub mod mixing;
mod neighbourhood;
pub mod noise_model;
mod pace;
pub mod prior;
mod quadratic;
pub mod subset;
pub mod termination;
pub mod walk;

pub use difference::difference;
pub use identify::{Certainty, certainty};
pub use linearized_posterior::LinearizedPosterior;
pub use loss::{Loss, Robust};
pub use mixing::Mixing;
pub use noise_model::NoiseProcess;
pub use prior::{Prior, Weighed, WithPriors};
pub use subset::{Dropped, Limits, Reason, Subset, subset};
pub use termination::Termination;
pub use walk::{Walk, walk};

use descent::Descent;
use nalgebra::{DMatrix, DVector};

/// A sum of squares to be made least. Cheapest to ask about many points at once: a difference stencil and a ladder of
/// trials are all just points.
pub trait LeastSquares {
    /// Why residuals could not be computed.
    type Error;

    /// Low and high side constraint of every variable; infinite where there is none.
    fn bounds(&self) -> &[(f64, f64)];

    /// Residuals at many points: each column of `points` is a point, and the same column of the answer its residuals,
    /// weighted (divided by their standard deviations) where that is wanted. A column with a NaN is a point at which
    /// nothing could be computed; it is not an error.
    ///
    /// # Errors
    /// When nothing at all can be computed.
    fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, Self::Error>;

    /// Residuals and their derivatives at many points, one a column, where the problem knows them; `None` has them found
    /// by differences of [`residuals`](Self::residuals).
    ///
    /// # Errors
    /// When nothing at all can be computed.
    fn tangents(&mut self, _points: &DMatrix<f64>) -> Result<Option<Vec<Tangent>>, Self::Error> {
        Ok(None)
    }

    /// The weight of each row of the Jacobian J in the curvature of S at these residuals: half of the second derivative
    /// of S is `Jᵀ W J` with W diagonal, but for the second derivatives of the model. `None` where every weight is one,
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

/// The residuals at a point and how they change about it.
#[derive(Clone, Debug)]
pub struct Tangent {
    /// One a residual.
    pub residuals: DVector<f64>,
    /// Residual × variable: `∂rᵢ/∂Pⱼ`.
    pub jacobian: DMatrix<f64>,
}

impl Tangent {
    /// Whether residuals and derivatives are numbers, and their squares too.
    fn is_finite(&self) -> bool {
        self.residuals.norm_squared().is_finite() && self.jacobian.norm_squared().is_finite()
    }
}

/// By what rules the damping goes, and a run ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rules {
    /// Damping from a radius that follows the gain of each step; ends by the tolerances of [`Options`].
    Radius,
    /// The paper's, to the letter but for the bounds: one trial a turn, μ tenfold after a failure and a tenth after a
    /// success, Ω of the point alone. Its tolerances are in the units of residuals and variables.
    Paper {
        /// μ of the first turn.
        damping: f64,
        /// ε₁: done when a turn changed S by less.
        tolerance_objective: f64,
        /// ε₂: done when the length of `Jᵀr` is less, variables on their bounds not counting.
        tolerance_slope: f64,
        /// ε₃: done when a step is shorter.
        tolerance_step: f64,
    },
}

/// Where the points of a difference lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sides {
    /// One on either side: an error of second order in the step, for two points a variable.
    Both,
    /// One on the side with more room: of first order, for one point a variable. Where points are dear, not where they
    /// are carried side by side.
    One,
}

/// How to minimise. The tolerances here do not depend on the units of residuals or variables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// How a step is found and accepted.
    pub rules: Rules,
    /// Steps tried at once under [`Rules::Radius`], each shorter and more damped than the one before. One costs the
    /// fewest points; several cost the fewest ensembles.
    pub trials: usize,
    /// Whether steps are bent along the curve that the residuals take (geodesic acceleration): one point more a trial, in
    /// an ensemble of its own. Worth it in long narrow valleys. Steps of a model with
    /// [weights](LeastSquares::curvature_weights) stay straight.
    pub bends: bool,
    /// Ladders of trials at most.
    pub patience: usize,
    /// The paper's ε₁ as a share: done when the last step promised and gained no more than this share of S, or the
    /// undamped step promises no more.
    pub tolerance_reduction: f64,
    /// The paper's ε₂ as a cosine: done when the angle between the residuals and every column of the Jacobian is that
    /// near to a right one. Variables that a bound holds back do not count.
    pub tolerance_gradient: f64,
    /// The paper's ε₃ as a share: done when the undamped step is no longer than this share of the point's distance from
    /// zero, every variable measured by its effect.
    pub tolerance_step: f64,
    /// Central or one-sided differences, where the problem has no derivatives.
    pub sides: Sides,
    /// Step of a difference relative to the variable, or to half of what it was relative to a turn before, as a variable may
    /// pass zero; at a start of zero it is the step itself. Large enough that the residuals change by much more than their
    /// own error.
    pub difference_step: f64,
    /// Relative error of the derivatives, told or by differences. Directions in which the Jacobian, its columns brought to
    /// unit length, is weaker than this are damped away rather than followed wherever the error points.
    pub derivative_error: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            rules: Rules::Radius,
            trials: 4,
            bends: false,
            patience: 50,
            tolerance_reduction: 1e-9,
            tolerance_gradient: 1e-8,
            tolerance_step: 1e-6,
            sides: Sides::Both,
            difference_step: 1e-4,
            derivative_error: 1e-5,
        }
    }
}

/// Where a minimisation ended and how it got there.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The variables where it ended.
    pub point: DVector<f64>,
    /// S, the sum of squared residuals.
    pub objective: f64,
    /// The residuals there.
    pub residuals: DVector<f64>,
    /// Residual × variable, at the point.
    pub jacobian: DMatrix<f64>,
    /// The points visited, the start first; S falls from each to the next.
    pub path: Vec<Turn>,
    /// Points at which residuals were computed, those of differences among them.
    pub evaluations: usize,
    /// Points at which the problem told its derivatives.
    pub tangents: usize,
    /// Which criterion ended it.
    pub termination: Termination,
}

/// One point visited.
#[derive(Clone, Debug, PartialEq)]
pub struct Turn {
    /// The variables.
    pub point: DVector<f64>,
    /// S there.
    pub objective: f64,
    /// μ of the step that led there; at the start, zero or the paper's first.
    pub damping: f64,
}

/// Finds the point between the bounds at which the sum of squares is least, from a start, which is moved between the
/// bounds where it lies outside. How it ended is a value in the [`Fit`], never an error.
///
/// # Errors
/// Those of the problem.
pub fn minimize<P: LeastSquares>(problem: &mut P, start: &DVector<f64>, options: &Options) -> Result<Fit, P::Error> {
    let starts = DMatrix::from_column_slice(start.len(), 1, start.as_slice());
    let mut fits = minimize_all(problem, &starts, options)?;
    Ok(fits.pop().expect("a fit a start"))
}

/// [`minimize`] from many starts, one a column, side by side: what all of them want to know next is one ensemble. One fit
/// a start, in their order; none depends on the others.
///
/// # Errors
/// Those of the problem.
pub fn minimize_all<P: LeastSquares>(
    problem: &mut P,
    starts: &DMatrix<f64>,
    options: &Options,
) -> Result<Vec<Fit>, P::Error> {
    let bounds = vec![problem.bounds().to_vec(); starts.ncols()];
    minimize_within(problem, starts, &bounds, options)
}

/// [`minimize_all`] with bounds of its own for each start, in the place of the problem's: a variable whose bounds are
/// equal is held there while the others are sought, which makes a profile of many points.
///
/// # Errors
/// Those of the problem.
pub fn minimize_within<P: LeastSquares>(
    problem: &mut P,
    starts: &DMatrix<f64>,
    bounds: &[Vec<(f64, f64)>],
    options: &Options,
) -> Result<Vec<Fit>, P::Error> {
    let mut descents: Vec<Descent> = starts
        .column_iter()
        .zip(bounds)
        .map(|(start, bounds)| Descent::new(&start.into_owned(), bounds, options))
        .collect();
    loop {
        let mut wanting: Vec<&mut Descent> = descents.iter_mut().filter_map(Descent::wanting_tangent).collect();
        if !wanting.is_empty() {
            let at: Vec<DVector<f64>> = wanting.iter().map(|descent| descent.next().clone()).collect();
            if let Some(tangents) = problem.tangents(&DMatrix::from_columns(&at))? {
                wanting.iter_mut().zip(tangents).for_each(|(descent, tangent)| descent.told(tangent, &*problem));
            }
        }

        let wanted: Vec<DMatrix<f64>> = descents.iter().map(Descent::wanted).collect();
        let columns: Vec<_> = wanted.iter().flat_map(|points| points.column_iter()).collect();
        if columns.is_empty() {
            break;
        }
        let computed = problem.residuals(&DMatrix::from_columns(&columns))?;
        let mut first = 0;
        for (descent, points) in descents.iter_mut().zip(&wanted).filter(|(_, points)| points.ncols() > 0) {
            descent.computed(computed.columns(first, points.ncols()).into_owned(), &*problem);
            first += points.ncols();
        }
    }
    Ok(descents.into_iter().map(Descent::end).collect())
}
