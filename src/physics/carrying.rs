//! Heat advected by pyrolysis gas, and its balance.
//!
//! Gas is at the temperature of the solid. Through the face under a cell it carries the mean enthalpy of both cells, so
//! each of them gains half the mass flux times the enthalpy difference.

use super::GAMMA;
use super::Real;
use super::compensated::{advanced, keep};
use super::member::Member;
use super::table::{Segment, spot, value};
use crate::plan::GasPath;

/// Advected heat gained by each of two neighbouring cells, W/m²: half the upward mass flux times the enthalpy
/// difference.
#[inline(always)]
pub(super) fn carried_gain<R: Real>(mass_flux: R, here_j_kg: R, below_j_kg: R) -> R {
    mass_flux * R::fixed(0.5) * (below_j_kg - here_j_kg)
}

/// Half the slopes of the heat advected upwards by the temperatures of the cell and of the next one, W/m²/K.
#[inline(always)]
pub(super) fn carried_slopes<R: Real>(mass_flux: R, rise: R, next_rise: R) -> [R; 2] {
    let half = mass_flux * R::fixed(0.5);
    [half * rise, half * next_rise]
}

/// Enthalpy of the gas (J/kg) and its slope (J/kg/K) from its table columns.
#[inline(always)]
pub(super) fn gas_enthalpy<R: Real>(here: Segment<'_, R>) -> [R; 2] {
    [value(here, 0), value(here, 1)]
}

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Whether a stage reads gas enthalpy from tables. The first stage does. The second extrapolates linearly, which
    /// keeps the order; with Darcy flow it reads the tables too, as the heat capacity of the stored gas must be that of
    /// the stage.
    #[inline(always)]
    pub(super) fn reads_gas(&self, stage: usize) -> bool {
        GAS && (stage == 0 || self.plan.gas == Some(GasPath::Darcy))
    }
    /// Extrapolates the gas enthalpy of the first stage to the second.
    #[inline(always)]
    pub(super) fn gas_onward(&mut self) {
        let first = &self.thermal.first[..];
        let gas_j_kg = &mut self.gas.gas_j_kg[..first.len()];
        let gas_rises = &self.gas.gas_rises[..first.len()];
        for i in 0..first.len() {
            gas_j_kg[i] = gas_j_kg[i] + gas_rises[i] * first[i];
        }
    }

    /// Heat capacity of the gas in the pores of a cell, J/m²/K.
    #[inline(always)]
    pub(super) fn gas_capacity(&self, cell: usize) -> R {
        self.darcy.pores[cell].storage * self.darcy.pressures[cell].high * self.gas.gas_rises[cell]
    }

    /// Pressure over density of the gas in a cell, J/kg.
    #[inline(always)]
    fn gas_work(&self, p: usize, cell: usize, stage: usize) -> R {
        let temperature_k = self.thermal.temperatures[cell].high + self.moved(cell, stage);
        temperature_k / value(self.gas_of(p, self.row_of(p, spot(temperature_k))), 2)
    }

    /// Heat stored in a cell's gas since the start, J/m². Adds the stored gas mass to the balance.
    #[inline(always)]
    pub(super) fn gas_gained(&mut self, p: usize, cell: usize) -> R {
        let zero = R::constant(0.0);
        if !GAS || self.plan.gas != Some(GasPath::Darcy) {
            return zero;
        }
        let now_kg_m2 = self.darcy.pores[cell].storage * self.darcy.pressures[cell].high;
        let now_j_kg = self.gas.gas_j_kg[cell] - self.gas_work(p, cell, 0);
        let then_kg_m2 = self.first_storage(p, cell) * R::of(self.rows.drives[0].pressure_pa);
        let start_k = R::of(self.rows.cells[cell].start_k);
        let then = self.gas_of(p, self.row_of(p, spot(start_k)));
        let then_j_kg = value(then, 0) - start_k / value(then, 2);
        self.accounts.lost_and_stored[1] = self.accounts.lost_and_stored[1] + keep(now_kg_m2 - then_kg_m2);
        now_kg_m2 * now_j_kg - then_kg_m2 * then_j_kg
    }

    /// Gas mass per pressure in a cell at the start, kg/m²/Pa.
    #[inline(always)]
    fn first_storage(&self, p: usize, cell: usize) -> R {
        let start_k = R::of(self.rows.cells[cell].start_k);
        let molar = value(self.gas_of(p, self.row_of(p, spot(start_k))), 2);
        let virgin = self.rows.substances[self.plan.plies[p].first_state as usize];
        let volume_m = R::of(self.rows.cells[cell].width_m) * self.scales.plies[p].thickness;
        volume_m * R::of(virgin.porosity) * (molar / start_k)
    }

    /// Work of the changing pressure on the gas in a cell's pores at a stage, W/m².
    #[inline(always)]
    pub(super) fn swept(&self, p: usize, cell: usize, stage: usize) -> R {
        self.darcy.pores[cell].storage * self.gas_work(p, cell, stage) * self.darcy.pressure_rates[cell]
    }

    /// Heat that gas draws from held faces at a stage, W/m²; accounts for the heat that leaves with the gas.
    #[inline(always)]
    pub(super) fn warm(&mut self, step: usize, stage: usize) -> [R; 2] {
        let last = self.thermal.temperatures.len() - 1;
        let mut drawn = [-self.reactions.given_ends[0], -self.reactions.given_ends[1]];
        let mut out = R::constant(0.0);
        if self.plan.gas == Some(GasPath::Unhindered) {
            for i in 0..=last {
                let leaves = self.made_at(i, stage) * self.gas.gas_j_kg[i];
                out = out + leaves;
                if i == 0 {
                    drawn[0] = drawn[0] + leaves;
                }
                if i == last {
                    drawn[1] = drawn[1] + leaves;
                }
            }
        } else {
            out = self.gas.leaving[stage] * self.gas.gas_j_kg[0];
            drawn[0] = drawn[0] + (out - self.carried(0));
            let back = self.gas.back_leaving * self.gas.gas_j_kg[last];
            drawn[1] = drawn[1] + (self.carried(last - 1) + back);
            out = out + back;
        }
        self.tally(step, stage, out);
        let held = [R::of(self.rows.faces[0].held), R::of(self.rows.faces[1].held)];
        [held[0] * drawn[0], held[1] * drawn[1]]
    }

    /// Heat advected upwards through the face under a cell, W/m².
    #[inline(always)]
    fn carried(&self, cell: usize) -> R {
        self.gas.flows[cell] * R::fixed(0.5) * (self.gas.gas_j_kg[cell + 1] + self.gas.gas_j_kg[cell])
    }

    /// Adds the heat that left with the gas, and the heat that reactions released beyond enthalpies, to the balance:
    /// mean of both stages.
    #[inline(always)]
    fn tally(&mut self, step: usize, stage: usize, out: R) {
        if stage == 0 {
            self.accounts.stage_heat = out;
            return;
        }
        let half_step_s = R::constant(0.5) * R::of(self.rows.lengths_s[step]);
        self.accounts.gas_heat = advanced(self.accounts.gas_heat, half_step_s * (self.accounts.stage_heat + out));
        self.accounts.reaction_gain = advanced(self.accounts.reaction_gain, half_step_s * self.reactions.given);
    }

    /// Slope of the heat that leaves through a face with the gas, by the temperature of its cell, times γ, W/m²/K.
    /// Without it the order of the face temperature falls to 1.6. Zero for inflow, which would weaken the diagonal.
    #[inline(always)]
    pub(super) fn let_out_heat(&self, face: usize, cell: usize) -> R {
        let zero = R::constant(0.0);
        if self.plan.gas == Some(GasPath::Unhindered) {
            return zero;
        }
        let leaving = if face == 0 { self.gas.leaving[0] } else { self.gas.back_leaving };
        leaving.max(zero) * self.gas.gas_rises[cell] * R::fixed(GAMMA)
    }
}
