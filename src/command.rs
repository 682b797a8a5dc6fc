//! The command: arguments are a [question](crate::question) to a [`Session`](crate::Session), whose answers become
//! text and an exit code.

pub mod args;
mod ask;
mod completions;
mod design;
mod devices;
pub mod exit;
mod init;
mod man;
mod materials;
mod member_output;
mod merge;
mod progress;
mod repeat;
mod resume;
pub mod run;
mod stop;
pub(crate) mod terminal;
mod twin;
mod uncertainty;
mod verify;

use crate::limits::check_thread_variable;
use crate::question::Goal;
use args::{Cli, Command, FailureArgs};
use ask::Extras;
use clap::Parser;
use exit::{Failure, Output};
use std::ffi::OsString;

/// Run the command with its words, the first of which is its name, and return the exit code.
pub fn run_words(words: impl Iterator<Item = OsString>) -> u8 {
    if let Err(message) = check_thread_variable() {
        terminal::print_error(&format!("bondline: {message}"));
        return 2;
    }
    let (printed, failure) = match Cli::try_parse_from(words).map(run) {
        Err(error) if error.use_stderr() => {
            terminal::print_error(&error.render().to_string());
            return 2;
        }
        Err(help) => (terminal::end(help.print()), None),
        Ok(Ok(output)) => (terminal::print(&output.text), output.failure.map(|reason| (1, reason))),
        Ok(Err(failure)) => (Ok(()), Some(failure.code_and_message())),
    };
    let (code, message) = match (printed, failure) {
        (Ok(()), None) => return 0,
        (Ok(()), Some(failure)) => failure,
        (Err(error), _) => (1, format!("standard output cannot be written: {error}")),
    };
    terminal::print_error(&format!("bondline: {message}"));
    code
}

/// Run the subcommand.
pub(crate) fn run(cli: Cli) -> Result<Output, Failure> {
    match cli.command {
        Command::Init(init) => init::run(&init),
        Command::Observations { case, question } => ask::run(&case, question, &Extras::default()),
        Command::Predict { case, question } => ask::run(&case, question, &Extras::default()),
        Command::Uncertainty { case, question, resume, keep, .. }
            if matches!(question.goal, Goal::Part(_) | Goal::Piece { .. }) =>
        {
            uncertainty::write_part(&case, question, &resume, keep)
        }
        Command::Uncertainty { case, question, failures: FailureArgs { max_failed }, resume, keep } => {
            ask::run(&case, question, &Extras { resume: Some(resume), max_failed, keep })
        }
        Command::Merge(merge) => merge::run(&merge),
        Command::Sensitivity { case, question } => ask::run(&case, question, &Extras::default()),
        Command::Estimate { case, question, resume } => ask::run(&case, question, &Extras::kept(resume, None)),
        Command::Study { case, question, failures, resume } => {
            ask::run(&case, question, &Extras::kept(resume, failures.max_failed))
        }
        Command::Size { case, question, failures, resume } => {
            ask::run(&case, question, &Extras::kept(resume, failures.max_failed))
        }
        Command::Trade { case, question, failures, resume } => {
            ask::run(&case, question, &Extras::kept(resume, failures.max_failed))
        }
        Command::Design { case, question } => ask::run(&case, question, &Extras::default()),
        Command::History { case, question } => ask::run(&case, question, &Extras::default()),
        Command::Twin { case, question, resume } => match question.data_sets {
            None => twin::write_observations(&case, question, &resume),
            Some(_) => ask::run(&case, question, &Extras::kept(resume, None)),
        },
        Command::Repeat(repeat) => repeat::run(&repeat),
        Command::Devices { json } => devices::run(json),
        Command::Materials { action } => materials::run(action),
        Command::Verify { json, group, march } => verify::run(json, group.as_deref(), &march),
        Command::Completions { shell } => Ok(completions::run(shell)),
        Command::Man { folder } => man::run(&folder),
    }
}
