//! One time step of one or several members.
//!
//! With increments Δ = Δt k, slopes K = ∂F/∂T of conduction, faces and reactions at the start of the step, and γ = 1 −
//! 1/√2 (Rosenbrock-W, second order with any K, L-stable):
//!
//! ```text
//! (C/Δt − γK) Δ₁ = F(T) + γr
//! (C/Δt − γK) Δ₂ = C/C* F*(T + Δ₁) − 2 C/Δt Δ₁ − γr
//! T' = T + 3/2 Δ₁ + 1/2 Δ₂
//! ```
//!
//! F is the net heat flux into each cell, C its heat capacity, with a star at the second stage; r is the change of F
//! over the step by the schedules of a face. K includes the slope of k(T): without it or r the order falls to 1.5 on
//! fine cells. A cell on a held face follows its schedule: Δ₁ = s, Δ₂ = −s for a rise of s. Heat through the faces is
//! integrated by the same scheme, so that the energy balance closes at its order. Methods of higher order and multistep
//! methods are no cheaper at the required errors, as Richardson extrapolation removes the leading errors in time and
//! space together (benches/README.md).

use super::Real;
use super::compensated::add_compensated;
use super::member::Member;
use super::tridiagonal::{back_substitute, flush_tiny};
use crate::layout::{TABLE_NODES, TABLE_STEP_K};

/// Allows rounding errors below absolute zero.
pub(super) const DIVERGENCE_MARGIN_K: f32 = 1.0;
/// From the margin to the last table node.
pub(super) const DIVERGENCE_SPAN_K: f32 = DIVERGENCE_MARGIN_K + TABLE_STEP_K as f32 * (TABLE_NODES as f32 - 1.0);

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Reads the sensors at the start of a step, then advances by the step; after the last step, only reads. `record`
    /// is called between the two.
    #[inline(always)]
    pub fn advance(&mut self, step: usize, mut record: impl FnMut(&Self)) {
        let (last, zero) = (self.thermal.temperatures.len() - 1, R::from_f64(0.0));
        self.apply_held_faces(step);
        let mut start = [zero; 2];
        let mut start_holder_heat = zero;
        for stage in 0..2 {
            if GAS {
                self.advance_reactions(step, stage);
                self.update_gas_flow(step, stage);
                self.gas.stage_outflow = self.gas.hot_outflow[stage];
            }
            self.properties(step, stage);
            for face in 0..self.plan.exchanging_faces {
                self.thermal.boundary_rows[face] = self.boundary_row(face, face * last, step, stage);
            }
            let holder_heat =
                if stage == 0 { self.assemble_first_stage(step) } else { self.assemble_second_stage(step) };
            let mut face_heat = [self.face_heat_flux(0, 0, step, stage), self.face_heat_flux(1, last, step, stage)];
            if GAS {
                let drawn = self.gas_heat_outflow(step, stage);
                face_heat = [face_heat[0] + drawn[0], face_heat[1] + drawn[1]];
            }
            if stage == 0 {
                self.update_sensors(step);
                record(self);
                if step == self.plan.steps() {
                    self.sum_stored_heat();
                    return;
                }
                start = face_heat;
                start_holder_heat = holder_heat;
                self.solve_first_increments();
            } else {
                self.update_temperatures(step);
                self.account_face_heat(0, step, start[0], face_heat[0], 0, 1);
                self.account_face_heat(1, step, start[1], face_heat[1], last, last - 1);
                if self.plan.has_holder {
                    self.account_holder_heat(step, start_holder_heat, holder_heat);
                }
            }
        }
    }

    /// Back substitution for the increments of the first stage.
    #[inline(always)]
    fn solve_first_increments(&mut self) {
        let first = &mut self.thermal.first_increments[..];
        let system = &self.thermal.system[..first.len()];
        let mut before = R::from_f64(0.0);
        for i in (0..first.len()).rev() {
            let row = system[i];
            before = back_substitute(row.rhs_or_increment, row.reciprocal, row.upper_ratio, before);
            first[i] = flush_tiny(before);
        }
    }

    /// Adds the heat through a face over a step to the balance: mean of both stages, and the implicit part of the
    /// scheme.
    #[inline(always)]
    fn account_face_heat(&mut self, face: usize, step: usize, start: R, end: R, cell: usize, neighbour: usize) {
        let (sum, neighbour_sum) =
            (self.thermal.system[cell].rhs_or_increment, self.thermal.system[neighbour].rhs_or_increment);
        let (row, [by_cell, by_neighbour]) =
            (self.thermal.boundary_rows[face], self.thermal.face_conduction_slopes[face]);
        let implicit = row.slope * sum - (by_cell * sum - by_neighbour * neighbour_sum) * row.held;
        let half_step_s = R::constant_from_f64(0.5) * R::constant(self.rows.step_lengths_s[step]);
        let amount = (start + end + implicit) * half_step_s;
        let zero = R::from_f64(0.0);
        self.sums.heat[2 * face] = add_compensated(self.sums.heat[2 * face], amount.max(zero));
        self.sums.heat[2 * face + 1] = add_compensated(self.sums.heat[2 * face + 1], (-amount).max(zero));
    }

    /// Back substitution for the increments of the second stage; advances the temperatures by both stages and stores
    /// the sum of both increments in the system. Divergence shows in a ply's coldest and hottest cell, or in its
    /// uppermost: NaN fails both comparisons, and back substitution spreads it upwards.
    #[inline(always)]
    fn update_temperatures(&mut self, step: usize) {
        let margin_k = R::constant_from_f64(f64::from(DIVERGENCE_MARGIN_K));
        let mut before = R::from_f64(0.0);
        for p in (0..self.scales.plies.len()).rev() {
            let ply = &self.plan.plies[p];
            let cells = ply.first_cell as usize..ply.end_cell as usize;
            let temperatures = &mut self.thermal.temperatures[cells.clone()];
            let first = &self.thermal.first_increments[cells.clone()][..temperatures.len()];
            let system = &mut self.thermal.system[cells][..temperatures.len()];
            let (mut coldest, mut hottest) = self.sums.extremes_k[p];
            for i in (0..temperatures.len()).rev() {
                let row = system[i];
                before = back_substitute(row.rhs_or_increment, row.reciprocal, row.upper_ratio, before);
                let own = flush_tiny(before);
                let increment = first[i] * R::constant_from_f64(1.5) + own * R::constant_from_f64(0.5);
                system[i].rhs_or_increment = first[i] + own;
                temperatures[i] = add_compensated(temperatures[i], increment);
                let high = temperatures[i].high;
                coldest = coldest.min(high);
                hottest = hottest.max(high);
            }
            self.sums.extremes_k[p] = (coldest, hottest);
            for (watched, span_k) in
                [(coldest, DIVERGENCE_SPAN_K), (hottest, DIVERGENCE_SPAN_K), (temperatures[0].high, f32::MAX)]
            {
                let diverged = &mut self.sums.diverged;
                (watched + margin_k).for_lanes_outside(span_k, |lane| {
                    diverged[lane].get_or_insert(step);
                });
            }
        }
    }
}
