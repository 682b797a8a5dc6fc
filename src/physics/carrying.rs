//! The heat of a member's reactions and of its gas.
//!
//! Gas is as warm as the solid it passes. Through the face under a cell it carries the mean of the enthalpies
//! on both sides, so that either cell gains half the flux times the fall of enthalpy towards it.

use super::GAMMA;
use super::Real;
use super::compensated::{advanced, keep};
use super::member::Member;
use super::table::{Segment, spot, value};
use crate::plan::GasPath;

/// Heat that the cells on both sides gain each by gas that flows up from one to the other, W/m²: half the flux times the fall of enthalpy.
#[inline(always)]
pub(super) fn carried_gain<R: Real>(flow: R, here_j_kg: R, below_j_kg: R) -> R {
    flow * R::fixed(0.5) * (below_j_kg - here_j_kg)
}

/// Half the heat that gas under a cell carries up per kelvin of the cell and of the next, W/m²/K, from how enthalpy rises in both.
#[inline(always)]
pub(super) fn carried_slopes<R: Real>(flow: R, rise: R, next_rise: R) -> [R; 2] {
    let half = flow * R::fixed(0.5);
    [half * rise, half * next_rise]
}

/// Enthalpy of the gas by its row, and its slope.
#[inline(always)]
pub(super) fn gas_enthalpy<R: Real>(here: Segment<'_, R>) -> [R; 2] {
    [value(here, 0), value(here, 1)]
}

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Whether a stage reads the enthalpy of gas from tables. The first does. The second continues it linearly, which
    /// keeps the order, but by Darcy's law cells hold gas, whose heat capacity must be that of the stage.
    #[inline(always)]
    pub(super) fn reads_gas(&self, stage: usize) -> bool {
        GAS && (stage == 0 || self.plan.gas == Some(GasPath::Darcy))
    }
    /// The enthalpy of gas at the second stage, from that at the first.
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

    /// Heat that the gas of a cell holds over that at the start, J/m²; its mass is noted too.
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

    /// Mass over pressure of the gas in a cell at the start.
    #[inline(always)]
    fn first_storage(&self, p: usize, cell: usize) -> R {
        let start_k = R::of(self.rows.cells[cell].start_k);
        let molar = value(self.gas_of(p, self.row_of(p, spot(start_k))), 2);
        let virgin = self.rows.substances[self.plan.plies[p].first_state as usize];
        let volume_m = R::of(self.rows.cells[cell].width_m) * self.scales.plies[p].thickness;
        volume_m * R::of(virgin.porosity) * (molar / start_k)
    }

    /// What pressure does in the pores of a cell at a stage, W/m².
    #[inline(always)]
    pub(super) fn swept(&self, p: usize, cell: usize, stage: usize) -> R {
        self.darcy.pores[cell].storage * self.gas_work(p, cell, stage) * self.darcy.pressure_rates[cell]
    }

    /// Tell what heat gas takes out; and what it draws from held faces, which they must supply, W/m².
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

    /// Heat that gas carries up from the cell under one, W/m².
    #[inline(always)]
    fn carried(&self, cell: usize) -> R {
        self.gas.flows[cell] * R::fixed(0.5) * (self.gas.gas_j_kg[cell + 1] + self.gas.gas_j_kg[cell])
    }

    /// Take the heat that gas carried out, and what reactions gave beyond enthalpies, into the accounts: the mean of
    /// the stages.
    #[inline(always)]
    fn tally(&mut self, step: usize, stage: usize, out: R) {
        if stage == 0 {
            self.accounts.stage_heat = out;
            return;
        }
        let half_length = R::constant(0.5) * R::of(self.rows.lengths_s[step]);
        self.accounts.gas_heat = advanced(self.accounts.gas_heat, half_length * (self.accounts.stage_heat + out));
        self.accounts.reaction_gain = advanced(self.accounts.reaction_gain, half_length * self.reactions.given);
    }

    /// The part in the system of gas that takes heat out through a face, W/m²/K, by how much that heat rises with the temperature
    /// of its cell: without it the order of the face's temperature falls to 1.6. Of gas that comes in nothing, as it would take from the
    /// diagonal.
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
