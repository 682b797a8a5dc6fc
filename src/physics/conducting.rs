//! A member's conduction: properties of every cell, what flows between them and through the faces.

use super::Real;
use super::compensated::{Pair, difference};
use super::faces::{FaceFlux, face_flux};
use super::holder::flux_sideways;
use super::material::{conductance_across, conductance_within, flux_slope, gain_across, solid};
use super::member::{Ends, Member};
use super::table::{segment, spot, value};
use crate::plan::GasPath;
use crate::plan::layout::{Drive, FACE_COLUMNS, GAS_COLUMNS};

impl<R: Real> Member<'_, R> {
    /// Conductivity, heat capacity and conductance of every cell at `T + Δ₁`; at the first stage also the slopes
    /// of the flux under it, by its own temperature in `lower` and by that of the next cell, less, in `upper`.
    #[inline(always)]
    pub(super) fn properties(&mut self, step: usize, stage: usize) {
        let rows = self.rows;
        for p in 0..self.plies.len() {
            let ply = &self.plan.plies[p];
            if ply.states > 1 || self.plan.levels > 1 {
                for i in ply.first_cell as usize..ply.end_cell as usize {
                    self.blend(p, i, spot(self.temperatures[i].high + self.first[i]), step, stage);
                }
            } else {
                self.plain(p, stage);
            }
            if self.plan.gas == Some(GasPath::Darcy) {
                for i in ply.first_cell as usize..ply.end_cell as usize {
                    self.evaluated[i] = self.evaluated[i] + self.gas_capacity(i);
                }
            }
            for i in ply.first_cell as usize..ply.end_cell as usize - 1 {
                let half_over_next_1_m = R::still(rows.cells[i].half_over_next_1_m);
                self.conductances[i] =
                    conductance_within(self.conductivities[i], self.conductivities[i + 1], half_over_next_1_m);
                if stage == 0 {
                    let [above, below] = [self.slopes[i], self.slopes[i + 1]].map(|slope| slope * half_over_next_1_m);
                    self.incline(i, above, below);
                }
            }
            if p > 0 {
                let i = ply.first_cell as usize - 1;
                self.conductances[i] = conductance_across(
                    self.conductivities[i],
                    R::still(rows.cells[i].below_m),
                    self.conductivities[i + 1],
                    R::still(rows.cells[i + 1].above_m),
                    self.contacts_m2_k_w[p - 1],
                );
                if stage == 0 {
                    let conductance = self.conductances[i];
                    let (below_m, above_m) = (R::still(rows.cells[i].below_m), R::still(rows.cells[i + 1].above_m));
                    let above = gain_across(conductance, self.conductivities[i], below_m);
                    let below = gain_across(conductance, self.conductivities[i + 1], above_m);
                    self.incline(i, above * self.slopes[i], below * self.slopes[i + 1]);
                }
            }
        }
    }

    /// Properties of the cells of a ply that is one substance at one pressure. Columns are cut to its cells beforehand, as half
    /// of the march is here and looking whether a cell is within them takes as long as to look its properties up.
    #[inline(always)]
    fn plain(&mut self, p: usize, stage: usize) {
        let (plan, ply, density_kg_m3) = (self.plan, self.plan.plies[p], self.plies[p].density_kg_m3);
        let scale = self.states[ply.first_state as usize];
        // The row's columns, told in numbers that are known beforehand: each read would be checked against the ply's.
        let columns = 2 * plan.properties() + if plan.gas.is_some() { GAS_COLUMNS } else { 0 };
        let table = &self.rows.tables[ply.table as usize..];
        let with_slope = stage == 0;
        let cells = ply.first_cell as usize..ply.end_cell as usize;
        let rows = &self.rows.cells[cells.clone()];
        let temperatures = &self.temperatures[cells.clone()][..rows.len()];
        let first = &self.first[cells.clone()][..rows.len()];
        let conductivities = &mut self.conductivities[cells.clone()][..rows.len()];
        let slopes = &mut self.slopes[cells.clone()][..rows.len()];
        let evaluated = &mut self.evaluated[cells.clone()][..rows.len()];
        for i in 0..rows.len() {
            let row = segment(table, spot(temperatures[i].high + first[i]), columns, 0);
            let here = solid(row, plan.parts, scale, with_slope);
            conductivities[i] = here.conductivity;
            slopes[i] = here.slope;
            evaluated[i] = density_kg_m3 * here.heat_capacity * R::still(rows[i].width_m);
        }
        if plan.gas.is_some() {
            for i in cells {
                let at = spot(self.temperatures[i].high + self.first[i]);
                self.gas_at(i, self.gas_of(p, self.row_of(p, at)));
            }
        }
    }

    /// The slopes of the flux under a cell, from what its conductance gains by the temperatures beside it.
    #[inline(always)]
    pub(super) fn incline(&mut self, i: usize, above_w_m2_k2: R, below_w_m2_k2: R) {
        let drop = difference(self.temperatures[i], self.temperatures[i + 1]);
        let zero = R::constant(0.0);
        let [above, below] = if self.plan.gas.is_some() { self.carried_slopes(i) } else { [zero, zero] };
        self.lower[i] = flux_slope(self.conductances[i], above_w_m2_k2, drop, above);
        self.upper[i] = flux_slope(self.conductances[i], below_w_m2_k2, -drop, below);
    }

    /// A cell's temperature at `T + Δ₁`.
    #[inline(always)]
    pub(super) fn staged(&self, cell: usize) -> Pair<R> {
        let Pair { high, low } = self.temperatures[cell];
        Pair { high, low: low + self.first[cell] }
    }

    /// Heat into the face cell: through an open face from outside, of a held one what passes on to its
    /// neighbour and to the holder.
    #[inline(always)]
    pub(super) fn through(&self, face: usize, drive: Drive<R::Scalar>, cell: usize, neighbour: usize) -> FaceFlux<R> {
        let rows = self.rows;
        let temperature_k = self.temperatures[cell].high + self.first[cell];
        let at = spot(temperature_k);
        let ply = face * (self.plies.len() - 1);
        let emissivity = self.face_emissivity(face, ply, cell, at);
        let air = segment(&rows.tables, at, FACE_COLUMNS, self.plan.face_table());
        let (enthalpy_j_kg, rise_j_kg_k) = (value(air, 0), value(air, 1));
        let scale = self.faces[face];
        let open = face_flux(
            drive,
            rows.faces[face],
            scale,
            temperature_k,
            emissivity,
            enthalpy_j_kg,
            rise_j_kg_k,
            self.outflow,
        );
        let held = R::of(rows.faces[face].held);
        let free = R::constant(1.0) - held;
        let conductance = self.conductances[cell.min(neighbour)];
        let next = conductance * difference(self.staged(cell), self.staged(neighbour));
        let sideways = self.conductance_sideways(face * (self.plies.len() - 1), cell);
        let onward = next - flux_sideways(sideways, R::of(drive.holder_k), self.staged(cell));
        FaceFlux { flux: held * onward + free * open.flux, slope: free * open.slope }
    }

    /// Net heat flux into every cell at `T + Δ₁`, left in `second`.
    #[inline(always)]
    pub(super) fn imbalance(&mut self, hot: Drive<R::Scalar>, back: Drive<R::Scalar>) -> Ends<R> {
        let last = self.second.len() - 1;
        let ends = Ends { hot: self.through(0, hot, 0, 1), back: self.through(1, back, last, last - 1) };
        let mut above = ends.hot.flux;
        let second = &mut self.second[..last];
        let conductances = &self.conductances[..last];
        let temperatures = &self.temperatures[..last + 1];
        let first = &self.first[..last + 1];
        let mut here = Pair { high: temperatures[0].high, low: temperatures[0].low + first[0] };
        for i in 0..last {
            let Pair { high, low } = temperatures[i + 1];
            let next = Pair { high, low: low + first[i + 1] };
            let below = conductances[i] * difference(here, next);
            second[i] = above - below;
            above = below;
            here = next;
        }
        self.second[last] = above + ends.back.flux;
        ends
    }
}
