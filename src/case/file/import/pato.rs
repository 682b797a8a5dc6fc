//! Import of a material of PATO (NASA's Porous material Analysis Toolbox based on OpenFOAM): `constantProperties`, and
//! tables `virgin` and `char` of p, T, c_p, h, k_i, k_j, k_k, emissivity and absorptivity, all in SI.
//!
//! Solid phase *i* has the volume fraction ε_i and the intrinsic density ρ_i; its reaction *j* turns the share F_ij of
//! its mass into gas at the rate A (1 − ξ)^m T^n e^(−E/RT) above T_ij (Lachaud et al., Int. J. Heat Mass Transfer 90,
//! 2015). Its mass loss of the whole is thus F_ij ε_i ρ_i / Σ ε ρ.
//!
//! The heat of pyrolysis is in the files twice. The enthalpies h of the tables include the heat of formation, which the
//! balance of PATO uses by default (that of CMA and FIAT); h[i][j] of the reactions belongs to its other balance, by
//! the sensible enthalpies of the solid. Both together would count the heat twice, so that one is chosen
//! ([`PatoHeat`]). h[i][j] is the heat *released* per mass of gas: an endothermic reaction has a negative number, where
//! the key `heat` of a material file is positive. The number counts, not its comment: beside the −4e6 of TACOT the file
//! says that TACOT_3.0.xls, which has −2e6, is wrong by a factor of two.

mod dictionary;
mod state_table;

use super::ImportRecord;
use super::material_text::{Property, provenance};
use crate::case::OutOfRange;
use crate::case::error::{Diagnostics, ReadResult, SourceLocation};
use crate::case::file::text_file::decode_text_file;
use crate::case::input_files::InputFile;
use crate::case::toml_string;
use crate::case::unit::Dimension;
use crate::limits::{REACTIONS, TEXT_FILE_MIB, read_file};
use dictionary::Dictionary;
use state_table::StateTable;
use std::path::Path;

/// Reference temperature of absolute enthalpies, K, if the tables include it.
const REFERENCE_K: f64 = 298.0;

/// The largest number of solid phases.
const MAX_PHASES: usize = 64;

/// The heat of pyrolysis that is imported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PatoHeat {
    /// Enthalpies of the tables, with the heat of formation.
    Absolute,
    /// Heats of the reactions.
    OfReaction,
}

/// The choices that the files leave open.
#[derive(Clone, Copy, Debug)]
pub struct PatoOptions {
    /// The heat of pyrolysis.
    pub heat: PatoHeat,
    /// The direction through the thickness: 0, 1 or 2 for i, j or k. Needed if a property depends on it.
    pub direction: Option<usize>,
}

/// A reaction of a phase.
struct PatoReaction {
    /// `2][1`, the indices of phase and reaction.
    place: String,
    mass_loss: f64,
    pre_exponential_1_s: f64,
    activation_energy_j_mol: f64,
    order: f64,
    onset_k: f64,
    released_j_kg: f64,
    /// The remark of the file on the heat.
    remark: Option<String>,
}

/// Porosity, permeability and Forchheimer coefficient of a state.
struct PatoPores {
    porosity: f64,
    permeability_m2: f64,
    forchheimer_1_m: f64,
}

