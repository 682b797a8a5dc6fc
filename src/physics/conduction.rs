//! Heat conduction: cell properties, fluxes between cells and through the surfaces.

use super::Real;
use super::compensated::{add_unnormalized, difference};
use super::double_word::DoubleWord;
use super::gas_advection::{advected_heat_gain, advected_heat_slopes, gas_enthalpy};
use super::holder::lateral_heat_flux;
use super::material::{
    at_pressure_levels, conductance_across, conductance_slope_across, conductance_within, flux_slopes, solid_properties,
};
use super::member::{Member, width_m};
use super::mixture::{conductivity_divisor, mixture_sums, state_change};
use super::state::{CellProperties, Mixture};
use super::surface_flux::{SurfaceFlux, surface_flux};
use super::table::{
    RowSearch, TableIndex, column_offset, index_by_directory, index_by_list, index_by_steps, integral, interpolate,
    row_segment,
};
use crate::layout::GasTransport;
use crate::layout::{BoundaryForcing, Cell, ENTHALPY_COLUMNS, GAS_COLUMNS, MAX_STATES, STEEP_COLUMNS};
use std::ops::Range;

/// A cell at a stage, as its two interior faces see it.
#[derive(Clone, Copy)]
pub(super) struct Node<R: Real> {
    pub(super) temperature: DoubleWord<R>,
    /// Temperature increment of the first stage, K; zero at the first stage.
    pub(super) increment: R,
    pub(super) properties: CellProperties<R>,
    /// Enthalpy of the gas in the cell, J/kg.
    pub(super) gas_enthalpy_j_kg: R,
    /// Slope of the enthalpy of the gas by temperature, J/kg/K.
    pub(super) gas_heat_capacity: R,
}

/// Fluxes from a node to the next: conducted heat and the advected heat gained by each of both cells, W/m². At the
/// first stage also the slopes of the heat by the node's temperature and, negated, by the next node's, W/m²/K.
#[derive(Clone, Copy)]
pub(super) struct InteriorFaceFlux<R> {
    pub(super) conducted: R,
    pub(super) advected: R,
    pub(super) slopes: [R; 2],
}

/// State of a surface at a stage.
#[derive(Clone, Copy)]
pub(super) struct SurfaceState<R> {
    temperature_k: R,
    emissivity: R,
    /// Enthalpy of air at the surface above that at the cold wall (J/kg), and its slope (J/kg/K).
    enthalpy_j_kg: R,
    enthalpy_slope_j_kg_k: R,
}

/// Columns sliced to a range of cells. One bounds check a slice replaces one a cell, which costs as much as the work.
pub(super) struct NodeColumns<'a, R: Real> {
    pub(super) cells: &'a [Cell<R::Scalar>],
    temperatures: &'a [DoubleWord<R>],
    first_increments: &'a [R],
    properties: &'a [CellProperties<R>],
    gas_enthalpies_j_kg: &'a [R],
    gas_heat_capacities: &'a [R],
    /// Whether the second stage extrapolates the gas enthalpies.
    extrapolates_gas: bool,
}

/// Slopes from changing conductivities, less those of advection.
#[inline(always)]
fn subtract_advection<R: Real>(conductivity_slopes: [R; 2], advection: [R; 2]) -> [R; 2] {
    [conductivity_slopes[0] - advection[0], conductivity_slopes[1] - advection[1]]
}

