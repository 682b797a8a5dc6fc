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
//! here are ill-conditioned before that. The bounds belong to the system that is solved; a step is not cut off at them
//! afterwards. The paper tries one damping μ after another; here a ladder of them is tried at once, since a device
//! carries four points in the time of one.
//!
//! Sources: Levenberg, Q. Appl. Math. 2 (1944); Marquardt, J. SIAM 11 (1963); Moré, Lect. Notes Math. 630 (1978);
//! Özışık & Orlande, *Inverse Heat Transfer* (2000).

mod bounds;
mod damping;
pub mod difference;
pub mod identify;
pub mod interval;
pub mod subset;
pub mod termination;

pub use difference::difference;
pub use identify::{Certainty, certainty};
pub use subset::{Dropped, Limits, Reason, Subset, subset};
pub use termination::Termination;

use damping::Neighbourhood;
use nalgebra::{DMatrix, DVector};
use std::ops::ControlFlow;

/// A sum of squares to be made least. Cheapest to ask about many points at once: a difference stencil and a ladder of
/// trials are all just points.
pub trait LeastSquares {
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

    /// Residuals and their derivatives at a point, where the problem knows them; `None` has them found by differences
    /// of [`residuals`](Self::residuals).
    ///
    /// # Errors
    /// When nothing at all can be computed.
    fn jacobian(&mut self, _point: &DVector<f64>) -> Result<Option<Tangent>, Self::Error> {
        Ok(None)
    }
}

/// The residuals at a point and how they change about it.
#[derive(Clone, Debug)]
pub struct Tangent {
    pub residuals: DVector<f64>,
    /// Residual × variable: `∂rᵢ/∂Pⱼ`.
    pub jacobian: DMatrix<f64>,
}

/// How to minimise. The tolerances do not depend on the units of residuals or variables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// μ of the first turn.
    pub damping: f64,
    /// Ladders of dampings tried at most.
    pub patience: usize,
    /// The paper's ε₁: done when the best of a ladder lowered S by no more than this share of it, or the undamped step
    /// promises no more.
    pub tolerance_reduction: f64,
    /// The paper's ε₂: done when the cosine of the angle between the residuals and every column of the Jacobian is
    /// no more than this. Variables that a bound holds back do not count.
    pub tolerance_gradient: f64,
    /// The paper's ε₃: done when the undamped step is no longer than this share of the point's distance from zero, every
    /// variable measured by its effect.
    pub tolerance_step: f64,
    /// Step of a difference relative to the variable: large enough that the residuals change by much more than their
    /// own error.
    pub difference_step: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            damping: 1e-3,
            patience: 50,
            tolerance_reduction: 1e-9,
            tolerance_gradient: 1e-8,
            tolerance_step: 1e-6,
            difference_step: 1e-4,
        }
    }
}

/// Where a minimisation ended and how it got there.
#[derive(Clone, Debug)]
pub struct Fit {
    pub point: DVector<f64>,
    /// S, the sum of squared residuals.
    pub objective: f64,
    pub residuals: DVector<f64>,
    /// Residual × variable, at the point.
    pub jacobian: DMatrix<f64>,
    /// The points visited, the start first; S falls from each to the next.
    pub path: Vec<Turn>,
    /// Points at which residuals were computed; a Jacobian that the problem knows counts as one.
    pub evaluations: usize,
    pub termination: Termination,
}

/// One point visited.
#[derive(Clone, Debug, PartialEq)]
pub struct Turn {
    pub point: DVector<f64>,
    /// S there.
    pub objective: f64,
    /// μ of the step that led there; at the start, μ of the first turn.
    pub damping: f64,
}

/// What a minimisation keeps from turn to turn besides its path.
struct Progress {
    damping: f64,
    ladders: usize,
    evaluations: usize,
}

/// Finds the point between the bounds at which the sum of squares is least, from a start, which is moved between the
/// bounds where it lies outside. How it ended is a value in the [`Fit`], never an error.
///
/// # Errors
/// Those of the problem.
pub fn minimize<P: LeastSquares>(problem: &mut P, start: &DVector<f64>, options: &Options) -> Result<Fit, P::Error> {
    let bounds = problem.bounds().to_vec();
    let mut point = bounds::inside(start, &bounds);
    let mut progress = Progress { damping: options.damping.max(damping::LEAST), ladders: 0, evaluations: 0 };
    let mut path: Vec<Turn> = Vec::new();
    loop {
        let (tangent, evaluations) = tangent(problem, &point, options)?;
        progress.evaluations += evaluations;
        let objective = tangent.residuals.norm_squared();
        path.push(Turn { point: point.clone(), objective, damping: progress.damping });

        let near = Neighbourhood::new(&point, &tangent, &bounds);
        let next = match termination::verdict(&near, &path, options) {
            Some(termination) => ControlFlow::Break(termination),
            None => descend(problem, &near, &mut progress, options)?,
        };
        match next {
            ControlFlow::Continue(lower) => point = lower,
            ControlFlow::Break(termination) => {
                let Tangent { residuals, jacobian } = tangent;
                let evaluations = progress.evaluations;
                return Ok(Fit { point, objective, residuals, jacobian, path, evaluations, termination });
            }
        }
    }
}

/// Residuals and derivatives at a point, and how many points that took.
fn tangent<P: LeastSquares>(
    problem: &mut P,
    point: &DVector<f64>,
    options: &Options,
) -> Result<(Tangent, usize), P::Error> {
    Ok(match problem.jacobian(point)? {
        Some(tangent) => (tangent, 1),
        None => (difference(problem, point, options.difference_step)?, difference::points(point.len())),
    })
}

/// The best point of the first ladder that holds one lower than where it stands.
fn descend<P: LeastSquares>(
    problem: &mut P,
    near: &Neighbourhood,
    progress: &mut Progress,
    options: &Options,
) -> Result<ControlFlow<Termination, DVector<f64>>, P::Error> {
    loop {
        if progress.ladders == options.patience {
            return Ok(ControlFlow::Break(Termination::OutOfPatience));
        }
        let rungs = damping::ladder(progress.damping);
        let trials = rungs.map(|rung| near.target(rung));
        if near.negligible(&trials[0], options.tolerance_step) {
            return Ok(ControlFlow::Break(Termination::Stalled));
        }
        let residuals = problem.residuals(&DMatrix::from_columns(&trials))?;
        progress.ladders += 1;
        progress.evaluations += rungs.len();

        let objectives: Vec<f64> = residuals.column_iter().map(|column| column.norm_squared()).collect();
        let best = objectives.iter().copied().fold(f64::INFINITY, f64::min);
        // The least damped of those that are nearly as good as the best: in a curved valley the lowest point of a
        // ladder lies near its foot, and to take that alone is to creep. A comparison with NaN is false, so a point
        // that could not be computed is never lower, and the step only shrinks.
        let good = |&objective: &f64| {
            objective < near.objective && near.objective - objective >= 0.25 * (near.objective - best)
        };
        match objectives.iter().position(good) {
            Some(rung) => {
                progress.damping = rungs[rung];
                return Ok(ControlFlow::Continue(trials[rung].clone()));
            }
            None => progress.damping = damping::beyond(&rungs),
        }
    }
}
