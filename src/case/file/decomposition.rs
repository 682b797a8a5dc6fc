//! `[decomposition]` of a material file: reactions and residues.

use super::property::{choice, conductivity, pores, provenance, table};
use super::written::{Section, Written, all};
use crate::case::error::Read;
use crate::case::unit::Dimension;
use crate::case::{Conductivity, Decomposition, Mixing, Pores, PyrolysisHeat, Reaction, Residue, Sequence, Table};

/// Relative tolerance of a stated density of a residue, for numbers rounded to three digits.
const SAME_DENSITY: f64 = 5e-3;

/// Properties of the virgin material, which residues inherit.
pub(super) struct Virgin {
    pub(super) density_kg_m3: f64,
    pub(super) heat_capacity: Table,
    pub(super) conductivity: Conductivity,
    pub(super) emissivity: Table,
    pub(super) pores: Pores,
}

pub(super) fn decomposition(section: &Section<'_>, virgin: &Virgin) -> Read<Decomposition> {
    let sequence = choice(section, "sequence", &[("side-by-side", Sequence::SideBySide), ("chain", Sequence::Chain)]);
    let mixing = choice(section, "mixing", &[("mass", Mixing::Mass), ("volume", Mixing::Volume)]);
    let absolute = choice(section, "heat", &[("of-reaction", false), ("absolute", true)]);
    let shrinkage = section.optional("shrinkage").map_or(Ok(0.0), shrinkage);
    let provenance = provenance(section);
    let (sequence, absolute) = (sequence?, absolute?);
    let reactions = reactions(section, sequence, absolute, virgin.density_kg_m3);
    let levels = absolute.then(|| levels(section));
    let residues = residues(section, sequence, absolute, virgin, reactions.as_deref().ok());
    section.close();
    let (reactions, (residues, residues_j_kg)) = (reactions?, residues?);
    let heat = match levels.transpose()? {
        Some((virgin_j_kg, reference_k)) => PyrolysisHeat::Absolute { virgin_j_kg, residues_j_kg, reference_k },
        None => PyrolysisHeat::OfReaction,
    };
    let (mixing, shrinkage, provenance) = (mixing?, shrinkage?, provenance?);
    Ok(Decomposition { reactions, sequence, residues, mixing, heat, shrinkage, provenance })
}

fn shrinkage(written: Written<'_>) -> Read<f64> {
    written.require(Decomposition::checked_shrinkage(written.quantity(Dimension::Fraction)?))
}

/// Absolute enthalpy of the virgin material, J/kg, and its reference temperature, K.
fn levels(section: &Section<'_>) -> Read<(f64, f64)> {
    let virgin = section.required("virgin_enthalpy", "the absolute enthalpy of the virgin material at `reference`");
    let virgin_j_kg = virgin.and_then(|written| written.quantity(Dimension::SpecificEnthalpy));
    let reference = section.required("reference", "the temperature of the enthalpies, such as \"298 K\"");
    let reference_k = reference.and_then(|written| written.quantity(Dimension::Temperature));
    Ok((virgin_j_kg?, reference_k?))
}

fn reactions(section: &Section<'_>, sequence: Sequence, absolute: bool, density_kg_m3: f64) -> Read<Vec<Reaction>> {
    let sections = section.tables("reaction")?;
    if sections.is_empty() {
        return Err(section.fault("no reaction: expected at least one [[decomposition.reaction]]"));
    }
    let reactions = all(sections.iter().map(|section| reaction(section, sequence, absolute, density_kg_m3)))?;
    section.require(Decomposition::leave_char(&reactions)).map(|()| reactions)
}

fn reaction(section: &Section<'_>, sequence: Sequence, absolute: bool, density_kg_m3: f64) -> Read<Reaction> {
    let order = section.required("order", "the order of the reaction, such as 1").and_then(order);
    let loss = match section.optional("loss") {
        Some(written) => loss(written).map(|loss| (loss, 1.0)),
        None if sequence == Sequence::Chain => {
            Err(section.fault("missing key \"loss\": expected the mass loss of each reaction of a chain, such as 0.3"))
        }
        None => component(section, density_kg_m3),
    };
    let rate_1_s = section.positive("rate", Dimension::Rate);
    let activation = section.required("activation", Dimension::MolarEnergy.expectation()).and_then(activation);
    let onset_k = section.optional("onset").map_or(Ok(0.0), |written| written.quantity(Dimension::Temperature));
    let heat_j_kg = match section.optional("heat") {
        Some(written) if absolute => Err(written.fault(PyrolysisHeat::NONE_OF_REACTION)),
        Some(written) => written.quantity(Dimension::SpecificEnthalpy),
        None if absolute => Ok(0.0),
        None => {
            Err(section.fault("missing key \"heat\": expected the heat absorbed per mass of gas, such as \"1 MJ/kg\""))
        }
    };
    section.close();
    let (order, (loss, remainder)) = (order?, loss?);
    Ok(Reaction {
        loss,
        rate_1_s: rate_1_s? * remainder.powf(order - 1.0),
        activation_j_mol: activation?,
        order,
        onset_k: onset_k?,
        heat_j_kg: heat_j_kg?,
    })
}

