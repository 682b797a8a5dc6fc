//! The transform of a schedule to the quantity that the heat flux is proportional to; a step uses its mean.

use crate::case::Conductivity;
use crate::case::air::cold_wall_enthalpy_j_kg;
use crate::physics::layout::{TABLE_START_K, TABLE_STEP_K, TABLE_STEPS};
use std::sync::Arc;

/// Relation between a scheduled value and the heat flux.
#[derive(Clone, Debug)]
pub(super) enum Transform {
    /// Proportional: fluxes, gas temperatures, pressures.
    Identity,
    /// Reciprocal of the excess over the enthalpy at the cold wall: recovery enthalpies of a hot-wall correction.
    HotWall,
    /// Fourth power: temperatures of radiating surroundings.
    FourthPower,
    /// Integral of the conductivity over temperature: temperatures of a held face (Kirchhoff transformation, Carslaw &
    /// Jaeger, Conduction of Heat in Solids, 1959, section 1.6). Averaging the temperature instead, noise of 11 K at a
    /// face of aerogel whose conductivity rises by 0.1 % a kelvin would shift temperatures behind it by 0.1 K.
    ConductivityIntegral(Arc<ConductivityIntegral>),
}

impl Transform {
    pub(super) fn apply(&self, value: f64) -> f64 {
        match self {
            Self::Identity => value,
            Self::HotWall => 1.0 / (value - cold_wall_enthalpy_j_kg()),
            Self::FourthPower => (value * value) * (value * value),
            Self::ConductivityIntegral(integral) => integral.at(value),
        }
    }

    pub(super) fn inverse(&self, transformed: f64) -> f64 {
        match self {
            Self::Identity => transformed,
            Self::HotWall => cold_wall_enthalpy_j_kg() + 1.0 / transformed,
            Self::FourthPower => transformed.max(0.0).sqrt().sqrt(),
            Self::ConductivityIntegral(integral) => integral.inverse(transformed),
        }
    }
}

/// ∫ k dT from the first table node, W/m, of a conductivity linear between nodes.
#[derive(Clone, Debug)]
pub(super) struct ConductivityIntegral {
    conductivities_w_m_k: Vec<f64>,
    integrals_w_m: Vec<f64>,
}

impl ConductivityIntegral {
    pub(super) fn new(conductivity: &Conductivity, pressure_pa: f64) -> Self {
        let node_k = |node: usize| (TABLE_START_K + TABLE_STEP_K * node as f64).max(1e-6);
        let at = |node: usize| conductivity.parts(node_k(node), pressure_pa).iter().sum::<f64>();
        let conductivities_w_m_k: Vec<f64> = (0..=TABLE_STEPS).map(at).collect();
        let mut integrals_w_m = vec![0.0];
        for pair in conductivities_w_m_k.windows(2) {
            integrals_w_m.push(integrals_w_m[integrals_w_m.len() - 1] + 0.5 * TABLE_STEP_K * (pair[0] + pair[1]));
        }
        Self { conductivities_w_m_k, integrals_w_m }
    }

    /// The conductivity at a node and its slope to the next, per kelvin.
    fn segment(&self, node: usize) -> (f64, f64) {
        let (here, next) = (self.conductivities_w_m_k[node], self.conductivities_w_m_k[node + 1]);
        (here, (next - here) / TABLE_STEP_K)
    }

    fn at(&self, temperature_k: f64) -> f64 {
        let node = ((temperature_k - TABLE_START_K) / TABLE_STEP_K).clamp(0.0, (TABLE_STEPS - 1) as f64) as usize;
        let beyond_k = temperature_k - (TABLE_START_K + TABLE_STEP_K * node as f64);
        let (conductivity, slope) = self.segment(node);
        self.integrals_w_m[node] + beyond_k * (conductivity + 0.5 * slope * beyond_k)
    }

    fn inverse(&self, integral_w_m: f64) -> f64 {
        let above = self.integrals_w_m.partition_point(|&other| other <= integral_w_m);
        let node = above.clamp(1, TABLE_STEPS) - 1;
        let beyond = integral_w_m - self.integrals_w_m[node];
        let (conductivity, slope) = self.segment(node);
        let root = (conductivity * conductivity + 2.0 * slope * beyond).max(0.0).sqrt();
        TABLE_START_K + TABLE_STEP_K * node as f64 + 2.0 * beyond / (conductivity + root).max(f64::MIN_POSITIVE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{OutOfRange, Table};

    #[test]
    fn transform_and_inverse_return_the_temperature() {
        let rising = Table {
            temperatures_k: vec![300.0, 800.0, 1300.0],
            values: vec![0.02, 0.03, 0.09],
            outside: OutOfRange::Extrapolate,
        };
        let conductivity = Conductivity::Tables(vec![(8e3, rising)]);
        let integral = Arc::new(ConductivityIntegral::new(&conductivity, 8e3));
        for transform in [Transform::Identity, Transform::FourthPower, Transform::ConductivityIntegral(integral)] {
            for temperature_k in [4.0, 300.0, 301.7, 1644.0, 3990.0] {
                let found_k = transform.inverse(transform.apply(temperature_k));
                assert!((found_k - temperature_k).abs() < 1e-9 * temperature_k, "{found_k} K, not {temperature_k} K");
            }
        }
        for enthalpy_j_kg in [2.5e3, 1e6, 3e7] {
            let found_j_kg = Transform::HotWall.inverse(Transform::HotWall.apply(enthalpy_j_kg));
            assert!((found_j_kg / enthalpy_j_kg - 1.0).abs() < 1e-9, "{found_j_kg} J/kg, not {enthalpy_j_kg} J/kg");
        }
    }
}
