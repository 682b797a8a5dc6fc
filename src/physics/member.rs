//! A member on its way: its state, its properties where it stands, and the heat that moves it.

use super::Real;
use super::compensated::{Pair, advanced, difference, keep};
use super::faces::{FaceFlux, FaceScale, face_flux, face_scale};
use super::holder::flux_sideways;
use super::material::{
    PlyScale, conductance_across, conductance_within, conductivity, conductivity_slope, flux_slope, gain_across,
    heat_capacity, ply_scale,
};
use super::reading::{covered, followed, reading};
use super::table::{integral, look_up, spot};
use crate::plan::layout::{Drive, FACE_COLUMNS, HEATS};
use crate::plan::{Plan, Rows};

/// One member, or lanes of them, on its way.
pub struct Member<'a, R: Real> {
    pub(super) plan: &'a Plan,
    pub(super) rows: &'a Rows<R::Scalar>,
    pub(super) plies: Vec<PlyScale<R>>,
    pub(super) contacts_m2_k_w: Vec<R>,
    pub(super) faces: [FaceScale<R>; 2],
    pub(super) temperatures: Vec<Pair<R>>,
    /// How much deeper than nominal each sensor lies, m; empty where no depth is scaled.
    pub(super) shifts_m: Vec<R>,
    /// Readings at the end of the last step, and the beads that follow them.
    pub(super) readings: Vec<Pair<R>>,
    pub(super) beads: Vec<Pair<R>>,
    /// Hot in, hot out, back in, back out, from the holder, to the holder, J/m².
    pub(super) heat: [Pair<R>; HEATS],
    pub(super) stored_j_m2: R,
    /// Coldest and hottest of each ply, K.
    pub(super) extremes_k: Vec<(R, R)>,
    /// The step on which each lane strayed.
    pub(super) strayed: Vec<Option<usize>>,
    pub(super) conductivities: Vec<R>,
    /// Slope of the conductivity of each cell, W/m/K².
    pub(super) slopes: Vec<R>,
    pub(super) conductances: Vec<R>,
    /// Heat capacity of each cell at the first stage and at the stage last evaluated, J/m²/K.
    pub(super) capacities: Vec<R>,
    pub(super) evaluated: Vec<R>,
    pub(super) lower: Vec<R>,
    pub(super) diagonal: Vec<R>,
    pub(super) upper: Vec<R>,
    pub(super) first: Vec<R>,
    pub(super) second: Vec<R>,
}

/// Heat into the layup through its two faces.
#[derive(Clone, Copy)]
pub(super) struct Ends<R> {
    pub(super) hot: FaceFlux<R>,
    pub(super) back: FaceFlux<R>,
}

impl<'a, R: Real> Member<'a, R> {
    /// Members at the start, from their columns: column 0 is one, the others their factors.
    #[inline(always)]
    pub fn start(plan: &'a Plan, rows: &'a Rows<R::Scalar>, column: impl Fn(u32) -> R + Copy) -> Self {
        let zero = R::constant(0.0);
        let none = Pair { high: zero, low: zero };
        let (cells, sensors) = (plan.cells(), plan.places.len());
        let plies = plan.plies.iter().zip(&rows.bulks).map(|(ply, &bulk)| ply_scale(ply, bulk, column)).collect();
        Self {
            plan,
            rows,
            plies,
            contacts_m2_k_w: rows
                .contacts_m2_k_w
                .iter()
                .zip(&plan.plies)
                .map(|(&resistance, ply)| R::of(resistance) / column(ply.contact))
                .collect(),
            faces: [face_scale(&plan.scalings[0], column), face_scale(&plan.scalings[1], column)],
            temperatures: rows.cells.iter().map(|cell| Pair { high: R::of(cell.start_k), low: zero }).collect(),
            shifts_m: if plan.has_depths {
                let sensors = plan.places.iter().zip(&rows.sensors);
                sensors.map(|(place, row)| R::of(row.depth_m) * (column(place.depth) - R::constant(1.0))).collect()
            } else {
                Vec::new()
            },
            readings: vec![none; sensors],
            beads: vec![none; sensors],
            heat: [none; HEATS],
            stored_j_m2: zero,
            extremes_k: vec![(R::constant(1e9), zero); plan.plies.len()],
            strayed: vec![None; R::LANES],
            conductivities: vec![zero; cells],
            slopes: vec![zero; cells],
            conductances: vec![zero; cells],
            capacities: vec![zero; cells],
            evaluated: vec![zero; cells],
            lower: vec![zero; cells],
            diagonal: vec![zero; cells],
            upper: vec![zero; cells],
            first: vec![zero; cells],
            second: vec![zero; cells],
        }
    }

