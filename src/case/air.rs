//! Properties of air, in pores and at the hot face.

/// Sutherland's law for the conductivity of air: conductivity at 273.15 K (W/m/K) and Sutherland temperature (K).
/// Values: F. M. White, *Viscous Fluid Flow*.
const CONDUCTIVITY_AT_ICE_POINT_W_M_K: f64 = 0.0241;
const SUTHERLAND_K: f64 = 194.4;
const ICE_POINT_K: f64 = 273.15;

/// Boltzmann's constant, J/K (exact in the SI of 2019).
const BOLTZMANN_J_K: f64 = 1.380_649e-23;
/// Collision diameter of air, m. Source: K. Daryabeigi, *Heat transfer in high-temperature fibrous insulation*, 2003
/// (from memory, not checked).
const COLLISION_DIAMETER_M: f64 = 3.65e-10;

/// Ratio of heat capacities and Prandtl number of air.
const GAMMA: f64 = 1.4;
const PRANDTL: f64 = 0.71;
/// Thermal accommodation coefficient of air at the walls of a pore; between 0.9 and 1 in Daryabeigi's fits.
const ACCOMMODATION_COEFFICIENT: f64 = 0.9;

/// Enthalpy of air over temperature, J/kg, zero at 298 K, integrated from the heat capacity. Dissociation, which
/// raises it above about 2000 K, is neglected.
const ENTHALPY_J_KG: [f64; 7] = [2e3, 310e3, 636e3, 980e3, 1338e3, 1582e3, 1954e3];
/// The temperatures of these enthalpies, K.
pub const AIR_ENTHALPY_CORNERS_K: [f64; 7] = [300.0, 600.0, 900.0, 1200.0, 1500.0, 1700.0, 2000.0];

/// Cold-wall temperature of the stated heat flux of a probe, K.
const COLD_WALL_K: f64 = 300.0;

/// Enthalpy of air at the cold wall of a probe relative to 298 K, J/kg.
pub fn cold_wall_enthalpy_j_kg() -> f64 {
    air_enthalpy_j_kg(COLD_WALL_K)
}

/// Conductivity of unconfined air, W/m/K.
pub fn air_conductivity_w_m_k(temperature_k: f64) -> f64 {
    let ratio = temperature_k / ICE_POINT_K;
    CONDUCTIVITY_AT_ICE_POINT_W_M_K * ratio * ratio.sqrt() * (ICE_POINT_K + SUTHERLAND_K)
        / (temperature_k + SUTHERLAND_K)
}

/// Mean free path of air, m: `k_B T / (√2 π d² p)`.
pub fn air_mean_free_path_m(temperature_k: f64, pressure_pa: f64) -> f64 {
    BOLTZMANN_J_K * temperature_k
        / (2f64.sqrt() * std::f64::consts::PI * COLLISION_DIAMETER_M * COLLISION_DIAMETER_M * pressure_pa)
}

/// Conductivity of air in pores of length L, W/m/K, with the temperature jump at the pore walls.
///
/// `k = k* / (1 + 2 (2−α)/α · 2γ/(γ+1) · Kn/Pr)` with `Kn = λ/L`, which is `k* p/(p + b T)` ([`air_slip_pa_k`]).
/// Daryabeigi drops one term of the denominator in the continuum and the other in free molecular flow. Both are used
/// here at all Knudsen numbers: the difference is a few per cent, and the function has a continuous derivative.
pub fn air_conductivity_in_pores_w_m_k(temperature_k: f64, pressure_pa: f64, length_m: f64) -> f64 {
    air_conductivity_w_m_k(temperature_k) / (1.0 + air_slip_pa_k(length_m) * temperature_k / pressure_pa)
}

/// Slip coefficient b of air in pores of length L, Pa/K: see [`air_conductivity_in_pores_w_m_k`].
pub fn air_slip_pa_k(length_m: f64) -> f64 {
    let jump =
        2.0 * (2.0 - ACCOMMODATION_COEFFICIENT) / ACCOMMODATION_COEFFICIENT * (2.0 * GAMMA / (GAMMA + 1.0)) / PRANDTL;
    jump * air_mean_free_path_m(1.0, 1.0) / length_m
}

/// Enthalpy of air relative to 298 K, J/kg: piecewise linear from 300 to 2000 K, extrapolated linearly outside.
pub fn air_enthalpy_j_kg(temperature_k: f64) -> f64 {
    let (corners_k, values) = (AIR_ENTHALPY_CORNERS_K, ENTHALPY_J_KG);
    let above = corners_k.partition_point(|&corner_k| corner_k <= temperature_k).clamp(1, corners_k.len() - 1);
    let slope = (values[above] - values[above - 1]) / (corners_k[above] - corners_k[above - 1]);
    values[above - 1] + slope * (temperature_k - corners_k[above - 1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conductivity_and_mean_free_path_of_air_match_handbook_values() {
        for (temperature_k, expected) in [(300.0, 0.0262), (673.0, 0.0502), (1073.0, 0.0692), (1473.0, 0.0846)] {
            let found = air_conductivity_w_m_k(temperature_k);
            assert!((found - expected).abs() < 2e-4, "{temperature_k} K: {found}");
        }
        let product = air_mean_free_path_m(300.0, 8010.0) * 8010.0 / 300.0;
        assert!((product - 2.333e-5).abs() < 2e-8, "{product}");
    }

    #[test]
    fn air_in_wide_pores_conducts_as_free_air_and_in_narrow_pores_in_proportion_to_pressure() {
        let free = air_conductivity_w_m_k(300.0);
        assert!((air_conductivity_in_pores_w_m_k(300.0, 101_325.0, 1.0) / free - 1.0).abs() < 1e-6);
        let (narrow, narrower) =
            (air_conductivity_in_pores_w_m_k(300.0, 100.0, 1e-7), air_conductivity_in_pores_w_m_k(300.0, 50.0, 1e-7));
        assert!((narrow / narrower - 2.0).abs() < 1e-2, "free molecular conduction is proportional to pressure");
    }

    #[test]
    fn enthalpy_of_air_is_zero_at_298_kelvin_and_increases() {
        assert!(air_enthalpy_j_kg(298.0).abs() < 100.0);
        assert_eq!(air_enthalpy_j_kg(750.0), 473e3);
        assert_eq!(air_enthalpy_j_kg(2300.0), 1954e3 + 372e3);
    }
}
