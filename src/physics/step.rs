//! One step of one member (or of lanes of members).
//!
//! With increments Δ = Δt k, slopes K = ∂F/∂T of conduction, faces and reactions at the start of the step, and
//! γ = 1 − 1/√2 (Rosenbrock-W, second order with any K, L-stable):
//!
//! ```text
//! (C/Δt − γK) Δ₁ = F(T) + γr
//! (C/Δt − γK) Δ₂ = C/C* F*(T + Δ₁) − 2 C/Δt Δ₁ − γr
//! T' = T + 3/2 Δ₁ + 1/2 Δ₂
//! ```
//!
//! F is the net heat flux into each cell, C its heat capacity, starred at the second stage; r is what the
//! schedules of a face add to F over the step. K holds the slope of k(T) and r is there because the order
//! falls to 1.5 on fine cells without either, though not on coarse ones. A cell on a held face follows its
//! schedule instead: Δ₁ = s, Δ₂ = −s for a rise of s. Heat through the faces is integrated by the scheme
//! itself, so that the energy balance closes at its order. Methods of higher order, and those that look back, are no cheaper at the
//! errors that are asked for, as a second march takes off errors in time along with those in space: benches/README.md.

use super::Real;
use super::compensated::advanced;
use super::member::Member;
use super::tridiagonal::{ascended, settled};
use crate::plan::layout::{TABLE_NODES, TABLE_STEP_K};

/// Round-off below absolute zero is forgiven, a kelvin is not.
pub(super) const STRAY_MARGIN_K: f32 = 1.0;
/// From the margin to the last node of the tables.
pub(super) const STRAY_SPAN_K: f32 = STRAY_MARGIN_K + TABLE_STEP_K as f32 * (TABLE_NODES as f32 - 1.0);

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Read the sensors at the start of a step, then march it; past the last step, only read. `note` is
    /// called between the two.
    #[inline(always)]
    pub fn advance(&mut self, step: usize, mut note: impl FnMut(&Self)) {
        let (last, zero) = (self.thermal.temperatures.len() - 1, R::constant(0.0));
        self.hold(step);
        let mut start = [zero; 2];
        let mut start_sideways = zero;
        for stage in 0..2 {
            if GAS {
                self.react(step, stage);
                self.flow(step, stage);
                self.gas.outflow = self.gas.leaving[stage];
            }
            self.properties(step, stage);
            for face in 0..self.plan.open_faces {
                self.thermal.edges[face] = self.edge(face, face * last, step, stage);
            }
            let sideways = if stage == 0 { self.assemble(step) } else { self.correct(step) };
            let mut through = [self.passed_through(0, 0, step, stage), self.passed_through(1, last, step, stage)];
            if GAS {
                let drawn = self.warm(step, stage);
                through = [through[0] + drawn[0], through[1] + drawn[1]];
            }
            if stage == 0 {
                self.look(step);
                note(self);
                if step == self.plan.steps() {
                    self.finish();
                    return;
                }
                start = through;
                start_sideways = sideways;
                self.ascend();
            } else {
                self.update(step);
                self.account(0, step, start[0], through[0], 0, 1);
                self.account(1, step, start[1], through[1], last, last - 1);
                if self.plan.has_holder {
                    self.account_sideways(step, start_sideways, sideways);
                }
            }
        }
    }

    /// The increments of the first stage, on the way up.
    #[inline(always)]
    fn ascend(&mut self) {
        let first = &mut self.thermal.first[..];
        let system = &self.thermal.system[..first.len()];
        let mut before = R::constant(0.0);
        for i in (0..first.len()).rev() {
            let row = system[i];
            before = ascended(row.second, row.reciprocal, row.over, before);
            first[i] = settled(before);
        }
    }

    /// Add the heat through a face over a step: the stages' mean, and the scheme's own implicit part.
    #[inline(always)]
    fn account(&mut self, face: usize, step: usize, start: R, end: R, cell: usize, neighbour: usize) {
        let (sum, beside) = (self.thermal.system[cell].second, self.thermal.system[neighbour].second);
        let (edge, [by_cell, by_neighbour]) = (self.thermal.edges[face], self.thermal.passed_slopes[face]);
        let implicit = edge.slope * sum - (by_cell * sum - by_neighbour * beside) * edge.held;
        let half_length = R::fixed(0.5) * R::still(self.rows.lengths_s[step]);
        let amount = (start + end + implicit) * half_length;
        let zero = R::constant(0.0);
        self.accounts.heat[2 * face] = advanced(self.accounts.heat[2 * face], amount.max(zero));
        self.accounts.heat[2 * face + 1] = advanced(self.accounts.heat[2 * face + 1], (-amount).max(zero));
    }

    /// The increments of the second stage, on the way up, and with those of the first into the temperatures; both together stay in the
    /// system. Watched is where temperatures go: a ply's coldest and hottest cell are looked at, and its uppermost, as what is no number is
    /// neither, and on the way up makes all cells above it alike.
    #[inline(always)]
    fn update(&mut self, step: usize) {
        let margin_k = R::fixed(f64::from(STRAY_MARGIN_K));
        let mut before = R::constant(0.0);
        for p in (0..self.scales.plies.len()).rev() {
            let ply = &self.plan.plies[p];
            let cells = ply.first_cell as usize..ply.end_cell as usize;
            let temperatures = &mut self.thermal.temperatures[cells.clone()];
            let first = &self.thermal.first[cells.clone()][..temperatures.len()];
            let system = &mut self.thermal.system[cells][..temperatures.len()];
            let (mut coldest, mut hottest) = self.accounts.extremes_k[p];
            for i in (0..temperatures.len()).rev() {
                let row = system[i];
                before = ascended(row.second, row.reciprocal, row.over, before);
                let own = settled(before);
                let increment = first[i] * R::fixed(1.5) + own * R::fixed(0.5);
                system[i].second = first[i] + own;
                temperatures[i] = advanced(temperatures[i], increment);
                let high = temperatures[i].high;
                coldest = coldest.min(high);
                hottest = hottest.max(high);
            }
            self.accounts.extremes_k[p] = (coldest, hottest);
            for (watched, span_k) in
                [(coldest, STRAY_SPAN_K), (hottest, STRAY_SPAN_K), (temperatures[0].high, f32::MAX)]
            {
                let strayed = &mut self.accounts.strayed;
                (watched + margin_k).within(span_k, |lane| {
                    strayed[lane].get_or_insert(step);
                });
            }
        }
    }
}
