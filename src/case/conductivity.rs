//! Conductivity over temperature and pressure: tables, or the sum of a solid, a gas and a radiative part.

use super::air::air_conductivity_in_pores_w_m_k;
use super::table::{Table, is_multiple};
use super::unit::Dimension;
use super::validation::{FieldPath, positive};

/// Conductivity over temperature and pressure, W/m/K.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub enum Conductivity {
    /// One table per pressure (Pa, increasing); linear in ln p between pressures, constant outside.
    Tables(Vec<(f64, Table)>),
    /// Solid + gas + radiation.
    ThreePart(ThreePartConductivity),
}

/// The three-part conductivity of a porous insulator.
///
/// `k = k_s0 (T/300)^m + φ k_g(T, P; L_c) + 16 σ T³/(3 β)`, with the temperature-jump gas part of
/// fibrous and aerogel insulations and the Rosseland diffusion approximation for radiation.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ThreePartConductivity {
    /// k_s0 at 300 K, W/m/K.
    pub solid_w_m_k: f64,
    /// m, the exponent of the solid part.
    pub solid_exponent: f64,
    /// Pore classes: volume fraction φ (above one where gas bridges fibre contacts) and characteristic length L_c, m.
    pub pores: Vec<(f64, f64)>,
    /// Rosseland extinction coefficient β, 1/m; `None` for no radiative part.
    pub extinction_1_m: Option<f64>,
    /// Whether β is stated per mass and so is proportional to density.
    pub extinction_follows_density: bool,
    /// Lowest and highest temperature of the fit, K.
    pub range_k: (f64, f64),
}

/// Stefan–Boltzmann constant, W/m²/K⁴ (CODATA 2018).
const STEFAN_BOLTZMANN: f64 = 5.670_374_419e-8;

impl Conductivity {
    /// The pressure of the next table, above the previous one and above zero, Pa.
    pub(super) fn checked_next_pressure_pa(last_pa: f64, pressure_pa: f64) -> Result<f64, String> {
        if positive(pressure_pa, format_args!("a pressure of {pressure_pa} Pa"))? > last_pa {
            return Ok(pressure_pa);
        }
        Err(format!("pressures must increase: {pressure_pa} Pa follows {last_pa} Pa"))
    }

    /// Record all errors of the tables or parts.
    pub(super) fn check(&self, at: &FieldPath<'_>) {
        match self {
            Self::Tables(tables) if tables.is_empty() => at.error("no table: expected at least one"),
            Self::Tables(tables) => {
                let mut last_pa = 0.0;
                for (at, (pressure_pa, table)) in at.elements(tables) {
                    last_pa = at.require(Self::checked_next_pressure_pa(last_pa, *pressure_pa)).unwrap_or(last_pa);
                    table.check(&at, Dimension::Conductivity);
                }
            }
            Self::ThreePart(parts) => parts.check(at),
        }
    }

    /// The solid, gas and radiative parts, W/m/K; their sum is the conductivity. A table counts as solid.
    pub fn parts(&self, temperature_k: f64, pressure_pa: f64) -> [f64; 3] {
        match self {
            Self::Tables(tables) => {
                [interpolate_in_log_pressure(tables, pressure_pa, |table| table.at(temperature_k)), 0.0, 0.0]
            }
            Self::ThreePart(parts) => parts.at(temperature_k, pressure_pa),
        }
    }

    /// The limits of the [`parts`](Self::parts) from lower temperatures: at a jump of a table the values before it.
    pub(crate) fn parts_just_below(&self, temperature_k: f64, pressure_pa: f64) -> [f64; 3] {
        match self {
            Self::Tables(tables) => {
                [interpolate_in_log_pressure(tables, pressure_pa, |table| table.just_below(temperature_k)), 0.0, 0.0]
            }
            Self::ThreePart(parts) => parts.at(temperature_k, pressure_pa),
        }
    }

    /// The ratio to another conductivity, if it is constant over temperature and pressure and equal for all parts.
    pub fn constant_ratio_to(&self, other: &Self) -> Option<f64> {
        match (self, other) {
            (Self::Tables(own), Self::Tables(others)) => {
                let pressures =
                    |tables: &[(f64, Table)]| tables.iter().map(|&(pressure_pa, _)| pressure_pa).collect::<Vec<_>>();
                let mut all = own.iter().zip(others).map(|((_, own), (_, other))| own.constant_ratio_to(other));
                let times = all.next()??;
                let is_alike = pressures(own) == pressures(others)
                    && all.all(|more| more.is_some_and(|more| is_multiple(more, 1.0, times)));
                is_alike.then_some(times)
            }
            (Self::ThreePart(own), Self::ThreePart(other)) => own.constant_ratio_to(other),
            _ => None,
        }
    }

