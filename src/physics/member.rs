//! A member on its way: its state, its properties where it stands, and the heat that moves it.

use super::Real;
use super::compensated::{Pair, advanced, difference, keep, raised};
use super::conducting::Matter;
use super::faces::{FaceScale, face_scale};
use super::gas::Porous;
use super::material::{PlyScale, StateScale, conductance_across, conductance_within, ply_scale, state_scale};
use super::reading::{covered, followed, reading};
use super::system::{Edge, Eliminated};
use super::table::{integral, spot};
use crate::plan::layout::{HEATS, Ply};
use crate::plan::{GasPath, Plan, Rows};

/// One member, or lanes of them, on its way. Whether gas flows is told beforehand: a march without is then a text of its own, for which
/// the compiler has registers enough.
pub struct Member<'a, R: Real, const GAS: bool> {
    pub(super) plan: &'a Plan,
    pub(super) rows: &'a Rows<R::Scalar>,
    pub(super) plies: Vec<PlyScale<R>>,
    pub(super) states: Vec<StateScale<R>>,
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
    /// What the faces do to their cells over the step; heat that conduction takes on from those at the stage at hand (W/m²), and −γ times its
    /// slopes by their temperatures and, less, by those of their neighbours (W/m²/K).
    pub(super) edges: [Edge<R>; 2],
    pub(super) passed: [R; 2],
    pub(super) passed_slopes: [[R; 2]; 2],
    /// Where the rows of the cells of the ply at hand begin in its table, and the shares of the way to the next.
    pub(super) row_places: Vec<R::Place>,
    pub(super) row_shares: Vec<R>,
    /// What each cell is like at the stage last evaluated.
    pub(super) matter: Vec<Matter<R>>,
    /// The system of the step, and what the first stage moves each cell by, K.
    pub(super) system: Vec<Eliminated<R>>,
    pub(super) first: Vec<R>,
    /// Cell × reaction: how far each has come.
    pub(super) advancements: Vec<Pair<R>>,
    /// Cell × state: its share of the volume as the first stage sees it, and as the second does.
    pub(super) phases: [Vec<R>; 2],
    /// Cell × state that has rows: how much its enthalpy has risen at the first stage (J/kg), and how fast it rises (J/kg/K).
    pub(super) risen: Vec<[R; 2]>,
    /// Gas that a cell makes (kg/m²/s) and heat that its reactions take up (W/m²): at the second stage, and the last step's mean.
    pub(super) made: Vec<R>,
    pub(super) absorbed: Vec<R>,
    pub(super) made_mean: Vec<R>,
    pub(super) absorbed_mean: Vec<R>,
    /// By how much the heat that the reactions of a cell take up rises with temperature, W/m²/K.
    pub(super) restraints: Vec<R>,
    /// What reactions give to enthalpies beyond what they take from them at a stage, and that in the end cells, W/m².
    pub(super) given: R,
    pub(super) given_ends: [R; 2],
    /// Enthalpy of the gas in a cell (J/kg) and its slope (J/kg/K).
    pub(super) gas_j_kg: Vec<R>,
    pub(super) gas_rises: Vec<R>,
    /// Gas up through the face under each cell at a stage, and out of the hot face at either, kg/m²/s.
    pub(super) flows: Vec<R>,
    pub(super) leaving: [R; 2],
    pub(super) back_leaving: R,
    /// Out of the hot face at the stage at hand; means of the last two steps.
    pub(super) outflow: R,
    pub(super) recent: [R; 2],
    /// Gas that left, kg/m²; heat that it took along and that reactions gave beyond enthalpies, J/m².
    pub(super) gas_in: Pair<R>,
    pub(super) gas_out: Pair<R>,
    pub(super) gas_heat: Pair<R>,
    pub(super) reaction_gain: Pair<R>,
    pub(super) stage_heat: R,
    /// Solid lost and gas stored since the start, kg/m².
    pub(super) lost_and_stored: [R; 2],
    /// Of gas by Darcy's law: pressures (Pa), their rates (Pa/s), pores, mean fluxes of the last step and what a step
    /// of pressure works on.
    pub(super) pressures: Vec<Pair<R>>,
    pub(super) pressure_rates: Vec<R>,
    pub(super) pores: Vec<Porous<R>>,
    pub(super) later: Vec<Porous<R>>,
    pub(super) mean_flows: Vec<R>,
    pub(super) mean_leaving: R,
    pub(super) supply: Vec<R>,
    /// By how much the first stage of pressure is supplied more than the mean, and the second less.
    pub(super) surges: Vec<R>,
    pub(super) first_flows: Vec<R>,
    pub(super) slopes_above: Vec<R>,
    pub(super) slopes_below: Vec<R>,
    pub(super) pressed_first: Vec<R>,
    pub(super) pressed_second: Vec<R>,
    pub(super) pressure_lower: Vec<R>,
    pub(super) pressure_diagonal: Vec<R>,
    pub(super) pressure_upper: Vec<R>,
}