/// Zero flux: below the last cell.
#[inline(always)]
pub(super) fn no_flux<R: Real>() -> InteriorFaceFlux<R> {
    let zero = R::from_f64(0.0);
    InteriorFaceFlux { conducted: zero, advected: zero, slopes: [zero; 2] }
}

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Evaluates conductivity and heat capacity of every cell at the temperature of the stage; at the first stage also
    /// the slope of the conductivity.
    #[inline(always)]
    pub(super) fn properties(&mut self, step: usize, stage: usize) {
        for p in 0..self.scales.plies.len() {
            let ply = &self.plan.plies[p];
            if ply.rows > 1 || ply.depends_on_pressure == 1 {
                for i in ply.first_cell as usize..ply.end_cell as usize {
                    self.mixture_properties(p, i, step, stage);
                }
            } else {
                self.single_substance_properties(p, stage);
            }
            // The heat capacity of the first stage, which steps that advance enthalpies keep, has that of the gas.
            let keeps_first = stage == 1 && self.plan.tables[p].enthalpy_search_span > 0;
            if GAS && self.plan.gas == Some(GasTransport::Darcy) && !keeps_first {
                for i in ply.first_cell as usize..ply.end_cell as usize {
                    let gas = self.gas_capacity(i);
                    let own = &mut self.thermal.properties[i];
                    let capacity = if stage == 0 { &mut own.first_capacity } else { &mut own.slope_or_capacity };
                    *capacity = *capacity + gas;
                }
            }
        }
    }

    /// Properties of a cell that is a mixture, or whose pressure changes.
    #[inline(always)]
    pub(super) fn mixture_properties(&mut self, p: usize, i: usize, step: usize, stage: usize) {
        let temperature_k = self.thermal.temperatures[i].high + self.stage_increment(i, stage);
        let row = self.ply_row(p, temperature_k);
        let phases = self.stage_phases(p, i, stage);
        let here = self.mixture(p, temperature_k, self.cell_pressure_pa(i, step, stage), phases, stage == 0);
        let mut capacity = here.heat_capacity * self.cell_width_m(i);
        if stage == 1 && self.plan.tables[p].enthalpy_search_span > 0 {
            capacity = self.thermal.properties[i].first_capacity * self.composition_ratio(p, i);
        }
        self.thermal.properties[i].set(here.conductivity, here.slope, capacity, stage);
        if self.reads_gas_tables(stage) {
            [self.gas.enthalpies_j_kg[i], self.gas.heat_capacities[i]] = gas_enthalpy(self.gas_columns(p, row));
        }
        let ply = self.plan.plies[p];
        if GAS && stage == 0 && ply.end_reaction > ply.first_reaction {
            self.store_enthalpy_rises(p, i, row);
        }
    }

    /// Properties of the cells of a ply at one pressure whose states are one substance or multiples of one. Half of a
    /// march is spent here. Slices of its cells spare the bounds checks.
    #[inline(always)]
    fn single_substance_properties(&mut self, p: usize, stage: usize) {
        let (plan, ply, bulk, whole) =
            (self.plan, self.plan.plies[p], self.rows.bulk_properties[p], self.scales.plies[p]);
        let (states, stride, parts) = (ply.states as usize, plan.max_states, ply.parts as usize);
        // Constant bounds of the row: the reads below need no bounds check.
        let location = plan.tables[p];
        let advances_enthalpy = location.enthalpy_search_span > 0;
        let columns = 2 * plan.properties()
            + if GAS { GAS_COLUMNS } else { 0 }
            + if location.conductivity_integral > 0 { STEEP_COLUMNS } else { 0 }
            + if advances_enthalpy { ENTHALPY_COLUMNS } else { 0 };
        let tables = &self.rows.tables[..];
        let table = &tables[location.offset as usize..];
        let (with_slope, reads_gas) = (stage == 0, self.reads_gas_tables(stage));
        let cells = ply.first_cell as usize..ply.end_cell as usize;
        let rows = &self.rows.cells[cells.clone()];
        let temperatures = &self.thermal.temperatures[cells.clone()][..rows.len()];
        let first = &self.thermal.first_increments[cells.clone()][..rows.len()];
        let properties = &mut self.thermal.properties[cells.clone()][..rows.len()];
        let of_gas = if GAS { cells.clone() } else { 0..0 };
        let gas_j_kg = &mut self.gas.enthalpies_j_kg[of_gas.clone()];
        let gas_rises = &mut self.gas.heat_capacities[of_gas];
        let mixes = GAS && states > 1;
        let of_states = if mixes { cells.start * stride..cells.end * stride } else { 0..0 };
        let phases = &self.reactions.phases[stage][of_states.clone()];
        let mixtures = &mut self.reactions.mixtures[if mixes { cells.clone() } else { 0..0 }];
        let own = &self.scales.states[ply.first_state as usize..][..states];
        // A copy: the stores of the loop could change what a reference reads.
        let conductivity_scale = own[0].conductivity;
        let changes = [state_change(own, 0), state_change(own, 1), state_change(own, 2), state_change(own, 3)];
        let risen = &mut self.reactions.enthalpy_rises[of_states];
        // Row offsets of all cells first, then the reads: otherwise each read waits for its own offset (time ratio 0.93
        // in f64 and 0.83 in f32).
        let offsets = &mut self.thermal.row_offsets[..rows.len()];
        let shares = &mut self.thermal.row_fractions[..rows.len()];
        // A loop for each kind of search: its branches and checks would take half as long as the reads.
        macro_rules! rows_by {
            ($index:ident, $($argument:expr),+) => {
                R::table_rows(
                    offsets,
                    table,
                    columns,
                    #[inline(always)]
                    |i| {
                        let increment = if with_slope { R::from_f64(0.0) } else { first[i] };
                        let at: TableIndex<R> = $index(temperatures[i].high + increment, $($argument),+);
                        shares[i] = at.fraction;
                        // Here, so that the division does not hold up the reads either.
                        if mixes {
                            let all = mixture_sums(&phases[i * stride..][..states], &changes, parts);
                            let per_left = R::from_f64(1.0) / conductivity_divisor(all.remains, whole, bulk);
                            mixtures[i] = Mixture {
                                conductivity: all.conductivity.times(per_left, parts),
                                density_kg_m3: whole.mass_kg_m3 * all.enthalpy_scale,
                            };
                        }
                        at.row
                    },
                )
            };
        }
        let found = match RowSearch::<R>::new(tables, &location) {
            RowSearch::Steps(last) => rows_by!(index_by_steps, last),
            RowSearch::List(origin, starts) => rows_by!(index_by_list, origin, starts),
            RowSearch::Directory(words, location) => rows_by!(index_by_directory, words, location),
        };
        for i in 0..rows.len() {
            let row = row_segment(found, i, shares[i]);
            let (mut scale, mut density_kg_m3) = (conductivity_scale, whole.density_kg_m3);
            if mixes {
                Mixture { conductivity: scale, density_kg_m3 } = mixtures[i];
                if with_slope {
                    risen[i * stride] = [integral(row, 1), interpolate(row, 1)];
                }
            }
            let here = solid_properties(row, parts, scale, with_slope);
            let capacity = density_kg_m3 * here.heat_capacity * width_m::<R>(&rows[i]);
            properties[i].set(here.conductivity, here.slope, capacity, stage);
            if reads_gas {
                [gas_j_kg[i], gas_rises[i]] = gas_enthalpy(column_offset(row, plan.properties()));
            }
        }
        if stage == 1 && advances_enthalpy {
            for i in cells {
                let ratio = self.composition_ratio(p, i);
                let own = &mut self.thermal.properties[i];
                own.slope_or_capacity = own.first_capacity * ratio;
            }
        }
    }
}

