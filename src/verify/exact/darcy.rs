//! Closed forms of Darcy flow through an isothermal slab:
//! `ε ∂p/∂t = ∂/∂x((K/μ)(p + b) ∂p/∂x) + (RT/M) π`.
//!
//! For an ideal gas the flux is a difference of p², so steady pressures are square roots (M. Muskat, *The flow of
//! homogeneous fluids through porous media*, 1937, chapter 11).

use super::GAS_CONSTANT_J_MOL_K;

/// An isothermal porous slab and its gas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DarcySlab {
    /// Molar mass of the gas.
    pub molar_mass_kg_mol: f64,
    /// Viscosity of the gas.
    pub viscosity_pa_s: f64,
    /// Temperature of gas and solid.
    pub temperature_k: f64,
    /// Permeability of the solid.
    pub permeability_m2: f64,
    /// Porosity of the solid, 0 to 1.
    pub porosity: f64,
    /// Klinkenberg's slip coefficient b at this temperature.
    pub slip_pa: f64,
    /// Forchheimer's coefficient.
    pub forchheimer_1_m: f64,
}

impl DarcySlab {
    /// Density over pressure, kg/m³/Pa.
    pub fn density_kg_m3_pa(&self) -> f64 {
        self.molar_mass_kg_mol / (GAS_CONSTANT_J_MOL_K * self.temperature_k)
    }

    /// Diffusivity of small pressure disturbances about a level, m²/s.
    pub fn diffusivity_m2_s(&self, pressure_pa: f64) -> f64 {
        self.permeability_m2 * (pressure_pa + self.slip_pa) / (self.viscosity_pa_s * self.porosity)
    }

    /// Steady pressure at a sealed back; all gas of a uniform source (kg/m³/s) leaves through the hot face:
    /// `(p + b)² = (p₀ + b)² + π μ L² (RT/M)/K`.
    pub fn sealed_back_pressure_pa(&self, face_pa: f64, source_kg_m3_s: f64, thickness_m: f64) -> f64 {
        let driven = source_kg_m3_s * self.viscosity_pa_s * thickness_m * thickness_m
            / (self.density_kg_m3_pa() * self.permeability_m2);
        ((face_pa + self.slip_pa).powi(2) + driven).sqrt() - self.slip_pa
    }

    /// Steady mass flux between two pressures: the root of `(M/RT) [(p₁² − p₀²)/2 + b (p₁ − p₀)]/L = μG/K + β G²`,
    /// exact for slip without inertia or inertia without slip.
    pub fn steady_flux_kg_m2_s(&self, high_pa: f64, low_pa: f64, thickness_m: f64) -> f64 {
        let mean_pa = 0.5 * (high_pa + low_pa) + self.slip_pa;
        let driving = self.density_kg_m3_pa() * mean_pa * (high_pa - low_pa) / thickness_m;
        let drag = self.viscosity_pa_s / self.permeability_m2;
        2.0 * driving / (drag + (drag * drag + 4.0 * self.forchheimer_1_m * driving).sqrt())
    }

    /// Pressure of a travelling wave of constant speed U into gas at `ahead_pa` = p∞: with u = p/p∞ − 1 the root of
    /// `u + ln(u/u₀) = c (Ut − x)/p∞`, c = U μ ε/K. `foot` is u₀, `behind_m` is Ut − x. No slip, no inertia.
    pub fn travelling_wave_pa(&self, speed_m_s: f64, ahead_pa: f64, foot: f64, behind_m: f64) -> f64 {
        let slope_pa_m = speed_m_s * self.viscosity_pa_s * self.porosity / self.permeability_m2;
        let along = slope_pa_m * behind_m / ahead_pa + foot.ln();
        // Newton's method on s = ln u: the equation eˢ + s = y is convex and has no pole.
        let start = if along > 1.0 { along.ln() } else { along };
        let s = (0..60).fold(start, |s, _| s - (s.exp() + s - along) / (s.exp() + 1.0));
        ahead_pa * (1.0 + s.exp())
    }

