//! How long a question took.

use std::time::Instant;

/// Where the time of a question went before its report, s.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Seconds {
    /// Adapting cells and time steps.
    pub plan_s: f64,
    /// Marching.
    pub march_s: f64,
    /// All else that the question took: statistics, minimisation.
    pub reduce_s: f64,
    /// When the question was asked: the total is counted from here.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub began: Instant,
}
