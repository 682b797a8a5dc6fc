//! `[decomposition]` of a material file: reactions and residues.

use super::property::{conductivity, keyword, pores, provenance, table};
use super::spanned_toml::{TableReader, ValueReader, collect_all};
use crate::case::error::ReadResult;
use crate::case::unit::Dimension;
use crate::case::{
    Conductivity, Decomposition, MixtureRule, Pores, PyrolysisHeat, Reaction, ReactionScheme, Residue, Table,
};
use crate::limits::REACTIONS;

/// Relative tolerance of a stated density of a residue, for numbers rounded to three digits.
const DENSITY_TOLERANCE: f64 = 5e-3;

/// Properties of the virgin material, which residues inherit.
pub(super) struct VirginProperties {
    pub(super) density_kg_m3: f64,
    pub(super) heat_capacity: Table,
    pub(super) conductivity: Conductivity,
    pub(super) emissivity: Table,
    pub(super) pores: Pores,
}

pub(super) fn decomposition(section: &TableReader<'_>, virgin: &VirginProperties) -> ReadResult<Decomposition> {
    let schemes = [ReactionScheme::Parallel, ReactionScheme::Consecutive].map(|scheme| (scheme.key(), scheme));
    let scheme = keyword(section, "reaction_scheme", &schemes);
    let mixture_rule = keyword(
        section,
        "mixture_rule",
        &[("mass", MixtureRule::MassFractions), ("volume", MixtureRule::VolumeFractions)],
    );
    let absolute = keyword(section, "heat", &[("of-reaction", false), ("absolute", true)]);
    let shrinkage = section.optional("shrinkage").map_or(Ok(0.0), shrinkage);
    let provenance = provenance(section);
    let (scheme, absolute) = (scheme?, absolute?);
    let reactions = reactions(section, scheme, absolute, virgin.density_kg_m3);
    let levels = absolute.then(|| virgin_enthalpy_and_reference(section));
    let residues = residues(section, scheme, absolute, virgin, reactions.as_deref().ok());
    section.deny_unknown_keys();
    let (reactions, (residues, residues_j_kg)) = (reactions?, residues?);
    let heat = match levels.transpose()? {
        Some((virgin_j_kg, reference_k)) => {
            PyrolysisHeat::AbsoluteEnthalpies { virgin_j_kg, residues_j_kg, reference_k }
        }
        None => PyrolysisHeat::HeatsOfReaction,
    };
    let (mixture_rule, shrinkage, provenance) = (mixture_rule?, shrinkage?, provenance?);
    Ok(Decomposition { reactions, scheme, residues, mixture_rule, heat, shrinkage, provenance })
}

fn shrinkage(written: ValueReader<'_>) -> ReadResult<f64> {
    written.require(Decomposition::checked_shrinkage(written.quantity(Dimension::Fraction)?))
}

/// Absolute enthalpy of the virgin material, J/kg, and its reference temperature, K.
fn virgin_enthalpy_and_reference(section: &TableReader<'_>) -> ReadResult<(f64, f64)> {
    let virgin = section.required("virgin_enthalpy", "the absolute enthalpy of the virgin material at `reference`");
    let virgin_j_kg = virgin.and_then(|written| written.quantity(Dimension::SpecificEnthalpy));
    let reference = section.required("reference", "the temperature of the enthalpies, such as \"298 K\"");
    let reference_k = reference.and_then(|written| written.quantity(Dimension::Temperature));
    Ok((virgin_j_kg?, reference_k?))
}

fn reactions(
    section: &TableReader<'_>,
    scheme: ReactionScheme,
    absolute: bool,
    density_kg_m3: f64,
) -> ReadResult<Vec<Reaction>> {
    let sections = section.array_of_tables("reaction")?;
    if sections.is_empty() {
        return Err(section.error("no reaction: expected at least one [[decomposition.reaction]]"));
    }
    section.require(REACTIONS.check(sections.len() as f64))?;
    let reactions = collect_all(sections.iter().map(|section| reaction(section, scheme, absolute, density_kg_m3)))?;
    section.require(Decomposition::check_char_remains(&reactions)).map(|()| reactions)
}

fn reaction(
    section: &TableReader<'_>,
    scheme: ReactionScheme,
    absolute: bool,
    density_kg_m3: f64,
) -> ReadResult<Reaction> {
    let order = section.required("order", "the order of the reaction, such as 1").and_then(order);
    let loss = match section.optional("mass_loss") {
        Some(written) => mass_loss(written).map(|loss| (loss, 1.0)),
        None if scheme == ReactionScheme::Consecutive => {
            let expected = "expected the mass loss of each consecutive reaction, such as 0.3";
            Err(section.error(format!("missing key \"mass_loss\": {expected}")))
        }
        None => component(section, density_kg_m3),
    };
    let rate_1_s = section.positive("pre_exponential", Dimension::Rate);
    let activation =
        section.required("activation_energy", Dimension::MolarEnergy.name_and_example()).and_then(activation);
    let onset_k =
        section.optional("onset_temperature").map_or(Ok(0.0), |written| written.quantity(Dimension::Temperature));
    let heat_j_kg = match section.optional("heat") {
        Some(written) if absolute => Err(written.error(PyrolysisHeat::ABSOLUTE_EXCLUDES_REACTION_HEAT)),
        Some(written) => written.quantity(Dimension::SpecificEnthalpy),
        None if absolute => Ok(0.0),
        None => {
            Err(section.error("missing key \"heat\": expected the heat absorbed per mass of gas, such as \"1 MJ/kg\""))
        }
    };
    section.deny_unknown_keys();
    let (order, (loss, remainder)) = (order?, loss?);
    Ok(Reaction {
        mass_loss: loss,
        pre_exponential_1_s: rate_1_s? * remainder.powf(order - 1.0),
        activation_energy_j_mol: activation?,
        order,
        onset_temperature_k: onset_k?,
        heat_j_kg: heat_j_kg?,
    })
}

