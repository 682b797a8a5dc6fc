//! Pores and decomposition of a material.

use super::PLOT_ROWS;
use super::{heading, sampled, table_text};
use crate::case::Provenance;
use crate::case::{Conductivity, Decomposition, Pores, PyrolysisHeat, ReactionScheme};
use crate::report::braille::{Curve, chart};

/// Usual heating rate and temperature range of thermogravimetry.
const HEATING_RATE_K_MIN: f64 = 10.0;
const HALF_CONVERSION_RATES_K_MIN: [f64; 3] = [1.0, 10.0, 100.0];
const RANGE_K: (f64, f64) = (300.0, 1300.0);

pub(super) fn pores_text(pores: &Pores, provenance: &Provenance) -> String {
    heading("pores", provenance) + &format!("  {}\n\n", pore_values(pores))
}

fn pore_values(pores: &Pores) -> String {
    let mut text = format!("porosity {}, permeability {:.1e} m²", pores.porosity, pores.permeability_m2);
    if pores.slip_pa_k > 0.0 {
        text += &format!(", slip {:.3} Pa/K", pores.slip_pa_k);
    }
    if pores.forchheimer_1_m > 0.0 {
        text += &format!(", Forchheimer {:.1e}/m", pores.forchheimer_1_m);
    }
    text
}

/// The temperatures at which each reaction is half complete: they show a wrong unit or exponent of A or E at once.
pub(super) fn half_conversions(decomposition: &Decomposition) -> String {
    let each_rate = HALF_CONVERSION_RATES_K_MIN.map(|rate| decomposition.half_conversion_temperatures_k(rate / 60.0));
    let heads: String =
        HALF_CONVERSION_RATES_K_MIN.iter().map(|rate| format!("{:>14}", format!("{rate} K/min"))).collect();
    let mut text = format!("  half complete, heated from 300 K, K\n{:>8}{heads}\n", "loss");
    for (index, reaction) in decomposition.reactions.iter().enumerate() {
        text += &format!("{:>8.4}", reaction.mass_loss);
        for found in &each_rate {
            let cell = match found[index] {
                Some(at_k) if at_k > 300.0 => format!("{at_k:.0}"),
                Some(_) => "at once".to_owned(),
                None => "never".to_owned(),
            };
            text += &format!("{cell:>14}");
        }
        text.push('\n');
    }
    text
}

pub(super) fn decomposition_text(decomposition: &Decomposition, virgin_kg_m3: f64) -> String {
    let mut text = heading("decomposition", &decomposition.provenance);
    text += match decomposition.scheme {
        ReactionScheme::Parallel => "  parallel reactions\n",
        ReactionScheme::Consecutive => "  consecutive reactions\n",
    };
    text += &format!(
        "{:>8}{:>12}{:>12}{:>8}{:>10}{:>14}\n",
        "loss", "A, 1/s", "E, kJ/mol", "order", "onset, K", "heat, MJ/kg"
    );
    for reaction in &decomposition.reactions {
        let heat = match decomposition.heat {
            PyrolysisHeat::HeatsOfReaction => format!("{}", 1e-6 * reaction.heat_j_kg),
            PyrolysisHeat::AbsoluteEnthalpies { .. } => "–".to_owned(),
        };
        let (loss, rate, energy) =
            (reaction.mass_loss, reaction.pre_exponential_1_s, 1e-3 * reaction.activation_energy_j_mol);
        let (order, onset) = (reaction.order, reaction.onset_temperature_k);
        text += &format!("{loss:>8.4}{rate:>12.3e}{energy:>12.1}{order:>8}{onset:>10}{heat:>14}\n");
    }
    text += &half_conversions(decomposition);
    if let PyrolysisHeat::AbsoluteEnthalpies { virgin_j_kg, reference_k, .. } = decomposition.heat {
        text += &format!("  heat in absolute enthalpies; virgin {} MJ/kg at {reference_k} K\n", 1e-6 * virgin_j_kg);
    }
    text += &format!("  shrinkage {} of the thickness\n\n", decomposition.shrinkage);

    let densities = decomposition.residue_densities_kg_m3(virgin_kg_m3);
    for (residue, density_kg_m3) in decomposition.residues.iter().zip(densities) {
        text += &format!("  {}, {density_kg_m3:.1} kg/m³: {}\n", residue.name, pore_values(&residue.pores));
        if let Conductivity::Tables(tables) = &residue.conductivity
            && let [(_, table)] = tables.as_slice()
        {
            text += &format!("  conductivity, W/m/K\n{}", table_text(table, 4));
        }
        text += &format!("  heat capacity, J/kg/K\n{}", table_text(&residue.heat_capacity, 0));
        text += &format!("  emissivity\n{}", table_text(&residue.emissivity, 2));
    }

    let points = sampled(RANGE_K, |temperature_k| temperature_k);
    let temperatures_k: Vec<f64> = points.into_iter().map(|point| point.0).collect();
    let left = decomposition.remaining_mass_fractions(HEATING_RATE_K_MIN / 60.0, &temperatures_k);
    let curve = Curve { name: String::new(), points: temperatures_k.into_iter().zip(left).collect() };
    text += &format!("  residual mass at {HEATING_RATE_K_MIN} K/min\n");
    text + &chart(&[curve], PLOT_ROWS, false, "temperature, K", |value| format!("{value:.3}")) + "\n"
}
