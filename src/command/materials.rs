//! `bondline materials`: the material database.

use crate::command::args::MaterialsCommand;
use crate::command::exit::{Failure, Output};
use bondline::case::Material;
use bondline::report::materials;

pub(crate) fn run(action: MaterialsCommand) -> Result<Output, Failure> {
    let text = match action {
        MaterialsCommand::List => materials::list()?,
        MaterialsCommand::Show { name } => materials::show(&Material::named(&name)?),
        MaterialsCommand::Check { file } => materials::check(&file)?,
    };
    Ok(Output { text, failure: None })
}
