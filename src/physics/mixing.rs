//! Mixture rules: composition of a cell and its properties.

use super::Real;
use super::compensated::keep;
use super::gas::level;
use super::material::{Level, Parts, PlyScale, Solid, StateScale, levelled, solid};
use super::member::Member;
use super::table::{Segment, Spot, beyond, integral, segment, spot, value};
use crate::plan::GasPath;
use crate::plan::layout::{AIR_PROPERTIES, Bulk, FACE_COLUMNS, Path, STATES_MAX};

impl<'a, R: Real, const GAS: bool> Member<'a, R, GAS> {
    /// Factors of the member on a state of a ply.
    #[inline(always)]
    fn scale_of(&self, ply: usize, state: usize) -> &StateScale<R> {
        &self.scales.states[self.plan.plies[ply].first_state as usize + state]
    }

    /// Volume fraction of each state in a cell, from the current advancements. Here and below, loops run over
    /// `STATES_MAX` states, not over those present: a constant bound keeps the fractions in registers.
    #[inline(always)]
    pub(super) fn phases_of(&self, ply: usize, cell: usize) -> [R; STATES_MAX] {
        let row = &self.plan.plies[ply];
        let mut phases = Self::virgin();
        for j in row.first_reaction as usize..row.end_reaction as usize {
            let place = cell * self.plan.reactions + j - row.first_reaction as usize;
            let moved_fraction = self.reactions.advancements[place].high * R::still(self.rows.reactions[j].share);
            phases = transferred(phases, self.plan.paths[j], moved_fraction);
        }
        phases
    }

    /// Volume fractions at a stage.
    #[expect(clippy::needless_range_loop, reason = "see above")]
    #[inline(always)]
    pub(super) fn phases_at(&self, ply: usize, cell: usize, stage: usize) -> [R; STATES_MAX] {
        let mut phases = Self::virgin();
        for state in 0..STATES_MAX {
            if GAS && state < self.plan.plies[ply].states as usize {
                phases[state] = self.reactions.phases[stage][cell * self.plan.states + state];
            }
        }
        phases
    }

    /// Volume fractions of the virgin material.
    #[inline(always)]
    pub(super) fn virgin() -> [R; STATES_MAX] {
        let mut phases = [R::constant(0.0); STATES_MAX];
        phases[0] = R::constant(1.0);
        phases
    }

    /// Mass of a cell over its virgin mass.
    #[expect(clippy::needless_range_loop, reason = "the WGSL twin has the same loop")]
    #[inline(always)]
    pub(super) fn mass_left(&self, ply: usize, phases: [R; STATES_MAX]) -> R {
        let mut density = phases[0];
        for state in 1..STATES_MAX {
            if state < self.plan.plies[ply].states as usize {
                density = density + phases[state] * self.scale_of(ply, state).remains;
            }
        }
        keep(density)
    }

    /// Emissivity of the ply at a face.
    #[expect(clippy::needless_range_loop, reason = "the WGSL twin has the same loop")]
    #[inline(always)]
    pub(super) fn face_emissivity(&self, face: usize, ply: usize, cell: usize, at: Spot<R>, stage: usize) -> R {
        let phases = self.phases_at(ply, cell, stage);
        let seen = segment(&self.rows.tables, at, FACE_COLUMNS, self.plan.face_table());
        let first = AIR_PROPERTIES + face * STATES_MAX;
        let by_volume = self.rows.bulks[ply].by_volume == R::scalar(1.0);
        let mut sum = R::constant(0.0);
        for state in 0..STATES_MAX {
            if state < self.plan.plies[ply].states as usize {
                let own = phases[state] * value(seen, first + state);
                sum = sum + if by_volume { own } else { own * self.scale_of(ply, state).remains };
            }
        }
        if by_volume { sum } else { sum / self.mass_left(ply, phases) }
    }