pub(super) fn material_text(
    folder: &Path,
    options: &PatoOptions,
    record: &ImportRecord<'_>,
    diagnostics: &Diagnostics,
) -> ReadResult<String> {
    let mut files = Vec::new();
    let mut read = |name: &str| {
        let label = folder.join(name).display().to_string();
        let bytes = read_file(&folder.join(name), &TEXT_FILE_MIB);
        files.push(InputFile::new(label.clone(), bytes.as_deref().unwrap_or_default()));
        decode_text_file(bytes, &label, &TEXT_FILE_MIB, diagnostics).map(|text| (label, text))
    };
    let constants = read("constantProperties").and_then(|(label, text)| Dictionary::parse(&text, &label, diagnostics));
    let virgin = read("virgin").and_then(|(label, text)| StateTable::parse(&text, &label, diagnostics));
    let constants = constants?;
    let (density_kg_m3, reactions) = phases(&constants)?;
    if reactions.is_empty() && options.heat != PatoHeat::Absolute {
        let place = SourceLocation::without_line("heat");
        return Err(diagnostics.record(&place, "the material has no reaction whose heat could be taken"));
    }
    let char = if reactions.is_empty() {
        None
    } else {
        Some(read("char").and_then(|(label, text)| StateTable::parse(&text, &label, diagnostics)))
    };
    let (virgin, char) = (virgin?, char.transpose()?);
    let direction = direction(&constants, options)?;
    let coefficient = conductivity_coefficient(&constants, direction)?;
    let conductivity = |table: &StateTable| table.conductivity(direction, coefficient, diagnostics);
    let (virgin_pores, char_pores) = (pores(&constants, "v", direction)?, pores(&constants, "c", direction)?);
    let [virgin_k, char_k] = [Some(&virgin), char.as_ref()].map(|table| table.map(conductivity).transpose());
    let (virgin_k, char_k) = (virgin_k?.unwrap_or_default(), char_k?.unwrap_or_default());

    let provenance = provenance(record, &files);
    let section = |key: &str, keys: &str| format!("\n[{key}]\n{keys}{provenance}");
    let mut text = format!("# Written by `bondline materials import pato`.\nname = {}\n", toml_string(record.name));
    text += &section("density", &format!("value = \"{density_kg_m3} kg/m^3\"\n"));
    text += &section("heat_capacity", &virgin.heat_capacity(diagnostics)?.keys(Dimension::HeatCapacity, OUTSIDE));
    text += &conductivity_text("conductivity", &virgin_k, &provenance);
    text += &section("emissivity", &virgin.emissivity(diagnostics)?.keys(Dimension::Fraction, OUTSIDE));
    if let Some(pores) = &virgin_pores {
        text += &section("pores", &pores_keys(pores));
    }
    let Some(char) = char else { return Ok(text) };
    let heat = heat_text(options.heat, &virgin, &char, diagnostics)?;
    text +=
        &section("decomposition", &format!("reaction_scheme = \"parallel\"\nmixture_rule = \"mass\"\n{}", heat.keys));
    text += &reactions.iter().map(|reaction| reaction_text(reaction, options.heat)).collect::<String>();
    let left = 1.0 - reactions.iter().map(|reaction| reaction.mass_loss).sum::<f64>();
    text += &format!("\n[decomposition.char]\ndensity = \"{} kg/m^3\"\n{}", density_kg_m3 * left, heat.of_char);
    text += &format!(
        "\n[decomposition.char.heat_capacity]\n{}",
        char.heat_capacity(diagnostics)?.keys(Dimension::HeatCapacity, OUTSIDE)
    );
    text += &conductivity_text("decomposition.char.conductivity", &char_k, "");
    text += &format!(
        "\n[decomposition.char.emissivity]\n{}",
        char.emissivity(diagnostics)?.keys(Dimension::Fraction, OUTSIDE)
    );
    if let (Some(_), Some(pores)) = (&virgin_pores, &char_pores) {
        text += &format!("\n[decomposition.char.pores]\n{}", pores_keys(pores));
    }
    Ok(text)
}

/// PATO refuses to leave its tables.
const OUTSIDE: OutOfRange = OutOfRange::Error;

