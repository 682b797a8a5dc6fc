//! Mixture rules: composition of a cell and its properties.

use super::Real;
use super::compensated::opaque;
use super::exponential::logarithm;
use super::material::{
    ConductivityParts, PlyScale, PressureIndex, SolidProperties, StateScale, at_pressure_levels, solid_properties,
};
use super::member::Member;
use super::state::{ReactionState, Scales};
use super::table::{
    TableIndex, TableSegment, TabulatedStates, column_offset, first_integral, heat_capacity_sum, integral, interpolate,
    rise_by_enthalpy, table_index, table_segment,
};
use crate::layout::GasTransport;
use crate::layout::{
    AIR_PROPERTIES, BulkProperties, ConductivityColumns, MAX_STATES, PlanData, PlanRows, ReactionPath, STEEP_COLUMNS,
};

impl<'a, R: Real, const GAS: bool> Member<'a, R, GAS> {
    /// Factors of the member on a state of a ply.
    #[inline(always)]
    fn scale_of(&self, ply: usize, state: usize) -> &StateScale<R> {
        &self.scales.states[self.plan.plies[ply].first_state as usize + state]
    }

    /// Volume fraction of each state in a cell, from the current advancements. Here and below, loops run over
    /// `MAX_STATES` states, not over those present: a constant bound keeps the fractions in registers.
    #[inline(always)]
    pub(super) fn current_phases(&self, ply: usize, cell: usize) -> [R; MAX_STATES] {
        let row = &self.plan.plies[ply];
        let mut phases = Self::virgin();
        for j in row.first_reaction as usize..row.end_reaction as usize {
            let place = cell * self.plan.max_reactions + j - row.first_reaction as usize;
            let moved_fraction = self.reactions.advancements[place].high * R::constant(self.rows.reactions[j].share);
            phases = transfer_volume(phases, self.plan.reaction_paths[j], moved_fraction);
        }
        phases
    }

    /// Volume fractions at a stage.
    #[expect(clippy::needless_range_loop, reason = "see above")]
    #[inline(always)]
    pub(super) fn stage_phases(&self, ply: usize, cell: usize, stage: usize) -> [R; MAX_STATES] {
        let mut phases = Self::virgin();
        for state in 0..MAX_STATES {
            if GAS && state < self.plan.plies[ply].states as usize {
                phases[state] = self.reactions.phases[stage][cell * self.plan.max_states + state];
            }
        }
        phases
    }

    /// Volume fractions of the virgin material.
    #[inline(always)]
    pub(super) fn virgin() -> [R; MAX_STATES] {
        let mut phases = [R::from_f64(0.0); MAX_STATES];
        phases[0] = R::from_f64(1.0);
        phases
    }

    /// Mass of a cell over its virgin mass.
    #[expect(clippy::needless_range_loop, reason = "the WGSL twin has the same loop")]
    #[inline(always)]
    pub(super) fn mass_ratio(&self, ply: usize, phases: [R; MAX_STATES]) -> R {
        let mut density = phases[0];
        for state in 1..MAX_STATES {
            if state < self.plan.plies[ply].states as usize {
                density = density + phases[state] * self.scale_of(ply, state).remains;
            }
        }
        opaque(density)
    }

    /// Solid mass that a cell has lost over its virgin mass, after the last step. A small loss is accurate, where one
    /// less the mass ratio in f32 would not be.
    #[inline(always)]
    pub(super) fn lost_mass_ratio(&self, ply: usize, cell: usize) -> R {
        let row = &self.plan.plies[ply];
        let (first, end) = (row.first_reaction as usize, row.end_reaction as usize);
        let place = cell * self.plan.max_reactions;
        let mut lost = R::from_f64(0.0);
        for (done, reaction) in
            self.reactions.advancements[place..place + end - first].iter().zip(&self.rows.reactions[first..end])
        {
            lost = lost + done.high * R::constant(reaction.loss);
        }
        self.scales.plies[ply].loss * lost
    }

    /// Emissivity of the ply at a face.
    #[expect(clippy::needless_range_loop, reason = "the WGSL twin has the same loop")]
    #[inline(always)]
    pub(super) fn face_emissivity(
        &self,
        face: usize,
        ply: usize,
        cell: usize,
        seen: TableSegment<'a, R>,
        stage: usize,
    ) -> R {
        let phases = self.stage_phases(ply, cell, stage);
        let first = AIR_PROPERTIES + face * MAX_STATES;
        let by_volume = self.rows.bulk_properties[ply].by_volume == R::scalar(1.0);
        let mut sum = R::from_f64(0.0);
        for state in 0..MAX_STATES {
            if state < self.plan.plies[ply].states as usize {
                let own = phases[state] * interpolate(seen, first + state);
                sum = sum + if by_volume { own } else { own * self.scale_of(ply, state).remains };
            }
        }
        if by_volume { sum } else { sum / self.mass_ratio(ply, phases) }
    }

