//! Options of `merge` and of `repeat`.

use clap::Args;
use std::path::PathBuf;

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

/// A report whose question is asked again.
#[derive(Debug, Args)]
pub struct RepeatArgs {
    /// Folder of the report, with its question.toml
    pub folder: PathBuf,
    /// Folder for the new report [default: that of the report, with -repeated at its end]
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Overwrite a folder that holds the report of another case
    #[arg(long)]
    pub force: bool,
    /// No progress bar and no remarks
    #[arg(long, short)]
    pub quiet: bool,
}