    /// Put the cells of held faces on their schedules, which may jump between steps.
    #[inline(always)]
    pub(super) fn hold(&mut self, step: usize) {
        let last = self.temperatures.len() - 1;
        for (cell, face, drive) in [(0, 0, 4 * step), (last, 1, 4 * step + 2)] {
            let held = R::of(self.rows.faces[face].held);
            let free = R::constant(1.0) - held;
            let held_k = R::of(self.rows.drives[drive].held_k);
            let Pair { high, low } = self.temperatures[cell];
            self.temperatures[cell] = Pair { high: held * held_k + free * high, low: free * low };
        }
    }

    /// Conductivity, heat capacity and conductance of every cell at `T + Δ₁`; at the first stage also the slopes
    /// of the flux under it, by its own temperature in `lower` and by that of the next cell, less, in `upper`.
    #[inline(always)]
    pub(super) fn properties(&mut self, stage: usize) {
        let rows = self.rows;
        for p in 0..self.plies.len() {
            let ply = &self.plan.plies[p];
            for i in ply.first_cell as usize..ply.end_cell as usize {
                let at = spot(self.temperatures[i].high + self.first[i]);
                let (parts, table) = (self.plan.parts, ply.table as usize);
                self.conductivities[i] = conductivity(&rows.tables, at, parts, table, self.plies[p]);
                self.slopes[i] = conductivity_slope(&rows.tables, at, parts, table, self.plies[p]);
                self.evaluated[i] =
                    R::of(rows.cells[i].width_m) * heat_capacity(&rows.tables, at, parts, table, self.plies[p]);
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
        self.lower[i] = flux_slope(self.conductances[i], above_1_m, self.slopes[i], drop);
        self.upper[i] = flux_slope(self.conductances[i], below_1_m, self.slopes[i + 1], -drop);
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
    pub(super) fn through(
        &self,
        face: usize,
        drive: Drive<R::Scalar>,
        cell: usize,
        neighbour: usize,
        column: usize,
    ) -> FaceFlux<R> {
        let (rows, table) = (self.rows, self.plan.face_table());
        let temperature_k = self.temperatures[cell].high + self.first[cell];
        let at = spot(temperature_k);
        let emissivity = look_up(&rows.tables, at, FACE_COLUMNS, table + column);
        let enthalpy_j_kg = look_up(&rows.tables, at, FACE_COLUMNS, table + 1);
        let rise_j_kg_k = look_up(&rows.tables, at, FACE_COLUMNS, table + 2);
        let open =
            face_flux(drive, rows.faces[face], self.faces[face], temperature_k, emissivity, enthalpy_j_kg, rise_j_kg_k);
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
        let ends = Ends { hot: self.through(0, hot, 0, 1, 0), back: self.through(1, back, last, last - 1, 3) };
        let mut above = ends.hot.flux;
        for i in 0..last {
            let below = self.conductances[i] * difference(self.staged(i), self.staged(i + 1));
            self.second[i] = above - below;
            above = below;
        }
        self.second[last] = above + ends.back.flux;
        ends
    }

    /// The temperature at a sensor's place.
    #[inline(always)]
    pub(super) fn read_sensor(&self, sensor: usize) -> Pair<R> {
        let i = self.plan.places[sensor].cell as usize;
        let nominal = reading(
            self.temperatures[i],
            self.temperatures[i + 1],
            self.conductivities[i],
            self.conductivities[i + 1],
            self.conductances[i],
            self.rows.sensors[sensor],
        );
        if self.plan.has_depths {
            return Pair { high: nominal.high, low: nominal.low + self.displaced(sensor) };
        }
        nominal
    }

    /// What a sensor reads more as it lies deeper than nominal, K: along straight lines from its face to the nearest
    /// node and on from node to node, on the side that it is shifted to.
    #[inline(always)]
    pub(super) fn displaced(&self, sensor: usize) -> R {
        let (place, row, cells) = (self.plan.places[sensor], self.rows.sensors[sensor], &self.rows.cells);
        let i = place.cell as usize;
        let zero = R::constant(0.0);
        let shift_m = self.shifts_m[sensor];
        let flux = self.conductances[i] * difference(self.temperatures[i], self.temperatures[i + 1]);
        let mut start_m = R::of(row.below_m);
        let mut rise = -(flux / self.conductivities[i + 1] * covered(shift_m, zero, start_m));
        for step in 0..place.steps_below as usize {
            let j = place.node_below as usize + step;
            let length_m = R::of(cells[j].below_m) + R::of(cells[j + 1].above_m);
            let gain = difference(self.temperatures[j + 1], self.temperatures[j]) / length_m;
            rise = rise + gain * covered(shift_m, start_m, length_m);
            start_m = start_m + length_m;
        }
        start_m = R::of(row.above_m);
        rise = rise + flux / self.conductivities[i] * covered(-shift_m, zero, start_m);
        for step in 0..place.steps_above as usize {
            let j = place.node_above as usize - step;
            let length_m = R::of(cells[j - 1].below_m) + R::of(cells[j].above_m);
            let gain = difference(self.temperatures[j - 1], self.temperatures[j]) / length_m;
            rise = rise + gain * covered(-shift_m, start_m, length_m);
            start_m = start_m + length_m;
        }
        rise
    }

    /// Read the sensors at the start of a step, and let the beads follow over the step before.
    #[inline(always)]
    pub(super) fn look(&mut self, step: usize) {
        let sensors = self.beads.len();
        for sensor in 0..sensors {
            let now = self.read_sensor(sensor);
            if step == 0 {
                self.beads[sensor] = now;
            } else {
                let weights = self.rows.beads[(step - 1) * sensors + sensor];
                self.beads[sensor] = followed(self.beads[sensor], self.readings[sensor], now, weights);
            }
            self.readings[sensor] = now;
        }
    }

    /// Sum up the heat stored since the start; what a held cell took up came through its face.
    #[inline(always)]
    pub(super) fn finish(&mut self) {
        let rows = self.rows;
        let last = self.temperatures.len() - 1;
        let zero = R::constant(0.0);
        for p in 0..self.plies.len() {
            let ply = &self.plan.plies[p];
            let columns = self.plan.table_columns();
            let offset = ply.table as usize + 2 * self.plan.parts;
            for i in ply.first_cell as usize..ply.end_cell as usize {
                let now_j_kg = integral(&rows.tables, spot(self.temperatures[i].high), columns, offset);
                let then_j_kg = integral(&rows.tables, spot(R::of(rows.cells[i].start_k)), columns, offset);
                let gained = keep(now_j_kg - then_j_kg) * self.plies[p].density_kg_m3 * R::of(rows.cells[i].width_m);
                self.stored_j_m2 = self.stored_j_m2 + gained;
                let hot = if i == 0 { R::of(rows.faces[0].held) * gained } else { zero };
                let back = if i == last { R::of(rows.faces[1].held) * gained } else { zero };
                self.heat[0] = advanced(self.heat[0], hot.max(zero));
                self.heat[1] = advanced(self.heat[1], (-hot).max(zero));
                self.heat[2] = advanced(self.heat[2], back.max(zero));
                self.heat[3] = advanced(self.heat[3], (-back).max(zero));
            }
        }
    }

    /// What a sensor's bead shows in one lane, K.
    pub fn shown_k(&self, sensor: usize, lane: usize) -> f64 {
        self.beads[sensor].high.lane(lane) + self.beads[sensor].low.lane(lane)
    }

    /// Hot in, hot out, back in, back out, from and to the holder of one lane, J/m².
    pub fn heat_j_m2(&self, lane: usize) -> [f64; HEATS] {
        self.heat.map(|pair| pair.high.lane(lane) + pair.low.lane(lane))
    }

    /// Heat stored since the start in one lane, J/m².
    pub fn stored_j_m2(&self, lane: usize) -> f64 {
        self.stored_j_m2.lane(lane)
    }

    /// Coldest and hottest temperature that a ply met in one lane, K.
    pub fn extremes_k(&self, ply: usize, lane: usize) -> (f64, f64) {
        (self.extremes_k[ply].0.lane(lane), self.extremes_k[ply].1.lane(lane))
    }

    /// The step on which one lane left all that is known, if it did.
    pub fn strayed(&self, lane: usize) -> Option<usize> {
        self.strayed[lane]
    }
}
