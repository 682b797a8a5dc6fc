//! Import of a table of properties over temperature, whose columns the analyst names.

use super::ImportRecord;
use super::material_text::{Property, provenance};
use crate::case::error::{Diagnostics, ReadResult, SourceLocation};
use crate::case::file::table_file::{ChosenColumn, Headings, TableChoice, TableFile};
use crate::case::input_files::InputFile;
use crate::case::unit::{Dimension, parse_quantity, unit_conversion};
use crate::case::{OutOfRange, Table, toml_string};
use crate::limits::{TABLE_FILE_MIB, read_file};
use std::path::Path;

/// The properties of a material in a table file. A property is the heading of its column, or a value with its unit.
#[derive(Clone, Copy, Debug)]
pub struct PropertyColumns<'a> {
    /// A value; without a unit in kg/m³.
    pub density: &'a str,
    /// Conductivity.
    pub conductivity: &'a str,
    /// Heat capacity.
    pub heat_capacity: &'a str,
    /// Emissivity.
    pub emissivity: &'a str,
}

/// The columns of a material in a table file.
#[derive(Clone, Copy, Debug)]
pub struct MaterialColumns<'a> {
    /// The heading of the temperatures.
    pub temperature: &'a str,
    /// The properties.
    pub properties: PropertyColumns<'a>,
    /// Headings and units of columns whose unit the file does not state, or states wrongly.
    pub units: &'a [(String, String)],
    /// Beyond the temperatures of the table.
    pub outside: OutOfRange,
}

pub(super) fn material_text(
    path: &Path,
    columns: &MaterialColumns<'_>,
    record: &ImportRecord<'_>,
    diagnostics: &Diagnostics,
) -> ReadResult<String> {
    let label = path.display().to_string();
    let bytes = read_file(path, &TABLE_FILE_MIB);
    let file = InputFile::new(label.clone(), bytes.as_deref().unwrap_or_default());
    let table = TableFile::read(
        bytes,
        &label,
        TableChoice::default(),
        Headings::Chosen(Some(columns.temperature)),
        diagnostics,
    )?;
    let reader = ColumnReader { table: &table, columns, diagnostics };
    let temperature = reader.column("temperature", columns.temperature, Dimension::Temperature, None);
    let unused = reader.check_units();
    let properties = &columns.properties;
    let density = reader.density(properties.density);
    let temperature = temperature?;
    let conductivity = reader.property("conductivity", properties.conductivity, temperature, Dimension::Conductivity);
    let heat_capacity =
        reader.property("heat_capacity", properties.heat_capacity, temperature, Dimension::HeatCapacity);
    let emissivity = reader.property("emissivity", properties.emissivity, temperature, Dimension::Fraction);
    unused?;
    let (conductivity, heat_capacity, emissivity) = (conductivity?, heat_capacity?, emissivity?);
    reader.check_outside([&conductivity, &heat_capacity, &emissivity])?;
    let provenance = provenance(record, &[file]);
    let section = |key: &str, property: &Property, dimension| {
        format!("\n[{key}]\n{}{provenance}", property.keys(dimension, columns.outside))
    };
    Ok([
        format!("# Written by `bondline materials import table`.\nname = {}\n", toml_string(record.name)),
        format!("\n[density]\nvalue = \"{} kg/m^3\"\n{provenance}", density?),
        section("heat_capacity", &heat_capacity, Dimension::HeatCapacity),
        section("conductivity", &conductivity, Dimension::Conductivity),
        section("emissivity", &emissivity, Dimension::Fraction),
    ]
    .concat())
}

/// Reads columns of a table that are named on the command line.
struct ColumnReader<'a> {
    table: &'a TableFile,
    columns: &'a MaterialColumns<'a>,
    diagnostics: &'a Diagnostics,
}

impl ColumnReader<'_> {
    /// The value, or the message of the rule recorded under the name of a choice.
    fn require<T>(&self, choice: &str, rule: Result<T, String>) -> ReadResult<T> {
        rule.map_err(|message| self.diagnostics.record(&SourceLocation::without_line(choice), message))
    }

    /// Every unit belongs to a column that is read.
    fn check_units(&self) -> ReadResult<()> {
        let PropertyColumns { conductivity, heat_capacity, emissivity, .. } = self.columns.properties;
        let read = [self.columns.temperature, conductivity, heat_capacity, emissivity];
        let read = read.map(|heading| self.table.find_column(heading, None).ok());
        self.columns.units.iter().try_for_each(|(heading, _)| {
            let index = self.require("unit", self.table.find_column(heading, None))?;
            let unread = || Err(format!("{heading:?} is the heading of a column that is not read"));
            self.require("unit", if read.contains(&Some(index)) { Ok(()) } else { unread() })
        })
    }

    /// Require a table if the rule for temperatures outside a table is stated.
    fn check_outside(&self, properties: [&Property; 3]) -> ReadResult<()> {
        let has_table = properties.iter().any(|property| matches!(property, Property::Table { .. }));
        let is_idle = !has_table && self.columns.outside != OutOfRange::Clamp;
        self.require(
            "outside",
            if is_idle { Err("no property is a table: every one is a value".to_owned()) } else { Ok(()) },
        )
    }

    /// A density with its unit, or in kg/m³.
    fn density(&self, text: &str) -> ReadResult<f64> {
        let text = if text.trim().parse::<f64>().is_ok() { format!("{text} kg/m^3") } else { text.to_owned() };
        let value = parse_quantity(&text, Dimension::Density);
        self.require("density", value.and_then(|value| Table::checked_value(value, Dimension::Density)))
    }

    /// The column of a heading. `hint` is added to the message if there is none.
    fn column(
        &self,
        choice: &str,
        heading: &str,
        dimension: Dimension,
        hint: Option<&str>,
    ) -> ReadResult<ChosenColumn> {
        let found = self.table.find_column(heading, None);
        let index = self.require(choice, found.map_err(|message| message + hint.unwrap_or_default()))?;
        let is_same = |other: &str| self.table.find_column(other, None) == Ok(index);
        let stated = self.columns.units.iter().find(|(other, _)| is_same(other));
        let conversion = stated.map(|(_, unit)| {
            self.require(
                "unit",
                unit_conversion(unit, dimension).map_err(|message| format!("{message}, found {unit:?}")),
            )
        });
        // A fraction without a unit is a number.
        let plain = (dimension == Dimension::Fraction && !self.table.has_unit(index)).then_some((1.0, 0.0));
        Ok(ChosenColumn { index, conversion: conversion.transpose()?.or(plain) })
    }

    /// A column over temperature, or a value.
    fn property(
        &self,
        choice: &str,
        text: &str,
        temperature: ChosenColumn,
        dimension: Dimension,
    ) -> ReadResult<Property> {
        if let Ok(value) = parse_quantity(text, dimension) {
            return self.require(choice, Table::checked_value(value, dimension)).map(Property::Constant);
        }
        let hint = format!(" (expected the heading of a column, or {})", dimension.name_and_example());
        let column = self.column(choice, text, dimension, Some(&hint))?;
        let (temperatures_k, values) =
            self.table.property_over_temperature(temperature, column, dimension, self.diagnostics)?;
        Ok(Property::Table { temperatures_k, values })
    }
}
