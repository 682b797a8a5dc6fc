//! A gas file: `[molar_mass]`, `[viscosity]` and `[enthalpy]`.

use super::property::{choice, provenance, table};
use super::written::Written;
use crate::case::Gas;
use crate::case::error::Read;
use crate::case::unit::Dimension;

pub(super) fn gas(written: Written<'_>, id: String) -> Read<Gas> {
    let top = written.section()?;
    let name = top.required("name", "a title of the gas").and_then(Written::text);
    let note = top.text_or("note", "");
    let provenance = provenance(&top);
    let property = |key, dimension| {
        let section = top.required(key, "a table of the property")?.section()?;
        let table = table(&section, dimension);
        section.close();
        table
    };
    let molar_mass = property("molar_mass", Dimension::MolarMass);
    let viscosity = property("viscosity", Dimension::Viscosity);
    let enthalpy = top.required("enthalpy", "a table of the property").and_then(Written::section).and_then(|section| {
        let absolute = section.required("level", "sensible or absolute");
        let absolute = absolute.and_then(|_| choice(&section, "level", &[("sensible", false), ("absolute", true)]));
        let table = table(&section, Dimension::SpecificEnthalpy);
        section.close();
        let table = table?;
        section.require(Gas::check_enthalpy(&table))?;
        Ok((table, absolute?))
    });
    top.close();
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
