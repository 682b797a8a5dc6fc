//! The command: arguments are converted to options of a [`Session`](crate::Session), whose answers become text and
//! an exit code.

pub mod args;
mod completions;
mod design;
mod devices;
mod estimate;
pub mod exit;
mod history;
mod init;
mod man;
mod materials;
mod member_output;
mod merge;
mod observations;
mod predict;
mod progress;
mod resume;
pub mod run;
mod sensitivity;
mod size;
mod stop;
mod study;
pub(crate) mod terminal;
mod trade;
mod twin;
mod uncertainty;
mod verify;

use crate::limits::check_thread_variable;
use args::{Cli, Command, convert};
use clap::Parser;
use exit::{Failure, Output};
use std::ffi::OsString;
use uncertainty::Part;

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
        Command::Observations(case) => observations::run(&case),
        Command::Predict { case, profiles } => predict::run(&case, &profiles),
        Command::Uncertainty { case, sweep, until: Some(target), .. } => uncertainty::run_until(&case, &sweep, &target),
        Command::Uncertainty { case, sweep, resume, profiles, keep, part: None, piece: None, .. } => {
            uncertainty::run(&case, &sweep, &resume, &profiles, keep)
        }
        Command::Uncertainty { case, sweep, resume, keep, part, piece, .. } => {
            let part = match (part, piece) {
                (Some(part), _) => Part { members: convert::member_range(&part, sweep.members)?, equal_pieces: None },
                (None, piece) => {
                    let (members, pieces) = convert::equal_piece(&piece.unwrap_or_default(), sweep.members)?;
                    Part { members, equal_pieces: Some(pieces) }
                }
            };
            uncertainty::write_part(&case, &sweep, &resume, keep, part)
        }
        Command::Merge(merge) => merge::run(&merge),
        Command::Sensitivity { case, data, step, method } => sensitivity::run(&case, &data, method, step),
        Command::Estimate { case, others, data, fit, posterior, seed, compare, resume } => {
            let arguments = estimate::Arguments {
                others: &others,
                compare: compare.as_deref(),
                data: &data,
                fit: &fit,
                posterior: &posterior,
                seed,
                resume: &resume,
            };
            estimate::run(&case, &arguments)
        }
        Command::Study { case, sweep, resume, profiles, data, fit, posterior } => {
            let kept = study::Kept { resume: &resume, profiles: &profiles };
            study::run(&case, &sweep, &kept, &data, &fit, &posterior)
        }
        Command::Size { case, size, sweep, resume } => size::run(&case, &size, &sweep, &resume),
        Command::Trade { case, exposures, trade, sweep, resume } => {
            trade::run(&case, &exposures, &trade, &sweep, &resume)
        }
        Command::Design { case, others, design } => design::run(&case, &others, &design),
        Command::History { case, data, history } => history::run(&case, &data, &history),
        Command::Twin { twin, resume, data, fit } => match twin.study {
            None => twin::write_observations(&twin, &resume, &data, &fit),
            Some(data_sets) => twin::coverage_study(&twin, &resume, &data, &fit, data_sets),
        },
        Command::Devices { json } => devices::run(json),
        Command::Materials { action } => materials::run(action),
        Command::Verify { json, group, march } => verify::run(json, group.as_deref(), &march),
        Command::Completions { shell } => Ok(completions::run(shell)),
        Command::Man { folder } => man::run(&folder),
    }
}
