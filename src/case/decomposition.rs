//! Thermal decomposition of a material into char and gas.
//!
//! Each reaction j has an extent of reaction ξ from zero to one:
//!
//! ```text
//! dξ_j/dt = A_j (s_j − ξ_j)^m_j exp(−E_j/RT)    above its onset temperature, else zero
//! ```
//!
//! Parallel reactions all consume the virgin material (s = 1) and produce the char. Consecutive reactions A → B → C
//! each consume the product of the previous one (s_j = ξ_{j−1}), and each has its own residue. The component model of
//! CMA and FIAT is equivalent: with ξ = (ρ_v − ρ)/(ρ_v − ρ_c) its rate constant is A ((ρ_v − ρ_c)/ρ_v)^(m−1).

use super::conductivity::Conductivity;
use super::provenance::Provenance;
use super::table::Table;
use super::unit::Dimension;
use super::validation::{FieldPath, finite};
use crate::limits::{LAYUP_TEMPERATURE_K, REACTIONS};
use crate::numerics::thermogravimetry::{Kinetics, Specimen};

pub use crate::numerics::thermogravimetry::GAS_CONSTANT_J_MOL_K;

/// The reactions of a material and their residues.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Decomposition {
    /// The reactions, at least one; consecutive reactions in their order.
    pub reactions: Vec<Reaction>,
    /// Parallel or consecutive reactions.
    pub scheme: ReactionScheme,
    /// Parallel reactions: the char alone. Consecutive reactions: one residue each; the last is the char. Their
    /// densities follow from the mass losses.
    pub residues: Vec<Residue>,
    /// Rule for the properties of partly decomposed material.
    pub mixture_rule: MixtureRule,
    /// How the heat of pyrolysis is stated.
    pub heat: PyrolysisHeat,
    /// Fraction of the thickness lost on complete reaction; before that in proportion to the mass loss.
    pub shrinkage: f64,
    /// Provenance of the reactions.
    pub provenance: Provenance,
}

/// One Arrhenius reaction.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Reaction {
    /// Mass of gas on complete reaction, as a fraction of the virgin mass.
    pub mass_loss: f64,
    /// Pre-exponential factor A, 1/s.
    pub pre_exponential_1_s: f64,
    /// Activation energy E, J/mol.
    pub activation_energy_j_mol: f64,
    /// Reaction order m.
    pub order: f64,
    /// Temperature below which the rate is zero, K; 0 for no onset.
    pub onset_temperature_k: f64,
    /// Heat of reaction per mass of gas, J/kg, positive if endothermic; used with [`PyrolysisHeat::HeatsOfReaction`].
    pub heat_j_kg: f64,
}

/// Parallel or consecutive reactions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[derive(serde::Serialize)]
pub enum ReactionScheme {
    /// Parallel: every reaction consumes the virgin material and produces the char.
    Parallel,
    /// Consecutive: each reaction consumes the product of the previous one.
    Consecutive,
}

impl ReactionScheme {
    /// Number of residues of `reactions` reactions, the char excluded.
    pub(super) fn intermediate_count(self, reactions: usize) -> usize {
        if self == Self::Consecutive { reactions.saturating_sub(1) } else { 0 }
    }

    /// Value of the key `reaction_scheme` in a material file.
    pub(super) fn key(self) -> &'static str {
        if self == Self::Consecutive { "consecutive" } else { "parallel" }
    }
}

/// Weights of the virgin material and the residues in the properties of their mixture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[derive(serde::Serialize)]
pub enum MixtureRule {
    /// Mass fractions, as in PATO and FIAT for conductivity and emissivity.
    MassFractions,
    /// Volume fractions, as in Gpyro.
    VolumeFractions,
}

/// The heat of pyrolysis is stated either as absolute enthalpies or as heats of reaction.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[derive(serde::Serialize)]
pub enum PyrolysisHeat {
    /// Absolute enthalpies of virgin material and residues at a reference temperature. The table of the gas must be
    /// absolute too.
    AbsoluteEnthalpies {
        /// Enthalpy of the virgin material, J/kg.
        virgin_j_kg: f64,
        /// Enthalpy of each residue, J/kg.
        residues_j_kg: Vec<f64>,
        /// Reference temperature of these enthalpies, K.
        reference_k: f64,
    },
    /// Heats of reaction; the gas carries sensible heat only.
    HeatsOfReaction,
}