    /// Whether the extinction coefficient is proportional to density.
    pub fn extinction_follows_density(&self) -> bool {
        matches!(self, Self::ThreePart(parts) if parts.extinction_follows_density)
    }

    /// Lowest and highest temperature for which it is known, K.
    pub fn range_k(&self) -> (f64, f64) {
        match self {
            Self::Tables(tables) => {
                let common = |(low, high): (f64, f64), (l, h): (f64, f64)| (low.max(l), high.min(h));
                tables.iter().map(|(_, table)| table.range_k()).fold((f64::NEG_INFINITY, f64::INFINITY), common)
            }
            Self::ThreePart(parts) => parts.range_k,
        }
    }
}

/// Interpolation of the values of the tables, linear in ln p; constant outside their pressures.
fn interpolate_in_log_pressure(tables: &[(f64, Table)], pressure_pa: f64, value: impl Fn(&Table) -> f64) -> f64 {
    let last = tables.len() - 1;
    let next = tables.partition_point(|&(pressure, _)| pressure <= pressure_pa);
    if next == 0 || next > last {
        return value(&tables[next.min(last)].1);
    }
    let ((p0, low), (p1, high)) = (&tables[next - 1], &tables[next]);
    let share = (pressure_pa / p0).ln() / (p1 / p0).ln();
    value(low) * (1.0 - share) + value(high) * share
}

impl ThreePartConductivity {
    /// Lowest and highest temperature of a fit, K.
    pub(super) fn checked_range_k((low_k, high_k): (f64, f64)) -> Result<(f64, f64), String> {
        if low_k < high_k {
            Ok((low_k, high_k))
        } else {
            Err(format!("range reversed: {low_k} K is not below {high_k} K"))
        }
    }

    fn check(&self, at: &FieldPath<'_>) {
        at.not_negative("solid_w_m_k", self.solid_w_m_k);
        at.finite("solid_exponent", self.solid_exponent);
        for (at, &(share, length_m)) in at.child("pores").elements(&self.pores) {
            at.require(positive(share, format_args!("a share of {share}")));
            at.require(positive(length_m, format_args!("a length of {length_m} m")));
        }
        if let Some(extinction_1_m) = self.extinction_1_m {
            at.positive("extinction_1_m", extinction_1_m);
        }
        let range = at.child("range_k");
        for limit_k in [self.range_k.0, self.range_k.1] {
            range.require(positive(limit_k, limit_k));
        }
        range.require(Self::checked_range_k(self.range_k));
    }

    fn constant_ratio_to(&self, other: &Self) -> Option<f64> {
        let times = self.solid_w_m_k / other.solid_w_m_k;
        let lengths = |parts: &Self| parts.pores.iter().map(|&(_, length_m)| length_m).collect::<Vec<_>>();
        let extinction_scales = match (self.extinction_1_m, other.extinction_1_m) {
            (None, None) => true,
            (Some(own), Some(other)) => is_multiple(other, own, times),
            _ => false,
        };
        let is_alike = is_multiple(self.solid_w_m_k, other.solid_w_m_k, times)
            && self.solid_exponent == other.solid_exponent
            && lengths(self) == lengths(other)
            && self.pores.iter().zip(&other.pores).all(|((own, _), (other, _))| is_multiple(*own, *other, times))
            && extinction_scales
            && self.extinction_follows_density == other.extinction_follows_density;
        is_alike.then_some(times)
    }

