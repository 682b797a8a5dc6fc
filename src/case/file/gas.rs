//! A gas file: `[molar_mass]`, `[viscosity]` and `[enthalpy]`.

use super::property::{keyword, provenance, table};
use super::spanned_toml::ValueReader;
use crate::case::Gas;
use crate::case::error::ReadResult;
use crate::case::unit::Dimension;

pub(super) fn gas(written: ValueReader<'_>, id: String) -> ReadResult<Gas> {
    let top = written.section()?;
    let name = top.required("name", "a title of the gas").and_then(ValueReader::title);
    let note = top.text_or("note", "");
    let provenance = provenance(&top);
    let property = |key, dimension| {
        let section = top.required(key, "a table of the property")?.section()?;
        let table = table(&section, dimension);
        section.deny_unknown_keys();
        table
    };
    let molar_mass = property("molar_mass", Dimension::MolarMass);
    let viscosity = property("viscosity", Dimension::Viscosity);
    let enthalpy =
        top.required("enthalpy", "a table of the property").and_then(ValueReader::section).and_then(|section| {
            let absolute = section.required("kind", "sensible or absolute");
            let absolute = absolute.and_then(|_| keyword(&section, "kind", &[("sensible", false), ("absolute", true)]));
            let table = table(&section, Dimension::SpecificEnthalpy);
            section.deny_unknown_keys();
            let table = table?;
            section.require(Gas::check_enthalpy(&table))?;
            Ok((table, absolute?))
        });
    top.deny_unknown_keys();
    let (enthalpy, enthalpy_is_absolute) = enthalpy?;
    Ok(Gas {
        id,
        name: name?.to_owned(),
        note: note?,
        molar_mass: molar_mass?,
        enthalpy,
        enthalpy_is_absolute,
        viscosity: viscosity?,
        provenance: provenance?,
    })
}
