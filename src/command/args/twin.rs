//! Options of `twin`.

use super::MarchArgs;
use clap::Args;
use std::path::PathBuf;

/// Synthetic observations; with `--study`, many sets of them, each fitted with the options of `estimate`.
#[derive(Debug, Args)]
pub struct TwinArgs {
    /// Case file, or folder with a case.toml
    pub case: PathBuf,
    /// True values of factors, as NAME=VALUE,...; other factors are nominal
    #[arg(long, value_delimiter = ',', conflicts_with = "study")]
    pub truth: Vec<String>,
    /// Standard deviation of the noise, with its unit [default: 0 K; with --study, that of the observations]
    #[arg(long)]
    pub noise: Option<String>,
    /// Correlation time τ of the noise, with its unit: the autocorrelation is exp(-t/τ) [default: white noise]
    #[arg(long)]
    pub correlation_time: Option<String>,
    /// Fit N synthetic data sets with random true factors, and count how often the 95 % intervals contain the truth
    #[arg(long, value_name = "N")]
    pub study: Option<usize>,
    /// Seed of the random true factors and of the noise [default: 1]
    #[arg(long)]
    pub seed: Option<u64>,
    /// CSV file for the observations, or folder for the report of a study [default: measured.csv, out/<case>/twin]
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Overwrite an existing file, or a folder that holds the report of another case
    #[arg(long)]
    pub force: bool,
    /// End a study after this time, such as "2 h", with the data sets so far
    #[arg(long, value_name = "TIME", requires = "study")]
    pub limit_time: Option<String>,
    /// Print the summary of a study as JSON
    #[arg(long, requires = "study")]
    pub json: bool,
    #[command(flatten)]
    pub march: MarchArgs,
}
