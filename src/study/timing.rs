//! Run time of a question.

use std::time::Instant;

/// Run time of a question by phase, before its report, s.
#[derive(Clone, Copy, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct Timing {
    /// Adaptation of cells and time steps, s.
    pub plan_s: f64,
    /// Marches, s.
    pub march_s: f64,
    /// Everything else: statistics, minimisation, s.
    pub other_s: f64,
    /// Start of the question.
    #[serde(skip)]
    pub start: Instant,
}
