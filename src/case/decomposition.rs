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

use super::material::{Conductivity, Provenance};
use super::table::Table;
use std::sync::Arc;

/// Gas constant, J/mol/K (CODATA 2018).
pub const GAS_CONSTANT_J_MOL_K: f64 = 8.314_462_618;

/// The reactions of a substance and what they leave.
#[derive(Clone, Debug, PartialEq)]
pub struct Decomposition {
    pub reactions: Vec<Reaction>,
    pub sequence: Sequence,
    /// What is left: the char alone side by side, one a reaction in a chain; the last is the char. Their
    /// densities follow from the losses.
    pub residues: Vec<Residue>,
    pub mixing: Mixing,
    pub heat: PyrolysisHeat,
    /// Share of the thickness lost when all has reacted, in proportion to the mass lost on the way.
    pub shrinkage: f64,
    pub provenance: Provenance,
}

/// One Arrhenius reaction.
#[derive(Clone, Debug, PartialEq)]
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
pub enum Sequence {
    SideBySide,
    Chain,
}

/// What a residue weighs in the properties of a mixture of virgin, intermediate and char.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mixing {
    /// By mass, as PATO and FIAT mix conductivity and emissivity.
    Mass,
    /// By volume, as gpyro does.
    Volume,
}

/// Where the heat of pyrolysis is written down; one way or the other, never both.
#[derive(Clone, Debug, PartialEq)]
pub enum PyrolysisHeat {
    /// In the absolute enthalpies of virgin, residues and gas. Here those of virgin and of each residue at
    /// a reference temperature, J/kg and K; the gas's table holds its own.
    Absolute { virgin_j_kg: f64, residues_j_kg: Vec<f64>, reference_k: f64 },
    /// In each reaction; the gas carries sensible heat alone.
    OfReaction,
}

/// What a reaction leaves behind.
#[derive(Clone, Debug, PartialEq)]
pub struct Residue {
    /// `char`, or what the file calls an intermediate.
    pub name: String,
    /// J/kg/K.
    pub heat_capacity: Table,
    pub conductivity: Conductivity,
    pub emissivity: Table,
    pub pores: Pores,
}

/// How gas passes through a substance.
#[derive(Clone, Copy, Debug, PartialEq)]
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
}

impl Decomposition {
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

/// Properties of the gas that flows, at about the pressure of the case.
#[derive(Clone, Debug, PartialEq)]
pub struct Gas {
    pub id: String,
    pub name: String,
    pub note: String,
    /// kg/mol.
    pub molar_mass: Table,
    /// J/kg; absolute where the heat of pyrolysis is, else sensible from any level.
    pub enthalpy: Table,
    /// Pa s.
    pub viscosity: Table,
    pub provenance: Provenance,
}

/// How the gas made in a layup leaves it.
#[derive(Clone, Debug, PartialEq)]
pub struct GasFlow {
    pub path: GasPath,
    pub gas: Arc<Gas>,
}

/// Ways out for gas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GasPath {
    /// Straight to the hot face, exchanging no heat on its way.
    Unhindered,
    /// All gas made below a depth flows through it to the hot face as it is made (CMA, FIAT).
    QuasiSteady,
    /// By Darcy's law, stored on its way.
    Darcy,
}