/// Virgin density, and the reactions of all phases.
fn phases(constants: &Dictionary<'_>) -> ReadResult<(f64, Vec<PatoReaction>)> {
    let count = constants.count("nSolidPhases", MAX_PHASES)?;
    let mut masses_kg_m3 = Vec::new();
    for phase in 1..=count {
        let density_kg_m3 = constants.positive(&format!("rhoI[{phase}]"))?;
        masses_kg_m3.push(density_kg_m3 * constants.positive(&format!("epsI[{phase}]"))?);
    }
    let density_kg_m3: f64 = masses_kg_m3.iter().sum();
    let mut reactions = Vec::new();
    for (phase, mass_kg_m3) in (1..).zip(&masses_kg_m3) {
        let key = format!("nPyroReac[{phase}]");
        let of_phase = if constants.has(&key) { constants.count(&key, REACTIONS.max as usize)? } else { 0 };
        for reaction in 1..=of_phase {
            let place = format!("{phase}][{reaction}");
            let key = |name: &str| format!("{name}[{place}]");
            let exponent = constants.number_or(&key("n"), 0.0)?;
            if exponent != 0.0 {
                let message = format!("expected 0, found {exponent}: the rate of a material file has no factor T^n");
                return Err(constants.error(&key("n"), message));
            }
            reactions.push(PatoReaction {
                mass_loss: constants.positive(&key("F"))? * mass_kg_m3 / density_kg_m3,
                pre_exponential_1_s: constants.positive(&key("A"))?,
                activation_energy_j_mol: constants.number(&key("E"))?,
                order: constants.number(&key("m"))?,
                onset_k: constants.number_or(&key("T"), 0.0)?,
                released_j_kg: constants.number_or(&key("h"), 0.0)?,
                remark: constants.remark(&key("h")),
                place,
            });
        }
    }
    Ok((density_kg_m3, reactions))
}

/// The direction through the thickness. A material whose directions are not those of the mesh is refused.
fn direction(constants: &Dictionary<'_>, options: &PatoOptions) -> ReadResult<Option<usize>> {
    let Some(direction) = options.direction else { return Ok(None) };
    if constants.has("tP") && constants.tensor("tP")? != [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0] {
        return Err(constants.error("tP", "expected the unit matrix: the material is rotated against the mesh"));
    }
    Ok(Some(direction))
}

/// The factor of the conductivities in a direction.
fn conductivity_coefficient(constants: &Dictionary<'_>, direction: Option<usize>) -> ReadResult<f64> {
    const KEYS: [&str; 3] = ["kiCoef", "kjCoef", "kkCoef"];
    let [i, j, k] = KEYS.map(|key| constants.number_or(key, 1.0));
    let coefficients = [i?, j?, k?];
    match direction {
        Some(direction) => Ok(coefficients[direction]),
        None if coefficients == [coefficients[0]; 3] => Ok(coefficients[0]),
        None => {
            let first = KEYS.into_iter().find(|key| constants.has(key)).unwrap_or(KEYS[0]);
            let [i, j, k] = coefficients;
            let message = format!(
                "the factors {i}, {j} and {k} of the conductivities differ: state the direction \
                                   through the thickness"
            );
            Err(constants.error(first, message))
        }
    }
}

/// The pores of a state, `v` or `c`; `None` if the file has no permeability of it.
fn pores(constants: &Dictionary<'_>, state: &str, direction: Option<usize>) -> ReadResult<Option<PatoPores>> {
    let key = |name: &str| format!("{name}_{state}");
    if !constants.has(&key("K")) {
        return Ok(None);
    }
    let along = |name: &str| constants.diagonal(&key(name), direction);
    Ok(Some(PatoPores {
        porosity: constants.positive(&key("eps_g"))?,
        permeability_m2: along("K")?,
        forchheimer_1_m: if constants.has(&key("Beta")) { along("Beta")? } else { 0.0 },
    }))
}

fn pores_keys(pores: &PatoPores) -> String {
    let PatoPores { porosity, permeability_m2, forchheimer_1_m } = pores;
    format!(
        "porosity = {porosity}\npermeability = \"{permeability_m2:e} m^2\"\n\
         forchheimer_coefficient = \"{forchheimer_1_m:e} 1/m\"\n"
    )
}

