//! Options of `init`.

use super::TemplateArg;
use clap::Args;
use std::path::PathBuf;

/// The template and the folder to write it into.
#[derive(Debug, Args)]
pub struct InitArgs {
    /// Folder for the case, which is created if it does not exist
    #[arg(required_unless_present = "list", conflicts_with = "list")]
    pub folder: Option<PathBuf>,
    /// Template to start from
    #[arg(long, value_enum, default_value = "layup", conflicts_with = "list")]
    pub template: TemplateArg,
    /// List the templates
    #[arg(long)]
    pub list: bool,
    /// Write into a folder that is not empty; files of the same names are overwritten
    #[arg(long, conflicts_with = "list")]
    pub force: bool,
}
