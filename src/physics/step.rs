//! One step of one member (or of lanes of members).
//!
//! With increments Δ = Δt k, slopes K = ∂F/∂T of conduction and faces at the start of the step, and
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
//! itself, so that the energy balance closes at its order.

use super::Real;
use super::compensated::{Pair, advanced, difference, keep};
use super::faces::{FaceFlux, FaceScale, face_flux, face_scale};
use super::material::{
    PlyScale, conductance_across, conductance_within, conductivity, conductivity_slope, flux_slope, gain_across,
    heat_capacity, ply_scale,
};
use super::reading::{followed, reading};
use super::table::{integral, look_up, spot};
use super::tridiagonal::{factorise, substitute};
use crate::plan::layout::{Drive, FACE_COLUMNS, TABLE_NODES, TABLE_STEP_K};
use crate::plan::{Plan, Rows};

const GAMMA: f64 = 0.292_893_218_813_452_4;
/// Round-off below absolute zero is forgiven, a kelvin is not.
const STRAY_MARGIN_K: f32 = 1.0;
/// From the margin to the last node of the tables.
const STRAY_SPAN_K: f32 = STRAY_MARGIN_K + TABLE_STEP_K as f32 * (TABLE_NODES as f32 - 1.0);

/// One member, or lanes of them, on its way.
pub struct Member<'a, R: Real> {
    plan: &'a Plan,
    rows: &'a Rows<R::Scalar>,
    plies: Vec<PlyScale<R>>,
    contacts_m2_k_w: Vec<R>,
    faces: [FaceScale<R>; 2],
    temperatures: Vec<Pair<R>>,
    /// Readings at the end of the last step, and the beads that follow them.
    readings: Vec<Pair<R>>,
    beads: Vec<Pair<R>>,
    /// Hot in, hot out, back in, back out, J/m².
    heat: [Pair<R>; 4],
    stored_j_m2: R,
    /// Coldest and hottest of each ply, K.
    extremes_k: Vec<(R, R)>,
    /// The step on which each lane strayed.
    strayed: Vec<Option<usize>>,
    conductivities: Vec<R>,
    /// Slope of the conductivity of each cell, W/m/K².
    slopes: Vec<R>,
    conductances: Vec<R>,
    /// Heat capacity of each cell at the first stage and at the stage last evaluated, J/m²/K.
    capacities: Vec<R>,
    evaluated: Vec<R>,
    lower: Vec<R>,
    diagonal: Vec<R>,
    upper: Vec<R>,
    first: Vec<R>,
    second: Vec<R>,
}

/// Heat into the layup through its two faces.
#[derive(Clone, Copy)]
struct Ends<R> {
    hot: FaceFlux<R>,
    back: FaceFlux<R>,
}

