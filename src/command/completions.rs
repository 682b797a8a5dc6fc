//! `bondline completions`: completion scripts of shells.

use crate::command::args::Cli;
use crate::command::exit::Output;
use clap_complete::Shell;

pub(crate) fn run(shell: Shell) -> Output {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::description(), "bondline", &mut script);
    Output { text: String::from_utf8_lossy(&script).into_owned(), failure: None }
}
