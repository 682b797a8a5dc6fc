//! Import of a table of properties.

use super::Scratch;
use crate::case::{
    Conductivity, ImportRecord, ImportedMaterial, MaterialColumns, OutOfRange, PropertyColumns, SourceKind, Table,
};

const FELT: &str = include_str!("../../../../data/import/felt.csv");
const RECORD: ImportRecord<'_> = ImportRecord { name: "My \"felt\"", date: "2026-11-24", mark: None, source: None };
/// A table, the properties and units that are named, and a part of the message.
type Fault<'a> = (&'a str, PropertyColumns<'a>, &'a [(&'a str, &'a str)], &'a str);

const PROPERTIES: PropertyColumns<'_> =
    PropertyColumns { density: "120", conductivity: "k [W/m/K]", heat_capacity: "cp", emissivity: "0.85" };

fn import(
    name: &str,
    text: &str,
    properties: PropertyColumns<'_>,
    units: &[(&str, &str)],
) -> Result<ImportedMaterial, String> {
    let scratch = Scratch::new(name);
    let units: Vec<(String, String)> = units.iter().map(|&(name, unit)| (name.to_owned(), unit.to_owned())).collect();
    let columns = MaterialColumns { temperature: "T", properties, units: &units, outside: OutOfRange::Clamp };
    let path = scratch.write("felt.csv", text);
    ImportedMaterial::from_table(&path, &columns, &RECORD).map_err(|error| error.to_string())
}

#[test]
fn named_columns_and_values_become_a_material_file_that_can_be_read_again() {
    let imported = import("import", FELT, PROPERTIES, &[("cp", "J/kg/K")]).unwrap_or_else(|error| panic!("{error}"));
    let material = imported.material;
    assert_eq!((material.name.as_str(), material.density_kg_m3), ("My \"felt\"", 120.0));
    let conductivity =
        Table::new(vec![300.0, 500.0, 800.0, 1100.0], vec![0.035, 0.052, 0.098, 0.176], OutOfRange::Clamp);
    let Conductivity::Tables(tables) = &material.conductivity else { panic!("tables") };
    assert_eq!(Ok(&tables[0].1), conductivity.as_ref());
    // The row without a heat capacity is left out of it alone.
    assert_eq!(material.heat_capacity.temperatures_k, [300.0, 500.0, 1100.0]);
    assert_eq!(material.emissivity, Table::constant(0.85));
    assert_eq!(material.density_provenance.source_kind, SourceKind::NotStated);
    let source = &material.conductivity_provenance.source;
    assert!(source.contains("imported on 2026-11-24 from") && source.contains("felt.csv, SHA-256 "), "{source}");
}

#[test]
fn columns_in_other_units_are_converted_with_or_without_a_stated_unit() {
    let text = "some logger\nT (degR);k;cp\n540;1e-5;0,2\n1080;2e-5;0,25\n";
    let properties = PropertyColumns { density: "7.5 lb/ft^3", conductivity: "k", ..PROPERTIES };
    let units = [("k", "BTU/ft-s-R"), ("cp", "BTU/lb-R")];
    let material = import("units", text, properties, &units).unwrap_or_else(|error| panic!("{error}")).material;
    let Conductivity::Tables(tables) = &material.conductivity else { panic!("tables") };
    let close = |found: f64, expected: f64| (found / expected - 1.0).abs() < 1e-12;
    assert!(close(tables[0].1.temperatures_k[1], 600.0) && close(tables[0].1.values[0], 0.06230644798937));
    assert!(close(material.heat_capacity.values[1], 1046.7) && close(material.density_kg_m3, 120.138475304701));
}

#[test]
fn a_mark_is_kept_with_its_source_and_uncertainty() {
    let of = |source: &str| {
        let scratch = Scratch::new(&format!("marked-{}", source.len()));
        let units = [("cp".to_owned(), "J/kg/K".to_owned())];
        let columns =
            MaterialColumns { temperature: "T", properties: PROPERTIES, units: &units, outside: OutOfRange::Error };
        let record = ImportRecord { mark: Some((SourceKind::Measured, "10 %")), source: Some(source), ..RECORD };
        ImportedMaterial::from_table(&scratch.write("felt.csv", FELT), &columns, &record)
    };
    let material = of("TR-2031").unwrap_or_else(|error| panic!("{error}")).material;
    assert_eq!(material.emissivity_provenance.source_kind, SourceKind::Measured);
    assert!(material.emissivity_provenance.source.starts_with("TR-2031; imported on"));
    assert_eq!(material.emissivity_provenance.relative_uncertainty, Some(0.05));
    assert_eq!(material.heat_capacity.outside, OutOfRange::Error);
}

#[test]
fn faults_of_the_table_and_of_the_choice_are_refused() {
    let cp: &[(&str, &str)] = &[("cp", "J/kg/K")];
    let wrong: &[Fault<'_>] = &[
        (FELT, PROPERTIES, &[], "felt.csv:1:17: missing unit in heading \"cp\": expected a heading with a unit"),
        (FELT, PROPERTIES, &[("cp", "J/kg")], "wrong dimension: expected a heat capacity"),
        (FELT, PROPERTIES, &[("cp", "J/kg/K"), ("c", "K")], "felt.csv has no column \"c\": known: cp"),
        (
            FELT,
            PROPERTIES,
            &[("cp", "J/kg/K"), ("remark", "K")],
            "\"remark\" is the heading of a column that is not read",
        ),
        (
            FELT,
            PropertyColumns { conductivity: "k2", ..PROPERTIES },
            cp,
            "(expected the heading of a column, or a conductivity such as",
        ),
        (FELT, PropertyColumns { density: "0 kg/m^3", ..PROPERTIES }, cp, "density: expected a value above 0"),
        (FELT, PropertyColumns { density: "120 kg", ..PROPERTIES }, cp, "wrong dimension: expected a density"),
        (FELT, PropertyColumns { emissivity: "1.2", ..PROPERTIES }, cp, "expected a value from 0 to 1, found 1.2"),
        (FELT, PropertyColumns { heat_capacity: "remark", ..PROPERTIES }, cp, "\"remark\""),
        ("T [K],k [W/m/K],cp\n300,1,1\n299,1,1\n", PROPERTIES, cp, "felt.csv:3:1: expected a temperature above 300 K"),
        ("T [K],k [W/m/K],cp\n300,-1,1\n", PROPERTIES, cp, "felt.csv:2:5: expected a value above 0"),
        ("T [K],k [W/m/K],cp\n300,x,1\n", PROPERTIES, cp, "felt.csv:2:5: "),
        ("temp [K],k [W/m/K],cp\n300,1,1\n", PROPERTIES, cp, "felt.csv has no column \"T\""),
    ];
    for (index, &(text, properties, units, expected)) in wrong.iter().enumerate() {
        let message = import(&format!("import-{index}"), text, properties, units).expect_err(expected);
        assert!(message.contains(expected), "{expected}: {message}");
    }
}