impl<'a, R: Real> Member<'a, R> {
    /// Members at the start, from their columns: column 0 is one, the others their factors.
    #[inline(always)]
    pub fn start(plan: &'a Plan, rows: &'a Rows<R::Scalar>, column: impl Fn(u32) -> R + Copy) -> Self {
        let zero = R::constant(0.0);
        let none = Pair { high: zero, low: zero };
        let (cells, sensors) = (plan.cells(), plan.sensor_cells.len());
        let plies = plan.plies.iter().zip(&rows.bulks).map(|(ply, &bulk)| ply_scale(ply, bulk, column)).collect();
        let contact = column(plan.contact);
        Self {
            plan,
            rows,
            plies,
            contacts_m2_k_w: rows.contacts_m2_k_w.iter().map(|&resistance| R::of(resistance) / contact).collect(),
            faces: [face_scale(&plan.scalings[0], column), face_scale(&plan.scalings[1], column)],
            temperatures: rows.cells.iter().map(|cell| Pair { high: R::of(cell.start_k), low: zero }).collect(),
            readings: vec![none; sensors],
            beads: vec![none; sensors],
            heat: [none; 4],
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
    fn hold(&mut self, step: usize) {
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
    fn properties(&mut self, stage: usize) {
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
    fn incline(&mut self, i: usize, above_1_m: R, below_1_m: R) {
        let drop = difference(self.temperatures[i], self.temperatures[i + 1]);
        self.lower[i] = flux_slope(self.conductances[i], above_1_m, self.slopes[i], drop);
        self.upper[i] = flux_slope(self.conductances[i], below_1_m, self.slopes[i + 1], -drop);
    }

    /// A cell's temperature at `T + Δ₁`.
    #[inline(always)]
    fn staged(&self, cell: usize) -> Pair<R> {
        let Pair { high, low } = self.temperatures[cell];
        Pair { high, low: low + self.first[cell] }
    }

    /// Heat into the face cell: through an open face from outside, of a held one what passes on to its
    /// neighbour.
    #[inline(always)]
    fn through(
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
        let onward = conductance * difference(self.staged(cell), self.staged(neighbour));
        FaceFlux { flux: held * onward + free * open.flux, slope: free * open.slope }
    }

    /// Net heat flux into every cell at `T + Δ₁`, left in `second`.
    #[inline(always)]
    fn imbalance(&mut self, hot: Drive<R::Scalar>, back: Drive<R::Scalar>) -> Ends<R> {
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
        for stage in 0..2 {
            self.properties(stage);
            if stage == 0 {
                self.look(step);
                note(self);
                if step == self.plan.steps() {
                    self.finish();
                    return;
                }
            }
            let ends = self.imbalance(self.rows.drives[4 * step + stage], self.rows.drives[4 * step + 2 + stage]);
            if stage == 0 {
                start = ends;
                onward = [[self.lower[0], self.upper[0]], [self.upper[last - 1], self.lower[last - 1]]];
                driven = self.driven(step, &start);
                self.assemble(step, &start, driven);
            } else {
                self.correct(step, driven);
            }
            substitute(&self.lower, &self.diagonal, &self.upper, &mut self.second);
            if stage == 0 {
                for i in 0..=last {
                    self.first[i] = self.second[i];
                }
            } else {
                self.account(0, step, start.hot, ends.hot, onward[0], 0, 1);
                self.account(1, step, start.back, ends.back, onward[1], last, last - 1);
            }
        }
        self.update(step);
    }

    /// The rise of a held face over a step, K.
    #[inline(always)]
    fn rise(&self, face: usize, step: usize) -> R {
        let drives = &self.rows.drives;
        R::of(drives[4 * step + 2 * face + 1].held_k) - R::of(drives[4 * step + 2 * face].held_k)
    }

    /// γr: by how much the schedules raise the flux through a face over a step, W/m²; of a held face nothing.
    #[inline(always)]
    fn driven(&self, step: usize, start: &Ends<R>) -> [R; 2] {
        let last = self.second.len() - 1;
        let gamma = R::constant(GAMMA);
        let hot = self.through(0, self.rows.drives[4 * step + 1], 0, 1, 0);
        let back = self.through(1, self.rows.drives[4 * step + 3], last, last - 1, 3);
        [gamma * (hot.flux - start.hot.flux), gamma * (back.flux - start.back.flux)]
    }

    /// The system of both stages, factored, and the right-hand side of the first. What leaves one cell enters
    /// the next, so the columns of K sum to nothing.
    #[inline(always)]
    fn assemble(&mut self, step: usize, start: &Ends<R>, driven: [R; 2]) {
        let last = self.second.len() - 1;
        let gamma = R::constant(GAMMA);
        let per_length = R::constant(1.0) / R::of(self.rows.lengths_s[step]);
        self.lower[last] = R::constant(0.0);
        self.upper[last] = R::constant(0.0);
        let mut arriving = R::constant(0.0);
        let mut returned = R::constant(0.0);
        for i in 0..=last {
            let leaving = self.lower[i];
            self.capacities[i] = self.evaluated[i];
            self.diagonal[i] = self.capacities[i] * per_length + gamma * (returned + leaving);
            returned = self.upper[i];
            self.lower[i] = -(gamma * arriving);
            self.upper[i] = -(gamma * returned);
            arriving = leaving;
        }
        for (cell, face, slope) in [(0, 0, start.hot.slope), (last, 1, start.back.slope)] {
            let held = R::of(self.rows.faces[face].held);
            let free = R::constant(1.0) - held;
            self.diagonal[cell] = held + free * (self.diagonal[cell] - gamma * slope);
            self.second[cell] = held * self.rise(face, step) + free * (self.second[cell] + driven[face]);
            self.lower[cell] = free * self.lower[cell];
            self.upper[cell] = free * self.upper[cell];
        }
        factorise(&mut self.lower, &mut self.diagonal, &self.upper);
    }

    /// The right-hand side of the second stage.
    #[inline(always)]
    fn correct(&mut self, step: usize, driven: [R; 2]) {
        let last = self.second.len() - 1;
        let per_length = R::constant(1.0) / R::of(self.rows.lengths_s[step]);
        for i in 0..=last {
            let weight = self.capacities[i] / self.evaluated[i];
            let carried = self.capacities[i] * per_length * self.first[i];
            self.second[i] = weight * self.second[i] - (carried + carried);
        }
        for (cell, face) in [(0, 0), (last, 1)] {
            let held = R::of(self.rows.faces[face].held);
            let free = R::constant(1.0) - held;
            self.second[cell] = free * (self.second[cell] - driven[face]) - held * self.rise(face, step);
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
        let held = R::of(self.rows.faces[face].held);
        let implicit = start.slope * sum + held * (onward[0] * sum - onward[1] * beside);
        let half_length = R::constant(0.5) * R::of(self.rows.lengths_s[step]);
        let amount = half_length * (start.flux + end.flux + R::constant(GAMMA) * implicit);
        let zero = R::constant(0.0);
        self.heat[2 * face] = advanced(self.heat[2 * face], amount.max(zero));
        self.heat[2 * face + 1] = advanced(self.heat[2 * face + 1], (-amount).max(zero));
    }

    /// Take the increments into the temperatures, and watch where they go.
    #[inline(always)]
    fn update(&mut self, step: usize) {
        for p in 0..self.plies.len() {
            let ply = &self.plan.plies[p];
            for i in ply.first_cell as usize..ply.end_cell as usize {
                let increment = R::constant(1.5) * self.first[i] + R::constant(0.5) * self.second[i];
                self.temperatures[i] = advanced(self.temperatures[i], increment);
                self.first[i] = R::constant(0.0);
                let high = self.temperatures[i].high;
                let (coldest, hottest) = self.extremes_k[p];
                self.extremes_k[p] = (coldest.min(high), hottest.max(high));
                let strayed = &mut self.strayed;
                (high + R::constant(f64::from(STRAY_MARGIN_K))).within(STRAY_SPAN_K, |lane| {
                    strayed[lane].get_or_insert(step);
                });
            }
        }
    }

    /// The temperature at a sensor's place.
    #[inline(always)]
    fn read_sensor(&self, sensor: usize) -> Pair<R> {
        let i = self.plan.sensor_cells[sensor] as usize;
        reading(
            self.temperatures[i],
            self.temperatures[i + 1],
            self.conductivities[i],
            self.conductivities[i + 1],
            self.conductances[i],
            self.rows.sensors[sensor],
        )
    }

    /// Read the sensors at the start of a step, and let the beads follow over the step before.
    #[inline(always)]
    fn look(&mut self, step: usize) {
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
    fn finish(&mut self) {
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

    /// Hot in, hot out, back in, back out and stored of one lane, J/m².
    pub fn heat_j_m2(&self, lane: usize) -> [f64; 5] {
        let [hot_in, hot_out, back_in, back_out] = self.heat.map(|pair| pair.high.lane(lane) + pair.low.lane(lane));
        [hot_in, hot_out, back_in, back_out, self.stored_j_m2.lane(lane)]
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