fn mass_loss(written: ValueReader<'_>) -> ReadResult<f64> {
    written.require(Reaction::checked_mass_loss(written.quantity(Dimension::Fraction)?))
}

/// Mass loss of a component as in CMA and FIAT, given by its volume share and its densities, and its reactive fraction
/// (ρ_v − ρ_c)/ρ_v. With ξ = (ρ_v − ρ)/(ρ_v − ρ_c) the rate constant becomes A ((ρ_v − ρ_c)/ρ_v)^(m−1).
fn component(section: &TableReader<'_>, density_kg_m3: f64) -> ReadResult<(f64, f64)> {
    let share = section.required("volume_share", "a key `mass_loss`, or the volume share of a component");
    let share = share.and_then(|written| written.positive(Dimension::Fraction));
    let virgin_kg_m3 = section.positive("virgin_density", Dimension::Density);
    let left = section.required("char_density", Dimension::Density.name_and_example());
    let char_kg_m3 = left.and_then(|written| written.not_negative(Dimension::Density));
    let (share, virgin_kg_m3, char_kg_m3) = (share?, virgin_kg_m3?, char_kg_m3?);
    if char_kg_m3 >= virgin_kg_m3 {
        let message = format!("expected a char density below {virgin_kg_m3} kg/m³, found {char_kg_m3} kg/m³");
        return Err(left?.error(message));
    }
    let whole_kg_m3 = share * virgin_kg_m3;
    if whole_kg_m3 > density_kg_m3 * (1.0 + DENSITY_TOLERANCE) {
        let message = format!(
            "expected a volume share times density of at most {density_kg_m3} kg/m³, found {whole_kg_m3} kg/m³"
        );
        return Err(section.error(message));
    }
    let remainder = (virgin_kg_m3 - char_kg_m3) / virgin_kg_m3;
    Ok((whole_kg_m3 * remainder / density_kg_m3, remainder))
}

fn order(written: ValueReader<'_>) -> ReadResult<f64> {
    written.require(Reaction::checked_order(written.number()?))
}

fn activation(written: ValueReader<'_>) -> ReadResult<f64> {
    written.require(Reaction::checked_activation(written.quantity(Dimension::MolarEnergy)?))
}

/// The residues, and their absolute enthalpies if stated.
fn residues(
    section: &TableReader<'_>,
    scheme: ReactionScheme,
    absolute: bool,
    virgin: &VirginProperties,
    reactions: Option<&[Reaction]>,
) -> ReadResult<(Vec<Residue>, Vec<f64>)> {
    let char = section.optional("char").map(ValueReader::section).transpose();
    let mut sections = section.array_of_tables("intermediate")?;
    if let Some(reactions) = reactions {
        let requested = scheme.intermediate_count(reactions.len());
        if sections.len() != requested {
            let kind = scheme.key();
            let (met, count) = (sections.len(), reactions.len());
            let message = format!(
                "expected {requested} [[decomposition.intermediate]] for {count} {kind} reactions, found {met}"
            );
            return Err(section.error(message));
        }
    }
    let count = sections.len();
    sections.extend(char?);
    let mass_lost = |index: usize| {
        let reactions = reactions.unwrap_or_default();
        let completed_reactions = if index == count { reactions } else { &reactions[..reactions.len().min(index + 1)] };
        completed_reactions.iter().map(|reaction| reaction.mass_loss).sum::<f64>()
    };
    let mut read = collect_all(sections.iter().enumerate().map(|(index, section)| {
        let density_kg_m3 = reactions.map(|_| virgin.density_kg_m3 * (1.0 - mass_lost(index)));
        residue(section, index < count, absolute, virgin, density_kg_m3)
    }))?;
    if read.len() == count {
        if absolute {
            return Err(
                section.error("absolute enthalpies without a char: expected [decomposition.char] with `enthalpy`")
            );
        }
        let VirginProperties { heat_capacity, conductivity, emissivity, pores, .. } = virgin;
        let (heat_capacity, conductivity) = (heat_capacity.clone(), conductivity.clone());
        let (name, emissivity, pores) = ("char".to_owned(), emissivity.clone(), *pores);
        read.push((Residue { name, heat_capacity, conductivity, emissivity, pores }, 0.0));
    }
    let (residues, enthalpies): (Vec<_>, Vec<_>) = read.into_iter().unzip();
    Ok((residues, if absolute { enthalpies } else { Vec::new() }))
}

