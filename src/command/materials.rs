//! `bondline materials`: the material database.

use crate::command::args::MaterialsCommand;
use crate::command::exit::{Failure, Output};
use crate::command::run::print_renamed_keys;
use bondline::case::Material;
use bondline::report::materials;

pub(crate) fn run(action: MaterialsCommand) -> Result<Output, Failure> {
    let text = match action {
        MaterialsCommand::List => materials::list()?,
        MaterialsCommand::Show { name } => materials::show(&Material::named(&name)?),
        MaterialsCommand::Check { file } => {
            let (material, renamed_keys) = Material::load_with_renamed_keys(&file)?;
            print_renamed_keys(&renamed_keys);
            format!("{}: ok\n{}", file.display(), materials::summary(&material))
        }
    };
    Ok(Output { text, failure: None })
}
