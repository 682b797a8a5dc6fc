//! The command `bondline`: the only place that prints.
//!
//! Exit codes: 0 success; 1 the run failed (no convergence, too many failed members, a failed check); 2 wrong input;
//! 3 device error.

mod command;

use clap::Parser;
use command::args::{Cli, renamed};
use command::exit::Failure;
use std::io::Write;
use std::process::ExitCode;

fn main() -> ExitCode {
    let (arguments, notes) = renamed::replace_old_names(std::env::args_os());
    for note in notes {
        eprintln!("{note}");
    }
    let (code, message) = match command::run(Cli::parse_from(arguments)) {
        Ok(output) => {
            // A closed pipe, as of a pager that was left, is no failure.
            let _ = std::io::stdout().lock().write_all(output.text.as_bytes());
            match output.failure {
                None => return ExitCode::SUCCESS,
                Some(reason) => (1, reason),
            }
        }
        Err(Failure::Report(error)) => (1, error.to_string()),
        Err(Failure::Input(error)) => (2, error.to_string()),
        Err(Failure::Device(error)) => (3, error.to_string()),
    };
    eprintln!("bondline: {}", message.trim_end());
    ExitCode::from(code)
}
