//! Heat advected by pyrolysis gas, and its balance.
//!
//! Gas is at the temperature of the solid. Through the face under a cell it carries the mean enthalpy of both cells, so
//! each of them gains half the mass flux times the enthalpy difference.

use super::GAMMA;
use super::Real;
use super::compensated::{add_compensated, opaque};
use super::darcy_flow::STORAGE_MIN;
use super::member::Member;
use super::table::{TableSegment, interpolate};
use crate::layout::GasTransport;

/// Advected heat gained by each of two neighbouring cells, W/m²: half the upward mass flux times the enthalpy
/// difference.
#[inline(always)]
pub(super) fn advected_heat_gain<R: Real>(mass_flux: R, here_j_kg: R, below_j_kg: R) -> R {
    mass_flux * R::constant_from_f64(0.5) * (below_j_kg - here_j_kg)
}

/// Half the slopes of the heat advected upwards by the temperatures of the cell and of the next one, W/m²/K.
#[inline(always)]
pub(super) fn advected_heat_slopes<R: Real>(mass_flux: R, rise: R, next_rise: R) -> [R; 2] {
    let half = mass_flux * R::constant_from_f64(0.5);
    [half * rise, half * next_rise]
}

/// Enthalpy of the gas (J/kg) and its slope (J/kg/K) from its table columns.
#[inline(always)]
pub(super) fn gas_enthalpy<R: Real>(here: TableSegment<'_, R>) -> [R; 2] {
    [interpolate(here, 0), interpolate(here, 1)]
}

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Whether a stage reads gas enthalpy from tables. The first stage does. The second extrapolates linearly, which
    /// keeps the order; with Darcy flow it reads the tables too, as the heat capacity of the stored gas must be that of
    /// the stage.
    #[inline(always)]
    pub(super) fn reads_gas_tables(&self, stage: usize) -> bool {
        GAS && (stage == 0 || self.plan.gas == Some(GasTransport::Darcy))
    }
    /// Gas enthalpy of a cell at a stage, J/kg. `NodeColumns` does the same on slices.
    #[inline(always)]
    pub(super) fn stage_gas_enthalpy(&self, cell: usize, stage: usize) -> R {
        let start = self.gas.enthalpies_j_kg[cell];
        if stage == 0 || self.reads_gas_tables(stage) {
            return start;
        }
        start + self.gas.heat_capacities[cell] * self.thermal.first_increments[cell]
    }

    /// Heat capacity of the gas in the pores of a cell, J/m²/K.
    #[inline(always)]
    pub(super) fn gas_capacity(&self, cell: usize) -> R {
        self.darcy.pores[cell].storage * self.darcy.pressures[cell].high * self.gas.heat_capacities[cell]
    }

    /// Pressure over density of the gas in a cell, J/kg.
    #[inline(always)]
    fn gas_flow_work(&self, p: usize, cell: usize, stage: usize) -> R {
        let temperature_k = self.thermal.temperatures[cell].high + self.stage_increment(cell, stage);
        temperature_k / interpolate(self.gas_columns(p, self.ply_row(p, temperature_k)), 2)
    }

    /// Heat stored in a cell's gas since the start, J/m². Adds the stored gas mass to the balance.
    #[inline(always)]
    pub(super) fn gas_heat_gain(&mut self, p: usize, cell: usize) -> R {
        let zero = R::from_f64(0.0);
        if !GAS || self.plan.gas != Some(GasTransport::Darcy) {
            return zero;
        }
        let now_kg_m2 = self.darcy.pores[cell].storage * self.darcy.pressures[cell].high;
        let now_j_kg = self.gas.enthalpies_j_kg[cell] - self.gas_flow_work(p, cell, 0);
        let then_kg_m2 = self.initial_gas_storage(p, cell) * R::splat(self.forcing(0, 0, 0).pressure_pa);
        let start_k = R::splat(self.rows.cells[cell].start_k);
        let then = self.gas_columns(p, self.ply_row(p, start_k));
        let then_j_kg = interpolate(then, 0) - start_k / interpolate(then, 2);
        self.sums.lost_and_stored[1] = self.sums.lost_and_stored[1] + opaque(now_kg_m2 - then_kg_m2);
        now_kg_m2 * now_j_kg - then_kg_m2 * then_j_kg
    }

    /// Gas mass per pressure in a cell at the start, kg/m²/Pa.
    #[inline(always)]
    pub(super) fn initial_gas_storage(&self, p: usize, cell: usize) -> R {
        let start_k = R::splat(self.rows.cells[cell].start_k);
        let molar = interpolate(self.gas_columns(p, self.ply_row(p, start_k)), 2);
        let virgin = self.rows.state_properties[self.plan.plies[p].first_state as usize];
        let volume_m = self.scales.plies[p].thickness * self.cell_width_m(cell);
        (volume_m * R::splat(virgin.porosity) * (molar / start_k)).max(R::from_f64(STORAGE_MIN))
    }

    /// Work of the changing pressure on the gas in a cell's pores at a stage, W/m².
    #[inline(always)]
    pub(super) fn pressure_work(&self, p: usize, cell: usize, stage: usize) -> R {
        self.darcy.pores[cell].storage * self.gas_flow_work(p, cell, stage) * self.darcy.pressure_rates[cell]
    }

    /// Heat that gas draws from held faces at a stage, W/m²; accounts for the heat that leaves with the gas.
    #[inline(always)]
    pub(super) fn gas_heat_outflow(&mut self, step: usize, stage: usize) -> [R; 2] {
        let last = self.thermal.temperatures.len() - 1;
        let mut drawn = [-self.reactions.released_heat_ends[0], -self.reactions.released_heat_ends[1]];
        let mut out = R::from_f64(0.0);
        if self.plan.gas == Some(GasTransport::Instantaneous) {
            for i in 0..=last {
                let leaves = self.gas_source_at(i, stage) * self.stage_gas_enthalpy(i, stage);
                out = out + leaves;
                if i == 0 {
                    drawn[0] = drawn[0] + leaves;
                }
                if i == last {
                    drawn[1] = drawn[1] + leaves;
                }
            }
        } else {
            out = self.gas.hot_outflow[stage] * self.stage_gas_enthalpy(0, stage);
            drawn[0] = drawn[0] + (out - self.advected_heat(0, stage));
            let back = self.gas.back_outflow * self.stage_gas_enthalpy(last, stage);
            drawn[1] = drawn[1] + (self.advected_heat(last - 1, stage) + back);
            out = out + back;
        }
        self.account_gas_heat(step, stage, out);
        let held = [R::splat(self.rows.faces[0].held), R::splat(self.rows.faces[1].held)];
        [held[0] * drawn[0], held[1] * drawn[1]]
    }

    /// Heat advected upwards through the face under a cell at a stage, W/m².
    #[inline(always)]
    fn advected_heat(&self, cell: usize, stage: usize) -> R {
        self.gas.mass_fluxes[cell]
            * R::constant_from_f64(0.5)
            * (self.stage_gas_enthalpy(cell + 1, stage) + self.stage_gas_enthalpy(cell, stage))
    }

    /// Adds the heat that left with the gas, and the heat that reactions released beyond enthalpies, to the balance:
    /// mean of both stages.
    #[inline(always)]
    fn account_gas_heat(&mut self, step: usize, stage: usize, out: R) {
        if stage == 0 {
            self.sums.first_stage_gas_heat = out;
            return;
        }
        let half_step_s = R::constant_from_f64(0.5) * self.step_length_s(step);
        self.sums.gas_heat = add_compensated(self.sums.gas_heat, (self.sums.first_stage_gas_heat + out) * half_step_s);
        self.sums.reaction_gain = add_compensated(self.sums.reaction_gain, self.reactions.released_heat * half_step_s);
    }

    /// Slope of the heat that leaves through a face with the gas, by the temperature of its cell, times γ, W/m²/K.
    /// Without it the order of the face temperature falls to 1.6. Zero for inflow, which would weaken the diagonal.
    #[inline(always)]
    pub(super) fn outflow_heat_slope(&self, face: usize, cell: usize) -> R {
        let zero = R::from_f64(0.0);
        if self.plan.gas == Some(GasTransport::Instantaneous) {
            return zero;
        }
        let leaving = if face == 0 { self.gas.hot_outflow[0] } else { self.gas.back_outflow };
        leaving.max(zero) * self.gas.heat_capacities[cell] * R::constant_from_f64(GAMMA)
    }
}
