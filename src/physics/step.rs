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
//!
//! A step could pass over a narrow peak of the heat capacity without the heat that it takes. Where a ply has one, steps
//! advance its enthalpy h instead, with one C at both stages:
//!
//! ```text
//! h(T') = h(T) + C (3/2 Δ₁ + 1/2 Δ₂)
//! ```
//!
//! The heat of a step is stored exactly, and the scheme is second order with any C. C is the heat capacity at the start
//! of the step; but where h(T) + C Δ₁ leaves a peak and the cell would rise further than Δ₁, which diverges, the first
//! stage is solved anew with the lower bound of the heat capacity near that temperature, with which cells never rise
//! further (after the relaxation of Jäger and Kačur, Numer. Math. 60, 1991). The second stage of such a cell is at the
//! temperature of h(T) + C Δ₁, that of the others at T + Δ₁: a cell above a peak whose stage is held by the peak would
//! not be damped, and oscillates from step to step.

use super::Real;
use super::compensated::add_compensated;
use super::member::Member;
use super::tridiagonal::{back_substitute, flush_tiny};
use crate::layout::{TABLE_STEP_K, TABLE_STEPS};

/// A temperature may be below absolute zero by this margin, due to rounding.
pub(super) const DIVERGENCE_MARGIN_K: f32 = 1.0;
/// Temperature span from the margin below zero to the last table node.
pub(super) const DIVERGENCE_SPAN_K: f32 = DIVERGENCE_MARGIN_K + TABLE_STEP_K as f32 * TABLE_STEPS as f32;

/// Solutions of the first stage after the first one, each with lower heat capacities, where steps advance enthalpies.
pub const CAPACITY_REDUCTIONS: usize = 3;
/// A temperature rise that exceeds its increment by less than this share does so by rounding.
const EXCESS_MIN: f64 = 1e-4;
pub(super) const EXCESS_ALLOWED: f64 = (1.0 + EXCESS_MIN) * (1.0 + EXCESS_MIN);

