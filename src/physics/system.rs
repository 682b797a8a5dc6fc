//! Assembly and forward elimination of the linear system of a step.
//!
//! Both stages have the same matrix: see `step`. One pass computes the fluxes, the matrix row and its elimination, as
//! storing and reloading columns would take longer than the arithmetic. A row is complete once the node below is known,
//! so it is assembled with the face between them.

use super::GAMMA;
use super::Real;
use super::conduction::{InteriorFaceFlux, Node, no_flux};
use super::member::{Member, half_over_distance_1_m};
use super::pyrolysis::{DAMPING_SHARE, stiffness_damping};
use super::state::{BoundaryRow, CellProperties, EliminatedRow};
use super::surface_flux::SurfaceFlux;
use super::tridiagonal::{eliminate_conducting_row, eliminate_row, flush_tiny, forward_eliminate};
use crate::layout::GasTransport;
use std::ops::Range;

/// Matrix row of a cell before elimination.
#[derive(Clone, Copy)]
struct MatrixRow<R> {
    lower: R,
    /// Diagonal element; in f32 its remainder after the elimination of the row above, without the slope of the flux to
    /// the next cell.
    diagonal: R,
    /// Slope of the flux to the next cell, negated.
    slope: R,
    upper: R,
    rhs: R,
}

/// State carried by the forward elimination from cell to cell.
struct ForwardSweep<R> {
    /// Conducted heat that flows into the cell, its gain by advection, and the heat that all cells above took from the
    /// holder, W/m².
    conducted: R,
    advected: R,
    from_holder: R,
    /// −γ times the slopes of the conducted heat, by the temperature of the cell above and, negated, by the cell's,
    /// W/m²/K.
    slopes: [R; 2],
    /// Reciprocal pivot, upper coefficient and right-hand side (not flushed) of the row above.
    reciprocal: R,
    upper: R,
    rhs: R,
    /// Share of its diagonal in the pivot of the row above, in f32.
    share: R,
    /// Heat conducted onwards by the cells of both faces, W/m², and −γ times its slopes by their temperatures and,
    /// negated, by those of their neighbours.
    face_conduction: [R; 2],
    face_conduction_slopes: [[R; 2]; 2],
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
fn forward_sweep<R: Real>() -> ForwardSweep<R> {
    let zero = R::from_f64(0.0);
    ForwardSweep {
        conducted: zero,
        advected: zero,
        from_holder: zero,
        slopes: [zero; 2],
        reciprocal: zero,
        upper: zero,
        rhs: zero,
        share: R::from_f64(1.0),
        face_conduction: [zero; 2],
        face_conduction_slopes: [[zero; 2]; 2],
    }
}

impl<R: Real> BoundaryRow<R> {
    /// The matrix row with the boundary condition, and with the slope of the heat that leaves with the gas.
    #[inline(always)]
    fn apply_boundary(self, row: MatrixRow<R>, outflow_slope: R) -> MatrixRow<R> {
        let free = R::constant_from_f64(1.0) - self.held;
        MatrixRow {
            lower: row.lower * free,
            diagonal: (row.diagonal + outflow_slope - self.slope) * free + self.held,
            slope: row.slope * free,
            upper: row.upper * free,
            rhs: (row.rhs + self.rhs_correction) * free + self.held * self.rise_k,
        }
    }

    /// The right-hand side of the second stage with the boundary condition.
    #[inline(always)]
    fn apply_boundary_rhs(self, rhs: R) -> R {
        (rhs - self.rhs_correction) * (R::constant_from_f64(1.0) - self.held) - self.held * self.rise_k
    }
}

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Rise of a held face's temperature over a step, K.
    #[inline(always)]
    fn held_face_rise(&self, face: usize, step: usize) -> R::Constant {
        R::constant(self.forcing(face, step, 1).held_k) - R::constant(self.forcing(face, step, 0).held_k)
    }