/// A table, or one for each pressure.
fn conductivity_text(key: &str, tables: &[(f64, Property)], provenance: &str) -> String {
    let keys = |property: &Property| property.keys(Dimension::Conductivity, OUTSIDE);
    match tables {
        [(_, table)] => format!("\n[{key}]\n{}{provenance}", keys(table)),
        several => {
            let at = |(pressure_pa, table): &(f64, Property)| {
                format!("\n[[{key}.at]]\npressure = \"{pressure_pa} Pa\"\n{}", keys(table))
            };
            format!("\n[{key}]\n{provenance}{}", several.iter().map(at).collect::<String>())
        }
    }
}

/// The keys of the heat of pyrolysis of `[decomposition]`, and that of the char.
struct HeatText {
    keys: String,
    of_char: String,
}

fn heat_text(
    heat: PatoHeat,
    virgin: &StateTable,
    char: &StateTable,
    diagnostics: &Diagnostics,
) -> ReadResult<HeatText> {
    if heat == PatoHeat::OfReaction {
        let remark = "# Heats of reaction: the enthalpies of virgin and char, with the heat of formation, are not\n\
                      # imported, as both would count the heat of pyrolysis twice.\n";
        return Ok(HeatText { keys: format!("{remark}heat = \"of-reaction\"\n"), of_char: String::new() });
    }
    let (low_k, high_k) = virgin.range_k();
    let reference_k = if (low_k..=high_k).contains(&REFERENCE_K) { REFERENCE_K } else { low_k };
    let (virgin_j_kg, char_j_kg) = (virgin.enthalpy_j_kg(reference_k), char.enthalpy_j_kg(reference_k));
    if virgin_j_kg == char_j_kg {
        let message = format!(
            "virgin and char have the same enthalpy at {reference_k} K, {virgin_j_kg} J/kg: expected different heats \
             of formation, or the heat \"of-reaction\""
        );
        return Err(diagnostics.record(&SourceLocation::without_line(virgin.label()), message));
    }
    let drift = |name: &str, table: &StateTable| {
        let (drift_j_kg, at_k) = table.enthalpy_drift(reference_k);
        format!("# {name}: h of the table and the integral of c_p differ by up to {drift_j_kg:.0} J/kg, at {at_k} K.\n")
    };
    let keys = format!(
        "# Enthalpies with the heat of formation: h of the reactions is not imported, as both would count the heat of\n\
         # pyrolysis twice. A gas with absolute enthalpies belongs to this material.\n{}{}heat = \"absolute\"\n\
         virgin_enthalpy = \"{virgin_j_kg} J/kg\"\nreference = \"{reference_k} K\"\n",
        drift("Virgin material", virgin),
        drift("Char", char),
    );
    Ok(HeatText { keys, of_char: format!("enthalpy = \"{char_j_kg} J/kg\"\n") })
}

fn reaction_text(reaction: &PatoReaction, heat: PatoHeat) -> String {
    let PatoReaction { place, mass_loss, pre_exponential_1_s, activation_energy_j_mol, order, onset_k, .. } = reaction;
    let mut text = format!(
        "\n# Reaction [{place}].\n[[decomposition.reaction]]\nmass_loss = {mass_loss}\n\
         pre_exponential = \"{pre_exponential_1_s:e} 1/s\"\nactivation_energy = \"{activation_energy_j_mol} J/mol\"\n\
         order = {order}\n"
    );
    if *onset_k > 0.0 {
        text += &format!("onset_temperature = \"{onset_k} K\"\n");
    }
    if heat == PatoHeat::OfReaction {
        let released_j_kg = reaction.released_j_kg;
        text += &format!("# h = {released_j_kg} J/kg is the heat released per mass of gas; heat is taken up.\n");
        if let Some(remark) = &reaction.remark {
            text += &format!("# The remark of the file is not used: {remark:?}\n");
        }
        // Zero stays without a sign.
        text += &format!("heat = \"{} J/kg\"\n", 0.0 - released_j_kg);
    }
    text
}

#[cfg(test)]
mod tests;