    /// Mass flux in the travelling wave at a pressure.
    pub fn travelling_wave_flux_kg_m2_s(&self, speed_m_s: f64, ahead_pa: f64, pressure_pa: f64) -> f64 {
        self.porosity * speed_m_s * self.density_kg_m3_pa() * (pressure_pa - ahead_pa)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gas and slab of the reference tables.
    const GAS: DarcySlab = DarcySlab {
        molar_mass_kg_mol: 0.022,
        viscosity_pa_s: 3e-5,
        temperature_k: 1000.0,
        permeability_m2: 2e-11,
        porosity: 0.85,
        slip_pa: 0.0,
        forchheimer_1_m: 0.0,
    };

    #[track_caller]
    fn meets(found: f64, expected: f64, tolerance: f64) {
        assert!((found - expected).abs() <= tolerance, "{found} is not {expected}: off by {:e}", found - expected);
    }

    // The table was computed with a gas constant 1e-6 larger.
    #[test]
    fn a_uniform_source_meets_its_table() {
        let gas = DarcySlab { temperature_k: 1000.0 * 8.314471469 / GAS_CONSTANT_J_MOL_K, ..GAS };
        meets(gas.sealed_back_pressure_pa(101_325.0, 0.5, 0.05), 104_763.425_643_072_5, 1e-9);
    }

    #[test]
    fn slip_and_inertia_satisfy_the_momentum_balance() {
        let (high_pa, low_pa, thickness_m) = (3e4, 1e4, 0.01);
        let slipping = DarcySlab { slip_pa: 2e4, ..GAS };
        let ratio = slipping.steady_flux_kg_m2_s(high_pa, low_pa, thickness_m)
            / GAS.steady_flux_kg_m2_s(high_pa, low_pa, thickness_m);
        meets(ratio, 2.0, 1e-14);
        let dragged = DarcySlab { forchheimer_1_m: 1e7, ..GAS };
        let flux = dragged.steady_flux_kg_m2_s(high_pa, low_pa, thickness_m);
        let driving = GAS.density_kg_m3_pa() * 2e4 * 2e4 / thickness_m;
        meets((3e-5 / 2e-11 * flux + 1e7 * flux * flux) / driving, 1.0, 1e-14);
        assert!(flux < 0.9 * GAS.steady_flux_kg_m2_s(high_pa, low_pa, thickness_m), "inertia must matter here");
    }

    #[test]
    fn a_travelling_wave_satisfies_the_flow_equation() {
        let (speed_m_s, ahead_pa, step_m) = (0.08, 2e3, 1e-6);
        let at = |behind_m: f64| GAS.travelling_wave_pa(speed_m_s, ahead_pa, 1e-3, behind_m);
        let mobility = GAS.permeability_m2 / GAS.viscosity_pa_s;
        for behind_m in [-5e-3, 0.0, 4e-3, 3e-2] {
            let [before, here, after] = [-step_m, 0.0, step_m].map(|shift_m| at(behind_m + shift_m));
            let stored = GAS.porosity * speed_m_s * (after - before) / (2.0 * step_m);
            let carried = mobility * (after * after - 2.0 * here * here + before * before) / (2.0 * step_m * step_m);
            meets(carried / stored, 1.0, 1e-4);
            let flux = mobility * here * (after - before) / (2.0 * step_m) * GAS.density_kg_m3_pa();
            meets(GAS.travelling_wave_flux_kg_m2_s(speed_m_s, ahead_pa, here) / flux, 1.0, 1e-6);
        }
    }

    // Into a vacuum the wave is the front of the porous medium equation: p = (U μ ε/K)(U t − x).
    #[test]
    fn a_wave_into_near_vacuum_is_a_straight_front() {
        let pressure_pa = GAS.travelling_wave_pa(0.05, 1e-3, 1.0, 0.02);
        meets(pressure_pa / (0.05 * 3e-5 * 0.85 / 2e-11 * 0.02), 1.0, 1e-4);
    }
}
