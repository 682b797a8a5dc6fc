//! `bondline man`: manual pages.

use crate::command::args::Cli;
use crate::command::exit::{Failure, Output, input, unusable_folder};
use crate::limits::{TEXT_FILE_MIB, read_file};
use crate::report::files::{check_writable, write_text};
use clap_mangen::Man;
use std::fs;
use std::path::Path;

/// Text that every page has, and no other file.
const TITLE: &str = ".TH bondline";

/// Write one page per command: `bondline.1`, `bondline-predict.1`, ... Only earlier pages are overwritten.
pub(crate) fn run(folder: &Path) -> Result<Output, Failure> {
    fs::create_dir_all(folder).map_err(|error| input(format!("{}: {error}", folder.display())))?;
    let pages: Vec<_> = pages()?.into_iter().map(|(name, text)| (folder.join(name), text)).collect();
    let is_other = |path: &Path| match read_file(path, &TEXT_FILE_MIB) {
        Ok(bytes) => !String::from_utf8_lossy(&bytes).contains(TITLE),
        Err(_) => path.symlink_metadata().is_ok(),
    };
    if let Some((path, _)) = pages.iter().find(|(path, _)| is_other(path)) {
        return Err(input(format!(
            "{} is there and is no manual page of bondline: name another folder",
            path.display()
        )));
    }
    check_writable(folder).map_err(unusable_folder)?;
    for (path, text) in &pages {
        write_text(path, text)?;
    }
    Ok(Output { text: format!("manual pages: {}\n", folder.join("bondline*.1").display()), failure: None })
}

/// Name and text of the page of every command.
fn pages() -> Result<Vec<(String, String)>, Failure> {
    let mut root = Cli::description().disable_help_subcommand(true);
    root.build();
    let (mut pages, mut commands) = (Vec::new(), vec![root]);
    while let Some(command) = commands.pop() {
        commands.extend(command.get_subcommands().cloned());
        let (page, mut text) = (Man::new(command), Vec::new());
        page.render(&mut text).map_err(input)?;
        pages.push((page.get_filename(), String::from_utf8_lossy(&text).into_owned()));
    }
    Ok(pages)
}
