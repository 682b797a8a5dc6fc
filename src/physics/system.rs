//! The system of a step, made and eliminated on the way down over the cells.
//!
//! Both stages have the same matrix: see `step`. All is done in one go, as to write a column and to read it again takes longer than most of what
//! is done to it: what flows from cell to cell, the row that this makes, and its elimination. A row is known once the node under it is,
//! so that it is made on the way over the link between them.

use super::GAMMA;
use super::Real;
use super::conducting::{Link, Node, no_link};
use super::member::Member;
use super::reacting::{EASE, restraint};
use super::state::{Edge, Eliminated};
use super::tridiagonal::{descended, eliminated, settled};
use crate::plan::GasPath;

/// A cell's row of the system on its way into it.
#[derive(Clone, Copy)]
struct Row<R> {
    lower: R,
    diagonal: R,
    upper: R,
    side: R,
}

/// What the way down has with it from cell to cell.
struct Way<R> {
    /// Heat that flows into the cell by conduction, what gas brings it, and what all cells before took from the holder, W/m².
    conducted: R,
    gained: R,
    taken: R,
    /// −γ times the slopes of what is conducted, by the temperature of the cell above and, less, by the cell's, W/m²/K.
    slopes: [R; 2],
    /// Of the row above the reciprocal of its pivot, its upper coefficient and its right-hand side, not settled yet.
    reciprocal: R,
    upper: R,
    side: R,
    /// Of the cells of both faces what they conduct on, W/m², and −γ times the slopes of that, by their temperatures and, less, by those of
    /// their neighbours.
    passed: [R; 2],
    passed_slopes: [[R; 2]; 2],
}

/// Where a cell lies: in its ply, among all, and at a face or at none.
#[derive(Clone, Copy)]
struct Position {
    ply: usize,
    cell: usize,
    face: Option<usize>,
}

/// That of a cell that has another one under it.
#[inline(always)]
fn position(ply: usize, cell: usize) -> Position {
    Position { ply, cell, face: (cell == 0).then_some(0) }
}