    /// Boundary row of a face at a stage. The first stage evaluates γr: the change of the flux over the step by the
    /// schedules.
    #[inline(always)]
    pub(super) fn boundary_row(&self, face: usize, cell: usize, step: usize, stage: usize) -> BoundaryRow<R> {
        let surface = self.surface_state(face, cell, stage);
        // By the schedules at the stage and, at the first, at the end of the step; a loop, for one copy of the code.
        let mut fluxes = [SurfaceFlux { flux: R::from_f64(0.0), slope: R::from_f64(0.0) }; 2];
        for (at, flux) in fluxes.iter_mut().enumerate().skip(stage) {
            *flux = self.open_face_flux(face, self.forcing(face, step, at), surface);
        }
        if stage == 1 {
            return BoundaryRow { flux: fluxes[1].flux, ..self.thermal.boundary_rows[face] };
        }
        let [now, end] = fluxes;
        BoundaryRow {
            held: R::constant(self.rows.faces[face].held),
            rise_k: self.held_face_rise(face, step),
            flux: now.flux,
            rhs_correction: (end.flux - now.flux) * R::constant_from_f64(GAMMA),
            slope: now.slope * R::constant_from_f64(GAMMA),
        }
    }

    /// Net heat flux into a cell at a stage, from the fluxes at the face below and from the holder, W/m².
    #[inline(always)]
    fn net_heat_flux(
        &self,
        at: Position,
        below: InteriorFaceFlux<R>,
        from_holder: R,
        stage: usize,
        sweep: &ForwardSweep<R>,
    ) -> R {
        let mut flux = sweep.conducted - below.conducted;
        if GAS {
            flux = ((sweep.conducted + sweep.advected) - (below.conducted - below.advected))
                - self.absorbed_heat_at(at.cell, stage);
        }
        if let Some(face) = at.face {
            flux = flux + self.thermal.boundary_rows[face].flux;
        }
        if GAS && self.plan.gas == Some(GasTransport::Darcy) {
            flux = flux + self.pressure_work(at.ply, at.cell, stage);
        }
        if self.plan.has_holder {
            flux = flux + from_holder;
        }
        flux
    }

    /// Eliminates the row of a cell, with the right-hand side of the first stage.
    #[inline(always)]
    fn first_stage_row(
        &self,
        sweep: &mut ForwardSweep<R>,
        at: Position,
        node: Node<R>,
        below: InteriorFaceFlux<R>,
        inverse_step_1_s: R::Constant,
        step: usize,
    ) -> EliminatedRow<R> {
        let less = R::constant_from_f64(-GAMMA);
        let (own_slope, next_slope) = (below.slopes[0] * less, below.slopes[1] * less);
        let mut from_holder = R::from_f64(0.0);
        if self.plan.has_holder {
            from_holder = self.holder_flux(at.ply, at.cell, step, 0);
            sweep.from_holder = sweep.from_holder + from_holder;
        }
        let storage = node.properties.first_capacity * inverse_step_1_s;
        let mut row = MatrixRow {
            lower: sweep.slopes[0],
            diagonal: if R::MANTISSA_BITS > 23 {
                storage - (sweep.slopes[1] + own_slope)
            } else {
                storage - sweep.slopes[1] * sweep.share
            },
            slope: own_slope,
            upper: next_slope,
            rhs: self.net_heat_flux(at, below, from_holder, 0, sweep),
        };
        if self.plan.has_holder {
            row.diagonal = row.diagonal + self.holder_conductance(at.ply, at.cell) * R::constant_from_f64(GAMMA);
        }
        if GAS && self.plan.plies[at.ply].end_reaction > self.plan.plies[at.ply].first_reaction {
            let damping_rate_1_s = inverse_step_1_s * R::constant_from_f64(DAMPING_SHARE);
            row.diagonal = row.diagonal
                + stiffness_damping(
                    self.reactions.sources[at.cell].heat_slope,
                    node.properties.first_capacity,
                    damping_rate_1_s,
                );
        }
        if let Some(face) = at.face {
            let (passed, slopes) = if face == 0 {
                (below.conducted, [own_slope, next_slope])
            } else {
                (-sweep.conducted, [sweep.slopes[1], sweep.slopes[0]])
            };
            sweep.face_conduction[face] = passed;
            sweep.face_conduction_slopes[face] = slopes;
            let outflow_slope = if GAS { self.outflow_heat_slope(face, at.cell) } else { R::from_f64(0.0) };
            row = self.thermal.boundary_rows[face].apply_boundary(row, outflow_slope);
        }
        let (under, reciprocal);
        if R::MANTISSA_BITS > 23 {
            [under, reciprocal] = eliminate_row(row.lower, row.diagonal, sweep.reciprocal, sweep.upper);
        } else {
            [under, reciprocal, sweep.share] =
                eliminate_conducting_row(row.lower, row.diagonal, row.slope, sweep.reciprocal);
        }
        sweep.rhs = forward_eliminate(row.rhs, under, sweep.rhs);
        sweep.slopes = [own_slope, next_slope];
        (sweep.reciprocal, sweep.upper) = (reciprocal, row.upper);
        (sweep.conducted, sweep.advected) = (below.conducted, below.advected);
        EliminatedRow {
            lower_ratio: under,
            reciprocal,
            upper_ratio: row.upper * reciprocal,
            rhs_or_increment: flush_tiny(sweep.rhs),
        }
    }