fn loss(written: Written<'_>) -> Read<f64> {
    written.require(Reaction::checked_loss(written.quantity(Dimension::Fraction)?))
}

/// Mass loss of a component as in CMA and FIAT, given by its volume share and its densities, and its reactive fraction
/// (ρ_v − ρ_c)/ρ_v. With ξ = (ρ_v − ρ)/(ρ_v − ρ_c) the rate constant becomes A ((ρ_v − ρ_c)/ρ_v)^(m−1).
fn component(section: &Section<'_>, density_kg_m3: f64) -> Read<(f64, f64)> {
    let share = section.required("volume_share", "a key `loss`, or the volume share of a component");
    let share = share.and_then(|written| written.positive(Dimension::Fraction));
    let virgin_kg_m3 = section.positive("virgin_density", Dimension::Density);
    let left = section.required("char_density", Dimension::Density.expectation());
    let char_kg_m3 = left.and_then(|written| written.not_negative(Dimension::Density));
    let (share, virgin_kg_m3, char_kg_m3) = (share?, virgin_kg_m3?, char_kg_m3?);
    if char_kg_m3 >= virgin_kg_m3 {
        let message = format!("expected a char density below {virgin_kg_m3} kg/m³, found {char_kg_m3} kg/m³");
        return Err(left?.fault(message));
    }
    let whole_kg_m3 = share * virgin_kg_m3;
    if whole_kg_m3 > density_kg_m3 * (1.0 + SAME_DENSITY) {
        let message = format!(
            "expected a volume share times density of at most {density_kg_m3} kg/m³, found {whole_kg_m3} kg/m³"
        );
        return Err(section.fault(message));
    }
    let remainder = (virgin_kg_m3 - char_kg_m3) / virgin_kg_m3;
    Ok((whole_kg_m3 * remainder / density_kg_m3, remainder))
}

fn order(written: Written<'_>) -> Read<f64> {
    written.require(Reaction::checked_order(written.number()?))
}

fn activation(written: Written<'_>) -> Read<f64> {
    written.require(Reaction::checked_activation(written.quantity(Dimension::MolarEnergy)?))
}

/// The residues, and their absolute enthalpies if stated.
fn residues(
    section: &Section<'_>,
    sequence: Sequence,
    absolute: bool,
    virgin: &Virgin,
    reactions: Option<&[Reaction]>,
) -> Read<(Vec<Residue>, Vec<f64>)> {
    let char = section.optional("char").map(Written::section).transpose();
    let mut sections = section.tables("intermediate")?;
    if let Some(reactions) = reactions {
        let wanted = sequence.intermediates(reactions.len());
        if sections.len() != wanted {
            let order = sequence.words();
            let (met, count) = (sections.len(), reactions.len());
            let message = format!(
                "expected {wanted} [[decomposition.intermediate]] for {count} reactions ({order}), found {met}"
            );
            return Err(section.fault(message));
        }
    }
    let count = sections.len();
    sections.extend(char?);
    let lost = |index: usize| {
        let reactions = reactions.unwrap_or_default();
        let through = if index == count { reactions } else { &reactions[..reactions.len().min(index + 1)] };
        through.iter().map(|reaction| reaction.loss).sum::<f64>()
    };
    let mut read = all(sections.iter().enumerate().map(|(index, section)| {
        let density_kg_m3 = reactions.map(|_| virgin.density_kg_m3 * (1.0 - lost(index)));
        residue(section, index < count, absolute, virgin, density_kg_m3)
    }))?;
    if read.len() == count {
        if absolute {
            return Err(
                section.fault("absolute enthalpies without a char: expected [decomposition.char] with `enthalpy`")
            );
        }
        let Virgin { heat_capacity, conductivity, emissivity, pores, .. } = virgin;
        let (heat_capacity, conductivity) = (heat_capacity.clone(), conductivity.clone());
        let (name, emissivity, pores) = ("char".to_owned(), emissivity.clone(), *pores);
        read.push((Residue { name, heat_capacity, conductivity, emissivity, pores }, 0.0));
    }
    let (residues, enthalpies): (Vec<_>, Vec<_>) = read.into_iter().unzip();
    Ok((residues, if absolute { enthalpies } else { Vec::new() }))
}

