//! The command `bondline`. Exit codes: 0 success; 1 the run failed (no convergence, too many failed members, a failed
//! check, a result that cannot be used); 2 wrong input; 3 device error.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(bondline::command::run_words(std::env::args_os()))
}
