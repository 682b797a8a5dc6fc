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
use super::reacting::{EASE, restraint};
use super::tridiagonal::{ascended, descended, eliminated};
use crate::plan::layout::{TABLE_NODES, TABLE_STEP_K};

pub(super) const GAMMA: f64 = 0.292_893_218_813_452_4;
/// Round-off below absolute zero is forgiven, a kelvin is not.
const STRAY_MARGIN_K: f32 = 1.0;
/// From the margin to the last node of the tables.
const STRAY_SPAN_K: f32 = STRAY_MARGIN_K + TABLE_STEP_K as f32 * (TABLE_NODES as f32 - 1.0);

/// What a face does to the row of its cell.
#[derive(Clone, Copy)]
pub(super) struct Edge<R: Real> {
    /// One where it follows its schedule, and how much that rises over the step, K.
    pub(super) held: R::Still,
    pub(super) rise_k: R::Still,
    /// γr, W/m², and γ times the slopes of what comes in and of the heat that gas takes out, W/m²/K.
    pub(super) driven: R,
    pub(super) slope: R,
    pub(super) let_out: R,
}

/// A cell's row of the system on its way into it.
#[derive(Clone, Copy)]
struct Row<R> {
    lower: R,
    diagonal: R,
    upper: R,
    side: R,
}

impl<R: Real> Edge<R> {
    /// The row with what the face does to it.
    #[inline(always)]
    fn bounds(self, row: Row<R>) -> Row<R> {
        let free = R::fixed(1.0) - self.held;
        Row {
            lower: row.lower * free,
            diagonal: (row.diagonal + self.let_out - self.slope) * free + self.held,
            upper: row.upper * free,
            side: (row.side + self.driven) * free + self.held * self.rise_k,
        }
    }