    /// Index of a temperature in the tables of a ply; for the faces, past the last ply.
    #[inline(always)]
    pub(super) fn ply_index(&self, ply: usize, temperature_k: R) -> TableIndex<R> {
        table_index(temperature_k, &self.rows.tables, &self.plan.tables[ply])
    }

    /// Row of a ply's tables at a table index.
    #[inline(always)]
    pub(super) fn row_at(&self, ply: usize, at: TableIndex<R>) -> TableSegment<'a, R> {
        let rows = self.rows;
        table_segment(&rows.tables, at, &self.plan.tables[ply])
    }

    /// Row of a ply's tables at a temperature.
    #[inline(always)]
    pub(super) fn ply_row(&self, ply: usize, temperature_k: R) -> TableSegment<'a, R> {
        self.row_at(ply, self.ply_index(ply, temperature_k))
    }

    /// Columns of a state in a row.
    #[inline(always)]
    pub(super) fn state_columns(&self, state: usize, row: TableSegment<'a, R>) -> TableSegment<'a, R> {
        column_offset(row, state * self.plan.properties())
    }

    /// Columns of the gas in a row: enthalpy, its slope, molar mass and viscosity.
    #[inline(always)]
    pub(super) fn gas_columns(&self, ply: usize, row: TableSegment<'a, R>) -> TableSegment<'a, R> {
        self.state_columns(self.plan.plies[ply].rows as usize, row)
    }

    /// Absolute enthalpy of a state of a ply, J per kg of the replaced virgin mass. `risen_j_kg`: integral of the heat
    /// capacity in the table row.
    #[inline(always)]
    pub(super) fn state_enthalpy(&self, ply: usize, state: usize, risen_j_kg: R) -> R {
        let own = self.scale_of(ply, state);
        own.enthalpy_scale * risen_j_kg + own.formation_j_kg
    }

    /// Stores the enthalpy rise of a cell (J/kg) and its heat capacity (J/kg/K) for all states with table rows.
    #[inline(always)]
    pub(super) fn store_enthalpy_rises(&mut self, p: usize, i: usize, row: TableSegment<'a, R>) {
        for state in 0..MAX_STATES {
            if state < self.plan.plies[p].rows as usize {
                let own = self.state_columns(state, row);
                self.reactions.enthalpy_rises[i * self.plan.max_states + state] =
                    [integral(own, 1), interpolate(own, 1)];
            }
        }
    }

    /// Properties of a cell with given volume fractions at a temperature and a pressure; heat capacity per unstretched
    /// volume, J/m³/K.
    #[inline(always)]
    pub(super) fn mixture(
        &self,
        p: usize,
        temperature_k: R,
        pressure_pa: R,
        phases: [R; MAX_STATES],
        with_slope: bool,
    ) -> SolidProperties<R> {
        let left = conductivity_divisor(self.mass_ratio(p, phases), self.scales.plies[p], self.rows.bulk_properties[p]);
        let per_left = R::from_f64(1.0) / left;
        let pressure = self.pressure_index(p, pressure_pa);
        let [under, over] = at_pressure_levels(self.ply_index(p, temperature_k), self.plan.tables[p].rows, pressure);
        let conditions = [temperature_k, pressure_pa];
        let mut here = self.mixture_at_level(p, self.row_at(p, under), conditions, phases, with_slope);
        if self.plan.plies[p].levels > 1 {
            let over = self.mixture_at_level(p, self.row_at(p, over), conditions, phases, with_slope);
            here.conductivity = here.conductivity + pressure.fraction * (over.conductivity - here.conductivity);
            here.slope = here.slope + pressure.fraction * (over.slope - here.slope);
        }
        SolidProperties { conductivity: here.conductivity * per_left, slope: here.slope * per_left, ..here }
    }

    /// Factor of each tabulated state of a cell on the first of its conductivity columns.
    #[expect(clippy::needless_range_loop, reason = "the WGSL twin has the same loop")]
    #[inline(always)]
    pub(super) fn conductivity_weights(&self, p: usize, cell: usize, stage: usize) -> [R; MAX_STATES] {
        let ply = self.plan.plies[p];
        let mut weights = self.stage_phases(p, cell, stage);
        let left =
            conductivity_divisor(self.mass_ratio(p, weights), self.scales.plies[p], self.rows.bulk_properties[p]);
        let per_left = R::from_f64(1.0) / left;
        if ply.rows == 1 {
            let own = &self.scales.states[ply.first_state as usize..][..ply.states as usize];
            let changes = [state_change(own, 0), state_change(own, 1), state_change(own, 2), state_change(own, 3)];
            weights[0] = mixture_sums(&weights[..own.len()], &changes, 1).conductivity.solid * per_left;
            return weights;
        }
        for state in 0..MAX_STATES {
            if state < ply.rows as usize {
                weights[state] = weights[state] * self.scale_of(p, state).conductivity.solid * per_left;
            }
        }
        weights
    }

    /// The first conductivity column of a state in a row (W/m/K), its integral from the start of the table (W/m), and
    /// its upper bound (W/m/K).
    #[inline(always)]
    pub(super) fn conductivity_integral(&self, p: usize, state: usize, row: TableSegment<'a, R>) -> [R; 3] {
        let steep = self.plan.tables[p].conductivity_integral as usize + state * STEEP_COLUMNS / 2;
        first_integral(self.state_columns(state, row), column_offset(row, steep))
    }

    /// Sums over the states of a cell at one pressure level. States that are multiples of the virgin one are summed
    /// before the row is read, as the read costs more than the sums.
    #[expect(clippy::needless_range_loop, reason = "the WGSL twin has the same loop")]
    #[inline(always)]
    fn mixture_at_level(
        &self,
        p: usize,
        row: TableSegment<'a, R>,
        conditions: [R; 2],
        phases: [R; MAX_STATES],
        with_slope: bool,
    ) -> SolidProperties<R> {
        let (mass_kg_m3, ply) = (self.scales.plies[p].mass_kg_m3, self.plan.plies[p]);
        let (states, rows, parts) = (ply.states as usize, ply.rows as usize, ply.parts as usize);
        let own = &self.scales.states[ply.first_state as usize..][..states];
        let mut alike = MixtureSums {
            conductivity: own[0].conductivity.times(phases[0], parts),
            enthalpy_scale: phases[0] * own[0].enthalpy_scale,
            remains: phases[0],
        };
        if rows == 1 {
            let changes = [state_change(own, 0), state_change(own, 1), state_change(own, 2), state_change(own, 3)];
            alike = mixture_sums(&phases[..states], &changes, parts);
        }
        alike.conductivity.gas = self.pore_factor(p, 0, conditions) * alike.conductivity.gas;
        let virgin = solid_properties(row, parts, alike.conductivity, with_slope);
        let mut sum =
            SolidProperties { heat_capacity: alike.enthalpy_scale * (mass_kg_m3 * virgin.heat_capacity), ..virgin };
        for state in 1..MAX_STATES {
            if state < rows {
                let (volume, own) = (phases[state], self.scale_of(p, state));
                let mut scale = own.conductivity;
                scale.gas = self.pore_factor(p, state, conditions) * scale.gas;
                let here = solid_properties(self.state_columns(state, row), parts, scale, with_slope);
                sum.conductivity = sum.conductivity + volume * here.conductivity;
                sum.slope = sum.slope + volume * here.slope;
                sum.heat_capacity =
                    sum.heat_capacity + (volume * own.enthalpy_scale) * (mass_kg_m3 * here.heat_capacity);
            }
        }
        sum
    }

    /// Factor of a state's pores on the conductivity of unconfined air at a temperature (K) and a pressure (Pa); one
    /// where the table holds the gas part itself.
    #[inline(always)]
    fn pore_factor(&self, p: usize, state: usize, [temperature_k, pressure_pa]: [R; 2]) -> R {
        let ConductivityColumns { first_pore, end_pore, .. } =
            self.plan.conductivity_columns[self.plan.plies[p].first_state as usize + state];
        if first_pore == end_pore {
            return R::from_f64(1.0);
        }
        let mut factor = R::from_f64(0.0);
        for pore in &self.rows.pore_classes[first_pore as usize..end_pore as usize] {
            let slip_pa = temperature_k * R::constant(pore.slip_pa_k);
            factor = factor + pressure_pa * R::constant(pore.share) / (pressure_pa + slip_pa);
        }
        factor
    }

    /// Conductivity of a cell with its current composition, W/m/K. Stages use the composition at another time, which
    /// would give a sensor next to the cell an error of first order in the step.
    #[inline(always)]
    pub(super) fn conductivity_now(&self, p: usize, i: usize, step: usize) -> R {
        let ply = self.plan.plies[p];
        if !GAS || ply.end_reaction == ply.first_reaction {
            return self.thermal.properties[i].conductivity;
        }
        let (temperature_k, pressure_pa) = (self.thermal.temperatures[i].high, self.cell_pressure_pa(i, step, 0));
        self.mixture(p, temperature_k, pressure_pa, self.current_phases(p, i), false).conductivity
    }

    /// Pressure in a cell at a stage, Pa.
    #[inline(always)]
    pub(super) fn cell_pressure_pa(&self, i: usize, step: usize, stage: usize) -> R {
        if self.plan.gas == Some(GasTransport::Darcy) {
            return self.darcy.pressures[i].high;
        }
        R::splat(self.forcing(0, step, stage).pressure_pa)
    }

    /// Position of a pressure among the levels of a ply, linear in its logarithm; at the end levels beyond them.
    #[inline(always)]
    pub(super) fn pressure_index(&self, p: usize, pressure_pa: R) -> PressureIndex<R> {
        let ply = &self.plan.plies[p];
        let (zero, one) = (R::from_f64(0.0), R::from_f64(1.0));
        if ply.levels < 2 {
            return PressureIndex { level_below: R::constant_from_f64(0.0), fraction: zero };
        }
        let (first, last) = (ply.first_level as usize, (ply.first_level + ply.levels) as usize - 1);
        let position = logarithm(pressure_pa);
        let mut below = R::constant_from_f64(0.0);
        let mut fraction = self.level_fraction(position, first);
        for number in first + 1..last {
            let past = position.reaches(R::constant(self.rows.pressure_levels[number].log_pressure));
            below = below + past;
            fraction = fraction * (R::constant_from_f64(1.0) - past) + self.level_fraction(position, number) * past;
        }
        PressureIndex { level_below: below, fraction: fraction.max(zero).min(one) }
    }

    /// Position of the logarithm of a pressure between a level and the next.
    #[inline(always)]
    fn level_fraction(&self, position: R, number: usize) -> R {
        let [here, next] = [number, number + 1].map(|level| R::splat(self.rows.pressure_levels[level].log_pressure));
        (position - here) / (next - here)
    }

    /// Heat capacity of the composition of a cell at the second stage over that at the first, at the temperature of the
    /// second stage.
    #[inline(always)]
    pub(super) fn composition_ratio(&self, p: usize, cell: usize) -> R {
        let ply = self.plan.plies[p];
        let states = ply.states as usize;
        if !GAS || states == 1 {
            return R::from_f64(1.0);
        }
        let mut capacities = [R::from_f64(0.0); 2];
        if ply.rows > 1 {
            let row = self.ply_row(p, self.thermal.temperatures[cell].high + self.stage_increment(cell, 1));
            for (stage, capacity) in capacities.iter_mut().enumerate() {
                let tabulated = Self::tabulated_states(self.plan, &self.scales, &self.reactions, [p, cell], stage);
                *capacity = heat_capacity_sum(row, &tabulated);
            }
            return capacities[1] / capacities[0];
        }
        let own = &self.scales.states[ply.first_state as usize..][..states];
        let changes = [state_change(own, 0), state_change(own, 1), state_change(own, 2), state_change(own, 3)];
        for (stage, capacity) in capacities.iter_mut().enumerate() {
            let phases = self.stage_phases(p, cell, stage);
            *capacity = mixture_sums(&phases[..states], &changes, ply.parts as usize).enthalpy_scale;
        }
        capacities[1] / capacities[0]
    }

    /// The tabulated states of a cell with its composition at a stage. One state has the weight one, as its multiples
    /// have the same temperature rise.
    #[inline(always)]
    pub(super) fn tabulated_states(
        plan: &PlanRows,
        scales: &Scales<R>,
        reactions: &ReactionState<R>,
        [p, cell]: [usize; 2],
        stage: usize,
    ) -> TabulatedStates<R> {
        let ply = plan.plies[p];
        let count = ply.rows as usize;
        let mut weights = Self::virgin();
        if GAS && count > 1 {
            for (state, weight) in weights.iter_mut().enumerate().take(count) {
                *weight = reactions.phases[stage][cell * plan.max_states + state]
                    * scales.states[ply.first_state as usize + state].enthalpy_scale;
            }
        }
        TabulatedStates { count, properties: plan.properties(), weights }
    }

    /// Rise of a cell's temperature over an increment of the scheme, K, and the lower bound of its heat capacity over
    /// the heat capacity at the start of the step. The rise is the increment, unless the steps of the ply advance the
    /// enthalpy of its cells. A held cell follows its schedule.
    #[inline(always)]
    pub(super) fn temperature_rise(
        plan: &PlanRows,
        rows: &PlanData<R::Scalar>,
        tabulated: &TabulatedStates<R>,
        [p, cell]: [usize; 2],
        temperature_k: R,
        increment: R,
        reduced: R,
    ) -> [R; 2] {
        let (one, location) = (R::from_f64(1.0), &plan.tables[p]);
        if location.enthalpy_search_span == 0 {
            return [increment, one];
        }
        let [rise_k, least] = rise_by_enthalpy(temperature_k, increment, reduced, &rows.tables, location, tabulated);
        let mut held = R::from_f64(0.0);
        for (face, face_cell) in [0, rows.cells.len() - 1].into_iter().enumerate() {
            if cell == face_cell {
                held = held + R::splat(rows.faces[face].held);
            }
        }
        [held * increment + (one - held) * rise_k, held + (one - held) * least]
    }

    /// Enthalpy of a cell per virgin mass, J/kg.
    #[expect(clippy::needless_range_loop, reason = "the WGSL twin has the same loop")]
    #[inline(always)]
    pub(super) fn solid_enthalpy(&self, ply: usize, phases: [R; MAX_STATES], here: TableSegment<'a, R>) -> R {
        let mut risen_j_kg = integral(here, 1);
        let mut sum = R::from_f64(0.0);
        for state in 0..MAX_STATES {
            if state < self.plan.plies[ply].states as usize {
                if state > 0 && self.plan.plies[ply].rows > 1 {
                    risen_j_kg = integral(self.state_columns(state, here), 1);
                }
                sum = sum + phases[state] * self.state_enthalpy(ply, state, risen_j_kg);
            }
        }
        sum
    }
}

/// Volume-weighted sums over the states of a cell: see [`StateScale`].
pub(super) struct MixtureSums<R> {
    pub conductivity: ConductivityParts<R>,
    pub enthalpy_scale: R,
    pub remains: R,
}

/// A residue less the virgin material; for state zero the virgin material itself.
#[inline(always)]
pub(super) fn state_change<R: Real>(own: &[StateScale<R>], state: usize) -> StateScale<R> {
    if state == 0 || state >= own.len() { own[0] } else { own[state].less(own[0]) }
}

/// The sums over as many states as there are volume fractions, which add up to one, from the changes of each state.
#[inline(always)]
pub(super) fn mixture_sums<R: Real>(
    phases: &[R],
    changes: &[StateScale<R>; MAX_STATES],
    parts: usize,
) -> MixtureSums<R> {
    let mut conductivity = changes[0].conductivity;
    let mut stores = changes[0].enthalpy_scale;
    let mut remains = changes[0].remains;
    for state in 1..phases.len().min(MAX_STATES) {
        let (volume, change) = (phases[state], &changes[state]);
        conductivity = conductivity.plus(change.conductivity.times(volume, parts), parts);
        stores = stores + volume * change.enthalpy_scale;
        remains = remains + volume * change.remains;
    }
    MixtureSums { conductivity, enthalpy_scale: stores, remains }
}

/// Divisor of the summed conductivities: the thickness ratio where parts mix by volume, times the mass ratio where they
/// mix by mass.
#[inline(always)]
pub(super) fn conductivity_divisor<R: Real>(density: R, ply: PlyScale<R>, bulk: BulkProperties<R::Scalar>) -> R {
    let stretch = thickness_ratio_of(density, ply, bulk);
    if bulk.by_volume == R::scalar(1.0) { stretch } else { density * stretch }
}

/// Degree of conversion: mass lost over the mass lost at full conversion.
#[inline(always)]
pub(super) fn degree_of_conversion<R: Real>(density: R, ply: PlyScale<R>) -> R {
    (R::from_f64(1.0) - density) * ply.per_loss
}

/// Thickness of a cell over its virgin thickness.
#[inline(always)]
pub(super) fn thickness_ratio_of<R: Real>(density: R, ply: PlyScale<R>, bulk: BulkProperties<R::Scalar>) -> R {
    R::from_f64(1.0) - (R::from_f64(1.0) - density) * (ply.per_loss * R::constant(bulk.shrinkage))
}

/// Volume fractions after a transfer of `moved_fraction` from one state to another.
#[inline(always)]
pub(super) fn transfer_volume<R: Real>(
    mut phases: [R; MAX_STATES],
    path: ReactionPath<u32>,
    moved_fraction: R,
) -> [R; MAX_STATES] {
    for (state, phase) in phases.iter_mut().enumerate() {
        if path.source as usize == state {
            *phase = *phase - moved_fraction;
        }
        if path.product as usize == state {
            *phase = *phase + moved_fraction;
        }
    }
    phases
}