/// One where a temperature rise is larger than the increment of the linear system.
#[inline(always)]
fn exceeds_increment<R: Real>(rise_k: R, increment: R) -> R {
    let allowed = increment * increment * R::from_f64(EXCESS_ALLOWED);
    R::from_f64(1.0) - allowed.ge_mask(rise_k * rise_k)
}

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
            for reduction in 0..=CAPACITY_REDUCTIONS {
                let holder_heat =
                    if stage == 0 { self.assemble_stage::<0>(step) } else { self.assemble_stage::<1>(step) };
                let mut face_heat = [self.face_heat_flux(0, 0, step, stage), self.face_heat_flux(1, last, step, stage)];
                if GAS && reduction == 0 {
                    let drawn = self.gas_heat_outflow(step, stage);
                    face_heat = [face_heat[0] + drawn[0], face_heat[1] + drawn[1]];
                }
                if stage == 0 {
                    if reduction == 0 {
                        self.update_sensors(step);
                        record(self);
                        if step == self.plan.steps() {
                            self.sum_stored_heat();
                            return;
                        }
                        start = face_heat;
                        start_holder_heat = holder_heat;
                    }
                    self.solve_first_increments();
                    if self.plan.has_enthalpy_steps && self.reduce_capacities(reduction) {
                        continue;
                    }
                } else {
                    self.update_temperatures(step);
                    if GAS && self.plan.has_enthalpy_steps {
                        self.adopt_next_phases();
                    }
                    self.account_face_heat(0, step, start[0], face_heat[0], 0, 1);
                    self.account_face_heat(1, step, start[1], face_heat[1], last, last - 1);
                    if self.plan.has_holder {
                        self.account_holder_heat(step, start_holder_heat, holder_heat);
                    }
                }
                break;
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

    /// Temperature rises of the first stage: its increments, or in cells with a reduced heat capacity those of their
    /// enthalpies. Returns one if the enthalpy of another cell rises further than its increment.
    #[inline(always)]
    fn rise_by_increments(&mut self) -> R {
        let (zero, one) = (R::from_f64(0.0), R::from_f64(1.0));
        self.thermal.first_solution.copy_from_slice(&self.thermal.first_increments);
        let mut exceeds = zero;
        for p in 0..self.scales.plies.len() {
            let ply = &self.plan.plies[p];
            for i in ply.first_cell as usize..ply.end_cell as usize {
                let (start_k, solution) = (self.thermal.temperatures[i].high, self.thermal.first_solution[i]);
                let reduced = self.thermal.reduced[i];
                let states = Self::tabulated_states(self.plan, &self.scales, &self.reactions, [p, i], 0);
                let [rise_k, _] =
                    Self::temperature_rise(self.plan, self.rows, &states, [p, i], start_k, solution, reduced);
                self.thermal.first_increments[i] = reduced * rise_k + (one - reduced) * solution;
                exceeds = exceeds.max(exceeds_increment(rise_k, solution) * (one - reduced));
            }
        }
        exceeds
    }

    /// Reduces the heat capacity of each cell that rises further than its increment to the lower bound; the last time,
    /// those of all cells of a member with such a cell. Returns whether a heat capacity was reduced, and the system is
    /// to be solved anew.
    #[inline(always)]
    fn reduce_capacities(&mut self, reduction: usize) -> bool {
        let (zero, one) = (R::from_f64(0.0), R::from_f64(1.0));
        if reduction == 0 {
            self.thermal.reduced.fill(zero);
        }
        let exceeds = self.rise_by_increments();
        if reduction == CAPACITY_REDUCTIONS || !exceeds.any_nonzero() {
            return false;
        }
        for p in 0..self.scales.plies.len() {
            let ply = &self.plan.plies[p];
            for i in ply.first_cell as usize..ply.end_cell as usize {
                let (start_k, solution) = (self.thermal.temperatures[i].high, self.thermal.first_solution[i]);
                let reduced = self.thermal.reduced[i];
                let states = Self::tabulated_states(self.plan, &self.scales, &self.reactions, [p, i], 0);
                let [rise_k, least] =
                    Self::temperature_rise(self.plan, self.rows, &states, [p, i], start_k, solution, reduced);
                let mut reduces = exceeds_increment(rise_k, solution);
                if reduction + 1 == CAPACITY_REDUCTIONS {
                    reduces = exceeds;
                }
                reduces = reduces * (one - reduced);
                let own = &mut self.thermal.properties[i];
                own.first_capacity = own.first_capacity * (one - reduces + reduces * least);
                self.thermal.reduced[i] = reduced + reduces;
            }
        }
        true
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
        let half_step_s = R::constant_from_f64(0.5) * self.step_length_s(step);
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
        let (plan, rows) = (self.plan, self.rows);
        let mut before = R::from_f64(0.0);
        for p in (0..self.scales.plies.len()).rev() {
            let ply = &self.plan.plies[p];
            let cells = ply.first_cell as usize..ply.end_cell as usize;
            let temperatures = &mut self.thermal.temperatures[cells.clone()];
            let solution =
                if plan.has_enthalpy_steps { &self.thermal.first_solution } else { &self.thermal.first_increments };
            let first = &solution[cells.clone()][..temperatures.len()];
            let system = &mut self.thermal.system[cells.clone()][..temperatures.len()];
            let (mut coldest, mut hottest) = self.sums.extremes_k[p];
            for i in (0..temperatures.len()).rev() {
                let row = system[i];
                before = back_substitute(row.rhs_or_increment, row.reciprocal, row.upper_ratio, before);
                let own = flush_tiny(before);
                let mut increment = first[i] * R::constant_from_f64(1.5) + own * R::constant_from_f64(0.5);
                system[i].rhs_or_increment = first[i] + own;
                if plan.has_enthalpy_steps {
                    let (start_k, reduced) = (temperatures[i].high, self.thermal.reduced[cells.start + i]);
                    let at = [p, cells.start + i];
                    let states = Self::tabulated_states(plan, &self.scales, &self.reactions, at, 0);
                    [increment, _] = Self::temperature_rise(plan, rows, &states, at, start_k, increment, reduced);
                }
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
