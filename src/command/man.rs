//! `bondline man`: manual pages.

use crate::command::args::Cli;
use crate::command::exit::{Failure, Output, input, unwritten};
use std::path::Path;

/// Write one page per command: `bondline.1`, `bondline-predict.1`, ...
pub(crate) fn run(folder: &Path) -> Result<Output, Failure> {
    let message = |error: std::io::Error| format!("{}: {error}", folder.display());
    std::fs::create_dir_all(folder).map_err(|error| input(message(error)))?;
    clap_mangen::generate_to(Cli::description(), folder).map_err(|error| unwritten(message(error)))?;
    Ok(Output { text: format!("manual pages: {}\n", folder.join("bondline*.1").display()), failure: None })
}
