//! Darcy flow of gas through the layup, and gas that leaves at once.
//!
//! Pressure takes two stages of its own over a step, between the two stages of temperature, when the temperatures at
//! both ends of the step are known:
//!
//! ```text
//! (S*/Δt + γB) δ₁ = G(p) + m + r
//! (S*/Δt + γB) δ₂ = G(p + δ₁) + m − r − 2 S*/Δt δ₁
//! p' = p + 3/2 δ₁ + 1/2 δ₂
//! ```
//!
//! S is stored mass per pressure, B the slope of the outflow by the cell's pressure, m the gas source less `p (S* −
//! S)/Δt`. Then `S*p' − Sp` is exactly the net inflow plus the source. r is the excess of m and of the mobility part of
//! G over their mean, at γ of the step, extrapolated from the previous step. Without r a pressure that settles within a
//! step settles to the source at mid-step, half a step late. Both stages use mid-step mobilities: in stiff flow the
//! scheme would amplify a change of mobility between stages by −4. Heat uses the mean mass flux of the step, and its
//! first stage that of the previous step: an instantaneous flux would amplify small pressure errors by the mobility.

use super::Real;
use super::compensated::{add_compensated, add_unnormalized, difference, opaque};
use super::double_word::DoubleWord;
use super::gas::{GasFlux, PoreState, gas_flux, midpoint_pores};
use super::member::Member;
use super::mixture::thickness_ratio_of;
use super::table::interpolate;
use super::tridiagonal::{factorise, substitute};
use crate::layout::GasTransport;
use crate::layout::MAX_STATES;

/// γ of the pressure stages: the larger root of 2γ² − 4γ + 1 = 0, L-stable as the smaller root of the temperatures,
/// with a larger error constant. Its first stage keeps the sign of a damped mode, (γ − 1)/γ, where the smaller root
/// overshoots by −2.4: gas flowing into nearly empty pores, whose mobility depends on pressure, would get a negative
/// pressure and the member diverge (J. Verwer, E. Spee, J. Blom, W. Hundsdorfer, 1999).
pub(super) const PRESSURE_GAMMA: f64 = 1.0 + std::f64::consts::FRAC_1_SQRT_2;

/// Conductance below which a face passes no gas, kg/m²/s/Pa: zero for sealed plies, 1e-18 and more for permeable ones.
pub(super) const CONDUCTANCE_MIN: f64 = 1e-30;