    /// The right-hand side of the second stage.
    #[inline(always)]
    fn corrects(self, side: R) -> R {
        (side - self.driven) * (R::fixed(1.0) - self.held) - self.held * self.rise_k
    }
}

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Read the sensors at the start of a step, then march it; past the last step, only read. `note` is
    /// called between the two.
    #[inline(always)]
    pub fn advance(&mut self, step: usize, mut note: impl FnMut(&Self)) {
        let last = self.second.len() - 1;
        self.hold(step);
        let none = FaceFlux { flux: R::constant(0.0), slope: R::constant(0.0) };
        let mut start = Ends { hot: none, back: none };
        let mut onward = [[none.flux; 2]; 2];
        let mut start_sideways = none.flux;
        for stage in 0..2 {
            if GAS {
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
            let [hot, back] = [0, 2].map(|face| self.rows.drives[4 * step + face + stage]);
            let mut ends = self.imbalance(hot, back, stage);
            if GAS {
                ends = self.warm(step, stage, ends);
            }
            let sideways = if self.plan.has_holder { self.exchange(step, stage) } else { none.flux };
            if stage == 0 {
                start = ends;
                start_sideways = sideways;
                onward = [[self.lower[0], self.upper[0]], [self.upper[last - 1], self.lower[last - 1]]];
                self.edges = self.edged(step, &start);
                self.assemble(step);
                self.ascend();
            } else {
                self.correct(step);
                self.update(step);
                self.account(0, step, start.hot, ends.hot, onward[0], 0, 1);
                self.account(1, step, start.back, ends.back, onward[1], last, last - 1);
                if self.plan.has_holder {
                    self.account_sideways(step, start_sideways, sideways);
                }
            }
        }
    }

    /// The rise of a held face over a step, K.
    #[inline(always)]
    fn rise(&self, face: usize, step: usize) -> R::Still {
        let drives = &self.rows.drives;
        R::still(drives[4 * step + 2 * face + 1].held_k) - R::still(drives[4 * step + 2 * face].held_k)
    }

    /// What the faces do to the rows of their cells, from the slopes at the start and γr: by how much the schedules raise the flux
    /// through a face over a step, W/m²; of a held face nothing.
    #[inline(always)]
    fn edged(&self, step: usize, start: &Ends<R>) -> [Edge<R>; 2] {
        let last = self.second.len() - 1;
        let hot = self.through(0, self.rows.drives[4 * step + 1], 0, 0, 1);
        let back = self.through(1, self.rows.drives[4 * step + 3], 0, last, last - 1);
        let zero = R::constant(0.0);
        [(0, hot, start.hot), (last, back, start.back)].map(|(cell, end, start)| {
            let face = usize::from(cell == last);
            Edge {
                held: R::still(self.rows.faces[face].held),
                rise_k: self.rise(face, step),
                driven: (end.flux - start.flux) * R::fixed(GAMMA),
                slope: start.slope * R::fixed(GAMMA),
                let_out: if GAS { self.let_out_heat(face, cell) } else { zero },
            }
        })
    }

    /// The system of both stages, factored, and on the way down the right-hand side of the first. What leaves one cell
    /// enters the next, so the columns of K sum to nothing. All in one go over the cells: to write a column and to read it again
    /// takes longer than most of what is done to it.
    #[inline(always)]
    fn assemble(&mut self, step: usize) {
        let last = self.second.len() - 1;
        let (gamma, less, zero) = (R::fixed(GAMMA), R::fixed(-GAMMA), R::constant(0.0));
        let per_length = R::fixed(1.0) / R::still(self.rows.lengths_s[step]);
        let eased = R::fixed(EASE) / R::still(self.rows.lengths_s[step]);
        let (has_holder, rows, edges) = (self.plan.has_holder, self.rows, self.edges);
        self.lower[last] = zero;
        self.upper[last] = zero;
        std::mem::swap(&mut self.capacities, &mut self.evaluated);
        let (mut arriving, mut returned) = (zero, zero);
        let (mut reciprocal, mut upper_before, mut before) = (zero, zero, zero);
        for p in 0..self.plies.len() {
            let cells = self.plan.plies[p].first_cell as usize..self.plan.plies[p].end_cell as usize;
            let (first, holder_w_m3_k) = (cells.start, self.plies[p].holder_w_m3_k);
            let capacities = &self.capacities[cells.clone()];
            let lower = &mut self.lower[cells.clone()][..capacities.len()];
            let diagonal = &mut self.diagonal[cells.clone()][..capacities.len()];
            let upper = &mut self.upper[cells.clone()][..capacities.len()];
            let second = &mut self.second[cells.clone()][..capacities.len()];
            let reacts = GAS && self.plan.plies[p].end_reaction > self.plan.plies[p].first_reaction;
            let restraints = if reacts { &self.restraints[cells] } else { &[][..] };
            for i in 0..capacities.len() {
                let (leaving, below) = (lower[i] * less, upper[i] * less);
                let mut row = Row {
                    lower: arriving,
                    diagonal: capacities[i] * per_length - (returned + leaving),
                    upper: below,
                    side: second[i],
                };
                (arriving, returned) = (leaving, below);
                if has_holder {
                    let sideways = holder_w_m3_k * R::still(rows.cells[first + i].width_m);
                    row.diagonal = row.diagonal + sideways * gamma;
                }
                if reacts {
                    row.diagonal = row.diagonal + restraint(restraints[i], capacities[i], eased);
                }
                if first + i == 0 || first + i == last {
                    row = edges[usize::from(first + i == last)].bounds(row);
                }
                let [under, inverse] = eliminated(row.lower, row.diagonal, reciprocal, upper_before);
                before = descended(row.side, under, before);
                (reciprocal, upper_before) = (inverse, row.upper);
                lower[i] = under;
                diagonal[i] = inverse;
                upper[i] = row.upper * inverse;
                second[i] = before;
            }
        }
    }

    /// The increments of the first stage, on the way up.
    #[inline(always)]
    fn ascend(&mut self) {
        let first = &mut self.first[..];
        let second = &self.second[..first.len()];
        let diagonal = &self.diagonal[..first.len()];
        let upper = &self.upper[..first.len()];
        let mut before = R::constant(0.0);
        for i in (0..first.len()).rev() {
            before = ascended(second[i], diagonal[i], upper[i], before);
            first[i] = before;
        }
    }

    /// The right-hand side of the second stage, on the way down.
    #[inline(always)]
    fn correct(&mut self, step: usize) {
        let last = self.second.len() - 1;
        let twice_per_length = R::fixed(2.0) / R::still(self.rows.lengths_s[step]);
        let edges = self.edges;
        let second = &mut self.second[..];
        let first = &self.first[..second.len()];
        let lower = &self.lower[..second.len()];
        let capacities = &self.capacities[..second.len()];
        let evaluated = &self.evaluated[..second.len()];
        let mut before = R::constant(0.0);
        for i in 0..second.len() {
            let weight = capacities[i] / evaluated[i];
            let mut side = weight * second[i] - capacities[i] * twice_per_length * first[i];
            if i == 0 || i == last {
                side = edges[usize::from(i == last)].corrects(side);
            }
            before = descended(side, lower[i], before);
            second[i] = before;
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
        let (sum, beside) = (self.second[cell], self.second[neighbour]);
        let held = R::still(self.rows.faces[face].held);
        let implicit = start.slope * sum + (onward[0] * sum - onward[1] * beside) * held;
        let half_length = R::fixed(0.5) * R::still(self.rows.lengths_s[step]);
        let amount = (start.flux + end.flux + implicit * R::fixed(GAMMA)) * half_length;
        let zero = R::constant(0.0);
        self.heat[2 * face] = advanced(self.heat[2 * face], amount.max(zero));
        self.heat[2 * face + 1] = advanced(self.heat[2 * face + 1], (-amount).max(zero));
    }

    /// The increments of the second stage, on the way up, and with those of the first into the temperatures; both together stay in
    /// `second`. Watched is where temperatures go: a ply's coldest and hottest cell are looked at, and its uppermost, as what is no number is
    /// neither, and on the way up makes all cells above it alike.
    #[inline(always)]
    fn update(&mut self, step: usize) {
        let margin_k = R::fixed(f64::from(STRAY_MARGIN_K));
        let zero = R::constant(0.0);
        let mut before = zero;
        for p in (0..self.plies.len()).rev() {
            let ply = &self.plan.plies[p];
            let cells = ply.first_cell as usize..ply.end_cell as usize;
            let temperatures = &mut self.temperatures[cells.clone()];
            let first = &mut self.first[cells.clone()][..temperatures.len()];
            let second = &mut self.second[cells.clone()][..temperatures.len()];
            let diagonal = &self.diagonal[cells.clone()][..temperatures.len()];
            let upper = &self.upper[cells][..temperatures.len()];
            let (mut coldest, mut hottest) = self.extremes_k[p];
            for i in (0..temperatures.len()).rev() {
                before = ascended(second[i], diagonal[i], upper[i], before);
                let increment = first[i] * R::fixed(1.5) + before * R::fixed(0.5);
                second[i] = first[i] + before;
                first[i] = zero;
                temperatures[i] = advanced(temperatures[i], increment);
                let high = temperatures[i].high;
                coldest = coldest.min(high);
                hottest = hottest.max(high);
            }
            self.extremes_k[p] = (coldest, hottest);
            for (watched, span_k) in
                [(coldest, STRAY_SPAN_K), (hottest, STRAY_SPAN_K), (temperatures[0].high, f32::MAX)]
            {
                let strayed = &mut self.strayed;
                (watched + margin_k).within(span_k, |lane| {
                    strayed[lane].get_or_insert(step);
                });
            }
        }
    }
}
