//! Options of least squares and of the posterior.

use super::{BoundsArg, MinimiserArg, PriorArg};
use clap::Args;

/// Default of `--max-iterations`.
const MAX_ITERATIONS: usize = 50;

/// The observations to fit. The case file states what is not given.
#[derive(Debug, Args)]
pub struct ObservationArgs {
    /// Sensors, as TC3,TC4
    #[arg(long, value_delimiter = ',')]
    pub sensors: Vec<String>,
    /// Time window START:END in seconds, as 0:80, for all sensors; replaces windows of the case file
    #[arg(long)]
    pub window: Option<String>,
    /// Bounds of the factors
    #[arg(long, value_enum)]
    pub bounds: Option<BoundsArg>,
}

/// The factors to fit and how. The case file states what is not given.
#[derive(Debug, Args)]
pub struct FitArgs {
    /// Factors to estimate, as f_k_INS,f_cp_INS
    #[arg(long, value_delimiter = ',')]
    pub factors: Vec<String>,
    /// Start values, as NAME=VALUE,...; other factors start at their nominal values
    #[arg(long, value_delimiter = ',')]
    pub start: Vec<String>,
    /// Loss function of the residuals: squares, soft-l1 or huber; with its width in standard deviations, as huber=1.345
    #[arg(long)]
    pub loss: Option<String>,
    /// Gaussian prior about the nominal values, with two standard deviations at these bounds
    #[arg(long, value_enum)]
    pub prior: Option<PriorArg>,
    /// Step control of the minimisation
    #[arg(long, value_enum, default_value = "trust-region")]
    pub minimiser: MinimiserArg,
    /// Number of minimisations (multi-start): the first from the start of the case, the others from random points
    #[arg(long, default_value_t = 1)]
    pub starts: usize,
    /// Factors whose profile likelihood is computed; it gives an interval without linearisation
    #[arg(long, value_name = "FACTORS", value_delimiter = ',')]
    pub profile: Vec<String>,
    /// Maximum number of iterations of a minimisation
    #[arg(long, default_value_t = MAX_ITERATIONS)]
    pub max_iterations: usize,
}

impl FitArgs {
    /// The first option that differs from its default, apart from `--factors`.
    pub fn given_option(&self) -> Option<&'static str> {
        [
            (!self.start.is_empty(), "--start"),
            (self.loss.is_some(), "--loss"),
            (self.prior.is_some(), "--prior"),
            (self.minimiser != MinimiserArg::TrustRegion, "--minimiser"),
            (self.starts != 1, "--starts"),
            (!self.profile.is_empty(), "--profile"),
            (self.max_iterations != MAX_ITERATIONS, "--max-iterations"),
        ]
        .into_iter()
        .find_map(|(is_given, option)| is_given.then_some(option))
    }
}

/// The posterior distribution of the estimated factors.
#[derive(Debug, Args)]
pub struct PosteriorArgs {
    /// Sample the posterior by ensemble MCMC: credible intervals of any shape, prediction intervals of every sensor
    #[arg(long)]
    pub posterior: bool,
    /// Number of MCMC walkers
    #[arg(long, default_value_t = 2000, requires = "posterior")]
    pub walkers: usize,
    /// Number of MCMC iterations of each walker
    #[arg(long, default_value_t = 500, requires = "posterior")]
    pub mcmc_iterations: usize,
}
