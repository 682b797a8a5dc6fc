//! How a substance turns into char and gas when it is heated.
//!
//! Each reaction j has an advancement ξ from zero to one:
//!
//! ```text
//! dξ_j/dt = A_j (s_j − ξ_j)^m_j exp(−E_j/RT)    above its onset, else nothing
//! ```
//!
//! Side by side every reaction starts from the virgin material (s = 1) and leads to the char. In a chain the
//! next one lives on what the one before has made (s_j = ξ_{j−1}), and every reaction leaves a residue of
//! its own: A → B → C. The component densities of CMA and FIAT are the same in other words: with
//! ξ = (ρ_v − ρ)/(ρ_v − ρ_c) their rate constant is A ((ρ_v − ρ_c)/ρ_v)^(m−1).

use super::check::{Field, finite};
use super::conductivity::Conductivity;
use super::provenance::Provenance;
use super::table::Table;
use super::unit::Dimension;

/// Gas constant, J/mol/K (CODATA 2018).
pub const GAS_CONSTANT_J_MOL_K: f64 = 8.314_462_618;

/// The reactions of a substance and what they leave.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Decomposition {
    /// One at least; in a chain in the order in which they follow.
    pub reactions: Vec<Reaction>,
    /// How the reactions follow each other.
    pub sequence: Sequence,
    /// What is left: the char alone side by side, one a reaction in a chain; the last is the char. Their
    /// densities follow from the losses.
    pub residues: Vec<Residue>,
    /// How virgin substance and residues weigh in a mixture.
    pub mixing: Mixing,
    /// Where the heat of the reactions is written down.
    pub heat: PyrolysisHeat,
    /// Share of the thickness lost when all has reacted, in proportion to the mass lost on the way.
    pub shrinkage: f64,
    /// Of the reactions.
    pub provenance: Provenance,
}

/// One Arrhenius reaction.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Reaction {
    /// Mass of gas when it is complete, as a share of the virgin mass.
    pub loss: f64,
    /// A, 1/s.
    pub rate_1_s: f64,
    /// E, J/mol.
    pub activation_j_mol: f64,
    /// m.
    pub order: f64,
    /// No reaction below this temperature, K; zero has no onset.
    pub onset_k: f64,
    /// Heat taken up per mass of gas, J/kg, positive where the reaction cools; used where the heat is of reaction.
    pub heat_j_kg: f64,
}

/// How reactions follow each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Sequence {
    /// Each starts from the virgin substance and leads to the char.
    SideBySide,
    /// Each lives on what the one before has made.
    Chain,
}

impl Sequence {
    /// Residues that so many reactions leave beside the char.
    pub(super) fn intermediates(self, reactions: usize) -> usize {
        if self == Self::Chain { reactions.saturating_sub(1) } else { 0 }
    }

    /// `in a chain`, `side by side`.
    pub(super) fn words(self) -> &'static str {
        if self == Self::Chain { "in a chain" } else { "side by side" }
    }
}

/// What a residue weighs in the properties of a mixture of virgin, intermediate and char.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Mixing {
    /// By mass, as PATO and FIAT mix conductivity and emissivity.
    Mass,
    /// By volume, as gpyro does.
    Volume,
}

/// Where the heat of pyrolysis is written down; one way or the other, never both.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum PyrolysisHeat {
    /// In the absolute enthalpies of virgin, residues and gas. Here those of virgin and of each residue at
    /// a reference temperature; the gas's table holds its own.
    Absolute {
        /// Enthalpy of the virgin substance, J/kg.
        virgin_j_kg: f64,
        /// Enthalpy of each residue, J/kg.
        residues_j_kg: Vec<f64>,
        /// The temperature of both, K.
        reference_k: f64,
    },
    /// In each reaction; the gas carries sensible heat alone.
    OfReaction,
}

/// What a reaction leaves behind.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Residue {
    /// `char`, or what the file calls an intermediate.
    pub name: String,
    /// J/kg/K.
    pub heat_capacity: Table,
    /// W/m/K.
    pub conductivity: Conductivity,
    /// Total hemispherical, 0 to 1.
    pub emissivity: Table,
    /// How gas passes through it.
    pub pores: Pores,
}

impl Residue {
    fn check(&self, at: &Field<'_>) {
        at.not_blank("name", &self.name);
        self.heat_capacity.check(&at.field("heat_capacity"), Dimension::HeatCapacity);
        self.conductivity.check(&at.field("conductivity"));
        self.emissivity.check(&at.field("emissivity"), Dimension::Fraction);
        self.pores.check(&at.field("pores"));
    }
}

/// How gas passes through a substance.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Pores {
    /// Share of the volume that gas fills.
    pub porosity: f64,
    /// K, m²; zero lets nothing through.
    pub permeability_m2: f64,
    /// Klinkenberg's slip, pressure b over temperature, Pa/K: in air 4 λP/(r T) = 9.33e-5 m/r Pa/K for a pore radius r.
    pub slip_pa_k: f64,
    /// Forchheimer's inertial coefficient, 1/m; zero is Darcy's law.
    pub inertia_1_m: f64,
}

impl Pores {
    /// None at all.
    pub const SEALED: Self = Self { porosity: 0.0, permeability_m2: 0.0, slip_pa_k: 0.0, inertia_1_m: 0.0 };

    /// Share of the volume that gas fills.
    pub(super) fn checked_porosity(porosity: f64) -> Result<f64, String> {
        if (0.0..1.0).contains(&porosity) {
            return Ok(porosity);
        }
        Err(format!("porosity {porosity} lies outside 0 to 1: a solid fills some of the volume"))
    }

