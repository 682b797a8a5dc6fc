//! `bondline man`: manual pages.

use crate::command::args::Cli;
use crate::command::exit::{Failure, Output, input};
use std::path::Path;

/// Write one page per command: `bondline.1`, `bondline-predict.1`, ...
pub(crate) fn run(folder: &Path) -> Result<Output, Failure> {
    let written = std::fs::create_dir_all(folder).and_then(|()| clap_mangen::generate_to(Cli::description(), folder));
    written.map_err(|error| input(format!("{}: {error}", folder.display())))?;
    Ok(Output { text: format!("manual pages: {}\n", folder.join("bondline*.1").display()), failure: None })
}
