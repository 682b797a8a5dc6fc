//! What is asked of a fit.

use super::{Minimiser, PriorKind};
use clap::Args;

/// Iterations of a fit at most, unless others are typed.
const PATIENCE: usize = 50;

/// What to fit; the case file says what is not given.
#[derive(Debug, Args)]
pub(crate) struct Fit {
    /// Factors, as f_k_INS,f_cp_INS
    #[arg(long, value_delimiter = ',')]
    pub factors: Vec<String>,
    /// Where to start, as NAME=VALUE,...; the others start nominal
    #[arg(long, value_delimiter = ',')]
    pub start: Vec<String>,
    /// How samples count that are far off: squares, soft-l1 or huber, with a width in standard deviations as huber=1.345
    #[arg(long)]
    pub loss: Option<String>,
    /// What is known beforehand: nominal values, with two standard deviations to these side constraints
    #[arg(long, value_enum)]
    pub prior: Option<PriorKind>,
    /// By what rules the damping goes and the descent ends
    #[arg(long, value_enum, default_value = "trust-region")]
    pub minimiser: Minimiser,
    /// Descents side by side, the first from the case's start, the others from anywhere between the bounds
    #[arg(long, default_value_t = 1)]
    pub starts: usize,
    /// Profile likelihood of these factors: intervals with the shape that the data give them
    #[arg(long, value_name = "FACTORS", value_delimiter = ',')]
    pub profile: Vec<String>,
    /// Iterations at most
    #[arg(long, default_value_t = PATIENCE)]
    pub patience: usize,
}

impl Fit {
    /// The first option that says how to fit, other than as it is by default, or what to report of the fit.
    pub(crate) fn typed(&self) -> Option<&'static str> {
        let of_minimiser = self.minimiser != Minimiser::TrustRegion;
        [
            (!self.start.is_empty(), "--start"),
            (self.loss.is_some(), "--loss"),
            (self.prior.is_some(), "--prior"),
            (of_minimiser, "--minimiser"),
            (self.starts != 1, "--starts"),
            (!self.profile.is_empty(), "--profile"),
            (self.patience != PATIENCE, "--patience"),
        ]
        .into_iter()
        .find_map(|(is_typed, option)| is_typed.then_some(option))
    }
}
