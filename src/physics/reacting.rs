//! A member's reactions: what its cells are made of, what they give off, the heat it takes.

use super::Real;
use super::compensated::{advanced, keep};
use super::decomposition::{consumed, rate};
use super::gas::level;
use super::material::{Level, Solid, levelled, solid};
use super::member::Member;
use super::step::GAMMA;
use super::table::{Segment, Spot, beyond, integral, segment, spot, value};
use crate::plan::GasPath;
use crate::plan::layout::{AIR_PROPERTIES, FACE_COLUMNS, STATES_MAX};

/// Share of a cell's capacity at which the restraint of its reactions is half of itself.
pub(super) const EASE: f64 = 0.3;

/// The reactions' part of the system, where they take up heat. Without it steps longer than a reaction needs to
/// swing the heat it takes blow up. What it adds is not what was lost times the heat of reaction, though, so that it
/// fades where steps are short: by `x/(x + 0.3)` for the share `x` of the capacity it is (with 1 a few of the
/// furthest members blew up, with 0 temperatures were off by half as much again). Of a reaction that gives heat it
/// is left out, as it would take from the diagonal.
#[inline(always)]
pub(super) fn restraint<R: Real>(rises_w_m2_k: R, capacity: R, eased_1_s: R::Still) -> R {
    let stiff = rises_w_m2_k * R::fixed(GAMMA);
    stiff * (stiff / (capacity * eased_1_s + stiff))
}