/// At the hot face.
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
    /// The row with what the face does to it, and with the slope of the heat that gas takes out.
    #[inline(always)]
    fn bounds(self, row: Row<R>, let_out: R) -> Row<R> {
        let free = R::fixed(1.0) - self.held;
        Row {
            lower: row.lower * free,
            diagonal: (row.diagonal + let_out - self.slope) * free + self.held,
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
    /// The rise of a held face over a step, K.
    #[inline(always)]
    fn rise(&self, face: usize, step: usize) -> R::Still {
        let drives = &self.rows.drives;
        R::still(drives[4 * step + 2 * face + 1].held_k) - R::still(drives[4 * step + 2 * face].held_k)
    }

    /// What a face does to the row of its cell at a stage; γr is told at the first: by how much the schedules raise the flux through the face
    /// over the step.
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

    /// The net heat flux into a cell at a stage, given the link under it and what comes from the holder, W/m².
    #[inline(always)]
    fn net(&self, at: Position, link: Link<R>, from_holder: R, stage: usize, way: &Way<R>) -> R {
        let mut net = way.conducted - link.conducted;
        if GAS {
            net = ((way.conducted + way.gained) - (link.conducted - link.gained)) - self.absorbed_at(at.cell, stage);
        }
        if let Some(face) = at.face {
            net = net + self.thermal.edges[face].flux;
        }
        if GAS && self.plan.gas == Some(GasPath::Darcy) {
            net = net + self.swept(at.ply, at.cell, stage);
        }
        if self.plan.has_holder {
            net = net + from_holder;
        }
        net
    }

    /// Over the link under a cell, which makes its row of the system of both stages with the right-hand side of the first.
    #[inline(always)]
    fn row(
        &self,
        way: &mut Way<R>,
        at: Position,
        node: Node<R>,
        link: Link<R>,
        per_length: R::Still,
        step: usize,
    ) -> Eliminated<R> {
        let less = R::fixed(-GAMMA);
        let (leaving, below) = (link.slopes[0] * less, link.slopes[1] * less);
        let mut from_holder = R::constant(0.0);
        if self.plan.has_holder {
            from_holder = self.sideways(at.ply, at.cell, step, 0);
            way.taken = way.taken + from_holder;
        }
        let mut row = Row {
            lower: way.slopes[0],
            diagonal: node.matter.capacity * per_length - (way.slopes[1] + leaving),
            upper: below,
            side: self.net(at, link, from_holder, 0, way),
        };
        if self.plan.has_holder {
            row.diagonal = row.diagonal + self.conductance_sideways(at.ply, at.cell) * R::fixed(GAMMA);
        }
        if GAS && self.plan.plies[at.ply].end_reaction > self.plan.plies[at.ply].first_reaction {
            let eased = per_length * R::fixed(EASE);
            row.diagonal = row.diagonal + restraint(self.reactions.restraints[at.cell], node.matter.capacity, eased);
        }
        if let Some(face) = at.face {
            let (passed, slopes) =
                [(link.conducted, [leaving, below]), (-way.conducted, [way.slopes[1], way.slopes[0]])][face];
            way.passed[face] = passed;
            way.passed_slopes[face] = slopes;
            let let_out = if GAS { self.let_out_heat(face, at.cell) } else { R::constant(0.0) };
            row = self.thermal.edges[face].bounds(row, let_out);
        }
        let [under, reciprocal] = eliminated(row.lower, row.diagonal, way.reciprocal, way.upper);
        way.side = descended(row.side, under, way.side);
        way.slopes = [leaving, below];
        (way.reciprocal, way.upper) = (reciprocal, row.upper);
        (way.conducted, way.gained) = (link.conducted, link.gained);
        let (over, capacity) = (row.upper * reciprocal, node.matter.capacity);
        Eliminated { under, reciprocal, over, capacity, second: settled(way.side) }
    }

    /// Over the link under a cell, which makes the right-hand side of the second stage in its row.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "the twin in WGSL has its columns at hand")]
    fn side(
        &self,
        way: &mut Way<R>,
        at: Position,
        node: Node<R>,
        link: Link<R>,
        row: Eliminated<R>,
        twice_per_length: R::Still,
        step: usize,
    ) -> R {
        let mut from_holder = R::constant(0.0);
        if self.plan.has_holder {
            from_holder = self.sideways(at.ply, at.cell, step, 1);
            way.taken = way.taken + from_holder;
        }
        let net = self.net(at, link, from_holder, 1, way);
        let mut side = row.capacity / node.matter.capacity * net - row.capacity * twice_per_length * node.moved;
        if let Some(face) = at.face {
            way.passed[face] = [link.conducted, -way.conducted][face];
            side = self.thermal.edges[face].corrects(side);
        }
        way.side = descended(side, row.under, way.side);
        (way.conducted, way.gained) = (link.conducted, link.gained);
        settled(way.side)
    }

    /// The system of both stages, factored, and on the way down the right-hand side of the first; what all cells take from the holder, W/m². What
    /// leaves one cell enters the next, so the columns of K sum to nothing.
    #[inline(always)]
    pub(super) fn assemble(&mut self, step: usize) -> R {
        let last = self.thermal.temperatures.len() - 1;
        let per_length = R::fixed(1.0) / self.length_s(step);
        let mut way = way();
        let mut system = std::mem::take(&mut self.thermal.system);
        for p in 0..self.scales.plies.len() {
            let cells = self.plan.plies[p].first_cell as usize..self.plan.plies[p].end_cell as usize;
            let nodes = self.nodes(cells.clone());
            if p > 0 {
                let i = cells.start - 1;
                let above = self.nodes(i..cells.start).node::<GAS>(0, 0);
                let link = self.link_across(p, above, nodes.node::<GAS>(0, 0), 0);
                system[i] = self.row(&mut way, position(p - 1, i), above, link, per_length, step);
            }
            let links = cells.len() - 1;
            let system = &mut system[cells.clone()][..links];
            // The cell at the hot face goes before the others, which then need not be asked whether they are at it. Both nodes are read
            // anew in each turn: one carried on from the turn before takes the registers in which the pivot is waited for, which then is
            // written to memory and read again between one cell and the next.
            let faced = links.min(usize::from(p == 0));
            if faced > 0 {
                let (here, next) = (nodes.node::<GAS>(0, 0), nodes.node::<GAS>(1, 0));
                let link = self.link_within(0, here, next, R::still(nodes.cells[0].half_over_next_1_m), 0);
                system[0] = self.row(&mut way, position(0, 0), here, link, per_length, step);
            }
            for (i, row) in (faced..).zip(&mut system[faced..]) {
                let cell = cells.start + i;
                let (here, next) = (nodes.node::<GAS>(i, 0), nodes.node::<GAS>(i + 1, 0));
                let link = self.link_within(cell, here, next, R::still(nodes.cells[i].half_over_next_1_m), 0);
                let at = Position { ply: p, cell, face: None };
                *row = self.row(&mut way, at, here, link, per_length, step);
            }
        }
        let at_back = Position { ply: self.scales.plies.len() - 1, cell: last, face: Some(1) };
        let here = self.nodes(last..last + 1).node::<GAS>(0, 0);
        system[last] = self.row(&mut way, at_back, here, no_link(), per_length, step);
        self.thermal.system = system;
        (self.thermal.passed, self.thermal.passed_slopes) = (way.passed, way.passed_slopes);
        way.taken
    }

    /// The right-hand side of the second stage, on the way down; what all cells take from the holder, W/m².
    #[inline(always)]
    pub(super) fn correct(&mut self, step: usize) -> R {
        let last = self.thermal.temperatures.len() - 1;
        let twice_per_length = R::fixed(2.0) / self.length_s(step);
        let mut way = way();
        let mut system = std::mem::take(&mut self.thermal.system);
        for p in 0..self.scales.plies.len() {
            let cells = self.plan.plies[p].first_cell as usize..self.plan.plies[p].end_cell as usize;
            let nodes = self.nodes(cells.clone());
            if p > 0 {
                let i = cells.start - 1;
                let above = self.nodes(i..cells.start).node::<GAS>(0, 1);
                let link = self.link_across(p, above, nodes.node::<GAS>(0, 1), 1);
                let row = system[i];
                system[i].second = self.side(&mut way, position(p - 1, i), above, link, row, twice_per_length, step);
            }
            let links = cells.len() - 1;
            let system = &mut system[cells.clone()][..links];
            let faced = links.min(usize::from(p == 0));
            if faced > 0 {
                let (here, next) = (nodes.node::<GAS>(0, 1), nodes.node::<GAS>(1, 1));
                let link = self.link_within(0, here, next, R::still(nodes.cells[0].half_over_next_1_m), 1);
                let row = system[0];
                system[0].second = self.side(&mut way, position(0, 0), here, link, row, twice_per_length, step);
            }
            for (i, row) in (faced..).zip(&mut system[faced..]) {
                let cell = cells.start + i;
                let (here, next) = (nodes.node::<GAS>(i, 1), nodes.node::<GAS>(i + 1, 1));
                let link = self.link_within(cell, here, next, R::still(nodes.cells[i].half_over_next_1_m), 1);
                let at = Position { ply: p, cell, face: None };
                row.second = self.side(&mut way, at, here, link, *row, twice_per_length, step);
            }
        }
        let at_back = Position { ply: self.scales.plies.len() - 1, cell: last, face: Some(1) };
        let here = self.nodes(last..last + 1).node::<GAS>(0, 1);
        let row = system[last];
        system[last].second = self.side(&mut way, at_back, here, no_link(), row, twice_per_length, step);
        self.thermal.system = system;
        self.thermal.passed = way.passed;
        way.taken
    }
}
