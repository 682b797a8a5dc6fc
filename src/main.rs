//! The command `bondline`: the only place that prints.
//!
//! Exit codes: 0 success; 1 the run failed (no convergence, too many failed members, a failed check); 2 wrong input;
//! 3 device error.

mod command;

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(command::run_words(std::env::args_os()))
}
