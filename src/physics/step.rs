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
use super::faces::FaceFlux;
use super::member::{Ends, Member};
use super::tridiagonal::{factorise, substitute};
use crate::plan::layout::{TABLE_NODES, TABLE_STEP_K};

pub(super) const GAMMA: f64 = 0.292_893_218_813_452_4;
/// Round-off below absolute zero is forgiven, a kelvin is not.
const STRAY_MARGIN_K: f32 = 1.0;
/// From the margin to the last node of the tables.
const STRAY_SPAN_K: f32 = STRAY_MARGIN_K + TABLE_STEP_K as f32 * (TABLE_NODES as f32 - 1.0);

impl<R: Real> Member<'_, R> {
    /// Read the sensors at the start of a step, then march it; past the last step, only read. `note` is
    /// called between the two.
    #[inline(always)]
    pub fn advance(&mut self, step: usize, mut note: impl FnMut(&Self)) {
        let last = self.second.len() - 1;
        self.hold(step);
        let none = FaceFlux { flux: R::constant(0.0), slope: R::constant(0.0) };
        let mut start = Ends { hot: none, back: none };
        let mut onward = [[none.flux; 2]; 2];
        let mut driven = [none.flux; 2];
        let mut start_sideways = none.flux;
        for stage in 0..2 {
            if self.plan.gas.is_some() {
                self.react(step, stage);
                self.flow(step, stage);
                self.outflow = self.leaving[stage];
            }
            self.properties(step, stage);
            if stage == 0 {
                self.look(step);
                note(self);
                if step == self.plan.steps() {
                    self.finish();
                    return;
                }
            }
            let mut ends = self.imbalance(self.rows.drives[4 * step + stage], self.rows.drives[4 * step + 2 + stage]);
            if self.plan.gas.is_some() {
                ends = self.warm(step, stage, ends);
            }
            let sideways = if self.plan.has_holder { self.exchange(step, stage) } else { none.flux };
            if stage == 0 {
                start = ends;
                start_sideways = sideways;
                onward = [[self.lower[0], self.upper[0]], [self.upper[last - 1], self.lower[last - 1]]];
                driven = self.driven(step, &start);
                self.assemble(step, &start, driven);
            } else {
                self.correct(step, driven);
            }
            substitute(&self.lower, &self.diagonal, &self.upper, &mut self.second);
            if stage == 0 {
                self.first.copy_from_slice(&self.second);
            } else {
                self.account(0, step, start.hot, ends.hot, onward[0], 0, 1);
                self.account(1, step, start.back, ends.back, onward[1], last, last - 1);
                if self.plan.has_holder {
                    self.account_sideways(step, start_sideways, sideways);
                }
            }
        }
        self.update(step);
    }

    /// The rise of a held face over a step, K.
    #[inline(always)]
    fn rise(&self, face: usize, step: usize) -> R::Still {
        let drives = &self.rows.drives;
        R::still(drives[4 * step + 2 * face + 1].held_k) - R::still(drives[4 * step + 2 * face].held_k)
    }

    /// γr: by how much the schedules raise the flux through a face over a step, W/m²; of a held face nothing.
    #[inline(always)]
    fn driven(&self, step: usize, start: &Ends<R>) -> [R; 2] {
        let last = self.second.len() - 1;
        let gamma = R::fixed(GAMMA);
        let hot = self.through(0, self.rows.drives[4 * step + 1], 0, 1);
        let back = self.through(1, self.rows.drives[4 * step + 3], last, last - 1);
        [(hot.flux - start.hot.flux) * gamma, (back.flux - start.back.flux) * gamma]
    }

    /// The system of both stages, factored, and the right-hand side of the first. What leaves one cell enters
    /// the next, so the columns of K sum to nothing.
    #[inline(always)]
    fn assemble(&mut self, step: usize, start: &Ends<R>, driven: [R; 2]) {
        let last = self.second.len() - 1;
        let gamma = R::fixed(GAMMA);
        let per_length = R::fixed(1.0) / R::still(self.rows.lengths_s[step]);
        self.lower[last] = R::constant(0.0);
        self.upper[last] = R::constant(0.0);
        let mut arriving = R::constant(0.0);
        let mut returned = R::constant(0.0);
        let lower = &mut self.lower[..];
        let upper = &mut self.upper[..lower.len()];
        let diagonal = &mut self.diagonal[..lower.len()];
        let capacities = &mut self.capacities[..lower.len()];
        let evaluated = &self.evaluated[..lower.len()];
        for i in 0..lower.len() {
            let leaving = lower[i];
            capacities[i] = evaluated[i];
            diagonal[i] = capacities[i] * per_length + (returned + leaving) * gamma;
            returned = upper[i];
            lower[i] = -(arriving * gamma);
            upper[i] = -(returned * gamma);
            arriving = leaving;
        }
        if self.plan.has_holder {
            self.brace();
        }
        if self.plan.gas.is_some() {
            self.restrain(step);
            self.let_out_heat();
        }
        for (cell, face, slope) in [(0, 0, start.hot.slope), (last, 1, start.back.slope)] {
            let held = R::still(self.rows.faces[face].held);
            let free = R::fixed(1.0) - held;
            self.diagonal[cell] = (self.diagonal[cell] - slope * gamma) * free + held;
            self.second[cell] = (self.second[cell] + driven[face]) * free + held * self.rise(face, step);
            self.lower[cell] = self.lower[cell] * free;
            self.upper[cell] = self.upper[cell] * free;
        }
        factorise(&mut self.lower, &mut self.diagonal, &mut self.upper);
    }

    /// The right-hand side of the second stage.
    #[inline(always)]
    fn correct(&mut self, step: usize, driven: [R; 2]) {
        let last = self.second.len() - 1;
        let per_length = R::fixed(1.0) / R::still(self.rows.lengths_s[step]);
        let second = &mut self.second[..];
        let first = &self.first[..second.len()];
        let capacities = &self.capacities[..second.len()];
        let evaluated = &self.evaluated[..second.len()];
        for i in 0..second.len() {
            let weight = capacities[i] / evaluated[i];
            let carried = capacities[i] * per_length * first[i];
            second[i] = weight * second[i] - (carried + carried);
        }
        for (cell, face) in [(0, 0), (last, 1)] {
            let held = R::still(self.rows.faces[face].held);
            let free = R::fixed(1.0) - held;
            self.second[cell] = (self.second[cell] - driven[face]) * free - held * self.rise(face, step);
        }
    }

    /// Add the heat through a face over a step: the stages' mean, and the scheme's own implicit part.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "the twin in WGSL takes the same scalars")]
    fn account(
        &mut self,
        face: usize,
        step: usize,
        start: FaceFlux<R>,
        end: FaceFlux<R>,
        onward: [R; 2],
        cell: usize,
        neighbour: usize,
    ) {
        let sum = self.first[cell] + self.second[cell];
        let beside = self.first[neighbour] + self.second[neighbour];
        let held = R::still(self.rows.faces[face].held);
        let implicit = start.slope * sum + (onward[0] * sum - onward[1] * beside) * held;
        let half_length = R::fixed(0.5) * R::still(self.rows.lengths_s[step]);
        let amount = (start.flux + end.flux + implicit * R::fixed(GAMMA)) * half_length;
        let zero = R::constant(0.0);
        self.heat[2 * face] = advanced(self.heat[2 * face], amount.max(zero));
        self.heat[2 * face + 1] = advanced(self.heat[2 * face + 1], (-amount).max(zero));
    }

    /// Take the increments into the temperatures, and watch where they go: a ply's coldest and hottest cell are looked at, and
    /// the sum of all, as what is no number is neither.
    #[inline(always)]
    fn update(&mut self, step: usize) {
        let margin_k = R::fixed(f64::from(STRAY_MARGIN_K));
        for p in 0..self.plies.len() {
            let ply = &self.plan.plies[p];
            let cells = ply.first_cell as usize..ply.end_cell as usize;
            let temperatures = &mut self.temperatures[cells.clone()];
            let first = &mut self.first[cells.clone()][..temperatures.len()];
            let second = &self.second[cells][..temperatures.len()];
            let (mut coldest, mut hottest) = self.extremes_k[p];
            let mut sum = R::constant(0.0);
            for i in 0..temperatures.len() {
                let increment = first[i] * R::fixed(1.5) + second[i] * R::fixed(0.5);
                temperatures[i] = advanced(temperatures[i], increment);
                first[i] = R::constant(0.0);
                let high = temperatures[i].high;
                coldest = coldest.min(high);
                hottest = hottest.max(high);
                sum = sum + high;
            }
            self.extremes_k[p] = (coldest, hottest);
            for (watched, span_k) in [(coldest, STRAY_SPAN_K), (hottest, STRAY_SPAN_K), (sum, f32::MAX)] {
                let strayed = &mut self.strayed;
                (watched + margin_k).within(span_k, |lane| {
                    strayed[lane].get_or_insert(step);
                });
            }
        }
    }
}
