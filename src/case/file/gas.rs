//! A gas file, and how gas leaves a layup: `decomposition` and `[gas]` of a case.

use super::exposure::BackFace;
use super::folder::{Folder, shipped_gas, unknown_gas};
use super::property::{choice, provenance, table};
use super::written::{Section, Written};
use crate::case::error::{Place, Read};
use crate::case::library;
use crate::case::unit::Dimension;
use crate::case::{Gas, GasFlow, GasPath, Layup, Material, OutOfRange, Ply, PyrolysisHeat};
use std::sync::Arc;

/// What gas is taken where a case names none: made by plies, or blown through them.
const MADE: &str = "pyrolysis";
const BLOWN: &str = "air";

/// A gas, and whether its enthalpy is absolute: counted from the elements as that of the solid it is made of.
pub(super) struct Filed {
    pub(super) gas: Gas,
    absolute: bool,
}

pub(super) fn filed(written: Written<'_>, id: String) -> Read<Filed> {
    let top = written.section()?;
    let name = top.required("name", "what people call the gas").and_then(Written::text);
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
        // Held in its ends or refused beyond them: a line continued has a floor that is of no use below zero.
        if table.outside == OutOfRange::Extrapolate {
            return Err(section.fault("an enthalpy cannot be extrapolated: expected clamp or error"));
        }
        if let Some(at) = table.values.windows(2).position(|pair| pair[0] >= pair[1]) {
            let temperature_k = table.temperatures_k[at + 1];
            return Err(section.fault(format!("the enthalpy does not rise up to {temperature_k} K")));
        }
        Ok((table, absolute?))
    });
    top.close();
    let (enthalpy, absolute) = enthalpy?;
    let (name, note, molar_mass, viscosity) = (name?.to_owned(), note?, molar_mass?, viscosity?);
    let gas = Gas { id, name, note, molar_mass, enthalpy, viscosity, provenance: provenance? };
    Ok(Filed { gas, absolute })
}

/// The layup as the key `decomposition` has it: without it every ply stays as it was made.
pub(super) fn reacting(top: &Section<'_>, layup: Read<Layup>) -> Read<Layup> {
    let written = top.optional("decomposition");
    let reacts = written.map_or(Ok(false), Written::truth);
    let (mut layup, reacts) = (layup?, reacts?);
    if !reacts {
        layup.plies.iter_mut().for_each(|ply| ply.material = as_made(&ply.material));
    } else if !layup.plies.iter().any(makes_gas) {
        let fault = |written: Written<'_>| written.fault("no ply is of a material with a [decomposition]");
        return Err(written.map_or_else(|| top.fault("no ply decomposes"), fault));
    }
    Ok(layup)
}

/// A material that never changes.
pub(super) fn as_made(material: &Arc<Material>) -> Arc<Material> {
    match material.decomposition {
        Some(_) => Arc::new(Material { decomposition: None, ..Material::clone(material) }),
        None => material.clone(),
    }
}

fn makes_gas(ply: &Ply) -> bool {
    ply.material.decomposition.is_some()
}

/// How gas leaves the layup as marched; `None` where there is none that moves.
pub(super) fn flow(
    top: &Section<'_>,
    folder: &Folder<'_>,
    layup: Option<&Layup>,
    back: Option<&BackFace<'_>>,
) -> Read<Option<GasFlow>> {
    let made = layup.is_some_and(|layup| layup.plies.iter().any(makes_gas));
    let written = top.optional("gas");
    let section = written.map(Written::section).transpose()?;
    let back_pressure = back.and_then(|back| back.pressure.as_ref());
    let Some(section) = section else {
        let back_pressure = back_pressure.map_or(Ok(()), |(_, written)| Err(written.fault(UNDRIVEN)));
        return back_pressure.and_then(|()| if made { quiet(top, folder, layup).map(Some) } else { Ok(None) });
    };
    let known =
        [("quasi-steady", GasPath::QuasiSteady), ("unhindered", GasPath::Unhindered), ("darcy", GasPath::Darcy)];
    let path = choice(&section, "flow", &known);
    let named = section.optional("gas");
    let filed = match named {
        Some(written) => folder.gas(written),
        None => default(if made { MADE } else { BLOWN }, folder),
    };
    section.close();
    let (path, filed) = (path?, filed?);
    let Some(layup) = layup else {
        return Ok(None);
    };
    if !made && path != GasPath::Darcy {
        return Err(section.fault("no ply makes gas: expected `decomposition = true`, or `flow = \"darcy\"`"));
    }
    match back_pressure {
        Some((_, written)) if path != GasPath::Darcy => return Err(written.fault(UNDRIVEN)),
        _ => {}
    }
    if let Some(reason) = refused(layup, path, back_pressure.is_some()) {
        return Err(section.fault(reason));
    }
    let gas =
        levelled(filed, layup).map_err(|reason| named.map_or_else(|| section.fault(&reason), |w| w.fault(&reason)))?;
    Ok(Some(GasFlow { path, gas }))
}

