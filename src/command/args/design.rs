//! Options of the design of an experiment.

use super::{BoundsArg, CriterionArg};
use clap::Args;

/// What to estimate, with which thermocouples.
#[derive(Debug, Args)]
pub struct DesignArgs {
    /// Factors to estimate, as a,b,c [default: those of the case]
    #[arg(long, value_delimiter = ',')]
    pub estimate: Vec<String>,
    /// Number of thermocouples
    #[arg(long, default_value_t = 4)]
    pub sensors: usize,
    /// Criterion of the design
    #[arg(long, value_enum, default_value = "d")]
    pub criterion: CriterionArg,
    /// Take the criterion over the worst 5 % of the members in place of all
    #[arg(long)]
    pub worst: bool,
    /// Sensor whose peak is predicted with the estimate [default: the deepest one]
    #[arg(long)]
    pub target: Option<String>,
    /// Distance of the candidate depths inside plies, as "0.5 mm"; interfaces are candidates too [default: 1/24 of the
    /// layup]
    #[arg(long)]
    pub grid: Option<String>,
    /// Smallest distance of two thermocouples
    #[arg(long, default_value = "0.5 mm")]
    pub least_distance: String,
    /// Standard deviation of the depth of a thermocouple
    #[arg(long, default_value = "0 mm")]
    pub position_tolerance: String,
    /// Time between two samples, as "0.5 s" [default: the output interval of the case]
    #[arg(long)]
    pub sampling: Option<String>,
    /// Standard deviation of a sample, with its unit [default: that of the residuals of the observations, or 2 K
    /// without any]
    #[arg(long)]
    pub noise: Option<String>,
    /// Correlation time τ of the noise, with its unit: the autocorrelation is exp(-t/τ); "0 s" is white noise [default:
    /// that of the residuals of the observations, or white noise without any]
    #[arg(long)]
    pub correlation_time: Option<String>,
    /// Lengths of the run to compare, as "60s,120s" [default: the duration of the case]
    #[arg(long)]
    pub run_lengths: Option<String>,
    /// Number of members drawn from the prior of the factors
    #[arg(short = 'n', value_name = "MEMBERS", default_value_t = 1000)]
    pub members: usize,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Bounds of the factors between which members are sampled [default: small]
    #[arg(long, value_enum)]
    pub sampling_bounds: Option<BoundsArg>,
}
