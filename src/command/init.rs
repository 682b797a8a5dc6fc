//! `bondline init`: a commented case to start from.

use crate::command::args::{InitArgs, TemplateArg};
use crate::command::exit::{Failure, Output, input, unusable_folder};
use crate::report::files::{check_writable, write_text};
use std::fmt::Write;
use std::fs;
use std::io;
use std::path::Path;

pub(crate) fn run(args: &InitArgs) -> Result<Output, Failure> {
    let text = match &args.folder {
        Some(folder) => write(folder, args)?,
        None => list(),
    };
    Ok(Output { text, failure: None })
}

fn list() -> String {
    let lines = TemplateArg::all().map(|(name, description)| format!("{name:<15}{description}\n"));
    lines.collect()
}

fn write(folder: &Path, args: &InitArgs) -> Result<String, Failure> {
    let failed = |error: io::Error| input(format!("{}: {error}", folder.display()));
    fs::create_dir_all(folder).map_err(failed)?;
    let is_empty = fs::read_dir(folder).map_err(failed)?.next().is_none();
    if !is_empty && !args.force {
        return Err(input(format!(
            "{} is not empty: name another folder, or give --force, which overwrites files of the same names",
            folder.display()
        )));
    }
    check_writable(folder).map_err(unusable_folder)?;
    let mut text = String::new();
    for (name, content) in files(args.template) {
        let path = folder.join(name);
        write_text(&path, content)?;
        // Writing to a string cannot fail.
        let _ = writeln!(text, "wrote {}", path.display());
    }
    let _ = writeln!(text, "next: edit the case, then run `bondline study {}`", folder.display());
    Ok(text)
}

/// Names and contents of the files of a template; the case is the last, so that there is none without its tables.
fn files(template: TemplateArg) -> &'static [(&'static str, &'static str)] {
    match template {
        TemplateArg::Layup => &[("case.toml", include_str!("init/layup/case.toml"))],
        TemplateArg::HeldFace => &[
            ("driver.csv", include_str!("init/held-face/driver.csv")),
            ("case.toml", include_str!("init/held-face/case.toml")),
        ],
        TemplateArg::Decomposition => &[("case.toml", include_str!("init/decomposition/case.toml"))],
        TemplateArg::Estimate => &[
            ("measured.csv", include_str!("init/estimate/measured.csv")),
            ("case.toml", include_str!("init/estimate/case.toml")),
        ],
    }
}
