//! The command: arguments in, questions to a [`Session`](bondline::Session), text and an exit code out.

pub(crate) mod args;
mod devices;
mod estimate;
pub(crate) mod exit;
mod history;
mod materials;
mod member_output;
mod merge;
mod predict;
mod progress;
mod run;
mod sensitivity;
mod size;
mod study;
mod twin;
mod uncertainty;
mod verify;

use args::{Cli, Command, convert};
use exit::{Ending, Failure};

/// Carry out what was typed.
pub(crate) fn run(cli: Cli) -> Result<Ending, Failure> {
    match cli.command {
        Command::Predict(ask) => predict::run(&ask),
        Command::Uncertainty { ask, sweep, keep, piece: None } => uncertainty::run(&ask, &sweep, keep),
        Command::Uncertainty { ask, sweep, keep, piece: Some(piece) } => {
            uncertainty::leave_piece(&ask, &sweep, keep, convert::piece(&piece, sweep.members)?)
        }
        Command::Merge(merge) => merge::run(&merge),
        Command::Sensitivity { ask, data, step, method } => sensitivity::run(&ask, &data, method, step),
        Command::Estimate { ask, others, data, fit, walk, seed, beside } => {
            let arguments = estimate::Arguments {
                others: &others,
                beside: beside.as_deref(),
                data: &data,
                fit: &fit,
                walk: &walk,
                seed,
            };
            estimate::run(&ask, &arguments)
        }
        Command::Study { ask, sweep, data, fit, walk } => study::run(&ask, &sweep, &data, &fit, &walk),
        Command::Size { ask, limit, sweep } => size::run(&ask, &limit, &sweep),
        Command::History { ask, data, trace } => history::run(&ask, &data, &trace),
        Command::Twin { twin, data, fit } => match twin.study {
            None => twin::make(&twin, &data, &fit),
            Some(twins) => twin::study(&twin, &data, &fit, twins),
        },
        Command::Devices { json } => devices::print(json),
        Command::Materials { look } => materials::print(look),
        Command::Verify { json, group, on } => verify::print(json, group.as_deref(), &on),
    }
}
