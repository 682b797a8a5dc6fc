//! The command: parse, study, report, exit code. The only place that prints.
//!
//! Exit codes: 0 done; 1 ran but failed (no convergence, too many failed members); 2 the input is wrong;
//! 3 the device failed.

mod command;

use clap::Parser;
use command::exit::Failure;
use std::io::Write;
use std::process::ExitCode;

fn main() -> ExitCode {
    let ran = command::run(command::args::Cli::parse());
    let (code, message) = match ran {
        Ok(ending) => {
            // A reader that has gone, such as a pager that was left, is no failure of ours.
            let _ = std::io::stdout().lock().write_all(ending.text.as_bytes());
            match ending.why {
                None => return ExitCode::SUCCESS,
                Some(why) => (1, why),
            }
        }
        Err(Failure::Report(error)) => (1, error.to_string()),
        Err(Failure::Input(error)) => (2, error.to_string()),
        Err(Failure::Device(error)) => (3, error.to_string()),
    };
    eprintln!("bondline: {}", message.trim_end());
    ExitCode::from(code)
}