const UNDRIVEN: &str = "a pressure drives gas by Darcy's law alone: expected [gas] with `flow = \"darcy\"`";

/// What a case with gas gets that says nothing of it.
fn quiet(top: &Section<'_>, folder: &Folder<'_>, layup: Option<&Layup>) -> Read<GasFlow> {
    let filed = default(MADE, folder)?;
    let layup = layup.map_or(Ok(filed.gas.clone()), |layup| levelled(filed, layup).map(Arc::unwrap_or_clone));
    let gas = layup.map_err(|reason| top.fault(format!("missing [gas]: {reason}")))?;
    Ok(GasFlow { path: GasPath::QuasiSteady, gas: Arc::new(gas) })
}

fn default(id: &str, folder: &Folder<'_>) -> Read<Filed> {
    let (id, text) = library::gas_text(id).ok_or_else(|| folder.faults.record(&Place::whole(id), unknown_gas(id)))?;
    shipped_gas(id, text, folder.faults)
}

/// The gas, unless its enthalpy counts from another level than that of a solid it is made of.
fn levelled(filed: Filed, layup: &Layup) -> Result<Arc<Gas>, String> {
    let absolute = |ply: &&Ply| {
        let decomposition = ply.material.decomposition.as_ref();
        decomposition.is_some_and(|decomposition| matches!(decomposition.heat, PyrolysisHeat::Absolute { .. }))
    };
    match layup.plies.iter().find(absolute) {
        Some(ply) if !filed.absolute => Err(format!(
            "gas {:?} has a sensible enthalpy, ply {:?} has absolute ones: expected a gas such as \"tacot\"",
            filed.gas.id, ply.name
        )),
        _ => Ok(Arc::new(filed.gas)),
    }
}

/// Why gas cannot take the path.
fn refused(layup: &Layup, path: GasPath, back_open: bool) -> Option<String> {
    if path != GasPath::Darcy {
        return None;
    }
    let plies = &layup.plies;
    if let Some(ply) = plies.iter().find(|ply| ply.material.pores_provenance.is_none()) {
        return Some(format!("nobody knows how gas passes ply {:?}: {:?} has no [pores]", ply.name, ply.material.id));
    }
    let makes = plies.iter().enumerate().filter(|(_, ply)| makes_gas(ply));
    makes.into_iter().find_map(|(index, ply)| {
        let above = plies[..=index].iter().rev().find(|ply| is_sealed(ply))?;
        let below = plies[index..].iter().find(|ply| is_sealed(ply));
        if back_open && below.is_none() {
            return None;
        }
        let (ply, seal) = (&ply.name, &above.name);
        let shut =
            if ply == seal { "nothing passes it".to_owned() } else { format!("nothing passes ply {seal:?} above it") };
        let back = if back_open { "the back is no way out either" } else { "the back is sealed" };
        Some(format!("ply {ply:?} makes gas that has no way out: {shut}, and {back}"))
    })
}

/// Whether a ply lets nothing through, as made or as char.
fn is_sealed(ply: &Ply) -> bool {
    let residues = ply.material.decomposition.iter().flat_map(|decomposition| &decomposition.residues);
    ply.material.pores.permeability_m2 == 0.0
        || residues.into_iter().any(|residue| residue.pores.permeability_m2 == 0.0)
}
