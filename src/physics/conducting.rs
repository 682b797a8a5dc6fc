//! A member's conduction: properties of every cell, what flows between them and through the faces.

use super::Real;
use super::compensated::{Pair, difference};
use super::faces::{FaceFlux, face_flux};
use super::holder::flux_sideways;
use super::material::{
    conductance_across, conductance_within, conductivity, conductivity_slope, flux_slope, gain_across, heat_capacity,
};
use super::member::{Ends, Member};
use super::table::{segment, spot, value};
use crate::plan::GasPath;
use crate::plan::layout::Drive;

impl<R: Real> Member<'_, R> {
    /// Conductivity, heat capacity and conductance of every cell at `T + Δ₁`; at the first stage also the slopes
    /// of the flux under it, by its own temperature in `lower` and by that of the next cell, less, in `upper`.
    #[inline(always)]
    pub(super) fn properties(&mut self, step: usize, stage: usize) {
        let rows = self.rows;
        for p in 0..self.plies.len() {
            let ply = &self.plan.plies[p];
            for i in ply.first_cell as usize..ply.end_cell as usize {
                let at = spot(self.temperatures[i].high + self.first[i]);
                if self.plan.gas.is_some() {
                    self.gas_at(i, at);
                }
                if ply.states > 1 || self.plan.levels > 1 {
                    self.blend(p, i, at, step, stage);
                    continue;
                }
                let (parts, scale) = (self.plan.parts, self.plies[p]);
                let here = segment(&rows.tables, at, self.plan.table_columns(), ply.table as usize);
                self.conductivities[i] = conductivity(here, parts, scale);
                if stage == 0 {
                    self.slopes[i] = conductivity_slope(here, parts, scale);
                }
                self.evaluated[i] = R::of(rows.cells[i].width_m) * heat_capacity(here, parts, scale);
            }
            if self.plan.gas == Some(GasPath::Darcy) {
                for i in ply.first_cell as usize..ply.end_cell as usize {
                    self.evaluated[i] = self.evaluated[i] + self.gas_capacity(i);
                }
            }
            for i in ply.first_cell as usize..ply.end_cell as usize - 1 {
                let half_over_next_1_m = R::of(rows.cells[i].half_over_next_1_m);
                self.conductances[i] =
                    conductance_within(self.conductivities[i], self.conductivities[i + 1], half_over_next_1_m);
                if stage == 0 {
                    self.incline(i, half_over_next_1_m, half_over_next_1_m);
                }
            }
            if p > 0 {
                let i = ply.first_cell as usize - 1;
                self.conductances[i] = conductance_across(
                    self.conductivities[i],
                    R::of(rows.cells[i].below_m),
                    self.conductivities[i + 1],
                    R::of(rows.cells[i + 1].above_m),
                    self.contacts_m2_k_w[p - 1],
                );
                if stage == 0 {
                    let conductance = self.conductances[i];
                    let above = gain_across(conductance, self.conductivities[i], R::of(rows.cells[i].below_m));
                    let below = gain_across(conductance, self.conductivities[i + 1], R::of(rows.cells[i + 1].above_m));
                    self.incline(i, above, below);
                }
            }
        }
    }

    /// The slopes of the flux under a cell, from what its conductance gains by the conductivities beside it.
    #[inline(always)]
    pub(super) fn incline(&mut self, i: usize, above_1_m: R, below_1_m: R) {
        let drop = difference(self.temperatures[i], self.temperatures[i + 1]);
        let zero = R::constant(0.0);
        let [above, below] = if self.plan.gas.is_some() { self.carried_slopes(i) } else { [zero, zero] };
        self.lower[i] = flux_slope(self.conductances[i], above_1_m, self.slopes[i], drop, above);
        self.upper[i] = flux_slope(self.conductances[i], below_1_m, self.slopes[i + 1], -drop, below);
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
        let (rows, table, columns) = (self.rows, self.plan.face_table(), self.plan.face_columns());
        let temperature_k = self.temperatures[cell].high + self.first[cell];
        let at = spot(temperature_k);
        let ply = face * (self.plies.len() - 1);
        let emissivity = self.face_emissivity(face, ply, cell, at);
        let air = segment(&rows.tables, at, columns, table);
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
        for i in 0..last {
            let below = self.conductances[i] * difference(self.staged(i), self.staged(i + 1));
            self.second[i] = above - below;
            above = below;
        }
        self.second[last] = above + ends.back.flux;
        ends
    }
}
