//! A substance: its properties over temperature and pressure, each with where it came from.

use super::air::air_in_pores_w_m_k;
use super::table::Table;

/// How far a number can be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// Read in a public source.
    Read,
    /// Remembered of a named publication; unverified.
    Remembered,
    /// Engineering estimate, or computed for this database.
    Estimated,
    /// Stated in the paper.
    Paper,
}

impl Mark {
    /// Each mark and its word in a material file.
    const WORDS: [(Mark, &'static str); 4] = [
        (Mark::Read, "read"),
        (Mark::Remembered, "remembered"),
        (Mark::Estimated, "estimated"),
        (Mark::Paper, "paper"),
    ];

    pub fn word(self) -> &'static str {
        Self::WORDS.iter().find(|(mark, _)| *mark == self).map_or("", |(_, word)| word)
    }

    pub fn named(word: &str) -> Option<Mark> {
        Self::WORDS.iter().find(|(_, known)| *known == word).map(|&(mark, _)| mark)
    }
}

/// Where a number came from.
#[derive(Clone, Debug, PartialEq)]
pub struct Provenance {
    pub mark: Mark,
    pub source: String,
    /// One standard deviation relative to the value.
    pub relative_uncertainty: f64,
}

/// A substance.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The file's name: `pyrogel3350`.
    pub id: String,
    /// What people call it.
    pub name: String,
    /// A sentence for the report; says `surrogate` where the real figures are not public.
    pub note: String,
    pub density_kg_m3: f64,
    pub density_provenance: Provenance,
    /// J/kg/K.
    pub heat_capacity: Table,
    pub heat_capacity_provenance: Provenance,
    pub conductivity: Conductivity,
    pub conductivity_provenance: Provenance,
    pub emissivity: Table,
    pub emissivity_provenance: Provenance,
}

/// Conductivity over temperature and pressure, W/m/K.
#[derive(Clone, Debug, PartialEq)]
pub enum Conductivity {
    /// A table a pressure, pressures rising (Pa); between them linear in the logarithm of pressure, held outside.
    Tables(Vec<(f64, Table)>),
    /// Solid + gas + radiation.
    Parts(Parts),
}

/// The three-part conductivity of a porous insulator.
///
/// `k = k_s0 (T/300)^m + φ k_g(T, P; L_c) + 16 σ T³/(3 β)`, with the temperature-jump gas part of
/// fibrous and aerogel insulations and the Rosseland diffusion approximation for radiation.
#[derive(Clone, Debug, PartialEq)]
pub struct Parts {
    /// k_s0 at 300 K, W/m/K.
    pub solid_w_m_k: f64,
    /// Exponent m.
    pub solid_exponent: f64,
    /// Pores, each a share φ (above one where gas bridges fibre contacts) and a length L_c, m.
    pub pores: Vec<(f64, f64)>,
    /// Rosseland extinction β, 1/m; `None` has no radiative part.
    pub extinction_1_m: Option<f64>,
    /// Temperatures for which the fit holds, K.
    pub range_k: (f64, f64),
}

/// Stefan–Boltzmann constant, W/m²/K⁴ (CODATA 2018).
const STEFAN_BOLTZMANN: f64 = 5.670_374_419e-8;

impl Conductivity {
    /// The solid, gas and radiative parts at a temperature and a pressure, W/m/K; they add up to the conductivity. A
    /// table does not tell its parts apart and counts as solid.
    pub fn parts(&self, temperature_k: f64, pressure_pa: f64) -> [f64; 3] {
        match self {
            Self::Tables(tables) => [between(tables, temperature_k, pressure_pa), 0.0, 0.0],
            Self::Parts(parts) => parts.at(temperature_k, pressure_pa),
        }
    }

    /// The temperatures for which it is known, K.
    pub fn range_k(&self) -> (f64, f64) {
        match self {
            Self::Tables(tables) => {
                let common = |(low, high): (f64, f64), (l, h): (f64, f64)| (low.max(l), high.min(h));
                tables.iter().map(|(_, table)| table.range_k()).fold((f64::NEG_INFINITY, f64::INFINITY), common)
            }
            Self::Parts(parts) => parts.range_k,
        }
    }
}

/// Linear in the logarithm of pressure, held outside.
fn between(tables: &[(f64, Table)], temperature_k: f64, pressure_pa: f64) -> f64 {
    let last = tables.len() - 1;
    let next = tables.partition_point(|&(pressure, _)| pressure <= pressure_pa);
    if next == 0 || next > last {
        return tables[next.min(last)].1.at(temperature_k);
    }
    let ((p0, low), (p1, high)) = (&tables[next - 1], &tables[next]);
    let share = (pressure_pa / p0).ln() / (p1 / p0).ln();
    low.at(temperature_k) * (1.0 - share) + high.at(temperature_k) * share
}

impl Parts {
    fn at(&self, temperature_k: f64, pressure_pa: f64) -> [f64; 3] {
        let solid = self.solid_w_m_k * (temperature_k / 300.0).powf(self.solid_exponent);
        let pore = |&(share, length_m): &(f64, f64)| share * air_in_pores_w_m_k(temperature_k, pressure_pa, length_m);
        let gas = self.pores.iter().map(pore).sum();
        let radiation = |extinction_1_m| 16.0 * STEFAN_BOLTZMANN * temperature_k.powi(3) / (3.0 * extinction_1_m);
        [solid, gas, self.extinction_1_m.map_or(0.0, radiation)]
    }
}
