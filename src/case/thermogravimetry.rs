//! Thermogravimetry: the remaining mass of a material at a constant heating rate β.
//!
//! With T(t) known, the reactant fraction w of each reaction follows `dw/dT = −k(T)/β · w^m`. Its solution depends only
//! on the integral of k, which is computed with the trapezoidal rule. For consecutive reactions half of the product of
//! the previous reaction is added before each temperature step and half after it.

use super::decomposition::{Decomposition, GAS_CONSTANT_J_MOL_K, Reaction, ReactionScheme};

/// Start temperature, K.
const START_K: f64 = 300.0;
/// Temperature step, small compared with the tens of kelvin over which a reaction runs, K.
const TEMPERATURE_STEP_K: f64 = 0.1;

impl Reaction {
    /// Rate constant, 1/s; zero below the onset temperature.
    fn rate_constant(&self, temperature_k: f64) -> f64 {
        if temperature_k < self.onset_temperature_k {
            return 0.0;
        }
        self.pre_exponential_1_s * (-self.activation_energy_j_mol / (GAS_CONSTANT_J_MOL_K * temperature_k)).exp()
    }

    /// Reactant fraction after a step from the fraction `share`; `turns` is the integral of the rate constant over the
    /// step.
    fn remaining_reactant(&self, share: f64, turns: f64) -> f64 {
        if share <= 0.0 {
            return 0.0;
        }
        if self.order == 1.0 {
            return share * (-turns).exp();
        }
        let power = share.powf(1.0 - self.order) + (self.order - 1.0) * turns;
        if power <= 0.0 { 0.0 } else { power.powf(1.0 / (1.0 - self.order)) }
    }
}

impl Decomposition {
    /// Remaining mass per virgin mass at increasing temperatures (K), heated from 300 K at a constant rate (K/s).
    pub fn remaining_mass_fractions(&self, heating_k_s: f64, temperatures_k: &[f64]) -> Vec<f64> {
        let count = self.reactions.len();
        let mut reactants = vec![if self.scheme == ReactionScheme::Consecutive { 0.0 } else { 1.0 }; count];
        reactants[0] = 1.0;
        let mut advancements = vec![0.0; count];
        let mut temperature_k = START_K;
        let mut left = Vec::new();
        for &wanted_k in temperatures_k {
            while temperature_k < wanted_k {
                let next_k = (temperature_k + TEMPERATURE_STEP_K).min(wanted_k);
                let mut made = 0.0;
                for (index, reaction) in self.reactions.iter().enumerate() {
                    let rate = 0.5 * (reaction.rate_constant(temperature_k) + reaction.rate_constant(next_k));
                    let before = reactants[index] + 0.5 * made;
                    let after = reaction.remaining_reactant(before, rate * (next_k - temperature_k) / heating_k_s);
                    advancements[index] += before - after;
                    reactants[index] = after + 0.5 * made;
                    made = if self.scheme == ReactionScheme::Consecutive { before - after } else { 0.0 };
                }
                temperature_k = next_k;
            }
            let lost = self.reactions.iter().zip(&advancements).map(|(reaction, xi)| reaction.mass_loss * xi);
            left.push(1.0 - lost.sum::<f64>());
        }
        left
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

    #[test]
    fn two_equal_consecutive_first_order_reactions_match_the_exact_solution() {
        // A → B → C of one constant rate k: ξ₁ = 1 − e^−kt, ξ₂ = 1 − (1 + kt) e^−kt.
        let (rate_1_s, heating_k_s) = (0.02, 1.0);
        let reaction = Reaction {
            mass_loss: 0.3,
            pre_exponential_1_s: rate_1_s,
            activation_energy_j_mol: 0.0,
            order: 1.0,
            onset_temperature_k: 0.0,
            heat_j_kg: 0.0,
        };
        let chain = Decomposition {
            reactions: vec![reaction.clone(), reaction],
            scheme: ReactionScheme::Consecutive,
            ..decomposition("apa")
        };
        let turns: f64 = rate_1_s * 100.0 / heating_k_s;
        let (first, second) = (1.0 - (-turns).exp(), 1.0 - (1.0 + turns) * (-turns).exp());
        let found = chain.remaining_mass_fractions(heating_k_s, &[400.0])[0];
        assert!((found - (1.0 - 0.3 * (first + second))).abs() < 1e-6, "{found}");
        let parallel = Decomposition { scheme: ReactionScheme::Parallel, ..chain };
        assert!((parallel.remaining_mass_fractions(heating_k_s, &[400.0])[0] - found).abs() > 0.05);
    }
}