    fn at(&self, temperature_k: f64, pressure_pa: f64) -> [f64; 3] {
        let solid = self.solid_w_m_k * (temperature_k / 300.0).powf(self.solid_exponent);
        let pore = |&(share, length_m): &(f64, f64)| {
            share * air_conductivity_in_pores_w_m_k(temperature_k, pressure_pa, length_m)
        };
        let gas = self.pores.iter().map(pore).sum();
        let radiation = |extinction_1_m| 16.0 * STEFAN_BOLTZMANN * temperature_k.powi(3) / (3.0 * extinction_1_m);
        [solid, gas, self.extinction_1_m.map_or(0.0, radiation)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Material;

    /// Material, pressure (Pa), temperatures (K) and conductivities (W/m/K) recorded when the parts were fitted,
    /// rounded to 1 mW/m/K for cloth and to 0.1 mW/m/K otherwise; half of the last digit is 1.3 %.
    type RecordedConductivities = (&'static str, f64, &'static [f64], &'static [f64]);

    const CLOTH_K: &[f64] = &[300.0, 473.0, 673.0, 873.0, 1073.0, 1273.0, 1473.0, 1673.0];
    const AEROGEL_K: &[f64] = &[300.0, 400.0, 500.0, 600.0, 700.0, 800.0, 900.0, 1000.0, 1100.0, 1200.0, 1300.0];
    const FIBRE_K: &[f64] = &[300.0, 500.0, 700.0, 900.0, 1100.0, 1300.0, 1500.0];

    const RECORDED: &[RecordedConductivities] = &[
        ("nextel440_bf20", 101_325.0, CLOTH_K, &[0.088, 0.112, 0.135, 0.154, 0.171, 0.186, 0.200, 0.213]),
        ("nextel440_bf20", 8010.0, CLOTH_K, &[0.083, 0.101, 0.116, 0.126, 0.134, 0.140, 0.145, 0.149]),
        ("nextel440_bf20", 3100.0, CLOTH_K, &[0.076, 0.088, 0.096, 0.100, 0.103, 0.104, 0.105, 0.105]),
        ("sic_5hs", 101_325.0, CLOTH_K, &[0.158, 0.185, 0.213, 0.239, 0.266, 0.295, 0.326, 0.362]),
        ("sic_5hs", 8010.0, CLOTH_K, &[0.152, 0.173, 0.192, 0.209, 0.226, 0.245, 0.267, 0.293]),
        ("sic_5hs", 3100.0, CLOTH_K, &[0.145, 0.159, 0.171, 0.181, 0.192, 0.206, 0.223, 0.246]),
        (
            "pyrogel3350",
            101_325.0,
            AEROGEL_K,
            &[0.0164, 0.0198, 0.0243, 0.0306, 0.0392, 0.0504, 0.0647, 0.0825, 0.1041, 0.1300, 0.1606],
        ),
        (
            "pyrogel2250",
            8010.0,
            AEROGEL_K,
            &[0.0099, 0.0129, 0.0174, 0.0237, 0.0324, 0.0437, 0.0581, 0.0760, 0.0978, 0.1238, 0.1545],
        ),
        (
            "pyrogel3350",
            100.0,
            AEROGEL_K,
            &[0.0091, 0.0121, 0.0166, 0.0230, 0.0317, 0.0430, 0.0575, 0.0754, 0.0972, 0.1233, 0.1540],
        ),
        ("saffil_96", 101_325.0, FIBRE_K, &[0.0313, 0.0536, 0.0842, 0.1283, 0.1908, 0.2762, 0.3890]),
        ("saffil_96", 8010.0, FIBRE_K, &[0.0304, 0.0513, 0.0802, 0.1224, 0.1827, 0.2659, 0.3763]),
        ("saffil_96", 100.0, FIBRE_K, &[0.0119, 0.0208, 0.0402, 0.0747, 0.1286, 0.2063, 0.3121]),
        ("apa", 101_325.0, FIBRE_K, &[0.0318, 0.0541, 0.0847, 0.1288, 0.1913, 0.2767, 0.3895]),
        ("apa2", 8010.0, FIBRE_K, &[0.0297, 0.0477, 0.0708, 0.1032, 0.1487, 0.2108, 0.2928]),
        ("pi_aerogel", 101_325.0, AEROGEL_K.split_at(6).0, &[0.0181, 0.0223, 0.0276, 0.0347, 0.0440, 0.0561]),
    ];

    /// The largest relative difference between the model and the recorded values.
    fn largest_relative_difference(id: &str, pressure_pa: f64, temperatures_k: &[f64], printed: &[f64]) -> f64 {
        let material = Material::named(id).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(temperatures_k.len(), printed.len());
        let difference = |(&temperature_k, &printed): (&f64, &f64)| {
            let found: f64 = material.conductivity.parts(temperature_k, pressure_pa).iter().sum();
            (found / printed - 1.0).abs()
        };
        temperatures_k.iter().zip(printed).map(difference).fold(0.0, f64::max)
    }

    #[test]
    fn fitted_parts_reproduce_the_recorded_conductivities() {
        for &(id, pressure_pa, temperatures_k, printed) in RECORDED {
            let worst = largest_relative_difference(id, pressure_pa, temperatures_k, printed);
            assert!(worst < 0.013, "{id} at {pressure_pa} Pa: {worst}");
        }
        let (id, _, temperatures_k, printed) = RECORDED[0];
        assert!(largest_relative_difference(id, 8010.0, temperatures_k, printed) > 0.05, "a wrong pressure must show");
    }

    #[test]
    fn tables_are_interpolated_in_the_logarithm_of_pressure() {
        let tables = vec![(100.0, Table::constant(0.02)), (10_000.0, Table::constant(0.04))];
        let conductivity = Conductivity::Tables(tables);
        for (pressure_pa, expected) in [(10.0, 0.02), (100.0, 0.02), (1000.0, 0.03), (10_000.0, 0.04), (1e5, 0.04)] {
            let [solid, gas, radiative] = conductivity.parts(300.0, pressure_pa);
            assert!((solid - expected).abs() < 1e-12, "{pressure_pa} Pa: {solid}");
            assert_eq!((gas, radiative), (0.0, 0.0));
        }
    }
}
