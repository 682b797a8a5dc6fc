//! A member's conduction: properties of every cell, what flows between them and through the faces.

use super::Real;
use super::carrying::{carried_gain, carried_slopes, gas_enthalpy};
use super::compensated::{Pair, difference, raised};
use super::faces::{FaceFlux, face_flux};
use super::holder::flux_sideways;
use super::material::{conductance_across, conductance_within, flux_slopes, gain_across, solid};
use super::member::{Ends, Member};
use super::mixing::{left_of, together};
use super::table::{beyond, integral, segment, spot, value};
use crate::plan::GasPath;
use crate::plan::layout::{Drive, FACE_COLUMNS, GAS_COLUMNS};

/// What the slopes of a flux gain as temperatures move conductivities, less what gas carries against it.
#[inline(always)]
fn less<R: Real>(gained: [R; 2], carried: [R; 2]) -> [R; 2] {
    [gained[0] - carried[0], gained[1] - carried[1]]
}

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Conductivity, heat capacity and conductance of every cell at `T + Δ₁`, and the heat that conduction and gas bring it and reactions take, in
    /// `second`; at the first stage also the slopes of the flux under it, by its own temperature in `lower` and by that of the next
    /// cell, less, in `upper`.
    #[inline(always)]
    pub(super) fn properties(&mut self, step: usize, stage: usize) {
        let mut above = R::constant(0.0);
        if GAS && !self.reads_gas(stage) {
            self.gas_onward();
        }
        for p in 0..self.plies.len() {
            let ply = &self.plan.plies[p];
            if ply.rows > 1 || self.plan.levels > 1 {
                for i in ply.first_cell as usize..ply.end_cell as usize {
                    let at = spot(self.temperatures[i].high + self.first[i]);
                    self.blend(p, i, at, step, stage);
                }
            } else {
                self.plain(p, stage);
            }
            if GAS && self.plan.gas == Some(GasPath::Darcy) {
                for i in ply.first_cell as usize..ply.end_cell as usize {
                    self.evaluated[i] = self.evaluated[i] + self.gas_capacity(i);
                }
            }
            if p > 0 {
                above = self.link_across(p, stage, above);
            }
            above = self.link_within(p, stage, above);
        }
        let last = self.second.len() - 1;
        self.second[last] = above - self.absorbed_at(last, stage);
    }

    /// Properties of the cells of a ply at one pressure whose states are one substance, or so many times one. Columns are cut to its cells
    /// beforehand, as half of the march is here and looking whether a cell is within them takes as long as to look its properties up.
    #[inline(always)]
    fn plain(&mut self, p: usize, stage: usize) {
        let (plan, ply, bulk, whole) = (self.plan, self.plan.plies[p], self.rows.bulks[p], self.plies[p]);
        let (states, stride, parts) = (ply.states as usize, plan.states, ply.parts as usize);
        let own = &self.states[ply.first_state as usize..][..states];
        // The row's columns, told in numbers that are known beforehand: each read would be checked against the ply's.
        let columns = 2 * plan.properties() + if GAS { GAS_COLUMNS } else { 0 };
        let table = &self.rows.tables[ply.table as usize..];
        let (with_slope, reads_gas) = (stage == 0, self.reads_gas(stage));
        let cells = ply.first_cell as usize..ply.end_cell as usize;
        let rows = &self.rows.cells[cells.clone()];
        let temperatures = &self.temperatures[cells.clone()][..rows.len()];
        let first = &self.first[cells.clone()][..rows.len()];
        let conductivities = &mut self.conductivities[cells.clone()][..rows.len()];
        let slopes = &mut self.slopes[cells.clone()][..rows.len()];
        let evaluated = &mut self.evaluated[cells.clone()][..rows.len()];
        let of_gas = if GAS { cells.clone() } else { 0..0 };
        let gas_j_kg = &mut self.gas_j_kg[of_gas.clone()];
        let gas_rises = &mut self.gas_rises[of_gas];
        let mixes = GAS && states > 1;
        let of_states = if mixes { cells.start * stride..cells.end * stride } else { 0..0 };
        let phases = &self.phases[stage][of_states.clone()];
        let risen = &mut self.risen[of_states];
        for i in 0..rows.len() {
            let row = segment(table, spot(temperatures[i].high + first[i]), columns, 0);
            let (mut scale, mut density_kg_m3) = (own[0].conductivity, whole.density_kg_m3);
            if mixes {
                let all = together(&phases[i * stride..][..own.len()], own, parts);
                let per_left = R::constant(1.0) / left_of(all.remains, whole, bulk);
                scale = all.conductivity.times(per_left, parts);
                density_kg_m3 = whole.mass_kg_m3 * all.stores;
                if with_slope {
                    risen[i * stride] = [integral(row, 1), value(row, 1)];
                }
            }
            let here = solid(row, parts, scale, with_slope);
            conductivities[i] = here.conductivity;
            slopes[i] = here.slope;
            evaluated[i] = density_kg_m3 * here.heat_capacity * R::still(rows[i].width_m);
            if reads_gas {
                [gas_j_kg[i], gas_rises[i]] = gas_enthalpy(beyond(row, plan.properties()));
            }
        }
    }

    /// What flows from cell to cell of a ply, given what flows into its first; returned is what flows into its last.
    #[inline(always)]
    fn link_within(&mut self, p: usize, stage: usize, mut above: R) -> R {
        let cells = self.plan.plies[p].first_cell as usize..self.plan.plies[p].end_cell as usize;
        let rows = &self.rows.cells[cells.clone()];
        let temperatures = &self.temperatures[cells.clone()][..rows.len()];
        let first = &self.first[cells.clone()][..rows.len()];
        let conductivities = &self.conductivities[cells.clone()][..rows.len()];
        let slopes = &self.slopes[cells.clone()][..rows.len()];
        let conductances = &mut self.conductances[cells.clone()][..rows.len()];
        let lower = &mut self.lower[cells.clone()][..rows.len()];
        let upper = &mut self.upper[cells.clone()][..rows.len()];
        let second = &mut self.second[cells.clone()][..rows.len()];
        let absorbed = if stage == 0 { &self.absorbed_mean } else { &self.absorbed };
        let [flows, gas_j_kg, gas_rises, absorbed] = [&self.flows, &self.gas_j_kg, &self.gas_rises, absorbed]
            .map(|column| if GAS { &column[cells.clone()] } else { &[][..] });
        let mut here = raised(temperatures[0], first[0]);
        for i in 0..rows.len() - 1 {
            let half_over_next_1_m = R::still(rows[i].half_over_next_1_m);
            let conductance = conductance_within(conductivities[i], conductivities[i + 1], half_over_next_1_m);
            let next = raised(temperatures[i + 1], first[i + 1]);
            let drop = difference(here, next);
            if stage == 0 {
                let gain = drop * half_over_next_1_m;
                let mut gained = [slopes[i] * gain, slopes[i + 1] * gain];
                if GAS {
                    gained = less(gained, carried_slopes(flows[i], gas_rises[i], gas_rises[i + 1]));
                }
                [lower[i], upper[i]] = flux_slopes(conductance, gained);
            }
            conductances[i] = conductance;
            let below = conductance * drop;
            if GAS {
                let gained = carried_gain(flows[i], gas_j_kg[i], gas_j_kg[i + 1]);
                second[i] = (above - (below - gained)) - absorbed[i];
                above = below + gained;
            } else {
                second[i] = above - below;
                above = below;
            }
            here = next;
        }
        above
    }

    /// The same across the interface over a ply, from the last cell of the one before.
    #[inline(always)]
    fn link_across(&mut self, p: usize, stage: usize, above: R) -> R {
        let (i, rows) = (self.plan.plies[p].first_cell as usize - 1, &self.rows.cells);
        let (below_m, above_m) = (R::still(rows[i].below_m), R::still(rows[i + 1].above_m));
        let (conductivity, next) = (self.conductivities[i], self.conductivities[i + 1]);
        let conductance = conductance_across(conductivity, below_m, next, above_m, self.contacts_m2_k_w[p - 1]);
        let drop = difference(self.staged(i), self.staged(i + 1));
        if stage == 0 {
            let own = gain_across(conductance, conductivity, below_m) * self.slopes[i];
            let below = gain_across(conductance, next, above_m) * self.slopes[i + 1];
            let mut gained = [own * drop, below * drop];
            if GAS {
                gained = less(gained, carried_slopes(self.flows[i], self.gas_rises[i], self.gas_rises[i + 1]));
            }
            [self.lower[i], self.upper[i]] = flux_slopes(conductance, gained);
        }
        self.conductances[i] = conductance;
        let below = conductance * drop;
        if !GAS {
            self.second[i] = above - below;
            return below;
        }
        let gained = carried_gain(self.flows[i], self.gas_j_kg[i], self.gas_j_kg[i + 1]);
        self.second[i] = (above - (below - gained)) - self.absorbed_at(i, stage);
        below + gained
    }

    /// A cell's temperature at `T + Δ₁`.
    #[inline(always)]
    pub(super) fn staged(&self, cell: usize) -> Pair<R> {
        raised(self.temperatures[cell], self.first[cell])
    }

    /// Heat into the face cell: through an open face from outside, of a held one what passes on to its
    /// neighbour and to the holder.
    #[inline(always)]
    pub(super) fn through(
        &self,
        face: usize,
        drive: Drive<R::Scalar>,
        stage: usize,
        cell: usize,
        neighbour: usize,
    ) -> FaceFlux<R> {
        let rows = self.rows;
        let temperature_k = self.temperatures[cell].high + self.first[cell];
        let at = spot(temperature_k);
        let ply = face * (self.plies.len() - 1);
        let emissivity = self.face_emissivity(face, ply, cell, at, stage);
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

    /// Heat flux through the faces at `T + Δ₁`, which completes what is in `second`: the net flux into every cell.
    #[inline(always)]
    pub(super) fn imbalance(&mut self, hot: Drive<R::Scalar>, back: Drive<R::Scalar>, stage: usize) -> Ends<R> {
        let last = self.second.len() - 1;
        let ends = Ends { hot: self.through(0, hot, stage, 0, 1), back: self.through(1, back, stage, last, last - 1) };
        self.second[0] = self.second[0] + ends.hot.flux;
        self.second[last] = self.second[last] + ends.back.flux;
        ends
    }
}
