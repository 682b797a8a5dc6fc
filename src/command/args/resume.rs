//! Options of commands that go on after an interruption.

use crate::question::quantity::time;
use clap::Args;

/// Keeping of finished work while a study runs.
#[derive(Clone, Debug, Default, Args)]
pub struct ResumeArgs {
    /// Go on from the finished work that an interrupted run has kept
    #[arg(long)]
    pub resume: bool,
    /// Time between two writes of the finished work [default: 5 s]
    #[arg(id = "checkpoint_interval", long = "checkpoint-interval", value_name = "TIME", value_parser = time::parse)]
    pub checkpoint_interval_s: Option<f64>,
}

impl ResumeArgs {
    /// The first of these options that was given.
    pub fn given_option(&self) -> Option<&'static str> {
        let interval = self.checkpoint_interval_s.map(|_| "--checkpoint-interval");
        self.resume.then_some("--resume").or(interval)
    }
}
