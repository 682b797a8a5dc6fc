//! Assembly and forward elimination of the linear system of a step.
//!
//! Both stages have the same matrix: see `step`. One pass computes the fluxes, the matrix row and its elimination, as
//! storing and reloading columns would take longer than the arithmetic. A row is complete once the node below is known,
//! so it is assembled with the face between them.

use super::GAMMA;
use super::Real;
use super::conducting::{Link, Node, no_link};
use super::member::Member;
use super::reacting::{EASE, restraint};
use super::state::{Edge, Eliminated};
use super::tridiagonal::{descended, eliminated, settled};
use crate::plan::GasPath;

/// Matrix row of a cell before elimination.
#[derive(Clone, Copy)]
struct Row<R> {
    lower: R,
    diagonal: R,
    upper: R,
    side: R,
}

/// State carried by the forward elimination from cell to cell.
struct Way<R> {
    /// Conducted heat that flows into the cell, its gain by advection, and the heat that all cells above took from the
    /// holder, W/m².
    conducted: R,
    gained: R,
    taken: R,
    /// −γ times the slopes of the conducted heat, by the temperature of the cell above and, negated, by the cell's,
    /// W/m²/K.
    slopes: [R; 2],
    /// Reciprocal pivot, upper coefficient and right-hand side (not flushed) of the row above.
    reciprocal: R,
    upper: R,
    side: R,
    /// Heat conducted onwards by the cells of both faces, W/m², and −γ times its slopes by their temperatures and,
    /// negated, by those of their neighbours.
    passed: [R; 2],
    passed_slopes: [[R; 2]; 2],
}

/// Position of a cell: ply, cell, and face if it lies at one.
#[derive(Clone, Copy)]
struct Position {
    ply: usize,
    cell: usize,
    face: Option<usize>,
}

/// Position of a cell that is not the last.
#[inline(always)]
fn position(ply: usize, cell: usize) -> Position {
    Position { ply, cell, face: (cell == 0).then_some(0) }
}

/// State at the hot face.
#[inline(always)]
fn way<R: Real>() -> Way<R> {
    let zero = R::constant(0.0);
    Way {
        conducted: zero,
        gained: zero,
        taken: zero,
        slopes: [zero; 2],
        reciprocal: zero,
        upper: zero,
        side: zero,
        passed: [zero; 2],
        passed_slopes: [[zero; 2]; 2],
    }
}

impl<R: Real> Edge<R> {
    /// The matrix row with the boundary condition, and with the slope of the heat that leaves with the gas.
    #[inline(always)]
    fn bounds(self, row: Row<R>, outflow_slope: R) -> Row<R> {
        let free = R::fixed(1.0) - self.held;
        Row {
            lower: row.lower * free,
            diagonal: (row.diagonal + outflow_slope - self.slope) * free + self.held,
            upper: row.upper * free,
            side: (row.side + self.driven) * free + self.held * self.rise_k,
        }
    }

