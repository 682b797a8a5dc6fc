//! Thermogravimetry: the remaining mass of a material at a constant heating rate β.
//!
//! With T(t) known, the reactant fraction w of each reaction follows `dw/dT = −k(T)/β · w^m`. Its solution depends only
//! on the integral of k, which is computed with the trapezoidal rule. For consecutive reactions half of the product of
//! the previous reaction is added before each temperature step and half after it.

use super::decomposition::{Decomposition, GAS_CONSTANT_J_MOL_K, Reaction, ReactionScheme};
use crate::limits::LAYUP_TEMPERATURE_K;

/// Start temperature, K.
const START_K: f64 = 300.0;
/// Highest temperature of a half conversion, the end of all tables, K.
const END_K: f64 = LAYUP_TEMPERATURE_K.max as f64;
/// Temperature step, small compared with the tens of kelvin over which a reaction runs, K.
const TEMPERATURE_STEP_K: f64 = 0.1;

impl Reaction {
    /// Rate constant, 1/s; zero below the onset temperature.
    fn rate_constant(&self, temperature_k: f64) -> f64 {
        if temperature_k < self.onset_temperature_k {
            return 0.0;
        }
        // In logarithms: either factor alone may leave the range of numbers.
        (self.pre_exponential_1_s.ln() - self.activation_energy_j_mol / (GAS_CONSTANT_J_MOL_K * temperature_k)).exp()
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
        let mut heating = Heating::new(self, heating_k_s);
        let mut left = Vec::new();
        for &wanted_k in temperatures_k {
            while heating.temperature_k < wanted_k {
                heating.step((heating.temperature_k + TEMPERATURE_STEP_K).min(wanted_k));
            }
            let lost = self.reactions.iter().zip(&heating.advancements).map(|(reaction, xi)| reaction.mass_loss * xi);
            left.push(1.0 - lost.sum::<f64>());
        }
        left
    }

    /// The temperature at which each reaction is half complete, K, heated from 300 K at a constant rate (K/s); `None`
    /// where that is after `END_K`. A reaction that is faster than the heating has 300 K.
    pub fn half_conversion_temperatures_k(&self, heating_k_s: f64) -> Vec<Option<f64>> {
        let mut heating = Heating::new(self, heating_k_s);
        let mut found = vec![None; self.reactions.len()];
        let mut before = heating.advancements.clone();
        while heating.temperature_k < END_K && found.iter().any(Option::is_none) {
            let from_k = heating.temperature_k;
            heating.step((from_k + TEMPERATURE_STEP_K).min(END_K));
            for ((found, &before), &after) in found.iter_mut().zip(&before).zip(&heating.advancements) {
                if found.is_none() && after >= 0.5 {
                    let is_sudden = from_k == START_K;
                    let share = if is_sudden { 0.0 } else { (0.5 - before) / (after - before) };
                    *found = Some(from_k + share * (heating.temperature_k - from_k));
                }
            }
            before.clone_from(&heating.advancements);
        }
        found
    }
}

/// A specimen that is heated at a constant rate.
struct Heating<'a> {
    decomposition: &'a Decomposition,
    heating_k_s: f64,
    temperature_k: f64,
    /// Of each reaction: what it can consume, and its advancement.
    reactants: Vec<f64>,
    advancements: Vec<f64>,
}

impl<'a> Heating<'a> {
    fn new(decomposition: &'a Decomposition, heating_k_s: f64) -> Self {
        let count = decomposition.reactions.len();
        let first = if decomposition.scheme == ReactionScheme::Consecutive { 0.0 } else { 1.0 };
        let mut reactants = vec![first; count];
        reactants[0] = 1.0;
        Self { decomposition, heating_k_s, temperature_k: START_K, reactants, advancements: vec![0.0; count] }
    }

    fn step(&mut self, next_k: f64) {
        let is_chain = self.decomposition.scheme == ReactionScheme::Consecutive;
        let step_s = (next_k - self.temperature_k) / self.heating_k_s;
        let mut made = 0.0;
        for (index, reaction) in self.decomposition.reactions.iter().enumerate() {
            let rate = 0.5 * (reaction.rate_constant(self.temperature_k) + reaction.rate_constant(next_k));
            let before = self.reactants[index] + 0.5 * made;
            let after = reaction.remaining_reactant(before, rate * step_s);
            self.advancements[index] += before - after;
            self.reactants[index] = after + 0.5 * made;
            made = if is_chain { before - after } else { 0.0 };
        }
        self.temperature_k = next_k;
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

    fn reaction(pre_exponential_1_s: f64, activation_energy_j_mol: f64) -> Decomposition {
        let mut apa = decomposition("apa");
        apa.reactions.truncate(1);
        let reaction = &mut apa.reactions[0];
        (reaction.pre_exponential_1_s, reaction.activation_energy_j_mol) =
            (pre_exponential_1_s, activation_energy_j_mol);
        (reaction.order, reaction.onset_temperature_k) = (1.0, 0.0);
        apa
    }

    /// Heating rate, K/min, A, 1/s, E, J/mol, and the temperature, K, at which the rate constant, integrated from 300 K
    /// over temperature by Simpson's rule with 200,000 intervals, is ln 2 times the heating rate.
    const HALF_CONVERSIONS: [(f64, f64, f64, f64); 9] = [
        (1.0, 1e9, 150e3, 638.91),
        (10.0, 1e9, 150e3, 691.55),
        (100.0, 1e9, 150e3, 753.27),
        (1.0, 3.16e33, 251.8e3, 364.64),
        (10.0, 3.16e33, 251.8e3, 374.79),
        (100.0, 3.16e33, 251.8e3, 385.51),
        (1.0, 1e38, 480e3, 615.34),
        (10.0, 1e38, 480e3, 630.49),
        (100.0, 1e38, 480e3, 646.40),
    ];

    #[test]
    fn half_conversion_is_at_the_temperature_of_the_ordinary_differential_equation() {
        for (heating_k_min, a_1_s, e_j_mol, expected_k) in HALF_CONVERSIONS {
            let found = reaction(a_1_s, e_j_mol).half_conversion_temperatures_k(heating_k_min / 60.0);
            let found_k = found[0].expect("it reacts");
            assert!((found_k - expected_k).abs() < 0.05, "{a_1_s:e} 1/s at {heating_k_min} K/min: {found_k} K");
        }
        assert_eq!(reaction(1e10, 0.0).half_conversion_temperatures_k(1.0), [Some(300.0)], "faster than the heating");
        assert_eq!(reaction(1e-9, 480e3).half_conversion_temperatures_k(1.0), [None], "never");
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
