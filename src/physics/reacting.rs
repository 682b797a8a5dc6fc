//! A member's reactions: what its cells are made of, what they give off, the heat it takes.

use super::Real;
use super::compensated::{advanced, keep};
use super::decomposition::{consumed, rate};
use super::gas::level;
use super::material::{Level, levelled, solid};
use super::member::Member;
use super::step::GAMMA;
use super::table::{Segment, Spot, integral, segment, spot, value};
use crate::plan::GasPath;
use crate::plan::layout::{AIR_PROPERTIES, FACE_COLUMNS, GAS_COLUMNS, STATES_MAX, TABLE_NODES};

/// Share of a cell's capacity at which the restraint of its reactions is half of itself.
const EASE: f64 = 0.3;

impl<R: Real> Member<'_, R> {
    /// Mass of a state of a ply where it has replaced all the virgin material, over the mass of that.
    #[inline(always)]
    pub(super) fn remains_of(&self, ply: usize, state: usize) -> R {
        self.remains[self.plan.plies[ply].first_state as usize + state]
    }

    /// Volume of a cell in each state of its ply, so far ahead of where the step stands as the pace of the reactions
    /// takes them, but never by more than a stage's share of what is left. Here and below loops run over all states that there
    /// may be, not over those that there are: then each has a place that is known beforehand, and stays in a register.
    #[expect(clippy::needless_range_loop, reason = "see above")]
    #[inline(always)]
    pub(super) fn phases_of(&self, ply: usize, cell: usize, lead_s: R) -> [R; STATES_MAX] {
        let row = &self.plan.plies[ply];
        let mut phases = [R::constant(0.0); STATES_MAX];
        phases[0] = R::constant(1.0);
        for j in row.first_reaction as usize..row.end_reaction as usize {
            let place = cell * self.plan.reactions + j - row.first_reaction as usize;
            let done = self.advancements[place].high;
            let ahead = (lead_s * self.paces[place]).min(R::constant(GAMMA) * (R::constant(1.0) - done));
            let moved = R::of(self.rows.reactions[j].share) * (done + ahead);
            let path = self.plan.paths[j];
            for state in 0..STATES_MAX {
                if path.source as usize == state {
                    phases[state] = phases[state] - moved;
                }
                if path.product as usize == state {
                    phases[state] = phases[state] + moved;
                }
            }
        }
        phases
    }

    /// Mass of a cell over that of the virgin material.
    #[expect(clippy::needless_range_loop, reason = "the twin in WGSL runs over the same indices")]
    #[inline(always)]
    pub(super) fn mass_left(&self, ply: usize, phases: [R; STATES_MAX]) -> R {
        let mut density = phases[0];
        for state in 1..STATES_MAX {
            if state < self.plan.plies[ply].states as usize {
                density = density + phases[state] * self.remains_of(ply, state);
            }
        }
        keep(density)
    }

    /// What each state weighs in the properties of a cell, by volume or by mass.
    #[inline(always)]
    pub(super) fn weights_of(&self, ply: usize, phases: [R; STATES_MAX], per_density: R) -> [R; STATES_MAX] {
        let by_volume = R::of(self.rows.bulks[ply].by_volume);
        let by_mass = (R::constant(1.0) - by_volume) * per_density;
        let mut weights = phases;
        for state in 0..STATES_MAX {
            if state < self.plan.plies[ply].states as usize {
                weights[state] = phases[state] * (by_volume + by_mass * self.remains_of(ply, state));
            }
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
        let phases = self.phases_of(ply, cell, self.lead_s);
        let weights = self.weights_of(ply, phases, R::constant(1.0) / self.mass_left(ply, phases));
        let seen = segment(&self.rows.tables, at, FACE_COLUMNS, self.plan.face_table());
        let first = AIR_PROPERTIES + face * STATES_MAX;
        let mut sum = R::constant(0.0);
        for state in 0..STATES_MAX {
            if state < self.plan.plies[ply].states as usize {
                sum = sum + weights[state] * value(seen, first + state);
            }
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
        let here = segment(&self.rows.tables, at, self.plan.table_columns(), self.block_of(ply, state));
        let risen = integral(here, 1);
        let row = self.plan.plies[ply].first_state as usize + state;
        self.plies[ply].heat_capacity * risen + R::of(self.rows.substances[row].formation_j_kg)
    }

    /// Conductivity, its slope and heat capacity of a cell that is a mixture, or whose pressure changes.
    #[inline(always)]
    pub(super) fn blend(&mut self, p: usize, i: usize, at: Spot<R>, step: usize, stage: usize) {
        let tables = &self.rows.tables;
        let (parts, columns) = (self.plan.parts, self.plan.table_columns());
        let phases = self.phases_of(p, i, self.lead_s);
        let density = self.mass_left(p, phases);
        let stretch = self.stretch_of(p, density);
        // One division for two.
        let inverse = R::constant(1.0) / (density * stretch);
        let weights = self.weights_of(p, phases, inverse * stretch);
        let per_stretch = inverse * density;
        let level = self.pressure_level(i, step, stage);
        let zero = R::constant(0.0);
        let (mut conducts, mut slope, mut stores) = (zero, zero, zero);
        for state in 0..STATES_MAX {
            if state >= self.plan.plies[p].states as usize {
                break;
            }
            let block = self.block_of(p, state);
            let scale = self.states[self.plan.plies[p].first_state as usize + state];
            let mut here;
            if self.plan.levels > 1 {
                let [under, over] = levelled(at, level);
                here = solid(tables, under, columns, block, parts, scale, stage == 0);
                let more = solid(tables, over, columns, block, parts, scale, stage == 0);
                here.conductivity = here.conductivity + level.share * (more.conductivity - here.conductivity);
                here.slope = here.slope + level.share * (more.slope - here.slope);
            } else {
                here = solid(tables, at, columns, block, parts, scale, stage == 0);
            }
            conducts = conducts + weights[state] * here.conductivity;
            slope = slope + weights[state] * here.slope;
            stores =
                stores + phases[state] * self.remains_of(p, state) * (self.plies[p].density_kg_m3 * here.heat_capacity);
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
        let under = way.floor(last as u32);
        Level { under, share: way - under }
    }

    /// Enthalpy of a cell over its virgin mass, J/kg.
    #[expect(clippy::needless_range_loop, reason = "the twin in WGSL runs over the same indices")]
    #[inline(always)]
    pub(super) fn solid_enthalpy(&self, ply: usize, phases: [R; STATES_MAX], at: Spot<R>) -> R {
        let mut sum = R::constant(0.0);
        for state in 0..STATES_MAX {
            if state < self.plan.plies[ply].states as usize {
                sum = sum + phases[state] * self.remains_of(ply, state) * self.enthalpy_of(ply, state, at);
            }
        }
        sum
    }

    /// What the tables say of the gas: its enthalpy, the slope of that, molar mass and viscosity.
    #[inline(always)]
    pub(super) fn gas_segment(&self, at: Spot<R>) -> Segment<'_, R> {
        segment(&self.rows.tables, at, GAS_COLUMNS, self.plan.gas_table())
    }

    /// Enthalpy of the gas, J/kg.
    #[inline(always)]
    pub(super) fn gas_enthalpy_at(&self, at: Spot<R>) -> R {
        value(self.gas_segment(at), 0)
    }

    /// What every cell gives off over a step, and the heat that takes. The first stage takes the mean of the step before;
    /// the second takes rates and enthalpies midway, moves the advancements on and keeps twice the mean of the step less
    /// the first: so that the mean of the stages is just what is lost, however stiff the reaction. (The mean of both ends'
    /// rates is second order too, but twice as far off, and runs away where a step would take a cell to where all is lost
    /// at once. To foretell the first stage from rates at the start costs twice the exponentials and gains nothing: what
    /// it is off by cancels but for a fifth.) Properties see the composition at γ and 1 − γ of the step, which is what γr
    /// is for a schedule: with that of the start and the end the order falls to 1.6.
    #[inline(always)]
    pub(super) fn react(&mut self, step: usize, stage: usize) {
        let zero = R::constant(0.0);
        self.given = zero;
        self.given_ends = [zero; 2];
        if step == self.plan.steps() {
            self.lead_s = zero;
            return;
        }
        let length_s = R::of(self.rows.lengths_s[step]);
        let lead_s = R::constant(GAMMA) * length_s;
        self.lead_s = if stage == 0 { lead_s } else { -lead_s };
        for p in 0..self.plies.len() {
            let ply = self.plan.plies[p];
            let (first, end) = (ply.first_reaction as usize, ply.end_reaction as usize);
            if end == first {
                continue;
            }
            for i in ply.first_cell as usize..ply.end_cell as usize {
                if stage == 0 {
                    self.made[i] = self.made_mean[i];
                    self.absorbed[i] = self.absorbed_mean[i];
                } else {
                    self.react_cell(p, i, first, end, length_s);
                }
            }
        }
    }

    #[expect(clippy::needless_range_loop, reason = "the twin in WGSL runs over the same indices")]
    #[inline(always)]
    fn react_cell(&mut self, p: usize, i: usize, first: usize, end: usize, length_s: R) {
        let (zero, one) = (R::constant(0.0), R::constant(1.0));
        let scale = self.plies[p];
        let temperature_k = self.temperatures[i].high + R::constant(0.5) * self.first[i];
        let at = spot(temperature_k);
        let gas_j_kg = self.gas_enthalpy_at(at);
        let absolute = R::of(self.rows.bulks[p].absolute);
        let mut held_j_kg = [zero; STATES_MAX];
        for state in 0..STATES_MAX {
            if state < self.plan.plies[p].states as usize {
                held_j_kg[state] = self.remains_of(p, state) * self.enthalpy_of(p, state, at);
            }
        }
        let per_kelvin = one / temperature_k;
        let per_length = one / length_s;
        let steepness_k = scale.activation * per_kelvin;
        let (mut before, mut fed) = (one, zero);
        let (mut made, mut absorbed, mut given, mut rises) = (zero, zero, zero, zero);
        for j in first..end {
            let place = i * self.plan.reactions + j - first;
            let reaction = self.rows.reactions[j];
            let steepness = R::of(reaction.activation_k) * steepness_k;
            let exposure = length_s * rate(reaction, temperature_k, scale.kinetics, steepness);
            // In a chain what comes in over the step is there for half of it.
            let chained = R::of(reaction.chained);
            let ahead = one + chained * (before - one);
            let done = self.advancements[place];
            let left = keep(keep(ahead - done.high) - done.low);
            let reactant = (left + chained * R::constant(0.5) * fed).max(zero);
            let spent = consumed(reactant, exposure, reaction.order);
            before = done.high;
            fed = spent;
            self.advancements[place] = advanced(done, spent);
            self.paces[place] = spent * per_length;
            // Over the virgin mass of the cell: the gas, and the enthalpy that it has beyond what the solid gave up.
            let path = self.plan.paths[j];
            let mut lost = zero;
            for state in 0..STATES_MAX {
                if path.source as usize == state {
                    lost = lost + held_j_kg[state];
                }
                if path.product as usize == state {
                    lost = lost - held_j_kg[state];
                }
            }
            let gas = spent * (R::of(reaction.loss) * scale.loss);
            let risen = gas * gas_j_kg - spent * (R::of(reaction.share) * lost);
            let of_reaction = gas * R::of(reaction.heat_j_kg);
            let heat = scale.pyrolysis_heat * (of_reaction + absolute * (risen - of_reaction));
            let spared = (reactant - spent) / reactant.max(R::constant(1e-30));
            made = made + gas;
            absorbed = absorbed + heat;
            given = given + keep(risen - heat);
            rises = rises + heat * (spared * steepness);
        }
        let flux_kg_m2_s = scale.mass_kg_m3 * R::of(self.rows.cells[i].width_m) * per_length;
        self.take_stage(i, flux_kg_m2_s * made, flux_kg_m2_s * absorbed, R::constant(2.0) * (flux_kg_m2_s * given));
        self.restraints[i] = (flux_kg_m2_s * (rises * per_kelvin)).max(zero);
    }

    /// Of the means over a step, what the second stage takes for the mean of both to be that.
    #[inline(always)]
    fn take_stage(&mut self, i: usize, made: R, absorbed: R, given: R) {
        let two = R::constant(2.0);
        self.made[i] = two * made - self.made[i];
        self.absorbed[i] = two * absorbed - self.absorbed[i];
        self.made_mean[i] = made;
        self.absorbed_mean[i] = absorbed;
        self.given = self.given + given;
        if i == 0 {
            self.given_ends[0] = given;
        }
        if i == self.made.len() - 1 {
            self.given_ends[1] = given;
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
}
