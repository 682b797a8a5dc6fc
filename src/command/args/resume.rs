//! Options of commands that go on after an interruption.

use clap::Args;

/// Keeping of complete members while a sweep runs.
#[derive(Debug, Args)]
pub(crate) struct ResumeArgs {
    /// Go on from the members that an interrupted run has kept
    #[arg(long)]
    pub resume: bool,
    /// Longest time between two writes of the complete members [default: 5 s]
    #[arg(long, value_name = "TIME")]
    pub checkpoint_interval: Option<String>,
}