impl<'a, R: Real, const GAS: bool> Member<'a, R, GAS> {
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
    pub(super) fn phases_of(&self, ply: usize, cell: usize, lead_s: R::Still) -> [R; STATES_MAX] {
        let row = &self.plan.plies[ply];
        let mut phases = [R::constant(0.0); STATES_MAX];
        phases[0] = R::constant(1.0);
        for j in row.first_reaction as usize..row.end_reaction as usize {
            let place = cell * self.plan.reactions + j - row.first_reaction as usize;
            let done = self.advancements[place].high;
            let ahead = (self.paces[place] * lead_s).min((R::constant(1.0) - done) * R::fixed(GAMMA));
            let moved = (done + ahead) * R::still(self.rows.reactions[j].share);
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
        let by_volume = R::still(self.rows.bulks[ply].by_volume);
        let by_mass = per_density * (R::fixed(1.0) - by_volume);
        let mut weights = phases;
        for state in 0..STATES_MAX {
            if state < self.plan.plies[ply].states as usize {
                weights[state] = phases[state] * (by_mass * self.remains_of(ply, state) + by_volume);
            }
        }
        weights
    }

    /// Share lost of all that a ply can lose.
    #[inline(always)]
    pub(super) fn converted(&self, ply: usize, density: R) -> R {
        (R::constant(1.0) - density) * self.plies[ply].per_loss
    }

    /// Thickness of a cell over that of the virgin one.
    #[inline(always)]
    pub(super) fn stretch_of(&self, ply: usize, density: R) -> R {
        R::constant(1.0) - self.converted(ply, density) * R::still(self.rows.bulks[ply].shrinkage)
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

    /// The row of a ply's tables under a spot.
    #[inline(always)]
    pub(super) fn row_of(&self, ply: usize, at: Spot<R>) -> Segment<'a, R> {
        let (rows, ply) = (self.rows, &self.plan.plies[ply]);
        segment(&rows.tables, at, ply.columns as usize, ply.table as usize)
    }

    /// Of such a row what it says of a state.
    #[inline(always)]
    pub(super) fn state_of(&self, state: usize, row: Segment<'a, R>) -> Segment<'a, R> {
        beyond(row, state * self.plan.properties())
    }

    /// Of such a row what it says of the gas: its enthalpy, the slope of that, molar mass and viscosity.
    #[inline(always)]
    pub(super) fn gas_of(&self, ply: usize, row: Segment<'a, R>) -> Segment<'a, R> {
        self.state_of(self.plan.plies[ply].states as usize, row)
    }

    /// Absolute enthalpy of a state of a ply by a row of its tables, J/kg.
    #[inline(always)]
    pub(super) fn enthalpy_of(&self, ply: usize, state: usize, here: Segment<'a, R>) -> R {
        let risen = integral(self.state_of(state, here), 1);
        let row = self.plan.plies[ply].first_state as usize + state;
        self.plies[ply].heat_capacity * risen + R::still(self.rows.substances[row].formation_j_kg)
    }

    /// Conductivity, its slope and heat capacity of a cell that is a mixture, or whose pressure changes.
    #[inline(always)]
    pub(super) fn blend(&mut self, p: usize, i: usize, at: Spot<R>, step: usize, stage: usize) {
        let level = self.level_of(i, step, stage);
        let row = self.row_of(p, levelled(at, level)[0]);
        let here = self.mixture(p, i, at, row, level, self.lead_s, stage == 0);
        self.conductivities[i] = here.conductivity;
        self.slopes[i] = here.slope;
        self.evaluated[i] = here.heat_capacity * R::still(self.rows.cells[i].width_m);
        if GAS {
            self.gas_at(i, self.gas_of(p, row));
        }
    }

    /// What such a cell is like with its composition so far ahead, by the row of the level under its pressure: its heat
    /// capacity in a volume as drawn, J/m³/K.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "a struct of them would keep the row from registers")]
    fn mixture(
        &self,
        p: usize,
        i: usize,
        at: Spot<R>,
        row: Segment<'a, R>,
        level: Level<R>,
        lead_s: R::Still,
        with_slope: bool,
    ) -> Solid<R> {
        let phases = self.phases_of(p, i, lead_s);
        let density = self.mass_left(p, phases);
        let stretch = self.stretch_of(p, density);
        // One division for two.
        let inverse = R::constant(1.0) / (density * stretch);
        let weights = self.weights_of(p, phases, inverse * stretch);
        let per_stretch = inverse * density;
        let mut here = self.of_states(p, row, phases, weights, with_slope);
        if self.plan.levels > 1 {
            let over = self.of_states(p, self.row_of(p, levelled(at, level)[1]), phases, weights, with_slope);
            here.conductivity = here.conductivity + level.share * (over.conductivity - here.conductivity);
            here.slope = here.slope + level.share * (over.slope - here.slope);
        }
        Solid { conductivity: here.conductivity * per_stretch, slope: here.slope * per_stretch, ..here }
    }

    /// What the states of such a cell are like together, by a row of their tables: conductivity by their weights, heat capacity by
    /// their volumes. As little as may be stands in this loop: the compiler unrolls short ones, which keeps phases in registers.
    #[inline(always)]
    fn of_states(
        &self,
        p: usize,
        row: Segment<'a, R>,
        phases: [R; STATES_MAX],
        weights: [R; STATES_MAX],
        with_slope: bool,
    ) -> Solid<R> {
        let zero = R::constant(0.0);
        let mut sum = Solid { conductivity: zero, slope: zero, heat_capacity: zero };
        for state in 0..STATES_MAX {
            if state < self.plan.plies[p].states as usize {
                let scale = self.states[self.plan.plies[p].first_state as usize + state];
                let here = solid(self.state_of(state, row), self.plan.parts, scale, with_slope);
                let volume = phases[state] * self.remains_of(p, state);
                sum.conductivity = sum.conductivity + weights[state] * here.conductivity;
                sum.slope = sum.slope + weights[state] * here.slope;
                sum.heat_capacity = sum.heat_capacity + volume * (self.plies[p].density_kg_m3 * here.heat_capacity);
            }
        }
        sum
    }

    /// Conductivity of a cell with the composition of the instant at hand, W/m/K. Stages see that of another one, by which
    /// what a sensor beside the cell reads would be off by the first order of a step.
    #[inline(always)]
    pub(super) fn conductivity_now(&self, p: usize, i: usize, step: usize) -> R {
        let ply = self.plan.plies[p];
        if !GAS || ply.end_reaction == ply.first_reaction {
            return self.conductivities[i];
        }
        let at = spot(self.temperatures[i].high);
        let level = self.level_of(i, step, 0);
        let row = self.row_of(p, levelled(at, level)[0]);
        self.mixture(p, i, at, row, level, R::fixed(0.0), false).conductivity
    }

    /// Where the pressure of a cell falls among the levels of the tables.
    #[inline(always)]
    fn level_of(&self, i: usize, step: usize, stage: usize) -> Level<R> {
        let zero = R::constant(0.0);
        if self.plan.levels == 1 {
            return Level { under: R::fixed(0.0), share: zero };
        }
        let mut pressure_pa = R::of(self.rows.drives[4 * step + stage].pressure_pa);
        if self.plan.gas == Some(GasPath::Darcy) {
            pressure_pa = self.pressures[i].high;
        }
        let last = self.plan.levels - 2;
        let way = level(pressure_pa, R::constant(self.plan.middle_pa)) * R::fixed((last + 1) as f64);
        let under = way.floor(last as u32);
        Level { under, share: way - under }
    }

    /// Enthalpy of a cell over its virgin mass, J/kg.
    #[expect(clippy::needless_range_loop, reason = "the twin in WGSL runs over the same indices")]
    #[inline(always)]
    pub(super) fn solid_enthalpy(&self, ply: usize, phases: [R; STATES_MAX], here: Segment<'a, R>) -> R {
        let mut sum = R::constant(0.0);
        for state in 0..STATES_MAX {
            if state < self.plan.plies[ply].states as usize {
                sum = sum + phases[state] * self.remains_of(ply, state) * self.enthalpy_of(ply, state, here);
            }
        }
        sum
    }

    /// What every cell gives off over a step, and the heat that takes. The first stage takes the mean of the step before;
    /// the second takes rates and enthalpies midway, moves the advancements on and keeps twice the mean of the step less
    /// the first: so that the mean of the stages is just what is lost, however stiff the reaction. (The mean of both ends'
    /// rates is second order too, but twice as far off, and runs away where a step would take a cell to where all is lost
    /// at once. To foretell the first stage from rates at the start costs twice the exponentials and gains nothing. To let it
    /// go on as the last two means went halves the error of nominal members, but of 4,096 of `lcat-2259-pyrolysis` drawn from
    /// the large bounds on 81 cells 82 then run away instead of one, and held within a quarter of the mean still 11.)
    /// Properties see the composition at γ and 1 − γ of the step, which is what γr is for a schedule: with that of the start
    /// and the end the order falls to 1.6.
    #[inline(always)]
    pub(super) fn react(&mut self, step: usize, stage: usize) {
        let zero = R::constant(0.0);
        self.given = zero;
        self.given_ends = [zero; 2];
        if step == self.plan.steps() {
            self.lead_s = R::fixed(0.0);
            return;
        }
        let length_s = R::still(self.rows.lengths_s[step]);
        let lead_s = length_s * R::fixed(GAMMA);
        self.lead_s = if stage == 0 { lead_s } else { -lead_s };
        if stage == 0 {
            return;
        }
        for p in 0..self.plies.len() {
            let ply = self.plan.plies[p];
            let (first, end) = (ply.first_reaction as usize, ply.end_reaction as usize);
            if end == first {
                continue;
            }
            for i in ply.first_cell as usize..ply.end_cell as usize {
                self.react_cell(p, i, first, end, length_s);
            }
        }
    }

    #[expect(clippy::needless_range_loop, reason = "the twin in WGSL runs over the same indices")]
    #[inline(always)]
    fn react_cell(&mut self, p: usize, i: usize, first: usize, end: usize, length_s: R::Still) {
        let (zero, one) = (R::constant(0.0), R::constant(1.0));
        let scale = self.plies[p];
        let temperature_k = self.temperatures[i].high + self.first[i] * R::fixed(0.5);
        let here = self.row_of(p, spot(temperature_k));
        let gas_j_kg = value(self.gas_of(p, here), 0);
        let absolute = R::still(self.rows.bulks[p].absolute);
        let mut held_j_kg = [zero; STATES_MAX];
        for state in 0..STATES_MAX {
            if state < self.plan.plies[p].states as usize {
                held_j_kg[state] = self.remains_of(p, state) * self.enthalpy_of(p, state, here);
            }
        }
        let per_kelvin = one / temperature_k;
        let per_length = R::fixed(1.0) / length_s;
        let steepness_k = scale.activation * per_kelvin;
        let (mut before, mut fed) = (one, zero);
        let (mut made, mut absorbed, mut given, mut rises) = (zero, zero, zero, zero);
        for j in first..end {
            let place = i * self.plan.reactions + j - first;
            let reaction = self.rows.reactions[j];
            let steepness = steepness_k * R::still(reaction.activation_k);
            let exposure = rate(reaction, temperature_k, scale.kinetics, steepness) * length_s;
            let done = self.advancements[place];
            // In a chain what comes in over the step is there for half of it. (Weighted by nothing where there is none, one
            // reaction would wait for the other all the same.)
            let (mut ahead, mut entering) = (one, zero);
            if reaction.chained == R::scalar(1.0) {
                ahead = before;
                entering = fed * R::fixed(0.5);
            }
            let left = keep(keep(ahead - done.high) - done.low);
            let reactant = (left + entering).max(zero);
            let share = consumed(reactant, exposure, reaction.order);
            let spent = reactant * share;
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
            let gas = spent * (scale.loss * R::still(reaction.loss));
            let risen = gas * gas_j_kg - spent * (lost * R::still(reaction.share));
            let of_reaction = gas * R::still(reaction.heat_j_kg);
            let heat = scale.pyrolysis_heat * (of_reaction + (risen - of_reaction) * absolute);
            made = made + gas;
            absorbed = absorbed + heat;
            given = given + keep(risen - heat);
            rises = rises + heat * ((one - share) * steepness);
        }
        let flux_kg_m2_s = scale.mass_kg_m3 * R::still(self.rows.cells[i].width_m) * per_length;
        self.take_stage(i, flux_kg_m2_s * made, flux_kg_m2_s * absorbed, (flux_kg_m2_s * given) * R::fixed(2.0));
        self.restraints[i] = (flux_kg_m2_s * (rises * per_kelvin)).max(zero);
    }

    /// Gas that a cell makes at a stage: the mean of the step before, then what makes the mean of both stages that of the step.
    #[inline(always)]
    pub(super) fn made_at(&self, i: usize, stage: usize) -> R {
        if stage == 0 { self.made_mean[i] } else { self.made[i] }
    }

    /// Heat that its reactions take up at a stage, likewise.
    #[inline(always)]
    pub(super) fn absorbed_at(&self, i: usize, stage: usize) -> R {
        if stage == 0 { self.absorbed_mean[i] } else { self.absorbed[i] }
    }

    /// Of the means over a step, what the second stage takes for the mean of both to be that.
    #[inline(always)]
    fn take_stage(&mut self, i: usize, made: R, absorbed: R, given: R) {
        let two = R::fixed(2.0);
        self.made[i] = made * two - self.made_mean[i];
        self.absorbed[i] = absorbed * two - self.absorbed_mean[i];
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
}