/// `density_kg_m3` follows from the mass losses; `None` if these are wrong.
fn residue(
    section: &Section<'_>,
    intermediate: bool,
    absolute: bool,
    virgin: &Virgin,
    density_kg_m3: Option<f64>,
) -> Read<(Residue, f64)> {
    let name = if intermediate {
        section.required("name", "a name such as \"tar\"").and_then(Written::text)
    } else {
        Ok("char")
    };
    let density = section.optional("density").map(|written| density(written, virgin.density_kg_m3, density_kg_m3));
    let left_kg_m3 = density_kg_m3.unwrap_or(virgin.density_kg_m3);
    let heat_capacity = section.optional("heat_capacity").map_or_else(
        || Ok(virgin.heat_capacity.clone()),
        |written| property(written, Dimension::HeatCapacity, &virgin.heat_capacity),
    );
    let emissivity = section.optional("emissivity").map_or_else(
        || Ok(virgin.emissivity.clone()),
        |written| property(written, Dimension::Fraction, &virgin.emissivity),
    );
    let conductivity = section.optional("conductivity").map_or_else(
        || Ok(virgin.conductivity.clone()),
        |written| conducting(written, &virgin.conductivity, left_kg_m3),
    );
    let pores = section.optional("pores").map_or(Ok(virgin.pores), |written| {
        let section = written.section()?;
        let pores = pores(&section, Some(virgin.pores));
        section.close();
        pores
    });
    let enthalpy = if absolute {
        let written = section.required("enthalpy", "the absolute enthalpy at `reference`, such as \"0 J/kg\"");
        written.and_then(|written| written.quantity(Dimension::SpecificEnthalpy))
    } else {
        Ok(0.0)
    };
    section.close();
    density.transpose()?;
    let (heat_capacity, conductivity, emissivity) = (heat_capacity?, conductivity?, emissivity?);
    Ok((Residue { name: name?.to_owned(), heat_capacity, conductivity, emissivity, pores: pores? }, enthalpy?))
}

/// A stated density, which must agree with the mass losses.
fn density(written: Written<'_>, virgin_kg_m3: f64, left_kg_m3: Option<f64>) -> Read<()> {
    let density_kg_m3 = written.positive(Dimension::Density)?;
    if density_kg_m3 >= virgin_kg_m3 {
        let message = format!("expected a density below the virgin {virgin_kg_m3} kg/m³, found {density_kg_m3} kg/m³");
        return Err(written.fault(message));
    }
    match left_kg_m3 {
        Some(left_kg_m3) if (density_kg_m3 / left_kg_m3 - 1.0).abs() > SAME_DENSITY => {
            let expected = format!("expected {left_kg_m3:.1} kg/m³ from the mass losses of the reactions");
            Err(written.fault(format!("{expected}, found {density_kg_m3} kg/m³")))
        }
        _ => Ok(()),
    }
}

/// A table, or `{ times_virgin = 0.95 }`.
fn property(written: Written<'_>, dimension: Dimension, virgin: &Table) -> Read<Table> {
    let section = written.section()?;
    let table = match section.optional("times_virgin") {
        Some(written) => written.positive(Dimension::Fraction).and_then(|factor| {
            let table = times(virgin, factor);
            let values = table.values.iter().map(|&value| Table::property_value(value, dimension));
            written.require(values.collect::<Result<Vec<_>, _>>()).map(|_| table)
        }),
        None => table(&section, dimension),
    };
    section.close();
    table
}

/// As [`residue_table`]; all parts of a three-part conductivity are scaled.
fn conducting(written: Written<'_>, virgin: &Conductivity, density_kg_m3: f64) -> Read<Conductivity> {
    let section = written.section()?;
    let conductivity = match section.optional("times_virgin") {
        Some(written) => written.positive(Dimension::Fraction).map(|factor| match virgin {
            Conductivity::Tables(tables) => Conductivity::Tables(
                tables.iter().map(|(pressure_pa, table)| (*pressure_pa, times(table, factor))).collect(),
            ),
            Conductivity::Parts(parts) => {
                let mut parts = parts.clone();
                parts.solid_w_m_k *= factor;
                parts.pores.iter_mut().for_each(|(share, _)| *share *= factor);
                parts.extinction_1_m = parts.extinction_1_m.map(|extinction_1_m| extinction_1_m / factor);
                Conductivity::Parts(parts)
            }
        }),
        None => conductivity(&section, density_kg_m3),
    };
    section.close();
    conductivity
}

fn times(table: &Table, factor: f64) -> Table {
    Table { values: table.values.iter().map(|value| value * factor).collect(), ..table.clone() }
}