    /// Row of a ply's tables at a table index.
    #[inline(always)]
    pub(super) fn row_of(&self, ply: usize, at: Spot<R>) -> Segment<'a, R> {
        let (rows, ply) = (self.rows, &self.plan.plies[ply]);
        segment(&rows.tables, at, ply.columns as usize, ply.table as usize)
    }

    /// Columns of a state in a row.
    #[inline(always)]
    pub(super) fn state_of(&self, state: usize, row: Segment<'a, R>) -> Segment<'a, R> {
        beyond(row, state * self.plan.properties())
    }

    /// Columns of the gas in a row: enthalpy, its slope, molar mass and viscosity.
    #[inline(always)]
    pub(super) fn gas_of(&self, ply: usize, row: Segment<'a, R>) -> Segment<'a, R> {
        self.state_of(self.plan.plies[ply].rows as usize, row)
    }

    /// Absolute enthalpy of a state of a ply, J per kg of the replaced virgin mass. `risen_j_kg`: integral of the heat
    /// capacity in the table row.
    #[inline(always)]
    pub(super) fn enthalpy_of(&self, ply: usize, state: usize, risen_j_kg: R) -> R {
        let own = self.scale_of(ply, state);
        own.stores * risen_j_kg + own.formation_j_kg
    }

    /// Stores the enthalpy rise of a cell (J/kg) and its heat capacity (J/kg/K) for all states with table rows.
    #[inline(always)]
    pub(super) fn rise_at(&mut self, p: usize, i: usize, row: Segment<'a, R>) {
        for state in 0..STATES_MAX {
            if state < self.plan.plies[p].rows as usize {
                let own = self.state_of(state, row);
                self.reactions.risen[i * self.plan.states + state] = [integral(own, 1), value(own, 1)];
            }
        }
    }

    /// Properties of a cell with given volume fractions, from the row of the pressure level below; heat capacity per
    /// unstretched volume, J/m³/K.
    #[inline(always)]
    pub(super) fn mixture(
        &self,
        p: usize,
        at: Spot<R>,
        row: Segment<'a, R>,
        pressure: Level<R>,
        phases: [R; STATES_MAX],
        with_slope: bool,
    ) -> Solid<R> {
        let left = left_of(self.mass_left(p, phases), self.scales.plies[p], self.rows.bulks[p]);
        let per_left = R::constant(1.0) / left;
        let mut here = self.of_states(p, row, phases, with_slope);
        if self.plan.levels > 1 {
            let over = self.of_states(p, self.row_of(p, levelled(at, pressure)[1]), phases, with_slope);
            here.conductivity = here.conductivity + pressure.share * (over.conductivity - here.conductivity);
            here.slope = here.slope + pressure.share * (over.slope - here.slope);
        }
        Solid { conductivity: here.conductivity * per_left, slope: here.slope * per_left, ..here }
    }

    /// Sums over the states of a cell at one pressure level. States that are multiples of the virgin one are summed
    /// before the row is read, as the read costs more than the sums.
    #[expect(clippy::needless_range_loop, reason = "the WGSL twin has the same loop")]
    #[inline(always)]
    fn of_states(&self, p: usize, row: Segment<'a, R>, phases: [R; STATES_MAX], with_slope: bool) -> Solid<R> {
        let (mass_kg_m3, ply) = (self.scales.plies[p].mass_kg_m3, self.plan.plies[p]);
        let (states, rows, parts) = (ply.states as usize, ply.rows as usize, ply.parts as usize);
        let alike = if rows == 1 { states } else { 1 };
        let sum = together(&phases[..alike], &self.scales.states[ply.first_state as usize..][..alike], parts);
        let virgin = solid(row, parts, sum.conductivity, with_slope);
        let mut sum = Solid { heat_capacity: sum.stores * (mass_kg_m3 * virgin.heat_capacity), ..virgin };
        for state in 1..STATES_MAX {
            if state < rows {
                let (volume, own) = (phases[state], self.scale_of(p, state));
                let here = solid(self.state_of(state, row), parts, own.conductivity, with_slope);
                sum.conductivity = sum.conductivity + volume * here.conductivity;
                sum.slope = sum.slope + volume * here.slope;
                sum.heat_capacity = sum.heat_capacity + (volume * own.stores) * (mass_kg_m3 * here.heat_capacity);
            }
        }
        sum
    }

    /// Conductivity of a cell with its current composition, W/m/K. Stages use the composition at another time, which
    /// would give a sensor next to the cell an error of first order in the step.
    #[inline(always)]
    pub(super) fn conductivity_now(&self, p: usize, i: usize, step: usize) -> R {
        let ply = self.plan.plies[p];
        if !GAS || ply.end_reaction == ply.first_reaction {
            return self.thermal.matter[i].conductivity;
        }
        let at = spot(self.thermal.temperatures[i].high);
        let pressure = self.level_of(i, step, 0);
        let row = self.row_of(p, levelled(at, pressure)[0]);
        self.mixture(p, at, row, pressure, self.phases_of(p, i), false).conductivity
    }

    /// Position of a cell's pressure among the table levels.
    #[inline(always)]
    pub(super) fn level_of(&self, i: usize, step: usize, stage: usize) -> Level<R> {
        let zero = R::constant(0.0);
        if self.plan.levels == 1 {
            return Level { under: R::fixed(0.0), share: zero };
        }
        let mut pressure_pa = R::of(self.rows.drives[4 * step + stage].pressure_pa);
        if self.plan.gas == Some(GasPath::Darcy) {
            pressure_pa = self.darcy.pressures[i].high;
        }
        let last = self.plan.levels - 2;
        let position = level(pressure_pa, R::constant(self.plan.middle_pa)) * R::fixed((last + 1) as f64);
        let under = position.floor(last as u32);
        Level { under, share: position - under }
    }

    /// Enthalpy of a cell per virgin mass, J/kg.
    #[expect(clippy::needless_range_loop, reason = "the WGSL twin has the same loop")]
    #[inline(always)]
    pub(super) fn solid_enthalpy(&self, ply: usize, phases: [R; STATES_MAX], here: Segment<'a, R>) -> R {
        let mut risen_j_kg = integral(here, 1);
        let mut sum = R::constant(0.0);
        for state in 0..STATES_MAX {
            if state < self.plan.plies[ply].states as usize {
                if state > 0 && self.plan.plies[ply].rows > 1 {
                    risen_j_kg = integral(self.state_of(state, here), 1);
                }
                sum = sum + phases[state] * self.enthalpy_of(ply, state, risen_j_kg);
            }
        }
        sum
    }
}

/// Volume-weighted sums over the states of a cell: see [`StateScale`].
pub(super) struct Together<R> {
    pub conductivity: Parts<R>,
    pub stores: R,
    pub remains: R,
}

/// The sums over as many states as there are volume fractions.
#[inline(always)]
pub(super) fn together<R: Real>(phases: &[R], own: &[StateScale<R>], parts: usize) -> Together<R> {
    let mut conductivity = own[0].conductivity.times(phases[0], parts);
    let mut stores = phases[0] * own[0].stores;
    let mut remains = phases[0];
    for (&volume, own) in phases[1..].iter().zip(&own[1..]) {
        conductivity = conductivity.plus(own.conductivity.times(volume, parts), parts);
        stores = stores + volume * own.stores;
        remains = remains + volume * own.remains;
    }
    Together { conductivity, stores, remains }
}

/// Divisor of the summed conductivities: the thickness ratio where parts mix by volume, times the mass ratio where they
/// mix by mass.
#[inline(always)]
pub(super) fn left_of<R: Real>(density: R, ply: PlyScale<R>, bulk: Bulk<R::Scalar>) -> R {
    let stretch = stretch_of(density, ply, bulk);
    if bulk.by_volume == R::scalar(1.0) { stretch } else { density * stretch }
}

/// Degree of conversion: mass lost over the mass lost at full conversion.
#[inline(always)]
pub(super) fn converted<R: Real>(density: R, ply: PlyScale<R>) -> R {
    (R::constant(1.0) - density) * ply.per_loss
}

/// Thickness of a cell over its virgin thickness.
#[inline(always)]
pub(super) fn stretch_of<R: Real>(density: R, ply: PlyScale<R>, bulk: Bulk<R::Scalar>) -> R {
    R::constant(1.0) - converted(density, ply) * R::still(bulk.shrinkage)
}

/// Volume fractions after a transfer of `moved` from one state to another.
#[inline(always)]
pub(super) fn transferred<R: Real>(mut phases: [R; STATES_MAX], path: Path<u32>, moved_fraction: R) -> [R; STATES_MAX] {
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