/// The solid product of a reaction.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Residue {
    /// `char`, or the name of an intermediate.
    pub name: String,
    /// J/kg/K.
    pub heat_capacity: Table,
    /// W/m/K.
    pub conductivity: Conductivity,
    /// Total hemispherical, 0 to 1.
    pub emissivity: Table,
    /// Porosity and permeability.
    pub pores: Pores,
}

impl Residue {
    fn check(&self, at: &FieldPath<'_>) {
        at.name("name", &self.name);
        self.heat_capacity.check(&at.child("heat_capacity"), Dimension::HeatCapacity);
        self.conductivity.check(&at.child("conductivity"));
        self.emissivity.check(&at.child("emissivity"), Dimension::Fraction);
        self.pores.check(&at.child("pores"));
    }
}

/// Porosity and permeability of a material.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Pores {
    /// Volume fraction of gas.
    pub porosity: f64,
    /// Permeability K, m²; 0 is impermeable.
    pub permeability_m2: f64,
    /// Klinkenberg slip pressure b over temperature, Pa/K: in air 4 λp/(r T) = 9.33e-5 m/r Pa/K for a pore radius r.
    pub slip_pa_k: f64,
    /// Forchheimer's inertial coefficient, 1/m; 0 is Darcy's law.
    pub forchheimer_1_m: f64,
}

impl Pores {
    /// Solid without pores.
    pub const IMPERMEABLE: Self = Self { porosity: 0.0, permeability_m2: 0.0, slip_pa_k: 0.0, forchheimer_1_m: 0.0 };

    /// The volume fraction of gas, from 0 to below 1.
    pub(super) fn checked_porosity(porosity: f64) -> Result<f64, String> {
        if (0.0..1.0).contains(&porosity) {
            return Ok(porosity);
        }
        Err(format!("expected a porosity from 0 to below 1, found {porosity}"))
    }

    /// Require pores in a permeable material.
    pub(super) fn check_permeable(self) -> Result<Self, String> {
        if self.permeability_m2 > 0.0 && self.porosity == 0.0 {
            let permeability_m2 = self.permeability_m2;
            return Err(format!("expected a porosity above 0 with a permeability of {permeability_m2} m², found 0"));
        }
        Ok(self)
    }

    pub(super) fn check(&self, at: &FieldPath<'_>) {
        at.child("porosity").require(Self::checked_porosity(self.porosity));
        at.not_negative("permeability_m2", self.permeability_m2);
        at.not_negative("slip_pa_k", self.slip_pa_k);
        at.not_negative("forchheimer_1_m", self.forchheimer_1_m);
        at.require(self.check_permeable());
    }
}

impl Reaction {
    /// Mass of gas per mass of virgin material, between 0 and 1.
    pub(super) fn checked_mass_loss(loss: f64) -> Result<f64, String> {
        if loss > 0.0 && loss < 1.0 {
            return Ok(loss);
        }
        Err(format!("expected a mass loss between 0 and 1 (gas per mass of virgin material), found {loss}"))
    }

    /// The reaction order m, at least zero.
    pub(super) fn checked_order(order: f64) -> Result<f64, String> {
        if finite(order, format_args!("a reaction order of {order}"))? >= 0.0 {
            return Ok(order);
        }
        Err(format!("expected a reaction order of 0 or more, found {order}"))
    }

    /// The activation energy E, at least zero, J/mol.
    pub(super) fn checked_activation(activation_energy_j_mol: f64) -> Result<f64, String> {
        if finite(activation_energy_j_mol, format_args!("an activation energy of {activation_energy_j_mol}"))? >= 0.0 {
            return Ok(activation_energy_j_mol);
        }
        Err(format!("expected an activation energy of 0 J/mol or more, found {activation_energy_j_mol} J/mol"))
    }

