//! Options of Monte Carlo sweeps, of their merging, and of sizing.

use super::{BoundsArg, SamplingArg};
use clap::Args;
use std::path::PathBuf;

/// A Monte Carlo sweep over the factors.
#[derive(Debug, Args)]
pub struct SweepArgs {
    /// Number of members (random samples of the factors)
    #[arg(short = 'n', value_name = "MEMBERS", default_value_t = 5000, value_parser = member_count)]
    pub members: usize,
    /// Sampling method and distribution
    #[arg(long, value_enum, default_value = "normal")]
    pub sampling: SamplingArg,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Maximum number of failed members before exit code 1 [default: 1 % of all]
    #[arg(long)]
    pub max_failed: Option<usize>,
    /// Bounds of the factors between which members are sampled [default: small]
    #[arg(long, value_enum)]
    pub sampling_bounds: Option<BoundsArg>,
}

/// The parts of one sweep.
#[derive(Debug, Args)]
pub struct MergeArgs {
    /// Files written by `uncertainty --members` or `--piece`, in any order, or folders of such files
    #[arg(required = true)]
    pub parts: Vec<PathBuf>,
    /// List the members that no part has, and write no report
    #[arg(long, conflicts_with_all = ["case", "out", "force", "json", "max_failed"])]
    pub missing: bool,
    /// Path of the case, if it has moved since the parts were computed
    #[arg(long)]
    pub case: Option<PathBuf>,
    /// Folder for the report [default: out/<case>/merge]
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Overwrite a folder that holds the report of another case
    #[arg(long)]
    pub force: bool,
    /// Print the summary as JSON
    #[arg(long)]
    pub json: bool,
    /// Maximum number of failed members before exit code 1 [default: 1 % of all]
    #[arg(long)]
    pub max_failed: Option<usize>,
}

/// The ply to size and its requirement.
#[derive(Debug, Args)]
pub struct SizeArgs {
    /// Ply to size, or a group whose plies are scaled together
    #[arg(long)]
    pub ply: String,
    #[command(flatten)]
    pub requirement: RequirementArgs,
}

/// The choices of materials, and the ply to size.
#[derive(Debug, Args)]
pub struct TradeArgs {
    /// Ply or group, and the materials that it may be of, as INS=pyrogel3350,saffil-96; repeated for each choice
    #[arg(long, value_name = "PLY=MATERIALS", required = true)]
    pub ply: Vec<String>,
    /// Ply to size, or a group whose plies are scaled together
    #[arg(long, value_name = "PLY")]
    pub size: String,
    #[command(flatten)]
    pub requirement: RequirementArgs,
}

/// The limit that a sized ply holds.
#[derive(Debug, Args)]
pub struct RequirementArgs {
    /// Limit of the peak temperature of a sensor, of a ply (hottest point) or of an interface (hotter face), as "TC4 <
    /// 623 K" or "INS2/GB < 623 K", or "TC4" with its limit in the case [default: the one sensor with a limit in the
    /// case, or else its one limit]
    #[arg(long)]
    pub limit: Option<String>,
    /// Required probability that a member stays below the limit
    #[arg(long, default_value_t = 0.99)]
    pub probability: f64,
    /// Smallest and largest thickness, as "3 mm:20 mm" [default: 1/4 to 4 times the thickness in the case]
    #[arg(long)]
    pub thickness_range: Option<String>,
}

/// A number of members, also in scientific notation.
fn member_count(text: &str) -> Result<usize, String> {
    let scientific = || text.parse::<f64>().ok().filter(|count| (0.0..1e15).contains(count) && count.fract() == 0.0);
    text.parse()
        .ok()
        .or(scientific().map(|count| count as usize))
        .ok_or("expected a whole number such as 5000 or 1e6".into())
}