    /// Eliminates the right-hand side of the second stage in a cell's row.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "the WGSL twin reads columns instead")]
    fn second_stage_row(
        &self,
        sweep: &mut ForwardSweep<R>,
        at: Position,
        node: Node<R>,
        below: InteriorFaceFlux<R>,
        row: EliminatedRow<R>,
        twice_inverse_step_1_s: R::Constant,
        step: usize,
    ) -> R {
        let mut from_holder = R::from_f64(0.0);
        if self.plan.has_holder {
            from_holder = self.holder_flux(at.ply, at.cell, step, 1);
            sweep.from_holder = sweep.from_holder + from_holder;
        }
        let net = self.net_heat_flux(at, below, from_holder, 1, sweep);
        let CellProperties { slope_or_capacity: capacity, first_capacity, .. } = node.properties;
        let mut solution = node.increment;
        if self.plan.has_enthalpy_steps {
            solution = self.thermal.first_solution[at.cell];
        }
        let mut rhs = first_capacity / capacity * net - first_capacity * twice_inverse_step_1_s * solution;
        if let Some(face) = at.face {
            sweep.face_conduction[face] = if face == 0 { below.conducted } else { -sweep.conducted };
            rhs = self.thermal.boundary_rows[face].apply_boundary_rhs(rhs);
        }
        sweep.rhs = forward_eliminate(rhs, row.lower_ratio, sweep.rhs);
        (sweep.conducted, sweep.advected) = (below.conducted, below.advected);
        flush_tiny(sweep.rhs)
    }

    /// The node whose matrix row is eliminated before the rows within ply `p`, and the fluxes from this node to the
    /// next one. It is the first node of the layup for the first ply, the last node of the ply above for a further ply,
    /// and the last node of the layup if `p` is the number of plies. `None` if the first ply has one cell.
    #[inline(always)]
    fn node_above(&self, p: usize, step: usize, stage: usize) -> Option<(Position, Node<R>, InteriorFaceFlux<R>)> {
        if p == self.scales.plies.len() {
            let last = self.thermal.temperatures.len() - 1;
            let here = self.node_columns(last..last + 1).node::<GAS>(0, stage);
            return Some((Position { ply: p - 1, cell: last, face: Some(1) }, here, no_flux()));
        }
        let cell = (self.plan.plies[p].first_cell as usize).saturating_sub(1);
        if p == 0 && self.plan.plies[0].end_cell == 1 {
            return None;
        }
        let nodes = self.node_columns(cell..cell + 2);
        let (here, next) = (nodes.node::<GAS>(0, stage), nodes.node::<GAS>(1, stage));
        let at = position(p.saturating_sub(1), cell);
        let below = if p == 0 {
            let half_over_next_1_m = half_over_distance_1_m::<R>(&nodes.cells[0]);
            match self.integrates_conductivity(0) {
                true => self.flux_within_ply::<true>(0, 0, here, next, half_over_next_1_m, step, stage),
                false => self.flux_within_ply::<false>(0, 0, here, next, half_over_next_1_m, step, stage),
            }
        } else {
            self.flux_across_interface(p, here, next, stage)
        };
        Some((at, here, below))
    }