    /// The right-hand side of the second stage with the boundary condition.
    #[inline(always)]
    fn corrects(self, rhs: R) -> R {
        (rhs - self.driven) * (R::fixed(1.0) - self.held) - self.held * self.rise_k
    }
}

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Rise of a held face's temperature over a step, K.
    #[inline(always)]
    fn rise(&self, face: usize, step: usize) -> R::Still {
        let forcing = &self.rows.drives;
        R::still(forcing[4 * step + 2 * face + 1].held_k) - R::still(forcing[4 * step + 2 * face].held_k)
    }

    /// Boundary row of a face at a stage. The first stage evaluates γr: the change of the flux over the step by the
    /// schedules.
    #[inline(always)]
    pub(super) fn edge(&self, face: usize, cell: usize, step: usize, stage: usize) -> Edge<R> {
        let start = 4 * step + 2 * face;
        let surface = self.surface(face, cell, stage);
        let now = self.through(face, self.rows.drives[start + stage], surface);
        if stage == 1 {
            return Edge { flux: now.flux, ..self.thermal.edges[face] };
        }
        let end = self.through(face, self.rows.drives[start + 1], surface);
        Edge {
            held: R::still(self.rows.faces[face].held),
            rise_k: self.rise(face, step),
            flux: now.flux,
            driven: (end.flux - now.flux) * R::fixed(GAMMA),
            slope: now.slope * R::fixed(GAMMA),
        }
    }

    /// Net heat flux into a cell at a stage, from the fluxes at the face below and from the holder, W/m².
    #[inline(always)]
    fn net(&self, at: Position, below: Link<R>, from_holder: R, stage: usize, sweep: &Way<R>) -> R {
        let mut flux = sweep.conducted - below.conducted;
        if GAS {
            flux = ((sweep.conducted + sweep.gained) - (below.conducted - below.gained))
                - self.absorbed_at(at.cell, stage);
        }
        if let Some(face) = at.face {
            flux = flux + self.thermal.edges[face].flux;
        }
        if GAS && self.plan.gas == Some(GasPath::Darcy) {
            flux = flux + self.swept(at.ply, at.cell, stage);
        }
        if self.plan.has_holder {
            flux = flux + from_holder;
        }
        flux
    }

    /// Eliminates the row of a cell, with the right-hand side of the first stage.
    #[inline(always)]
    fn row(
        &self,
        sweep: &mut Way<R>,
        at: Position,
        node: Node<R>,
        below: Link<R>,
        inverse_step_1_s: R::Still,
        step: usize,
    ) -> Eliminated<R> {
        let less = R::fixed(-GAMMA);
        let (own_slope, next_slope) = (below.slopes[0] * less, below.slopes[1] * less);
        let mut from_holder = R::constant(0.0);
        if self.plan.has_holder {
            from_holder = self.sideways(at.ply, at.cell, step, 0);
            sweep.taken = sweep.taken + from_holder;
        }
        let mut row = Row {
            lower: sweep.slopes[0],
            diagonal: node.matter.capacity * inverse_step_1_s - (sweep.slopes[1] + own_slope),
            upper: next_slope,
            side: self.net(at, below, from_holder, 0, sweep),
        };
        if self.plan.has_holder {
            row.diagonal = row.diagonal + self.conductance_sideways(at.ply, at.cell) * R::fixed(GAMMA);
        }
        if GAS && self.plan.plies[at.ply].end_reaction > self.plan.plies[at.ply].first_reaction {
            let damping_rate_1_s = inverse_step_1_s * R::fixed(EASE);
            row.diagonal =
                row.diagonal + restraint(self.reactions.restraints[at.cell], node.matter.capacity, damping_rate_1_s);
        }
        if let Some(face) = at.face {
            let (passed, slopes) =
                [(below.conducted, [own_slope, next_slope]), (-sweep.conducted, [sweep.slopes[1], sweep.slopes[0]])]
                    [face];
            sweep.passed[face] = passed;
            sweep.passed_slopes[face] = slopes;
            let outflow_slope = if GAS { self.let_out_heat(face, at.cell) } else { R::constant(0.0) };
            row = self.thermal.edges[face].bounds(row, outflow_slope);
        }
        let [under, reciprocal] = eliminated(row.lower, row.diagonal, sweep.reciprocal, sweep.upper);
        sweep.side = descended(row.side, under, sweep.side);
        sweep.slopes = [own_slope, next_slope];
        (sweep.reciprocal, sweep.upper) = (reciprocal, row.upper);
        (sweep.conducted, sweep.gained) = (below.conducted, below.gained);
        let (over, capacity) = (row.upper * reciprocal, node.matter.capacity);
        Eliminated { under, reciprocal, over, capacity, second: settled(sweep.side) }
    }

    /// Eliminates the right-hand side of the second stage in a cell's row.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "the WGSL twin reads columns instead")]
    fn side(
        &self,
        sweep: &mut Way<R>,
        at: Position,
        node: Node<R>,
        below: Link<R>,
        row: Eliminated<R>,
        twice_inverse_step_1_s: R::Still,
        step: usize,
    ) -> R {
        let mut from_holder = R::constant(0.0);
        if self.plan.has_holder {
            from_holder = self.sideways(at.ply, at.cell, step, 1);
            sweep.taken = sweep.taken + from_holder;
        }
        let net = self.net(at, below, from_holder, 1, sweep);
        let mut rhs = row.capacity / node.matter.capacity * net - row.capacity * twice_inverse_step_1_s * node.moved;
        if let Some(face) = at.face {
            sweep.passed[face] = [below.conducted, -sweep.conducted][face];
            rhs = self.thermal.edges[face].corrects(rhs);
        }
        sweep.side = descended(rhs, row.under, sweep.side);
        (sweep.conducted, sweep.gained) = (below.conducted, below.gained);
        settled(sweep.side)
    }

    /// Assembles and factors the system of both stages, and eliminates the right-hand side of the first. Returns the
    /// heat that all cells take from the holder, W/m².
    #[inline(always)]
    pub(super) fn assemble(&mut self, step: usize) -> R {
        let last = self.thermal.temperatures.len() - 1;
        let inverse_step_1_s = R::fixed(1.0) / self.length_s(step);
        let mut sweep = way();
        let mut system = std::mem::take(&mut self.thermal.system);
        for p in 0..self.scales.plies.len() {
            let cells = self.plan.plies[p].first_cell as usize..self.plan.plies[p].end_cell as usize;
            let nodes = self.nodes(cells.clone());
            if p > 0 {
                let i = cells.start - 1;
                let above = self.nodes(i..cells.start).node::<GAS>(0, 0);
                let below = self.link_across(p, above, nodes.node::<GAS>(0, 0), 0);
                system[i] = self.row(&mut sweep, position(p - 1, i), above, below, inverse_step_1_s, step);
            }
            let links = cells.len() - 1;
            let system = &mut system[cells.clone()][..links];
            // The cell at the hot face comes first, so that the loop needs no test for it. Both nodes are read anew in
            // each turn: carrying one over would spill the registers of the pivot, which is the critical path.
            let first_links = links.min(usize::from(p == 0));
            if first_links > 0 {
                let (here, next) = (nodes.node::<GAS>(0, 0), nodes.node::<GAS>(1, 0));
                let below = self.link_within(0, here, next, R::still(nodes.cells[0].half_over_next_1_m), 0);
                system[0] = self.row(&mut sweep, position(0, 0), here, below, inverse_step_1_s, step);
            }
            for (i, row) in (first_links..).zip(&mut system[first_links..]) {
                let cell = cells.start + i;
                let (here, next) = (nodes.node::<GAS>(i, 0), nodes.node::<GAS>(i + 1, 0));
                let below = self.link_within(cell, here, next, R::still(nodes.cells[i].half_over_next_1_m), 0);
                let at = Position { ply: p, cell, face: None };
                *row = self.row(&mut sweep, at, here, below, inverse_step_1_s, step);
            }
        }
        let at_back = Position { ply: self.scales.plies.len() - 1, cell: last, face: Some(1) };
        let here = self.nodes(last..last + 1).node::<GAS>(0, 0);
        system[last] = self.row(&mut sweep, at_back, here, no_link(), inverse_step_1_s, step);
        self.thermal.system = system;
        (self.thermal.passed, self.thermal.passed_slopes) = (sweep.passed, sweep.passed_slopes);
        sweep.taken
    }

    /// Eliminates the right-hand side of the second stage. Returns the heat that all cells take from the holder, W/m².
    #[inline(always)]
    pub(super) fn correct(&mut self, step: usize) -> R {
        let last = self.thermal.temperatures.len() - 1;
        let twice_inverse_step_1_s = R::fixed(2.0) / self.length_s(step);
        let mut sweep = way();
        let mut system = std::mem::take(&mut self.thermal.system);
        for p in 0..self.scales.plies.len() {
            let cells = self.plan.plies[p].first_cell as usize..self.plan.plies[p].end_cell as usize;
            let nodes = self.nodes(cells.clone());
            if p > 0 {
                let i = cells.start - 1;
                let above = self.nodes(i..cells.start).node::<GAS>(0, 1);
                let below = self.link_across(p, above, nodes.node::<GAS>(0, 1), 1);
                let row = system[i];
                system[i].second =
                    self.side(&mut sweep, position(p - 1, i), above, below, row, twice_inverse_step_1_s, step);
            }
            let links = cells.len() - 1;
            let system = &mut system[cells.clone()][..links];
            let first_links = links.min(usize::from(p == 0));
            if first_links > 0 {
                let (here, next) = (nodes.node::<GAS>(0, 1), nodes.node::<GAS>(1, 1));
                let below = self.link_within(0, here, next, R::still(nodes.cells[0].half_over_next_1_m), 1);
                let row = system[0];
                system[0].second =
                    self.side(&mut sweep, position(0, 0), here, below, row, twice_inverse_step_1_s, step);
            }
            for (i, row) in (first_links..).zip(&mut system[first_links..]) {
                let cell = cells.start + i;
                let (here, next) = (nodes.node::<GAS>(i, 1), nodes.node::<GAS>(i + 1, 1));
                let below = self.link_within(cell, here, next, R::still(nodes.cells[i].half_over_next_1_m), 1);
                let at = Position { ply: p, cell, face: None };
                row.second = self.side(&mut sweep, at, here, below, *row, twice_inverse_step_1_s, step);
            }
        }
        let at_back = Position { ply: self.scales.plies.len() - 1, cell: last, face: Some(1) };
        let here = self.nodes(last..last + 1).node::<GAS>(0, 1);
        let row = system[last];
        system[last].second = self.side(&mut sweep, at_back, here, no_link(), row, twice_inverse_step_1_s, step);
        self.thermal.system = system;
        self.thermal.passed = sweep.passed;
        sweep.taken
    }
}
