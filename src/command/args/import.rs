//! Options of `materials import`.

use super::{DirectionArg, OutsideArg, PatoHeatArg};
use clap::{Args, Subcommand};
use std::path::PathBuf;

/// The kinds of files that a material is imported from.
#[derive(Debug, Subcommand)]
pub enum ImportCommand {
    /// A material file from columns of a table over temperature
    #[command(
        after_long_help = super::examples::MATERIALS_IMPORT_TABLE,
        override_usage = "bondline materials import table <FILE> --name <NAME> --out <OUT> <COLUMNS> [OPTIONS]"
    )]
    Table(TableArgs),
    /// A material file from a material of PATO: constantProperties, virgin and char
    #[command(after_long_help = super::examples::MATERIALS_IMPORT_PATO)]
    Pato(PatoArgs),
}

/// The table, and its columns. A property is the heading of its column, or a value with its unit.
#[derive(Debug, Args)]
pub struct TableArgs {
    /// The table file
    pub file: PathBuf,
    /// Heading of the temperatures, as "T [K]"
    #[arg(long)]
    pub temperature: String,
    /// Density: a value such as "24 lb/ft^3"; without a unit in kg/m^3
    #[arg(long)]
    pub density: String,
    /// Conductivity: a heading such as "k (W/m/K)", or a value
    #[arg(long)]
    pub conductivity: String,
    /// Heat capacity: a heading, or a value such as "900 J/kg/K"
    #[arg(long)]
    pub heat_capacity: String,
    /// Emissivity: a heading, or a value such as 0.85
    #[arg(long)]
    pub emissivity: String,
    /// Unit of a column, which replaces that of the file; may be repeated
    #[arg(long = "unit", value_name = "HEADING=UNIT")]
    pub units: Vec<String>,
    /// Beyond the temperatures of the table
    #[arg(long, value_enum, default_value = "clamp")]
    pub outside: OutsideArg,
    #[command(flatten)]
    pub record: RecordArgs,
}

/// The folder, and the choices that its files leave open.
#[derive(Debug, Args)]
pub struct PatoArgs {
    /// The folder with constantProperties, virgin and char
    pub folder: PathBuf,
    /// The heat of pyrolysis, which the files have twice
    #[arg(long, value_enum, default_value = "absolute")]
    pub heat: PatoHeatArg,
    /// Direction through the thickness; needed if a property depends on it
    #[arg(long, value_enum)]
    pub direction: Option<DirectionArg>,
    #[command(flatten)]
    pub record: RecordArgs,
}

/// The output, its title and its marks.
#[derive(Debug, Args)]
pub struct RecordArgs {
    /// Title of the material
    #[arg(long)]
    pub name: String,
    /// The material file to write, such as materials/my_felt.toml in the folder of a case
    #[arg(long)]
    pub out: PathBuf,
    /// Overwrite the file
    #[arg(long)]
    pub force: bool,
    /// Mark of every property: read, remembered, estimated, paper or measured [default: not stated]
    #[arg(long, requires = "source", requires = "uncertainty")]
    pub mark: Option<String>,
    /// The publication, or the report with its number; the names and checksums of the files are added
    #[arg(long)]
    pub source: Option<String>,
    /// Uncertainty of every property at 95 %, such as "10 %"
    #[arg(long, requires = "mark")]
    pub uncertainty: Option<String>,
}