impl<R: Real> NodeColumns<'_, R> {
    /// Node at a stage. The device looks properties up here, as storing columns dominates its time; the processor has
    /// them in its cache (benches/LOG.md).
    #[inline(always)]
    pub(super) fn node<const GAS: bool>(&self, i: usize, stage: usize) -> Node<R> {
        let zero = R::from_f64(0.0);
        let (increment, start) = (self.first_increments[i], self.temperatures[i]);
        let (mut gas_enthalpy_j_kg, mut gas_heat_capacity) = (zero, zero);
        if GAS {
            (gas_enthalpy_j_kg, gas_heat_capacity) = (self.gas_enthalpies_j_kg[i], self.gas_heat_capacities[i]);
            if stage == 1 && self.extrapolates_gas {
                gas_enthalpy_j_kg = gas_enthalpy_j_kg + gas_heat_capacity * increment;
            }
        }
        Node {
            temperature: if stage == 0 { start } else { add_unnormalized(start, increment) },
            increment: if stage == 0 { zero } else { increment },
            properties: self.properties[i],
            gas_enthalpy_j_kg,
            gas_heat_capacity,
        }
    }
}

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Nodes of a range of cells.
    #[inline(always)]
    pub(super) fn node_columns(&self, cells: Range<usize>) -> NodeColumns<'_, R> {
        let of_gas = if GAS { cells.clone() } else { 0..0 };
        NodeColumns {
            cells: &self.rows.cells[cells.clone()],
            temperatures: &self.thermal.temperatures[cells.clone()],
            first_increments: &self.thermal.first_increments[cells.clone()][..cells.len()],
            properties: &self.thermal.properties[cells.clone()][..cells.len()],
            gas_enthalpies_j_kg: &self.gas.enthalpies_j_kg[of_gas.clone()],
            gas_heat_capacities: &self.gas.heat_capacities[of_gas],
            extrapolates_gas: !self.reads_gas_tables(1),
        }
    }

    /// Fluxes from a cell to the next of its ply, whose conductivity may be integrated.
    ///
    /// The slopes are then those of the larger upper bound of both conductivities: a cell that passes a jump of the
    /// conductivity within a step would overshoot by hundreds of kelvin with the slope of the smaller one.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "as its WGSL twin")]
    pub(super) fn flux_within_ply<const STEEP: bool>(
        &self,
        p: usize,
        cell: usize,
        here: Node<R>,
        next: Node<R>,
        half_over_next_1_m: R::Constant,
        step: usize,
        stage: usize,
    ) -> InteriorFaceFlux<R> {
        let (own, other) = (here.properties, next.properties);
        let mut conductance = conductance_within(own.conductivity, other.conductivity, half_over_next_1_m);
        let drop = difference(here.temperature, next.temperature);
        let mut conductivity_slopes = [R::from_f64(0.0); 2];
        if stage == 0 {
            let gain = drop * half_over_next_1_m;
            conductivity_slopes = [own.slope_or_capacity * gain, other.slope_or_capacity * gain];
        }
        if STEEP {
            let over_next_1_m = half_over_next_1_m + half_over_next_1_m;
            let [integral_correction, excess, next_excess] = self.conductivity_by_integral(p, cell, drop, step, stage);
            conductance = conductance + integral_correction * over_next_1_m;
            if stage == 0 {
                let bound = (own.conductivity + excess).max(other.conductivity + next_excess);
                let slope = bound * over_next_1_m - conductance;
                conductivity_slopes = [slope, R::from_f64(0.0) - slope];
            }
        }
        self.interior_face_flux(cell, here, next, conductance, drop, conductivity_slopes, stage)
    }

    /// Corrections of the conductivities of a cell and the next, W/m/K. The first number is the integral mean of the
    /// conductivity between both temperatures (Kirchhoff's transformation; Carslaw and Jaeger, 1959, section 1.6) minus
    /// the mean of the two conductivities: the integral includes a jump of the conductivity between the nodes. The
    /// others are the upper bound of either conductivity minus this conductivity. States have the mean of their weights
    /// in both cells, and pressure levels those of the mean pressure. Within a row of the table the first number is
    /// zero and takes no difference of large numbers.
    #[inline(always)]
    pub(super) fn conductivity_by_integral(&self, p: usize, cell: usize, drop: R, step: usize, stage: usize) -> [R; 3] {
        let (zero, one, half) = (R::from_f64(0.0), R::from_f64(1.0), R::from_f64(0.5));
        let (ply, table) = (&self.plan.plies[p], &self.plan.tables[p]);
        let index_at = |i: usize| self.ply_index(p, self.thermal.temperatures[i].high + self.stage_increment(i, stage));
        let (at, next_at) = (index_at(cell), index_at(cell + 1));
        let (row, next_row) = (zero + at.row, zero + next_at.row);
        // Two words that are equal in sum may lie in two rows.
        let is_level = drop.ge_mask(zero) * (zero - drop).ge_mask(zero);
        let is_same = (row.ge_mask(next_row) * next_row.ge_mask(row)).max(is_level);
        let per_drop_1_k = (one - is_same) / ((one - is_same) * drop + is_same);
        let pressures_pa = [cell, cell + 1].map(|i| self.cell_pressure_pa(i, step, stage));
        let pressure = self.pressure_index(p, half * (pressures_pa[0] + pressures_pa[1]));
        let weights = self.conductivity_weights(p, cell, stage);
        let next_weights = self.conductivity_weights(p, cell + 1, stage);
        let mut sums = [zero; 3];
        for level in 0..ply.levels.min(2) as usize {
            let rows = [at, next_at].map(|at| self.row_at(p, at_pressure_levels(at, table.rows, pressure)[level]));
            let share = if level == 1 { pressure.fraction } else { one - pressure.fraction };
            for state in 0..MAX_STATES {
                if state < ply.rows as usize {
                    let [own, next] = rows.map(|row| self.conductivity_integral(p, state, row));
                    let mean_conductivity = half * (own[0] + next[0]);
                    let integral_correction = (own[1] - next[1]) * per_drop_1_k - (one - is_same) * mean_conductivity;
                    sums[0] = sums[0] + share * (half * (weights[state] + next_weights[state])) * integral_correction;
                    sums[1] = sums[1] + share * weights[state] * (own[2] - own[0]);
                    sums[2] = sums[2] + share * next_weights[state] * (next[2] - next[0]);
                }
            }
        }
        sums
    }

    /// Fluxes across the interface above a ply, from the last cell of the ply before.
    #[inline(always)]
    pub(super) fn flux_across_interface(
        &self,
        p: usize,
        here: Node<R>,
        next: Node<R>,
        stage: usize,
    ) -> InteriorFaceFlux<R> {
        let cell = self.plan.plies[p].first_cell as usize - 1;
        let [below_m, above_m] = self.lengths_to_next_m(cell);
        let contact_m2_k_w = self.scales.contacts_m2_k_w[p - 1];
        let conductance = conductance_across(
            here.properties.conductivity,
            below_m,
            next.properties.conductivity,
            above_m,
            contact_m2_k_w,
        );
        let drop = difference(here.temperature, next.temperature);
        let mut conductivity_slopes = [R::from_f64(0.0); 2];
        if stage == 0 {
            let own = conductance_slope_across(conductance, here.properties.conductivity, below_m)
                * here.properties.slope_or_capacity;
            let below = conductance_slope_across(conductance, next.properties.conductivity, above_m)
                * next.properties.slope_or_capacity;
            conductivity_slopes = [own * drop, below * drop];
        }
        self.interior_face_flux(cell, here, next, conductance, drop, conductivity_slopes, stage)
    }

    /// Fluxes between two nodes. `conductivity_slopes`: slopes from changing conductivities, at the first stage.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "as its WGSL twin")]
    fn interior_face_flux(
        &self,
        cell: usize,
        here: Node<R>,
        next: Node<R>,
        conductance: R,
        drop: R,
        mut conductivity_slopes: [R; 2],
        stage: usize,
    ) -> InteriorFaceFlux<R> {
        let mut flux = InteriorFaceFlux { conducted: conductance * drop, ..no_flux() };
        if GAS {
            flux.advected =
                advected_heat_gain(self.gas.mass_fluxes[cell], here.gas_enthalpy_j_kg, next.gas_enthalpy_j_kg);
        }
        if stage == 0 {
            if GAS {
                conductivity_slopes = subtract_advection(
                    conductivity_slopes,
                    advected_heat_slopes(self.gas.mass_fluxes[cell], here.gas_heat_capacity, next.gas_heat_capacity),
                );
            }
            flux.slopes = flux_slopes(conductance, conductivity_slopes);
        }
        flux
    }

    /// State of the surface of a face at a stage.
    #[inline(always)]
    pub(super) fn surface_state(&self, face: usize, cell: usize, stage: usize) -> SurfaceState<R> {
        let temperature_k = self.thermal.temperatures[cell].high + self.stage_increment(cell, stage);
        let plies = self.scales.plies.len();
        let here = self.ply_row(plies, temperature_k);
        let emissivity = self.face_emissivity(face, face * (plies - 1), cell, here, stage);
        SurfaceState {
            temperature_k,
            emissivity,
            enthalpy_j_kg: interpolate(here, 0),
            enthalpy_slope_j_kg_k: interpolate(here, 1),
        }
    }

    /// Heat flux from outside into the cell of a face; zero for a held face, whose heat is that conducted onwards.
    #[inline(always)]
    pub(super) fn open_face_flux(
        &self,
        face: usize,
        forcing: BoundaryForcing<R::Scalar>,
        surface: SurfaceState<R>,
    ) -> SurfaceFlux<R> {
        let open = surface_flux(
            forcing,
            self.scales.faces[face],
            surface.temperature_k,
            surface.emissivity,
            surface.enthalpy_j_kg,
            surface.enthalpy_slope_j_kg_k,
            self.gas.stage_outflow,
        );
        let free = R::from_f64(1.0) - R::splat(self.rows.faces[face].held);
        SurfaceFlux { flux: free * open.flux, slope: free * open.slope }
    }

    /// Heat flux in through a face at a stage: from outside if open; if held, the heat that its cell passes to the next
    /// cell and to the holder.
    #[inline(always)]
    pub(super) fn face_heat_flux(&self, face: usize, cell: usize, step: usize, stage: usize) -> R {
        let mut conducted_on = self.thermal.face_conduction[face];
        if self.plan.has_holder {
            let forcing = self.forcing(face, step, stage);
            let conductance = self.holder_conductance(face * (self.scales.plies.len() - 1), cell);
            conducted_on = conducted_on
                - lateral_heat_flux(conductance, R::splat(forcing.holder_k), self.stage_temperature(cell, stage));
        }
        self.thermal.boundary_rows[face].flux + R::splat(self.rows.faces[face].held) * conducted_on
    }
}
