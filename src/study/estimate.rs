//! Which factors make the prediction meet the measurement?

use super::nominal::{Misfit, Nominal};
use super::sensitivity::Identifiability;

/// Estimated factors and how they were found.
#[derive(Clone, Debug)]
pub struct Estimated {
    /// Indices into the case's factors, in the order of every vector here.
    pub factors: Vec<usize>,
    /// Indices of the sensors whose observations were fitted.
    pub sensors: Vec<usize>,
    pub window_s: (f64, f64),
    pub bounds: Vec<(f64, f64)>,
    pub start: Vec<f64>,
    pub values: Vec<f64>,
    /// From the covariance scaled by the residuals; infinite where not determined.
    pub standard_errors: Vec<f64>,
    /// 95 % confidence intervals.
    pub intervals: Vec<(f64, f64)>,
    /// Whether an estimate stands on one of its bounds.
    pub at_bound: Vec<bool>,
    pub identifiability: Identifiability,
    /// Sum of squared residuals in K² (the paper's S), at the start and at the end.
    pub objective_k2: (f64, f64),
    /// The points visited, the start first.
    pub path: Vec<Turn>,
    /// Members marched.
    pub marches: usize,
    pub termination: String,
    pub converged: bool,
    pub advice: String,
    /// The nominal march and the one at the estimates.
    pub before: Nominal,
    pub after: Nominal,
    /// Misfit of each fitted observation before and after, over the window.
    pub misfits: Vec<(Misfit, Misfit)>,
    /// One a fitted observation: times and measured less predicted, over the window.
    pub residuals: Vec<(Vec<f64>, Vec<f64>)>,
    /// Lag-one autocorrelation of the residuals and the number of independent samples that it leaves.
    pub autocorrelation: f64,
    pub effective_samples: f64,
    pub samples: usize,
    /// Of a pair of factors: the objective over the plane of the two.
    pub landscape: Option<Landscape>,
}

/// One accepted iteration.
#[derive(Clone, Debug)]
pub struct Turn {
    pub values: Vec<f64>,
    /// S, K².
    pub objective_k2: f64,
    pub damping: f64,
}

/// The objective over two factors: the paper's design space.
#[derive(Clone, Debug)]
pub struct Landscape {
    /// Values of the first factor, and of the second.
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    /// S in K², `objective_k2[j][i]` at `x[i]`, `y[j]`; NaN where the member failed.
    pub objective_k2: Vec<Vec<f64>>,
}
