//! `bondline materials`: the material database, and the import of materials.

use crate::case::{
    ImportRecord, ImportedMaterial, Material, MaterialColumns, OutOfRange, PatoHeat, PatoOptions, PropertyColumns,
    SourceKind,
};
use crate::command::args::{
    DirectionArg, ImportCommand, MaterialsCommand, OutsideArg, PatoArgs, PatoHeatArg, RecordArgs, TableArgs, pairs,
};
use crate::command::exit::{Failure, Output, input, unusable_folder};
use crate::plan::{advances_enthalpy, integrates_conductivity};
use crate::report::files;
use crate::report::materials;
use crate::study::run_record::utc_date;
use std::path::Path;

pub(crate) fn run(action: MaterialsCommand) -> Result<Output, Failure> {
    let text = match action {
        MaterialsCommand::List => materials::list()?,
        MaterialsCommand::Show { name } => materials::show(&Material::named(&name)?),
        MaterialsCommand::Check { file } => {
            let material = Material::load(&file)?;
            format!("{}: ok\n{}", file.display(), summary(&material))
        }
        MaterialsCommand::Import { from } => match *from {
            ImportCommand::Table(args) => import_table(&args)?,
            ImportCommand::Pato(args) => import_pato(&args)?,
        },
    };
    Ok(Output { text, failure: None })
}

fn import_table(args: &TableArgs) -> Result<String, Failure> {
    let TableArgs { temperature, density, conductivity, heat_capacity, emissivity, .. } = args;
    let units = pairs(&args.units, "--unit")?;
    let columns = MaterialColumns {
        temperature,
        properties: PropertyColumns { density, conductivity, heat_capacity, emissivity },
        units: &units,
        outside: match args.outside {
            OutsideArg::Clamp => OutOfRange::Clamp,
            OutsideArg::Extrapolate => OutOfRange::Extrapolate,
            OutsideArg::Error => OutOfRange::Error,
        },
    };
    write(&args.record, |record| ImportedMaterial::from_table(&args.file, &columns, record))
}

fn import_pato(args: &PatoArgs) -> Result<String, Failure> {
    let options = PatoOptions {
        heat: match args.heat {
            PatoHeatArg::Absolute => PatoHeat::Absolute,
            PatoHeatArg::OfReaction => PatoHeat::OfReaction,
        },
        direction: args.direction.map(|direction| match direction {
            DirectionArg::I => 0,
            DirectionArg::J => 1,
            DirectionArg::K => 2,
        }),
    };
    write(&args.record, |record| ImportedMaterial::from_pato(&args.folder, &options, record))
}

/// Import a material and write its file, whole or not at all.
fn write(
    args: &RecordArgs,
    import: impl FnOnce(&ImportRecord<'_>) -> Result<ImportedMaterial, crate::case::CaseError>,
) -> Result<String, Failure> {
    let out = &args.out;
    if out.exists() && !args.force {
        return Err(input(format!("{} exists already; give --force to overwrite it", out.display())));
    }
    let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return Err(input(format!("--out {}: no such folder: {}", out.display(), folder.display())));
    }
    files::check_writable(folder).map_err(unusable_folder)?;
    let mark = args.mark.as_ref().map(|word| {
        SourceKind::named(word).ok_or_else(|| {
            input(format!("--mark: expected read, remembered, estimated, paper or measured, found {word:?}"))
        })
    });
    let date = utc_date();
    let record = ImportRecord {
        name: &args.name,
        date: &date,
        mark: mark.transpose()?.zip(args.uncertainty.as_deref()),
        source: args.source.as_deref(),
    };
    let ImportedMaterial { text, material } = import(&record)?;
    files::write_text(out, &text)?;
    Ok(format!("{}: written\n{}", out.display(), summary(&material)))
}

/// Summary of a material, and its treatment by a march.
fn summary(material: &Material) -> String {
    let mut text = materials::summary(material);
    if advances_enthalpy(material) {
        text += "  c_p is steep: steps advance the enthalpy, so that no peak is passed over\n";
    }
    if integrates_conductivity(material) {
        text += "  k is steep: heat flows by differences of its integral\n";
    }
    text
}
