//! The command `bondline`: the only place that prints.
//!
//! Exit codes: 0 success; 1 the run failed (no convergence, too many failed members, a failed check); 2 wrong input;
//! 3 device error.

mod command;

use clap::Parser;
use command::args::{Cli, renamed};
use command::exit::Failure;
use command::terminal;
use std::process::ExitCode;

fn main() -> ExitCode {
    let (arguments, notes) = renamed::replace_old_names(std::env::args_os());
    for note in notes {
        terminal::print_error(&note);
    }
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(error) if error.use_stderr() => {
            terminal::print_error(&error.render().to_string());
            return ExitCode::from(2);
        }
        Err(help) => help.exit(),
    };
    let (code, message) = match command::run(cli) {
        Ok(output) => match (terminal::print(&output.text), output.failure) {
            (Ok(()), None) => return ExitCode::SUCCESS,
            (Ok(()), Some(reason)) => (1, reason),
            (Err(error), _) => (1, format!("standard output cannot be written: {error}")),
        },
        Err(Failure::Report(error)) => (1, error.to_string()),
        Err(Failure::Input(error)) => (2, error.to_string()),
        Err(Failure::Device(error)) => (3, error.to_string()),
    };
    terminal::print_error(&format!("bondline: {message}"));
    ExitCode::from(code)
}