    fn check(&self, at: &FieldPath<'_>, heat: &PyrolysisHeat) {
        at.child("mass_loss").require(Self::checked_mass_loss(self.mass_loss));
        at.positive("pre_exponential_1_s", self.pre_exponential_1_s);
        at.child("activation_energy_j_mol").require(Self::checked_activation(self.activation_energy_j_mol));
        at.child("order").require(Self::checked_order(self.order));
        at.not_negative("onset_temperature_k", self.onset_temperature_k);
        at.finite("heat_j_kg", self.heat_j_kg);
        if self.heat_j_kg != 0.0 && *heat != PyrolysisHeat::HeatsOfReaction {
            at.child("heat_j_kg").error(PyrolysisHeat::ABSOLUTE_EXCLUDES_REACTION_HEAT);
        }
    }
}

impl PyrolysisHeat {
    /// Error for a heat of reaction together with absolute enthalpies.
    pub(super) const ABSOLUTE_EXCLUDES_REACTION_HEAT: &str =
        "expected no heat of reaction: the absolute enthalpies include it";
}

impl Decomposition {
    /// Fraction of the thickness lost, from 0 to below 1.
    pub(super) fn checked_shrinkage(shrinkage: f64) -> Result<f64, String> {
        if (0.0..1.0).contains(&shrinkage) {
            return Ok(shrinkage);
        }
        Err(format!("expected a shrinkage from 0 to below 1, found {shrinkage}"))
    }

    /// Require that some char remains.
    pub(super) fn check_char_remains(reactions: &[Reaction]) -> Result<(), String> {
        let lost: f64 = reactions.iter().map(|reaction| reaction.mass_loss).sum();
        if lost < 1.0 {
            return Ok(());
        }
        // Rounded: the sum of decimal fractions has a binary rounding error.
        let lost = (lost * 1e9).round() / 1e9;
        Err(format!("the mass losses of the reactions add up to {lost}: expected less than 1, so that char remains"))
    }

    /// Record all errors of reactions and residues.
    pub(super) fn check(&self, at: &FieldPath<'_>) {
        let reactions = at.child("reactions");
        if self.reactions.is_empty() {
            reactions.error("no reaction: expected at least one");
        }
        reactions.require(REACTIONS.check(self.reactions.len() as f64));
        for (at, reaction) in reactions.elements(&self.reactions) {
            reaction.check(&at, &self.heat);
        }
        reactions.require(Self::check_char_remains(&self.reactions));
        let residues = at.child("residues");
        for (at, residue) in residues.elements(&self.residues) {
            residue.check(&at);
        }
        let (count, found) = (self.reactions.len(), self.residues.len());
        let requested = self.scheme.intermediate_count(count) + 1;
        if found != requested {
            let scheme = self.scheme.key();
            residues.error(format!("expected {requested} residues of {count} {scheme} reactions, found {found}"));
        }
        if let PyrolysisHeat::AbsoluteEnthalpies { virgin_j_kg, residues_j_kg, reference_k } = &self.heat {
            let at = at.child("heat");
            at.finite("virgin_j_kg", *virgin_j_kg);
            at.positive("reference_k", *reference_k);
            let residues = at.child("residues_j_kg");
            residues.require_each(residues_j_kg, |&enthalpy_j_kg| finite(enthalpy_j_kg, enthalpy_j_kg));
            if residues_j_kg.len() != found {
                residues.error(format!(
                    "expected one enthalpy for each of {found} residues, found {}",
                    residues_j_kg.len()
                ));
            }
        }
        at.child("shrinkage").require(Self::checked_shrinkage(self.shrinkage));
        self.provenance.check(&at.child("provenance"));
    }

    /// Fraction of the virgin mass that becomes gas on complete reaction.
    pub fn mass_loss(&self) -> f64 {
        self.reactions.iter().map(|reaction| reaction.mass_loss).sum()
    }

    /// Density of each residue after it has replaced all virgin material, per virgin volume, kg/m³.
    pub fn residue_densities_kg_m3(&self, virgin_kg_m3: f64) -> Vec<f64> {
        match self.scheme {
            ReactionScheme::Parallel => vec![virgin_kg_m3 * (1.0 - self.mass_loss())],
            ReactionScheme::Consecutive => self
                .reactions
                .iter()
                .scan(1.0, |left, reaction| {
                    *left -= reaction.mass_loss;
                    Some(virgin_kg_m3 * *left)
                })
                .collect(),
        }
    }
}

