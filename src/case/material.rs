//! A substance: its properties over temperature and pressure, each with where it came from.

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

impl Conductivity {
    /// Solid, gas and radiative part at a temperature and pressure, W/m/K; a plain table is all solid.
    pub fn parts(&self, temperature_k: f64, _pressure_pa: f64) -> [f64; 3] {
        match self {
            Self::Tables(tables) => [tables[0].1.at(temperature_k), 0.0, 0.0],
            Self::Parts(parts) => [parts.solid_w_m_k, 0.0, 0.0],
        }
    }
}