/// `density_kg_m3` follows from the mass losses; `None` if these are wrong.
fn residue(
    section: &TableReader<'_>,
    intermediate: bool,
    absolute: bool,
    virgin: &VirginProperties,
    density_kg_m3: Option<f64>,
) -> ReadResult<(Residue, f64)> {
    let name = if intermediate {
        section.required("name", "a name such as \"tar\"").and_then(ValueReader::name)
    } else {
        Ok("char")
    };
    let density =
        section.optional("density").map(|written| check_residue_density(written, virgin.density_kg_m3, density_kg_m3));
    let left_kg_m3 = density_kg_m3.unwrap_or(virgin.density_kg_m3);
    let heat_capacity = section.optional("heat_capacity").map_or_else(
        || Ok(virgin.heat_capacity.clone()),
        |written| residue_table(written, Dimension::HeatCapacity, &virgin.heat_capacity),
    );
    let emissivity = section.optional("emissivity").map_or_else(
        || Ok(virgin.emissivity.clone()),
        |written| residue_table(written, Dimension::Fraction, &virgin.emissivity),
    );
    let conductivity = section.optional("conductivity").map_or_else(
        || Ok(virgin.conductivity.clone()),
        |written| residue_conductivity(written, &virgin.conductivity, left_kg_m3),
    );
    let pores = section.optional("pores").map_or(Ok(virgin.pores), |written| {
        let section = written.section()?;
        let pores = pores(&section, Some(virgin.pores));
        section.deny_unknown_keys();
        pores
    });
    let enthalpy = if absolute {
        let written = section.required("enthalpy", "the absolute enthalpy at `reference`, such as \"0 J/kg\"");
        written.and_then(|written| written.quantity(Dimension::SpecificEnthalpy))
    } else {
        Ok(0.0)
    };
    section.deny_unknown_keys();
    density.transpose()?;
    let (heat_capacity, conductivity, emissivity) = (heat_capacity?, conductivity?, emissivity?);
    Ok((Residue { name: name?.to_owned(), heat_capacity, conductivity, emissivity, pores: pores? }, enthalpy?))
}

/// A stated density, which must agree with the mass losses.
fn check_residue_density(written: ValueReader<'_>, virgin_kg_m3: f64, left_kg_m3: Option<f64>) -> ReadResult<()> {
    let density_kg_m3 = written.positive(Dimension::Density)?;
    if density_kg_m3 >= virgin_kg_m3 {
        let message = format!("expected a density below the virgin {virgin_kg_m3} kg/m³, found {density_kg_m3} kg/m³");
        return Err(written.error(message));
    }
    match left_kg_m3 {
        Some(left_kg_m3) if (density_kg_m3 / left_kg_m3 - 1.0).abs() > DENSITY_TOLERANCE => {
            let expected = format!("expected {left_kg_m3:.1} kg/m³ from the mass losses of the reactions");
            Err(written.error(format!("{expected}, found {density_kg_m3} kg/m³")))
        }
        _ => Ok(()),
    }
}

/// A table, or `{ times_virgin = 0.95 }`.
fn residue_table(written: ValueReader<'_>, dimension: Dimension, virgin: &Table) -> ReadResult<Table> {
    let section = written.section()?;
    let table = match section.optional("times_virgin") {
        Some(written) => written.positive(Dimension::Fraction).and_then(|factor| {
            let table = scaled_table(virgin, factor);
            let values = table.values.iter().map(|&value| Table::checked_value(value, dimension));
            written.require(values.collect::<Result<Vec<_>, _>>()).map(|_| table)
        }),
        None => table(&section, dimension),
    };
    section.deny_unknown_keys();
    table
}

/// As [`residue_table`]; all parts of a three-part conductivity are scaled.
fn residue_conductivity(
    written: ValueReader<'_>,
    virgin: &Conductivity,
    density_kg_m3: f64,
) -> ReadResult<Conductivity> {
    let section = written.section()?;
    let conductivity = match section.optional("times_virgin") {
        Some(written) => written.positive(Dimension::Fraction).map(|factor| match virgin {
            Conductivity::Tables(tables) => Conductivity::Tables(
                tables.iter().map(|(pressure_pa, table)| (*pressure_pa, scaled_table(table, factor))).collect(),
            ),
            Conductivity::ThreePart(parts) => {
                let mut parts = parts.clone();
                parts.solid_w_m_k *= factor;
                parts.pores.iter_mut().for_each(|(share, _)| *share *= factor);
                parts.extinction_1_m = parts.extinction_1_m.map(|extinction_1_m| extinction_1_m / factor);
                Conductivity::ThreePart(parts)
            }
        }),
        None => conductivity(&section, density_kg_m3),
    };
    section.deny_unknown_keys();
    conductivity
}

fn scaled_table(table: &Table, factor: f64) -> Table {
    Table { values: table.values.iter().map(|value| value * factor).collect(), ..table.clone() }
}