/// Least stored mass per pressure of a cell, kg/m²/Pa: the pivot of a sealed cell must not vanish.
pub(super) const STORAGE_MIN: f64 = 1e-18;

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Evaluates the mass fluxes under every cell and out of the hot face at a stage, kg/m²/s.
    #[inline(always)]
    pub(super) fn update_gas_flow(&mut self, step: usize, stage: usize) {
        if self.plan.gas == Some(GasTransport::Darcy) {
            if stage == 0 {
                self.update_pores(step);
            } else {
                self.advance_pressures(step);
            }
            return;
        }
        let carries = R::constant_from_f64(if self.plan.gas == Some(GasTransport::QuasiSteady) { 1.0 } else { 0.0 });
        let mut upward_flux = R::from_f64(0.0);
        for from_back in 0..self.scales.plies.len() {
            let p = self.scales.plies.len() - 1 - from_back;
            let ply = self.plan.plies[p];
            let reacts = ply.end_reaction > ply.first_reaction;
            for up in 0..(ply.end_cell - ply.first_cell) as usize {
                let i = ply.end_cell as usize - 1 - up;
                self.gas.mass_fluxes[i] = upward_flux * carries;
                if reacts {
                    upward_flux = upward_flux + self.gas_source_at(i, stage);
                }
            }
        }
        self.gas.hot_outflow[stage] = upward_flux;
        if stage == 1 {
            let mean = R::from_f64(0.5) * (self.gas.hot_outflow[0] + self.gas.hot_outflow[1]);
            self.account_outflow(step, mean, R::from_f64(0.0));
        }
    }

    /// Adds the gas that left through the faces over a step to the balance.
    #[inline(always)]
    fn account_outflow(&mut self, step: usize, hot_kg_m2_s: R, back_kg_m2_s: R) {
        let step_length_s = self.step_length_s(step);
        self.add_gas_exchange(hot_kg_m2_s * step_length_s, back_kg_m2_s * step_length_s);
        self.gas.recent_outflows = [self.gas.recent_outflows[1], hot_kg_m2_s];
    }

    /// Adds gas that left through the faces (kg/m², negative: inflow) to the sums of outflow and inflow.
    #[inline(always)]
    fn add_gas_exchange(&mut self, hot_kg_m2: R, back_kg_m2: R) {
        let zero = R::from_f64(0.0);
        self.sums.gas_in = add_compensated(self.sums.gas_in, (-hot_kg_m2).max(zero) + (-back_kg_m2).max(zero));
        self.sums.gas_out = add_compensated(self.sums.gas_out, hot_kg_m2.max(zero) + back_kg_m2.max(zero));
    }

    /// State of the pores of a cell at the temperature of a stage.
    #[expect(clippy::needless_range_loop, reason = "the WGSL twin has the same loop")]
    #[inline(always)]
    pub(super) fn pore_state(&self, p: usize, i: usize, stage: usize) -> PoreState<R> {
        let ply = &self.plan.plies[p];
        let temperature_k = self.thermal.temperatures[i].high + self.stage_increment(i, stage);
        let gas = self.gas_columns(p, self.ply_row(p, temperature_k));
        let (molar_kg_k_j, viscosity_pa_s) = (interpolate(gas, 2), interpolate(gas, 3));
        let phases = self.current_phases(p, i);
        let thickness_ratio =
            thickness_ratio_of(self.mass_ratio(p, phases), self.scales.plies[p], self.rows.bulk_properties[p]);
        let zero = R::from_f64(0.0);
        let (mut porosity, mut permeability, mut slip, mut inertia) = (zero, zero, zero, zero);
        for state in 0..MAX_STATES {
            if state >= ply.states as usize {
                break;
            }
            let row = self.rows.state_properties[ply.first_state as usize + state];
            porosity = porosity + phases[state] * R::splat(row.porosity);
            permeability = permeability + phases[state] * R::splat(row.permeability_m2);
            slip = slip + phases[state] * R::splat(row.slip_pa_k);
            inertia = inertia + phases[state] * R::splat(row.forchheimer_1_m);
        }
        let mobility = self.scales.plies[p].permeability * permeability / (viscosity_pa_s * thickness_ratio);
        let density_s2_m2 = molar_kg_k_j / temperature_k;
        let volume_m = self.scales.plies[p].thickness * self.cell_width_m(i) * thickness_ratio;
        PoreState {
            storage: (volume_m * porosity * density_s2_m2).max(R::from_f64(STORAGE_MIN)),
            mobility_s: mobility * density_s2_m2,
            slip_pa: slip * temperature_k,
            inertia_m_pa2: R::from_f64(4.0) * inertia * mobility * mobility * density_s2_m2,
        }
    }

    /// Pores at the start of a step. Stored mass and pressure, and so their ratio, stay as at the end of the previous
    /// step, also where the temperature of a held face jumps, and at the start where its first value differs from the
    /// initial profile: the error of the predicted end temperature enters the next step's expansion, where it cancels.
    /// Correcting the pressure at once gave an error of first order.
    #[inline(always)]
    fn update_pores(&mut self, step: usize) {
        for p in 0..self.scales.plies.len() {
            let ply = self.plan.plies[p];
            for i in ply.first_cell as usize..ply.end_cell as usize {
                let held = if step > 0 { self.darcy.pores[i].storage } else { self.initial_gas_storage(p, i) };
                self.gas.mass_fluxes[i] = self.darcy.mean_mass_fluxes[i];
                self.darcy.pores[i] = self.pore_state(p, i, 0);
                self.darcy.pores[i].storage = held;
            }
        }
        self.gas.hot_outflow[0] = self.darcy.mean_hot_outflow;
        self.apply_face_pressures(step);
    }

    /// Sets the pressure of open faces to that outside, which may jump between steps; the difference in stored mass
    /// counts as inflow.
    #[inline(always)]
    fn apply_face_pressures(&mut self, step: usize) {
        let last = self.darcy.pressures.len() - 1;
        let none = R::from_f64(0.0);
        for (face, cell, is_open) in [(0, 0, true), (1, last, self.plan.back_is_open)] {
            if is_open {
                let outside = DoubleWord::single(R::splat(self.forcing(face, step, 0).pressure_pa));
                let taken = self.darcy.pores[cell].storage * difference(self.darcy.pressures[cell], outside);
                self.add_gas_exchange(taken, none);
                self.darcy.pressures[cell] = outside;
            }
        }
    }

    /// Mass flux through the face under a cell at pressures `p + δ₁`, with the pores at mid-step or at the end of the
    /// step.
    #[inline(always)]
    fn gas_flux_below(&self, i: usize, at_end: bool) -> GasFlux<R> {
        let [above_m, below_m] = self.lengths_to_next_m(i);
        let (mut upper, mut under) = (self.darcy.pores_at_end[i], self.darcy.pores_at_end[i + 1]);
        if !at_end {
            upper = midpoint_pores(self.darcy.pores[i], upper);
            under = midpoint_pores(self.darcy.pores[i + 1], under);
        }
        gas_flux(upper, above_m, self.stage_pressure(i), under, below_m, self.stage_pressure(i + 1))
    }

    /// Pressure of a cell at `p + δ₁`.
    #[inline(always)]
    pub(super) fn stage_pressure(&self, cell: usize) -> DoubleWord<R> {
        add_unnormalized(self.darcy.pressures[cell], self.darcy.first_pressure_increments[cell])
    }

    /// Updates the pores at the end of a step, and the gas that each cell supplies: source less thermal expansion.
    #[inline(always)]
    fn update_gas_supply(&mut self, step: usize) {
        let inverse_step_1_s = R::constant_from_f64(1.0) / self.step_length_s(step);
        let length_s = self.step_length_s(step);
        let before_s = self.step_length_s(step.max(1) - 1);
        let share =
            (R::constant_from_f64(PRESSURE_GAMMA) - R::constant_from_f64(0.5)) * R::constant_from_f64(2.0) * length_s
                / (length_s + before_s);
        for p in 0..self.scales.plies.len() {
            let ply = self.plan.plies[p];
            for i in ply.first_cell as usize..ply.end_cell as usize {
                self.darcy.pores_at_end[i] = self.pore_state(p, i, 1);
                let expansion = (self.darcy.pores_at_end[i].storage - self.darcy.pores[i].storage) * inverse_step_1_s;
                let supply = self.reactions.sources[i].mean_gas - self.darcy.pressures[i].high * expansion;
                self.darcy.source_corrections[i] = (supply - self.darcy.supply[i]) * share;
                self.darcy.supply[i] = supply;
            }
        }
    }

    /// Advances the pressures by a step, with the predicted end temperatures, and evaluates the mean mass fluxes.
    #[inline(always)]
    fn advance_pressures(&mut self, step: usize) {
        let last = self.gas.mass_fluxes.len() - 1;
        let gamma = R::from_f64(PRESSURE_GAMMA);
        let (zero, one) = (R::from_f64(0.0), R::from_f64(1.0));
        let inverse_step_1_s = R::constant_from_f64(1.0) / self.step_length_s(step);
        let open = [one, R::from_f64(if self.plan.back_is_open { 1.0 } else { 0.0 })];
        for i in 0..=last {
            self.darcy.first_pressure_increments[i] = zero;
        }
        self.update_gas_supply(step);
        let mut slope_above = zero;
        let mut slope_below = zero;
        let mut above = zero;
        let mut correction_above = zero;
        let correction_factor = R::from_f64(2.0 * PRESSURE_GAMMA - 1.0);
        for i in 0..=last {
            let none = GasFlux { flux: zero, above: zero, below: zero };
            let under = if i < last { self.gas_flux_below(i, false) } else { none };
            let ending = if i < last { self.gas_flux_below(i, true).flux } else { zero };
            let correction = correction_factor * (ending - under.flux);
            self.darcy.source_corrections[i] = self.darcy.source_corrections[i] + opaque(correction - correction_above);
            correction_above = correction;
            self.darcy.slopes_above[i] = under.above;
            self.darcy.slopes_below[i] = under.below;
            self.darcy.first_stage_fluxes[i] = under.flux;
            self.darcy.pressure_unknowns[i] =
                under.flux - above + opaque(self.darcy.supply[i] + self.darcy.source_corrections[i]);
            self.darcy.pressure_diagonal[i] =
                self.darcy.pores_at_end[i].storage * inverse_step_1_s + gamma * (under.above + slope_below);
            self.darcy.pressure_lower[i] = -(gamma * slope_above);
            self.darcy.pressure_upper[i] = -(gamma * under.below);
            slope_above = under.above;
            slope_below = under.below;
            above = under.flux;
        }
        let rises = self.ambient_pressure_rises(step);
        for (cell, face) in [(0, 0), (last, 1)] {
            let free = one - open[face];
            self.darcy.pressure_diagonal[cell] = open[face] + free * self.darcy.pressure_diagonal[cell];
            self.darcy.pressure_lower[cell] = free * self.darcy.pressure_lower[cell];
            self.darcy.pressure_upper[cell] = free * self.darcy.pressure_upper[cell];
            self.darcy.pressure_unknowns[cell] = open[face] * rises[face] + free * self.darcy.pressure_unknowns[cell];
        }
        factorise(&mut self.darcy.pressure_lower, &mut self.darcy.pressure_diagonal, &mut self.darcy.pressure_upper);
        substitute(
            &self.darcy.pressure_lower,
            &self.darcy.pressure_diagonal,
            &self.darcy.pressure_upper,
            &mut self.darcy.pressure_unknowns,
        );
        for i in 0..=last {
            self.darcy.first_pressure_increments[i] = self.darcy.pressure_unknowns[i];
        }
        let mut above = zero;
        for i in 0..=last {
            let under = if i < last { self.gas_flux_below(i, false).flux } else { zero };
            let stored =
                self.darcy.pores_at_end[i].storage * inverse_step_1_s * self.darcy.first_pressure_increments[i];
            self.darcy.pressure_unknowns[i] =
                under - above + opaque(self.darcy.supply[i] - self.darcy.source_corrections[i]) - (stored + stored);
            self.darcy.first_stage_fluxes[i] = self.darcy.first_stage_fluxes[i] + under;
            above = under;
        }
        for (cell, face) in [(0, 0), (last, 1)] {
            let free = one - open[face];
            self.darcy.pressure_unknowns[cell] = free * self.darcy.pressure_unknowns[cell] - open[face] * rises[face];
        }
        substitute(
            &self.darcy.pressure_lower,
            &self.darcy.pressure_diagonal,
            &self.darcy.pressure_upper,
            &mut self.darcy.pressure_unknowns,
        );
        self.update_mean_fluxes(step);
    }

    /// Rise of the outside pressures over a step, Pa.
    #[inline(always)]
    fn ambient_pressure_rises(&self, step: usize) -> [R; 2] {
        let pressure = |face, at| R::splat(self.forcing(face, step, at).pressure_pa);
        [pressure(0, 1) - pressure(0, 0), pressure(1, 1) - pressure(1, 0)]
    }

    /// Rise of a cell's pressure over a step, Pa.
    #[inline(always)]
    fn pressure_increment(&self, cell: usize) -> R {
        self.darcy.first_pressure_increments[cell] * R::constant_from_f64(1.5)
            + self.darcy.pressure_unknowns[cell] * R::constant_from_f64(0.5)
    }

    /// Gas source of a cell less the increase of its stored gas, mean over a step, kg/m²/s.
    #[inline(always)]
    fn net_gas_release(&self, cell: usize, inverse_step_1_s: R::Constant) -> R {
        let storage = self.darcy.pores_at_end[cell].storage;
        let held = storage * self.pressure_increment(cell)
            + (storage - self.darcy.pores[cell].storage) * self.darcy.pressures[cell].high;
        self.reactions.sources[cell].mean_gas - held * inverse_step_1_s
    }

    /// Mean Darcy flux of a step through the face under a cell, by both stages, kg/m²/s.
    #[inline(always)]
    fn mean_darcy_flux(&self, cell: usize) -> R {
        let here = self.darcy.first_pressure_increments[cell] + self.darcy.pressure_unknowns[cell];
        let next = self.darcy.first_pressure_increments[cell + 1] + self.darcy.pressure_unknowns[cell + 1];
        let implicit = (self.darcy.slopes_below[cell] * next - self.darcy.slopes_above[cell] * here)
            * R::constant_from_f64(PRESSURE_GAMMA);
        (self.darcy.first_stage_fluxes[cell] + implicit) * R::constant_from_f64(0.5)
    }

    /// One if the face under a cell passes all gas from below; zero if it is sealed or the flux follows from the
    /// pressures.
    #[inline(always)]
    fn pass_mask(&self, cell: usize) -> R {
        let last = self.gas.mass_fluxes.len() - 1;
        if cell == last {
            return R::from_f64(1.0);
        }
        if cell + 1 == last && self.plan.back_is_open {
            return R::from_f64(0.0);
        }
        (self.darcy.slopes_above[cell] + self.darcy.slopes_below[cell]).ge_mask(R::from_f64(CONDUCTANCE_MIN))
    }

    /// Mean mass flux of a step through the face under a cell, from that through the next face below, kg/m²/s.
    #[inline(always)]
    fn mean_flux_below(&self, cell: usize, behind: R, inverse_step_1_s: R::Constant) -> R {
        let last = self.gas.mass_fluxes.len() - 1;
        if cell == last {
            return behind;
        }
        if cell + 1 == last && self.plan.back_is_open {
            return self.mean_darcy_flux(cell);
        }
        self.pass_mask(cell) * (behind + self.net_gas_release(cell + 1, inverse_step_1_s))
    }

    /// Mean mass fluxes of the step, pressures at its end, and outflow. The flux through a face is that through the
    /// face below plus the net release of the cell between. The sum from the back avoids the rounding error of Darcy's
    /// law on the solved pressures (2.5e-5 of the mass in f32), whose pivots barely resolve the stored mass.
    #[inline(always)]
    fn update_mean_fluxes(&mut self, step: usize) {
        let last = self.gas.mass_fluxes.len() - 1;
        let zero = R::from_f64(0.0);
        let inverse_step_1_s = R::constant_from_f64(1.0) / self.step_length_s(step);
        let mut mean = zero;
        for up in 0..=last {
            let i = last - up;
            mean = self.mean_flux_below(i, mean, inverse_step_1_s);
            // Heat: the first stage used the mean flux of the previous step; the mean of both stages is that of this
            // step.
            self.gas.mass_fluxes[i] = mean * R::constant_from_f64(2.0) - self.darcy.mean_mass_fluxes[i];
            self.darcy.mean_mass_fluxes[i] = mean;
        }
        let mut left = [self.darcy.mean_mass_fluxes[0] + self.net_gas_release(0, inverse_step_1_s), zero];
        if self.plan.back_is_open {
            left[1] = self.net_gas_release(last, inverse_step_1_s) - self.darcy.mean_mass_fluxes[last - 1];
        }
        self.gas.hot_outflow = [self.darcy.mean_hot_outflow, R::from_f64(2.0) * left[0] - self.darcy.mean_hot_outflow];
        self.darcy.mean_hot_outflow = left[0];
        self.gas.back_outflow = left[1];
        self.account_outflow(step, left[0], left[1]);
        for i in 0..=last {
            let rise = self.pressure_increment(i);
            self.darcy.pressures[i] = add_compensated(self.darcy.pressures[i], rise);
            // The predicted pores become those of the next step's start.
            self.darcy.pores[i] = self.darcy.pores_at_end[i];
            self.darcy.pressure_rates[i] = rise * inverse_step_1_s;
        }
    }
}
