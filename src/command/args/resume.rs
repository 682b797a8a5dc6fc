//! Options of commands that go on after an interruption.

use clap::Args;

/// Keeping of finished work while a study runs.
#[derive(Debug, Args)]
pub struct ResumeArgs {
    /// Go on from the finished work that an interrupted run has kept
    #[arg(long)]
    pub resume: bool,
    /// Time between two writes of the finished work [default: 5 s]
    #[arg(long, value_name = "TIME")]
    pub checkpoint_interval: Option<String>,
}

impl ResumeArgs {
    /// The first of these options that was given.
    pub fn given_option(&self) -> Option<&'static str> {
        let interval = self.checkpoint_interval.as_ref().map(|_| "--checkpoint-interval");
        self.resume.then_some("--resume").or(interval)
    }
}
