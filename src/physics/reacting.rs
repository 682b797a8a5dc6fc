//! A member's reactions: what its cells are made of, what they give off, the heat it takes.

use super::Real;
use super::compensated::{advanced, keep};
use super::decomposition::{consumed, rate};
use super::gas::level;
use super::material::{Level, conductivity, conductivity_slope, heat_capacity, levelled};
use super::member::Member;
use super::step::GAMMA;
use super::table::{Spot, integral, look_up, spot};
use crate::plan::GasPath;
use crate::plan::layout::{AIR_COLUMNS, GAS_COLUMNS, STATES_MAX, TABLE_NODES};

/// Share of a cell's capacity at which the restraint of its reactions is half of itself.
const EASE: f64 = 0.3;

impl<R: Real> Member<'_, R> {
    /// Mass of a state of a ply where it has replaced all the virgin material, over the mass of that.
    #[inline(always)]
    pub(super) fn remains_of(&self, ply: usize, state: usize) -> R {
        let one = R::constant(1.0);
        let row = self.plan.plies[ply].first_state as usize + state;
        keep(one - self.plies[ply].loss * (one - R::of(self.rows.substances[row].remains)))
    }

    /// Volume of a cell in each state of its ply.
    #[inline(always)]
    pub(super) fn phases_of(&self, ply: usize, cell: usize) -> [R; STATES_MAX] {
        let row = &self.plan.plies[ply];
        let mut phases = [R::constant(0.0); STATES_MAX];
        phases[0] = R::constant(1.0);
        for j in row.first_reaction as usize..row.end_reaction as usize {
            let place = cell * self.plan.reactions + j - row.first_reaction as usize;
            let moved = R::of(self.rows.reactions[j].share) * self.advancements[place].high;
            let path = self.plan.paths[j];
            phases[path.source as usize] = phases[path.source as usize] - moved;
            phases[path.product as usize] = phases[path.product as usize] + moved;
        }
        phases
    }

    /// Mass of a cell over that of the virgin material.
    #[expect(clippy::needless_range_loop, reason = "the twin in WGSL runs over the same indices")]
    #[inline(always)]
    pub(super) fn mass_left(&self, ply: usize, phases: [R; STATES_MAX]) -> R {
        let mut density = phases[0];
        for state in 1..self.plan.plies[ply].states as usize {
            density = density + phases[state] * self.remains_of(ply, state);
        }
        keep(density)
    }

    /// What each state weighs in the properties of a cell, by volume or by mass.
    #[inline(always)]
    pub(super) fn weights_of(&self, ply: usize, phases: [R; STATES_MAX]) -> [R; STATES_MAX] {
        let by_volume = R::of(self.rows.bulks[ply].by_volume);
        let by_mass = R::constant(1.0) - by_volume;
        let per_density = R::constant(1.0) / self.mass_left(ply, phases);
        let mut weights = phases;
        for state in 0..self.plan.plies[ply].states as usize {
            weights[state] = phases[state] * (by_volume + by_mass * (self.remains_of(ply, state) * per_density));
        }
        weights
    }

    /// Share lost of all that a ply can lose.
    #[inline(always)]
    pub(super) fn converted(&self, ply: usize, density: R) -> R {
        let one = R::constant(1.0);
        let last = self.plan.plies[ply].states as usize - 1;
        (one - density) / (one - self.remains_of(ply, last)).max(R::constant(1e-6))
    }

    /// Thickness of a cell over that of the virgin one.
    #[inline(always)]
    pub(super) fn stretch_of(&self, ply: usize, density: R) -> R {
        R::constant(1.0) - R::of(self.rows.bulks[ply].shrinkage) * self.converted(ply, density)
    }

    /// Emissivity of the ply behind a face.
    #[expect(clippy::needless_range_loop, reason = "the twin in WGSL runs over the same indices")]
    #[inline(always)]
    pub(super) fn face_emissivity(&self, face: usize, ply: usize, cell: usize, at: Spot<R>) -> R {
        let weights = self.weights_of(ply, self.phases_of(ply, cell));
        let first = self.plan.face_table() + AIR_COLUMNS + face * self.plan.states;
        let mut sum = R::constant(0.0);
        for state in 0..self.plan.plies[ply].states as usize {
            sum = sum + weights[state] * look_up(&self.rows.tables, at, self.plan.face_columns(), first + state);
        }
        sum
    }

    /// Where the block of a state begins in the tables.
    #[inline(always)]
    pub(super) fn block_of(&self, ply: usize, state: usize) -> usize {
        let of_state = self.plan.levels * TABLE_NODES * self.plan.table_columns();
        self.plan.plies[ply].table as usize + state * of_state
    }

    /// Absolute enthalpy of a state of a ply, J/kg.
    #[inline(always)]
    pub(super) fn enthalpy_of(&self, ply: usize, state: usize, at: Spot<R>) -> R {
        let offset = self.block_of(ply, state) + 2 * self.plan.parts;
        let risen = integral(&self.rows.tables, at, self.plan.table_columns(), offset);
        let row = self.plan.plies[ply].first_state as usize + state;
        self.plies[ply].heat_capacity * risen + R::of(self.rows.substances[row].formation_j_kg)
    }

    /// Conductivity, its slope and heat capacity of a cell that is a mixture, or whose pressure changes.
    #[inline(always)]
    pub(super) fn blend(&mut self, p: usize, i: usize, step: usize, stage: usize) {
        let tables = &self.rows.tables;
        let (parts, scale) = (self.plan.parts, self.plies[p]);
        let at = spot(self.temperatures[i].high + self.first[i]);
        let phases = self.phases_of(p, i);
        let weights = self.weights_of(p, phases);
        let per_stretch = R::constant(1.0) / self.stretch_of(p, self.mass_left(p, phases));
        let level = self.pressure_level(i, step, stage);
        let zero = R::constant(0.0);
        let (mut conducts, mut slope, mut stores) = (zero, zero, zero);
        for state in 0..self.plan.plies[p].states as usize {
            let block = self.block_of(p, state);
            if self.plan.levels > 1 {
                let [under, over] = levelled(at, level);
                let low = conductivity(tables, under, parts, block, scale);
                let high = conductivity(tables, over, parts, block, scale);
                conducts = conducts + weights[state] * (low + level.share * (high - low));
                if stage == 0 {
                    let low = conductivity_slope(tables, under, parts, block, scale);
                    let high = conductivity_slope(tables, over, parts, block, scale);
                    slope = slope + weights[state] * (low + level.share * (high - low));
                }
            } else {
                conducts = conducts + weights[state] * conductivity(tables, at, parts, block, scale);
                if stage == 0 {
                    slope = slope + weights[state] * conductivity_slope(tables, at, parts, block, scale);
                }
            }
            let stored = heat_capacity(tables, at, parts, block, scale);
            stores = stores + phases[state] * self.remains_of(p, state) * stored;
        }
        self.conductivities[i] = conducts * per_stretch;
        self.slopes[i] = slope * per_stretch;
        self.evaluated[i] = R::of(self.rows.cells[i].width_m) * stores;
    }

    /// Where the pressure of a cell falls among the levels of the tables.
    #[inline(always)]
    fn pressure_level(&self, i: usize, step: usize, stage: usize) -> Level<R> {
        let mut pressure_pa = R::of(self.rows.drives[4 * step + stage].pressure_pa);
        if self.plan.gas == Some(GasPath::Darcy) {
            pressure_pa = self.pressures[i].high;
        }
        let last = self.plan.levels.max(2) - 2;
        let way = R::constant((last + 1) as f64) * level(pressure_pa, R::constant(self.plan.middle_pa));
        let under = R::from_row(way.max(R::constant(0.0)).row(last as u32));
        Level { under, share: way - under }
    }

    /// Enthalpy of a cell over its virgin mass, J/kg.
    #[expect(clippy::needless_range_loop, reason = "the twin in WGSL runs over the same indices")]
    #[inline(always)]
    pub(super) fn solid_enthalpy(&self, ply: usize, phases: [R; STATES_MAX], at: Spot<R>) -> R {
        let mut sum = R::constant(0.0);
        for state in 0..self.plan.plies[ply].states as usize {
            sum = sum + phases[state] * self.remains_of(ply, state) * self.enthalpy_of(ply, state, at);
        }
        sum
    }

    /// Enthalpy of the gas, J/kg.
    #[inline(always)]
    pub(super) fn gas_enthalpy_at(&self, at: Spot<R>) -> R {
        look_up(&self.rows.tables, at, GAS_COLUMNS, self.plan.gas_table())
    }

    /// What every reaction gives off over a step. The first stage foretells it from the temperature at the start; the
    /// second takes the rate midway, moves the advancements on and keeps twice that less the first: so that the mean of
    /// the stages is just what is lost, however stiff the reaction. (The mean of both ends' rates is second order too,
    /// but twice as far off, and runs away where a step would take a cell to where all is lost at once.)
    #[inline(always)]
    pub(super) fn react(&mut self, step: usize, stage: usize) {
        let length_s = R::of(self.rows.lengths_s[step]);
        for p in 0..self.plies.len() {
            let ply = self.plan.plies[p];
            let (first, end) = (ply.first_reaction as usize, ply.end_reaction as usize);
            for i in ply.first_cell as usize..ply.end_cell as usize {
                self.react_cell(p, i, first, end, length_s, stage);
            }
        }
    }

    #[inline(always)]
    fn react_cell(&mut self, p: usize, i: usize, first: usize, end: usize, length_s: R, stage: usize) {
        let (zero, one) = (R::constant(0.0), R::constant(1.0));
        let temperature_k = self.temperatures[i].high + R::constant(0.5) * self.first[i];
        let mass_kg_m2 = self.plies[p].mass_kg_m3 * R::of(self.rows.cells[i].width_m) * self.plies[p].loss;
        let flux_kg_m2_s = mass_kg_m2 / length_s;
        let per_kelvin = one / temperature_k;
        let mut before = one;
        let mut fed = zero;
        for j in first..end {
            let place = i * self.plan.reactions + j - first;
            let reaction = self.rows.reactions[j];
            let steepness = self.plies[p].activation * R::of(reaction.activation_k) * per_kelvin;
            let now_1_s = rate(reaction, temperature_k, self.plies[p].kinetics, steepness);
            let exposure = length_s * now_1_s;
            // In a chain what comes in over the step is there for half of it.
            let chained = R::of(reaction.chained);
            let ahead = one + chained * (before - one);
            let done = self.advancements[place];
            let left = keep(keep(ahead - done.high) - done.low);
            let reactant = (left + chained * R::constant(0.5) * fed).max(zero);
            let spent = consumed(reactant, exposure, reaction.order);
            let release = spent * R::of(reaction.loss) * flux_kg_m2_s;
            before = done.high;
            fed = spent;
            if stage == 0 {
                self.releases[place] = release;
                let spared = (reactant - spent) / reactant.max(R::constant(1e-30));
                self.responses[place] = release * spared * steepness * per_kelvin;
            } else {
                self.releases[place] = R::constant(2.0) * release - self.releases[place];
                self.advancements[place] = advanced(done, spent);
            }
        }
    }

    /// The reactions' part of the system, where they take up heat. Without it steps longer than a reaction needs to
    /// swing the heat it takes blow up. What it adds is not what was lost times the heat of reaction, though, so that it
    /// fades where steps are short: by `x/(x + 0.3)` for the share `x` of the capacity it is (with 1 a few of the
    /// furthest members blew up, with 0 temperatures were off by half as much again). Of a reaction that gives heat it
    /// is left out, as it would take from the diagonal.
    #[inline(always)]
    pub(super) fn restrain(&mut self, step: usize) {
        let per_length = R::constant(EASE) / R::of(self.rows.lengths_s[step]);
        for i in 0..self.restraints.len() {
            let stiff = R::constant(GAMMA) * self.restraints[i];
            self.diagonal[i] = self.diagonal[i] + stiff * (stiff / (self.capacities[i] * per_length + stiff));
        }
    }

    /// Gas made in a cell at a stage, kg/m²/s.
    #[inline(always)]
    pub(super) fn made_in(&self, ply: usize, cell: usize) -> R {
        let row = &self.plan.plies[ply];
        let mut sum = R::constant(0.0);
        for j in 0..(row.end_reaction - row.first_reaction) as usize {
            sum = sum + self.releases[cell * self.plan.reactions + j];
        }
        sum
    }

    /// Heat that the reactions of a cell take up at a stage, and what they give to the enthalpies of solid and gas
    /// beyond what they take from them, W/m²; by how much the first rises with temperature, W/m²/K.
    #[expect(clippy::needless_range_loop, reason = "the twin in WGSL runs over the same indices")]
    #[inline(always)]
    pub(super) fn reaction_heat(&self, ply: usize, cell: usize) -> [R; 3] {
        let row = &self.plan.plies[ply];
        let at = spot(self.temperatures[cell].high + self.first[cell]);
        let gas_j_kg = self.gas_enthalpy_at(at);
        let absolute = R::of(self.rows.bulks[ply].absolute);
        let mut held_j_kg = [R::constant(0.0); STATES_MAX];
        for state in 0..row.states as usize {
            held_j_kg[state] = self.remains_of(ply, state) * self.enthalpy_of(ply, state, at);
        }
        let (mut absorbed, mut given, mut rises) = (R::constant(0.0), R::constant(0.0), R::constant(0.0));
        for j in row.first_reaction as usize..row.end_reaction as usize {
            let reaction = self.rows.reactions[j];
            let path = self.plan.paths[j];
            let (from, to) = (path.source as usize, path.product as usize);
            let lost = held_j_kg[from] - held_j_kg[to];
            // Enthalpy that the solid gives up per mass of gas.
            let solid_j_kg = R::of(reaction.share) * lost / (self.plies[ply].loss * R::of(reaction.loss));
            let rise = gas_j_kg - solid_j_kg;
            let of_reaction = R::of(reaction.heat_j_kg);
            let heat_j_kg = self.plies[ply].pyrolysis_heat * (of_reaction + absolute * (rise - of_reaction));
            let place = cell * self.plan.reactions + j - row.first_reaction as usize;
            let release = self.releases[place];
            absorbed = absorbed + release * heat_j_kg;
            rises = rises + self.responses[place] * heat_j_kg;
            given = given + release * (rise - heat_j_kg);
        }
        [absorbed, given, rises]
    }
}