    /// Cells of a ply, and the number of its first faces between cells that [`node_above`](Self::node_above) covers;
    /// `None` past the last ply.
    #[inline(always)]
    fn cells_and_covered_faces(&self, p: usize) -> Option<(Range<usize>, usize)> {
        let ply = self.plan.plies.get(p)?;
        let cells = ply.first_cell as usize..ply.end_cell as usize;
        let covered = usize::from(p == 0).min(cells.len() - 1);
        Some((cells, covered))
    }

    /// Whether the fluxes within a ply are differences of the integral of its conductivity.
    #[inline(always)]
    pub(super) fn integrates_conductivity(&self, p: usize) -> bool {
        self.plan.tables[p].conductivity_integral > 0
    }

    /// Eliminates the row of a cell at a stage: the matrix and the right-hand side at the first, the right-hand side at
    /// the second. `rate_1_s`: the reciprocal length of the step, twice that at the second stage.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "as its WGSL twin")]
    fn eliminate_stage_row<const STAGE: usize>(
        &self,
        row: &mut EliminatedRow<R>,
        sweep: &mut ForwardSweep<R>,
        at: Position,
        here: Node<R>,
        below: InteriorFaceFlux<R>,
        rate_1_s: R::Constant,
        step: usize,
    ) {
        if STAGE == 0 {
            *row = self.first_stage_row(sweep, at, here, below, rate_1_s, step);
        } else {
            row.rhs_or_increment = self.second_stage_row(sweep, at, here, below, *row, rate_1_s, step);
        }
    }

    /// [`assemble_stage`](Self::assemble_stage) of the cells of a ply after the first `after_first`, but the last. A
    /// copy for each kind of conductivity: the rare one would spill registers of the other.
    #[inline(always)]
    fn assemble_within<const STAGE: usize, const STEEP: bool>(
        &self,
        rows: &mut [EliminatedRow<R>],
        sweep: &mut ForwardSweep<R>,
        (p, cells, after_first): (usize, Range<usize>, usize),
        rate_1_s: R::Constant,
        step: usize,
    ) {
        let nodes = self.node_columns(cells.clone());
        // Both nodes are read anew in each turn: carrying one over would spill the registers of the pivot, which is the
        // critical path.
        for (after, row) in rows[..cells.len() - 1][after_first..].iter_mut().enumerate() {
            let i = after_first + after;
            let cell = cells.start + i;
            let (here, next) = (nodes.node::<GAS>(i, STAGE), nodes.node::<GAS>(i + 1, STAGE));
            let half_over_next_1_m = half_over_distance_1_m::<R>(&nodes.cells[i]);
            let below = self.flux_within_ply::<STEEP>(p, cell, here, next, half_over_next_1_m, step, STAGE);
            let at = Position { ply: p, cell, face: None };
            self.eliminate_stage_row::<STAGE>(row, sweep, at, here, below, rate_1_s, step);
        }
    }

    /// Assembles the system of a stage and eliminates its right-hand side; the first stage factors the matrix of both.
    /// Returns the heat that all cells take from the holder, W/m².
    #[inline(always)]
    pub(super) fn assemble_stage<const STAGE: usize>(&mut self, step: usize) -> R {
        let rate_1_s = R::constant_from_f64(if STAGE == 0 { 1.0 } else { 2.0 }) / self.step_length_s(step);
        let mut sweep = forward_sweep();
        let mut system = std::mem::take(&mut self.thermal.system);
        for p in 0..=self.scales.plies.len() {
            if let Some((at, here, below)) = self.node_above(p, step, STAGE) {
                self.eliminate_stage_row::<STAGE>(&mut system[at.cell], &mut sweep, at, here, below, rate_1_s, step);
            }
            let Some((cells, after_first)) = self.cells_and_covered_faces(p) else { break };
            let (rows, within) = (&mut system[cells.clone()], (p, cells, after_first));
            match self.integrates_conductivity(p) {
                true => self.assemble_within::<STAGE, true>(rows, &mut sweep, within, rate_1_s, step),
                false => self.assemble_within::<STAGE, false>(rows, &mut sweep, within, rate_1_s, step),
            }
        }
        self.thermal.system = system;
        self.thermal.face_conduction = sweep.face_conduction;
        if STAGE == 0 {
            self.thermal.face_conduction_slopes = sweep.face_conduction_slopes;
        }
        sweep.from_holder
    }
}