impl Decomposition {
    fn kinetics(&self) -> Vec<Kinetics> {
        let of = |reaction: &Reaction| Kinetics {
            pre_exponential_1_s: reaction.pre_exponential_1_s,
            activation_energy_j_mol: reaction.activation_energy_j_mol,
            order: reaction.order,
            onset_temperature_k: reaction.onset_temperature_k,
        };
        self.reactions.iter().map(of).collect()
    }

    /// Remaining mass per virgin mass at increasing temperatures (K), heated from 300 K at a constant rate (K/s).
    pub fn remaining_mass_fractions(&self, heating_k_s: f64, temperatures_k: &[f64]) -> Vec<f64> {
        let kinetics = self.kinetics();
        let mut specimen = Specimen::new(&kinetics, self.scheme == ReactionScheme::Consecutive, heating_k_s);
        let left = |&temperature_k: &f64| {
            let advancements = specimen.heated_to(temperature_k);
            let lost = self.reactions.iter().zip(advancements).map(|(reaction, xi)| reaction.mass_loss * xi);
            1.0 - lost.sum::<f64>()
        };
        temperatures_k.iter().map(left).collect()
    }

    /// The temperature at which each reaction is half complete, K, heated from 300 K at a constant rate (K/s); `None`
    /// where that is beyond all tables. A reaction that is faster than the heating has 300 K.
    pub fn half_conversion_temperatures_k(&self, heating_k_s: f64) -> Vec<Option<f64>> {
        let kinetics = self.kinetics();
        let specimen = Specimen::new(&kinetics, self.scheme == ReactionScheme::Consecutive, heating_k_s);
        specimen.half_conversion_temperatures_k(LAYUP_TEMPERATURE_K.max as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Material;

    fn decomposition(id: &str) -> Decomposition {
        let material = Material::named(id).unwrap_or_else(|error| panic!("{error}"));
        material.decomposition.unwrap_or_else(|| panic!("{id} decomposes"))
    }

    /// Recorded when the kinetics were fitted, to three digits.
    const TEMPERATURES_K: [f64; 7] = [573.0, 648.0, 700.0, 750.0, 800.0, 873.0, 950.0];
    const SLOW: [f64; 7] = [0.980, 0.974, 0.937, 0.870, 0.812, 0.741, 0.723];
    const FAST: [f64; 7] = [0.980, 0.980, 0.979, 0.976, 0.962, 0.901, 0.820];

    fn worst(found: &[f64], expected: &[f64]) -> f64 {
        assert_eq!(found.len(), expected.len());
        found.iter().zip(expected).map(|(found, expected)| (found - expected).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn pyrogel_reproduces_the_recorded_mass_loss() {
        for id in ["pyrogel3350", "pyrogel2250"] {
            let pyrogel = decomposition(id);
            for (kelvin_a_minute, expected) in [(10.0, SLOW), (1000.0, FAST)] {
                let found = pyrogel.remaining_mass_fractions(kelvin_a_minute / 60.0, &TEMPERATURES_K);
                assert!(worst(&found, &expected) < 1e-3, "{id} at {kelvin_a_minute} K/min: {found:?}");
            }
            let tenfold = pyrogel.remaining_mass_fractions(100.0 / 60.0, &TEMPERATURES_K);
            assert!(worst(&tenfold, &SLOW) > 0.02, "a wrong heating rate must show");
        }
    }

    #[test]
    fn mass_loss_rates_peak_at_the_fitted_temperature() {
        for (id, peak_k) in [("apa", 600.0), ("apa2", 600.0), ("pi_aerogel", 868.0)] {
            let temperatures_k: Vec<f64> = (0..1400).map(|step| 400.0 + 0.5 * f64::from(step)).collect();
            let left = decomposition(id).remaining_mass_fractions(10.0 / 60.0, &temperatures_k);
            let falls = left.windows(2).map(|pair| pair[0] - pair[1]);
            let (steepest, _) =
                falls.enumerate().fold((0, 0.0), |most, fall| if fall.1 > most.1 { fall } else { most });
            assert!((temperatures_k[steepest] - peak_k).abs() < 3.0, "{id}: {} K", temperatures_k[steepest]);
        }
    }
}
