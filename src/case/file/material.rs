//! A material file: `[density]`, `[heat_capacity]`, `[conductivity]`, `[emissivity]` and optionally `[pores]` and
//! `[decomposition]`, each with its provenance.

use super::decomposition::{VirginProperties, decomposition};
use super::property::{self, provenance, table};
use super::spanned_toml::{TableReader, ValueReader};
use crate::case::error::ReadResult;
use crate::case::unit::Dimension;
use crate::case::{Conductivity, Material, Pores, Provenance, Table};

pub(super) fn material(written: ValueReader<'_>, id: String) -> ReadResult<Material> {
    let top = written.section()?;
    let name = top.required("name", "a title of the material").and_then(ValueReader::title);
    let note = top.text_or("note", "");
    let property = |key| top.required(key, "a table of the property").and_then(ValueReader::section);
    let density = property("density").and_then(|section| density(&section));
    let heat_capacity =
        property("heat_capacity").and_then(|section| table_with_provenance(&section, Dimension::HeatCapacity));
    // The density converts a specific extinction to an extinction coefficient.
    let density_kg_m3 = density.as_ref().map_or(1.0, |(density_kg_m3, _)| *density_kg_m3);
    let conductivity = property("conductivity").and_then(|section| conductivity(&section, density_kg_m3));
    let emissivity = property("emissivity").and_then(|section| table_with_provenance(&section, Dimension::Fraction));
    let pores = top.optional("pores").map(|written| pores(&written.section()?)).transpose();
    // Defaults replace wrong properties, so that the errors of the residues are reported too.
    let virgin = VirginProperties {
        density_kg_m3,
        heat_capacity: heat_capacity.as_ref().map_or_else(|_| Table::constant(1.0), |(table, _)| table.clone()),
        conductivity: conductivity
            .as_ref()
            .map_or_else(|_| placeholder_conductivity(), |(conductivity, _)| conductivity.clone()),
        emissivity: emissivity.as_ref().map_or_else(|_| Table::constant(1.0), |(table, _)| table.clone()),
        pores: pores.as_ref().ok().and_then(Option::as_ref).map_or(Pores::IMPERMEABLE, |(pores, _)| *pores),
    };
    let reacting = top.optional("decomposition");
    let decomposition = reacting.map(|written| decomposition(&written.section()?, &virgin)).transpose();
    top.deny_unknown_keys();
    let (density_kg_m3, density_provenance) = density?;
    let (heat_capacity, heat_capacity_provenance) = heat_capacity?;
    let (conductivity, conductivity_provenance) = conductivity?;
    let (emissivity, emissivity_provenance) = emissivity?;
    let (pores, pores_provenance) = pores?.unzip();
    Ok(Material {
        id,
        name: name?.to_owned(),
        note: note?,
        density_kg_m3,
        density_provenance,
        heat_capacity,
        heat_capacity_provenance,
        conductivity,
        conductivity_provenance,
        emissivity,
        emissivity_provenance,
        pores: pores.unwrap_or(Pores::IMPERMEABLE),
        pores_provenance,
        decomposition: decomposition?,
    })
}

fn density(section: &TableReader<'_>) -> ReadResult<(f64, Provenance)> {
    let value = section.positive("value", Dimension::Density);
    let provenance = provenance(section);
    section.deny_unknown_keys();
    Ok((value?, provenance?))
}

fn table_with_provenance(section: &TableReader<'_>, dimension: Dimension) -> ReadResult<(Table, Provenance)> {
    let table = table(section, dimension);
    let provenance = provenance(section);
    section.deny_unknown_keys();
    Ok((table?, provenance?))
}

fn conductivity(section: &TableReader<'_>, density_kg_m3: f64) -> ReadResult<(Conductivity, Provenance)> {
    let conductivity = property::conductivity(section, density_kg_m3);
    let provenance = provenance(section);
    section.deny_unknown_keys();
    Ok((conductivity?, provenance?))
}

fn pores(section: &TableReader<'_>) -> ReadResult<(Pores, Provenance)> {
    let pores = property::pores(section, None);
    let provenance = provenance(section);
    section.deny_unknown_keys();
    Ok((pores?, provenance?))
}

fn placeholder_conductivity() -> Conductivity {
    Conductivity::Tables(vec![(101_325.0, Table::constant(1.0))])
}
