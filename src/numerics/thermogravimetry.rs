//! Thermogravimetry: reactions of a specimen that is heated at a constant rate β.
//!
//! With T(t) known, the reactant fraction w of each reaction follows `dw/dT = −k(T)/β · w^m`. Its solution depends only
//! on the integral of k, which is computed with the trapezoidal rule. For consecutive reactions half of the product of
//! the previous reaction is added before each temperature step and half after it.

/// Gas constant, J/mol/K (CODATA 2018).
pub const GAS_CONSTANT_J_MOL_K: f64 = 8.314_462_618;

/// Start temperature, K.
const START_K: f64 = 300.0;
/// Temperature step, small compared with the tens of kelvin over which a reaction runs, K.
const TEMPERATURE_STEP_K: f64 = 0.1;

/// Kinetics of an Arrhenius reaction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kinetics {
    /// A, 1/s.
    pub(crate) pre_exponential_1_s: f64,
    /// E, J/mol.
    pub(crate) activation_energy_j_mol: f64,
    /// m.
    pub(crate) order: f64,
    /// Temperature below which the rate is zero, K.
    pub(crate) onset_temperature_k: f64,
}

impl Kinetics {
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

/// A specimen that is heated from 300 K at a constant rate.
pub(crate) struct Specimen<'a> {
    reactions: &'a [Kinetics],
    /// Whether each reaction consumes the product of the one before.
    is_chain: bool,
    heating_k_s: f64,
    temperature_k: f64,
    /// Amount of reactant that each reaction can consume.
    reactants: Vec<f64>,
    advancements: Vec<f64>,
}

impl<'a> Specimen<'a> {
    /// A specimen of at least one reaction.
    pub(crate) fn new(reactions: &'a [Kinetics], is_chain: bool, heating_k_s: f64) -> Self {
        let mut reactants = vec![if is_chain { 0.0 } else { 1.0 }; reactions.len()];
        reactants[0] = 1.0;
        let advancements = vec![0.0; reactions.len()];
        Self { reactions, is_chain, heating_k_s, temperature_k: START_K, reactants, advancements }
    }

    /// Advancement of each reaction, from 0 to 1, when the specimen has a temperature that is not below its own, K.
    pub(crate) fn heated_to(&mut self, temperature_k: f64) -> &[f64] {
        while self.temperature_k < temperature_k {
            self.step((self.temperature_k + TEMPERATURE_STEP_K).min(temperature_k));
        }
        &self.advancements
    }

    /// The temperature at which each reaction is half complete, K; `None` where that is after `end_k`. A reaction that
    /// is faster than the heating has 300 K.
    pub(crate) fn half_conversion_temperatures_k(mut self, end_k: f64) -> Vec<Option<f64>> {
        let mut found = vec![None; self.reactions.len()];
        let mut before = self.advancements.clone();
        while self.temperature_k < end_k && found.iter().any(Option::is_none) {
            let from_k = self.temperature_k;
            self.step((from_k + TEMPERATURE_STEP_K).min(end_k));
            for ((found, &before), &after) in found.iter_mut().zip(&before).zip(&self.advancements) {
                if found.is_none() && after >= 0.5 {
                    let is_sudden = from_k == START_K;
                    let share = if is_sudden { 0.0 } else { (0.5 - before) / (after - before) };
                    *found = Some(from_k + share * (self.temperature_k - from_k));
                }
            }
            before.clone_from(&self.advancements);
        }
        found
    }

    fn step(&mut self, next_k: f64) {
        let step_s = (next_k - self.temperature_k) / self.heating_k_s;
        let mut made = 0.0;
        for (index, reaction) in self.reactions.iter().enumerate() {
            let rate = 0.5 * (reaction.rate_constant(self.temperature_k) + reaction.rate_constant(next_k));
            let before = self.reactants[index] + 0.5 * made;
            let after = reaction.remaining_reactant(before, rate * step_s);
            self.advancements[index] += before - after;
            self.reactants[index] = after + 0.5 * made;
            made = if self.is_chain { before - after } else { 0.0 };
        }
        self.temperature_k = next_k;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinetics(pre_exponential_1_s: f64, activation_energy_j_mol: f64) -> Kinetics {
        Kinetics { pre_exponential_1_s, activation_energy_j_mol, order: 1.0, onset_temperature_k: 0.0 }
    }

    fn half_conversions(pre_exponential_1_s: f64, activation_energy_j_mol: f64, heating_k_s: f64) -> Vec<Option<f64>> {
        let reactions = [kinetics(pre_exponential_1_s, activation_energy_j_mol)];
        Specimen::new(&reactions, false, heating_k_s).half_conversion_temperatures_k(4000.0)
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
            let found = half_conversions(a_1_s, e_j_mol, heating_k_min / 60.0);
            let found_k = found[0].expect("it reacts");
            assert!((found_k - expected_k).abs() < 0.05, "{a_1_s:e} 1/s at {heating_k_min} K/min: {found_k} K");
        }
        assert_eq!(half_conversions(1e10, 0.0, 1.0), [Some(300.0)], "faster than the heating");
        assert_eq!(half_conversions(1e-9, 480e3, 1.0), [None], "never");
    }

    #[test]
    fn two_equal_consecutive_first_order_reactions_match_the_exact_solution() {
        // A → B → C of one constant rate k: ξ₁ = 1 − e^−kt, ξ₂ = 1 − (1 + kt) e^−kt.
        let (rate_1_s, heating_k_s) = (0.02, 1.0);
        let reactions = [kinetics(rate_1_s, 0.0); 2];
        let turns: f64 = rate_1_s * 100.0 / heating_k_s;
        let expected = [1.0 - (-turns).exp(), 1.0 - (1.0 + turns) * (-turns).exp()];
        let advancements = |is_chain| Specimen::new(&reactions, is_chain, heating_k_s).heated_to(400.0).to_vec();
        let chained = advancements(true);
        assert!(chained.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 3e-6), "{chained:?}");
        assert!((advancements(false)[1] - expected[1]).abs() > 0.05);
    }
}
