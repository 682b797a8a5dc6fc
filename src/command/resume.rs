//! Finished work of an interrupted run: whether to go on from it, to refuse, or to start anew.

use crate::command::args::{CaseArgs, ResumeArgs};
use crate::command::exit::{Failure, input, unwritten};
use crate::command::terminal::print_error;
use crate::session::{Checkpoint, KeptWork};
use std::path::PathBuf;
use std::time::Duration;

/// The checkpoint of a run, which no other process uses, and the work that it keeps.
pub(crate) struct Resumable {
    pub checkpoint: Checkpoint,
    pub kept: Option<KeptWork>,
}

impl Resumable {
    /// Look for kept work of a command. Without `--resume` it is not overwritten, unless `--force` is given.
    pub(crate) fn open(command: &str, folder: PathBuf, args: &CaseArgs, resume: &ResumeArgs) -> Result<Self, Failure> {
        let mut checkpoint = Checkpoint::new(folder);
        if let Some(interval_s) = resume.checkpoint_interval_s {
            checkpoint = checkpoint.every(duration(interval_s, "--checkpoint-interval")?);
        }
        let kept = if resume.resume || !args.force { checkpoint.found()? } else { None };
        let path = checkpoint.folder().display().to_string();
        match &kept {
            Some(KeptWork { unit, range, requested, date, .. }) => {
                let requested = requested.map_or(String::new(), |requested| format!(" of {requested}"));
                let found = format!(
                    "{path} keeps {unit} {}..{}{requested} of a run of {date} that was interrupted",
                    range.start, range.end
                );
                if !resume.resume {
                    return Err(input(format!("{found}: give --resume to go on, or --force to start anew")));
                }
                if !units(command).contains(unit) {
                    return Err(input(format!(
                        "{found}: {command} has no {unit} to go on from; give --force to start anew"
                    )));
                }
                if !args.march.quiet {
                    print_error(&format!("{found}: going on from there"));
                }
            }
            None => {
                if resume.resume && !args.march.quiet {
                    print_error(&format!("{path} keeps nothing: starting with the first"));
                }
                checkpoint.remove().map_err(|error| input(format!("{path}: cannot be removed: {error}")))?;
            }
        }
        Ok(Self { checkpoint, kept })
    }

    /// Remove the work, once the answer is in safety.
    pub(crate) fn remove(&self) -> Result<(), Failure> {
        let path = self.checkpoint.folder().display();
        self.checkpoint.remove().map_err(|error| unwritten(format!("removing {path}: {error}")))
    }
}

impl Drop for Resumable {
    /// A folder without finished work is of no use.
    fn drop(&mut self) {
        if matches!(self.checkpoint.found(), Ok(None)) {
            // An error is ignored: the next run of this output tries again.
            let _ = self.checkpoint.remove();
        }
    }
}

/// The units of the work that a command keeps.
fn units(command: &str) -> &'static [&'static str] {
    match command {
        "uncertainty" => &["members"],
        "study" => &["members", "iterations"],
        "estimate" => &["iterations"],
        "size" | "trade" => &["marches"],
        _ => &["data sets"],
    }
}

/// The longest time that is counted, ten years.
const MAX_SECONDS: f64 = 3.2e8;

/// A duration of `--limit-time`.
pub(crate) fn time_limit(args: &CaseArgs) -> Result<Option<Duration>, Failure> {
    args.limit_time_s.map(|limit_s| duration(limit_s, "--limit-time")).transpose()
}

fn duration(time_s: f64, option: &str) -> Result<Duration, Failure> {
    if time_s < 0.0 {
        return Err(input(format!("{option} {time_s} s: expected no less than 0 s")));
    }
    Ok(Duration::from_secs_f64(time_s.min(MAX_SECONDS)))
}