impl<'a, R: Real, const GAS: bool> Member<'a, R, GAS> {
    /// Members at the start, from their columns: column 0 is one, the others their factors.
    #[inline(always)]
    pub fn start(plan: &'a Plan, rows: &'a Rows<R::Scalar>, column: impl Fn(u32) -> R + Copy) -> Self {
        let zero = R::constant(0.0);
        let none = Pair { high: zero, low: zero };
        let (cells, sensors) = (plan.cells(), plan.places.len());
        let char = |ply: &Ply<u32>| rows.substances[(ply.first_state + ply.states) as usize - 1];
        let plies: Vec<_> =
            plan.plies.iter().zip(&rows.bulks).map(|(ply, &bulk)| ply_scale(ply, bulk, char(ply), column)).collect();
        let of_states = |ply: &Ply<u32>| ply.first_state as usize..(ply.first_state + ply.states) as usize;
        let scaled = plan.plies.iter().zip(&rows.bulks).zip(&plies);
        let scaled = scaled.flat_map(|((ply, &bulk), &scale)| of_states(ply).map(move |row| (row, bulk, scale)));
        let states = scaled
            .map(|(row, bulk, scale)| state_scale(&plan.conductions[row], rows.substances[row], bulk, scale, column))
            .collect();
        let reactions = cells * plan.reactions;
        let flowing = if GAS { cells } else { 0 };
        let darcy = if plan.gas == Some(GasPath::Darcy) { cells } else { 0 };
        let outside = Pair { high: R::of(rows.drives[0].pressure_pa), low: zero };
        let sealed = Porous { storage: zero, mobility_s: zero, slip_pa: zero, inertia_m_pa2: zero };
        Self {
            plan,
            rows,
            plies,
            states,
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
            edges: [Edge { held: R::fixed(0.0), rise_k: R::fixed(0.0), flux: zero, driven: zero, slope: zero }; 2],
            passed: [zero; 2],
            passed_slopes: [[zero; 2]; 2],
            row_places: vec![R::Place::default(); cells],
            row_shares: vec![zero; cells],
            matter: vec![Matter { conductivity: zero, slope: zero, capacity: zero }; cells],
            system: vec![Eliminated { under: zero, reciprocal: zero, over: zero, capacity: zero, second: zero }; cells],
            first: vec![zero; cells],
            advancements: vec![none; reactions],
            phases: [0, 1].map(|_| {
                (0..flowing * plan.states)
                    .map(|place| R::constant(f64::from(u8::from(place % plan.states == 0))))
                    .collect()
            }),
            risen: vec![[zero; 2]; flowing * plan.states],
            made: vec![zero; flowing],
            absorbed: vec![zero; flowing],
            made_mean: vec![zero; flowing],
            absorbed_mean: vec![zero; flowing],
            restraints: vec![zero; flowing],
            given: zero,
            given_ends: [zero; 2],
            gas_j_kg: vec![zero; flowing],
            gas_rises: vec![zero; flowing],
            flows: vec![zero; flowing],
            leaving: [zero; 2],
            back_leaving: zero,
            outflow: zero,
            recent: [zero; 2],
            gas_in: none,
            gas_out: none,
            gas_heat: none,
            reaction_gain: none,
            stage_heat: zero,
            lost_and_stored: [zero; 2],
            pressures: vec![outside; darcy],
            pressure_rates: vec![zero; darcy],
            pores: vec![sealed; darcy],
            later: vec![sealed; darcy],
            mean_flows: vec![zero; darcy],
            mean_leaving: zero,
            supply: vec![zero; darcy],
            surges: vec![zero; darcy],
            first_flows: vec![zero; darcy],
            slopes_above: vec![zero; darcy],
            slopes_below: vec![zero; darcy],
            pressed_first: vec![zero; darcy],
            pressed_second: vec![zero; darcy],
            pressure_lower: vec![zero; darcy],
            pressure_diagonal: vec![zero; darcy],
            pressure_upper: vec![zero; darcy],
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

    /// The temperature at a sensor's place.
    #[inline(always)]
    pub(super) fn read_sensor(&self, sensor: usize, step: usize) -> Pair<R> {
        let (place, cells) = (self.plan.places[sensor], &self.rows.cells);
        let (i, ply) = (place.cell as usize, place.ply_above as usize);
        let conductivity = self.conductivity_now(ply, i, step);
        let next = self.conductivity_now(place.ply_below as usize, i + 1, step);
        let conductance = if place.ply_above == place.ply_below {
            conductance_within(conductivity, next, R::still(cells[i].half_over_next_1_m))
        } else {
            let (below_m, above_m) = (R::still(cells[i].below_m), R::still(cells[i + 1].above_m));
            conductance_across(conductivity, below_m, next, above_m, self.contacts_m2_k_w[ply])
        };
        let (here, below) = (self.temperatures[i], self.temperatures[i + 1]);
        let nominal = reading(here, below, conductivity, next, conductance, self.rows.sensors[sensor]);
        if self.plan.has_depths {
            let flux = conductance * difference(here, below);
            let displaced = self.displaced(sensor, flux / conductivity, flux / next);
            return raised(nominal, displaced);
        }
        nominal
    }

    /// What a sensor reads more as it lies deeper than nominal, K: along straight lines from its face to the nearest
    /// node, given how much temperature falls there over and under the face (K/m), and on from node to node, on the side that it
    /// is shifted to.
    #[inline(always)]
    fn displaced(&self, sensor: usize, fall_above_k_m: R, fall_below_k_m: R) -> R {
        let (place, row, cells) = (self.plan.places[sensor], self.rows.sensors[sensor], &self.rows.cells);
        let zero = R::constant(0.0);
        let shift_m = self.shifts_m[sensor];
        // On an outer face the node is on the face, and there are nodes on one side only.
        let is_inside = place.node_above < place.node_below;
        let mut start_m = R::of(row.below_m);
        let mut rise = zero;
        if is_inside {
            rise = -(fall_below_k_m * covered(shift_m, zero, start_m, false));
        }
        for step in 0..place.steps_below as usize {
            let j = place.node_below as usize + step;
            let length_m = R::of(cells[j].below_m) + R::of(cells[j + 1].above_m);
            let gain = difference(self.temperatures[j + 1], self.temperatures[j]) / length_m;
            rise = rise + gain * covered(shift_m, start_m, length_m, !is_inside && step == 0);
            start_m = start_m + length_m;
        }
        start_m = R::of(row.above_m);
        if is_inside {
            rise = rise + fall_above_k_m * covered(-shift_m, zero, start_m, false);
        }
        for step in 0..place.steps_above as usize {
            let j = place.node_above as usize - step;
            let length_m = R::of(cells[j - 1].below_m) + R::of(cells[j].above_m);
            let gain = difference(self.temperatures[j - 1], self.temperatures[j]) / length_m;
            rise = rise + gain * covered(-shift_m, start_m, length_m, !is_inside && step == 0);
            start_m = start_m + length_m;
        }
        rise
    }

    /// Read the sensors at the start of a step, and let the beads follow over the step before.
    #[inline(always)]
    pub(super) fn look(&mut self, step: usize) {
        let sensors = self.beads.len();
        for sensor in 0..sensors {
            let now = self.read_sensor(sensor, step);
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
            for i in ply.first_cell as usize..ply.end_cell as usize {
                let gained = self.gained(p, i);
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

    /// Heat that a cell holds over that at the start, J/m²; its gas and what solid it lost are taken into account.
    #[inline(always)]
    pub(super) fn gained(&mut self, p: usize, i: usize) -> R {
        let rows = self.rows;
        let ply = self.plan.plies[p];
        let width_m = R::of(rows.cells[i].width_m);
        let now = spot(self.temperatures[i].high);
        let then = spot(R::of(rows.cells[i].start_k));
        if ply.states == 1 {
            let now_j_kg = integral(self.row_of(p, now), 1);
            let then_j_kg = integral(self.row_of(p, then), 1);
            return keep(now_j_kg - then_j_kg) * self.plies[p].density_kg_m3 * width_m + self.gas_gained(p, i);
        }
        let phases = self.phases_of(p, i);
        let mass_kg_m2 = self.plies[p].mass_kg_m3 * width_m;
        let lost_kg_m2 = mass_kg_m2 * (R::constant(1.0) - self.mass_left(p, phases));
        self.lost_and_stored[0] = self.lost_and_stored[0] + lost_kg_m2;
        let then = self.row_of(p, then);
        let then_j_kg = self.enthalpy_of(p, 0, integral(then, 1));
        let now_j_kg = self.solid_enthalpy(p, phases, self.row_of(p, now));
        keep(now_j_kg - then_j_kg) * mass_kg_m2 + self.gas_gained(p, i)
    }

    /// What a sensor's bead shows in one lane, K.
    #[inline(always)]
    pub fn shown_k(&self, sensor: usize, lane: usize) -> f64 {
        self.beads[sensor].lane(lane)
    }

    /// Heat through the faces and from and to the holder in one lane, in the order of the sums of heat, J/m².
    pub fn heat_j_m2(&self, lane: usize) -> [f64; HEATS] {
        self.heat.map(|pair| pair.lane(lane))
    }

    /// Heat stored since the start in one lane, J/m².
    pub fn stored_j_m2(&self, lane: usize) -> f64 {
        self.stored_j_m2.lane(lane)
    }

    /// What gas took along in one lane: see [`Balance::and_gas`](crate::traces::Balance::and_gas).
    pub fn gone(&self, lane: usize) -> [f64; 6] {
        let [lost_kg_m2, stored_kg_m2] = self.lost_and_stored.map(|sum| sum.lane(lane));
        let [in_kg_m2, out_kg_m2, heat_j_m2, gain_j_m2] =
            [self.gas_in, self.gas_out, self.gas_heat, self.reaction_gain].map(|pair| pair.lane(lane));
        [in_kg_m2, out_kg_m2, heat_j_m2, gain_j_m2, lost_kg_m2, stored_kg_m2]
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
