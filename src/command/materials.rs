//! `materials`: what the database holds.

use crate::command::args::Materials;
use crate::command::exit::{Ending, Failure};
use bondline::case::Material;
use bondline::report::materials;

pub(crate) fn print(look: Materials) -> Result<Ending, Failure> {
    let text = match look {
        Materials::List => materials::list()?,
        Materials::Show { name } => materials::show(&Material::named(&name)?),
        Materials::Check { file } => materials::check(&file)?,
    };
    Ok(Ending { text, why: None })
}
