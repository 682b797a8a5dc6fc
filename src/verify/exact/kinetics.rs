//! Closed forms of Arrhenius reactions: dX/dt = A (1 − X)ⁿ exp(−E/RT).
//!
//! For a linear temperature ramp the integrated rate constant is an exponential integral (J. Coheur,
//! F. Torres-Herrador, P. Chatelain, N. N. Mansour, T. E. Magin, M. Arnst, *Analytical solution for multi-component
//! pyrolysis simulations of thermal protection materials*, 2021).

use super::GAS_CONSTANT_J_MOL_K;

/// A reaction with its rate constant A exp(−E/RT).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrhenius {
    /// Pre-exponential factor.
    pub rate_1_s: f64,
    /// Activation energy.
    pub activation_energy_j_mol: f64,
    /// Order of the reaction.
    pub order: f64,
    /// Onset temperature; the rate is zero below it.
    pub onset_k: f64,
}

impl Arrhenius {
    /// Rate constant, 1/s.
    pub fn rate_constant_1_s(&self, temperature_k: f64) -> f64 {
        if temperature_k < self.onset_k {
            return 0.0;
        }
        self.rate_1_s * (-self.activation_energy_j_mol / (GAS_CONSTANT_J_MOL_K * temperature_k)).exp()
    }

    /// Rate constant integrated over a temperature ramp of β K/s:
    /// `(A/β) [T e^(−x) − (E/R) E₁(x)]` with x = E/RT.
    pub fn integrated_rate_constant(&self, rise_k_s: f64, from_k: f64, to_k: f64) -> f64 {
        let (from_k, to_k) = (from_k.max(self.onset_k), to_k.max(self.onset_k));
        let primitive_k = |temperature_k: f64| {
            let x = self.activation_energy_j_mol / (GAS_CONSTANT_J_MOL_K * temperature_k);
            if x > 0.0 {
                temperature_k * (-x).exp() * (1.0 - x * scaled_exponential_integral(x))
            } else {
                temperature_k
            }
        };
        self.rate_1_s / rise_k_s * (primitive_k(to_k) - primitive_k(from_k))
    }

    /// 1 − X as a function of the integrated rate constant.
    pub fn remaining(&self, integral: f64) -> f64 {
        if self.order == 1.0 {
            return (-integral).exp();
        }
        (1.0 + (self.order - 1.0) * integral).max(0.0).powf(1.0 / (1.0 - self.order))
    }
}

/// eˣ E₁(x) for x ≥ 1, by Lentz's method on its continued fraction (Abramowitz and Stegun, 5.1.22).
fn scaled_exponential_integral(x: f64) -> f64 {
    let mut b = x + 1.0;
    let mut c = f64::INFINITY;
    let mut d = 1.0 / b;
    let mut value = d;
    for i in 1..500 {
        let a = -f64::from(i * i);
        b += 2.0;
        d = 1.0 / (a * d + b);
        c = b + a / c;
        value *= c * d;
        if (c * d - 1.0).abs() < 1e-16 {
            break;
        }
    }
    value
}

/// A → B → C at constant rates (1/s): the amounts of A, B and C after a time, starting from A = 1.
pub fn consecutive_reactions(first_1_s: f64, second_1_s: f64, time_s: f64) -> [f64; 3] {
    let (first, second) = ((-first_1_s * time_s).exp(), (-second_1_s * time_s).exp());
    let between = first_1_s / (second_1_s - first_1_s) * (first - second);
    [first, between, 1.0 - first - between]
}

#[cfg(test)]
#[expect(clippy::excessive_precision, reason = "figures are quoted whole, as published")]
mod tests {
    use super::super::runge_kutta;
    use super::*;

    #[track_caller]
    fn meets(found: f64, expected: f64, tolerance: f64) {
        assert!((found - expected).abs() <= tolerance, "{found} is not {expected}: off by {:e}", found - expected);
    }

    // The tables were computed with a gas constant 1e-6 larger: E is scaled accordingly.
    fn as_tabled(rate_1_s: f64, activation_energy_j_mol: f64, order: f64, onset_k: f64) -> Arrhenius {
        let activation_energy_j_mol = activation_energy_j_mol * GAS_CONSTANT_J_MOL_K / 8.314471469;
        Arrhenius { rate_1_s, activation_energy_j_mol, order, onset_k }
    }

    #[test]
    fn one_reaction_meets_its_table_of_eighteen_digits_at_every_order() {
        for (order, at_650_k, at_750_k) in [
            (0.5, 0.980756991958968611, 0.234272766604843534),
            (1.0, 0.980849267670833091, 0.356306002813409568),
            (2.0, 0.981030323884378513, 0.492134374059407464),
            (3.0, 0.981206882736807464, 0.571295140137703727),
        ] {
            let reaction = as_tabled(1e9, 150e3, order, 0.0);
            meets(reaction.remaining(reaction.integrated_rate_constant(1.0, 300.0, 650.0)), at_650_k, 1e-12);
            meets(reaction.remaining(reaction.integrated_rate_constant(1.0, 300.0, 750.0)), at_750_k, 1e-12);
        }
        let root = as_tabled(1e9, 150e3, 0.5, 0.0);
        assert_eq!(root.remaining(root.integrated_rate_constant(1.0, 300.0, 800.0)), 0.0);
    }

    #[test]
    fn reactions_of_a_phenolic_meet_their_table_at_three_kelvin_a_second() {
        for (reaction, at_380_k, at_780_k, at_1380_k) in [
            (as_tabled(1.2e4, 71130.89, 3.0, 333.3), 9.71605808919e-6, 0.668787792054741067, 0.980810586437284037),
            (as_tabled(4.97777e8, 1.69975e5, 3.0, 555.6), 0.0, 0.0179479937495975672, 0.989885741282060656),
        ] {
            let reacted = |end_k| 1.0 - reaction.remaining(reaction.integrated_rate_constant(3.1, 300.0, end_k));
            meets(reacted(380.0), at_380_k, 1e-12);
            meets(reacted(780.0), at_780_k, 1e-12);
            meets(reacted(1380.0), at_1380_k, 1e-12);
        }
    }

    #[test]
    fn without_activation_energy_the_rate_is_constant() {
        let reaction = Arrhenius { rate_1_s: 0.01, activation_energy_j_mol: 0.0, order: 1.0, onset_k: 0.0 };
        meets(reaction.integrated_rate_constant(2.0, 300.0, 400.0), 0.5, 1e-15);
    }

    #[test]
    fn consecutive_reactions_match_printed_values_and_their_equations() {
        let printed =
            [(1.0, [6.7773427e-1, 2.8111147e-1, 4.1154256e-2]), (10.0, [2.0445346e-2, 1.6037066e-1, 8.1918399e-1])];
        for (time_s, expected) in printed {
            let found = consecutive_reactions(0.389, 0.262, time_s);
            let integrated = runge_kutta([1.0, 0.0, 0.0], 0.0..time_s, 1e-3, |_, [a, b, _]| {
                [-0.389 * a, 0.389 * a - 0.262 * b, 0.262 * b]
            });
            for i in 0..3 {
                meets(found[i], expected[i], 5e-9);
                meets(found[i], integrated[i], 1e-13);
            }
        }
    }
}