    /// That what lets gas through has pores.
    pub(super) fn passable(self) -> Result<Self, String> {
        if self.permeability_m2 > 0.0 && self.porosity == 0.0 {
            let permeability_m2 = self.permeability_m2;
            return Err(format!("without pores nothing passes: porosity 0 and permeability {permeability_m2} m²"));
        }
        Ok(self)
    }

    pub(super) fn check(&self, at: &Field<'_>) {
        at.field("porosity").require(Self::checked_porosity(self.porosity));
        at.not_negative("permeability_m2", self.permeability_m2);
        at.not_negative("slip_pa_k", self.slip_pa_k);
        at.not_negative("inertia_1_m", self.inertia_1_m);
        at.require(self.passable());
    }
}

impl Reaction {
    /// Gas made of each kilogram of virgin substance, a share of it.
    pub(super) fn checked_loss(loss: f64) -> Result<f64, String> {
        if loss > 0.0 && loss < 1.0 {
            return Ok(loss);
        }
        Err(format!("loss {loss} lies outside 0 to 1: it is the gas made of each kilogram of virgin substance"))
    }

    /// The order m, zero or more.
    pub(super) fn checked_order(order: f64) -> Result<f64, String> {
        if finite(order, format_args!("order {order}"))? >= 0.0 {
            return Ok(order);
        }
        Err(format!("order {order} is negative: a reaction slows as it runs out of what it lives on"))
    }

    /// The activation energy E, zero or more, J/mol.
    pub(super) fn checked_activation(activation_j_mol: f64) -> Result<f64, String> {
        if finite(activation_j_mol, format_args!("activation energy {activation_j_mol}"))? >= 0.0 {
            return Ok(activation_j_mol);
        }
        Err(format!("activation energy {activation_j_mol} J/mol is negative: a reaction quickens as it is heated"))
    }

    fn check(&self, at: &Field<'_>, heat: &PyrolysisHeat) {
        at.field("loss").require(Self::checked_loss(self.loss));
        at.positive("rate_1_s", self.rate_1_s);
        at.field("activation_j_mol").require(Self::checked_activation(self.activation_j_mol));
        at.field("order").require(Self::checked_order(self.order));
        at.not_negative("onset_k", self.onset_k);
        at.finite("heat_j_kg", self.heat_j_kg);
        if self.heat_j_kg != 0.0 && *heat != PyrolysisHeat::OfReaction {
            at.field("heat_j_kg").fault(PyrolysisHeat::NONE_OF_REACTION);
        }
    }
}

impl PyrolysisHeat {
    /// Why a reaction has no heat where enthalpies are absolute.
    pub(super) const NONE_OF_REACTION: &str = "the heat lies in absolute enthalpies: expected none of a reaction";
}

impl Decomposition {
    /// Share of the thickness lost.
    pub(super) fn checked_shrinkage(shrinkage: f64) -> Result<f64, String> {
        if (0.0..1.0).contains(&shrinkage) {
            return Ok(shrinkage);
        }
        Err(format!("shrinkage {shrinkage} lies outside 0 to 1: some of the thickness must be left"))
    }

    /// That reactions leave a char.
    pub(super) fn leave_char(reactions: &[Reaction]) -> Result<(), String> {
        let lost: f64 = reactions.iter().map(|reaction| reaction.loss).sum();
        if lost < 1.0 {
            return Ok(());
        }
        // As written, without what sums of binary fractions add in the last place.
        let lost = (lost * 1e9).round() / 1e9;
        Err(format!("losses of {lost} in all leave no char: expected a sum below 1"))
    }

    /// Record what is wrong with each reaction and residue.
    pub(super) fn check(&self, at: &Field<'_>) {
        let reactions = at.field("reactions");
        if self.reactions.is_empty() {
            reactions.fault("no reaction: expected at least one");
        }
        for (at, reaction) in reactions.items(&self.reactions) {
            reaction.check(&at, &self.heat);
        }
        reactions.require(Self::leave_char(&self.reactions));
        let residues = at.field("residues");
        for (at, residue) in residues.items(&self.residues) {
            residue.check(&at);
        }
        let (count, found) = (self.reactions.len(), self.residues.len());
        let wanted = self.sequence.intermediates(count) + 1;
        if found != wanted {
            residues
                .fault(format!("{count} reactions {} leave {wanted} residues, found {found}", self.sequence.words()));
        }
        if let PyrolysisHeat::Absolute { virgin_j_kg, residues_j_kg, reference_k } = &self.heat {
            let at = at.field("heat");
            at.finite("virgin_j_kg", *virgin_j_kg);
            at.positive("reference_k", *reference_k);
            let residues = at.field("residues_j_kg");
            residues.require_each(residues_j_kg, |&enthalpy_j_kg| finite(enthalpy_j_kg, enthalpy_j_kg));
            if residues_j_kg.len() != found {
                residues.fault(format!("{} enthalpies of {found} residues", residues_j_kg.len()));
            }
        }
        at.field("shrinkage").require(Self::checked_shrinkage(self.shrinkage));
        self.provenance.check(&at.field("provenance"));
    }

    /// Share of the virgin mass that leaves as gas when all has reacted.
    pub fn loss(&self) -> f64 {
        self.reactions.iter().map(|reaction| reaction.loss).sum()
    }

    /// Density of each residue where it has replaced all the virgin material, in the volume of the virgin.
    pub fn residue_densities_kg_m3(&self, virgin_kg_m3: f64) -> Vec<f64> {
        match self.sequence {
            Sequence::SideBySide => vec![virgin_kg_m3 * (1.0 - self.loss())],
            Sequence::Chain => self
                .reactions
                .iter()
                .scan(1.0, |left, reaction| {
                    *left -= reaction.loss;
                    Some(virgin_kg_m3 * *left)
                })
                .collect(),
        }
    }
}
