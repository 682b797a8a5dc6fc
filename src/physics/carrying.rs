//! The heat of a member's reactions and of its gas.
//!
//! Gas is as warm as the solid it passes. Through the face under a cell it carries the mean of the enthalpies
//! on both sides, so that either cell gains half the flux times the fall of enthalpy towards it.

use super::Real;
use super::compensated::{advanced, keep};
use super::faces::FaceFlux;
use super::member::{Ends, Member};
use super::table::{look_up, spot};
use crate::plan::GasPath;
use crate::plan::layout::GAS_COLUMNS;

impl<R: Real> Member<'_, R> {
    /// Enthalpy of the gas in a cell at `T + Δ₁`, J/kg.
    #[inline(always)]
    fn gas_enthalpy_in(&self, cell: usize) -> R {
        self.gas_enthalpy_at(spot(self.temperatures[cell].high + self.first[cell]))
    }

    /// Half the heat that gas under a cell carries per kelvin of the cell and of the next, W/m²/K.
    #[inline(always)]
    pub(super) fn carried_slopes(&self, cell: usize) -> [R; 2] {
        let (tables, rise) = (&self.rows.tables, self.plan.gas_table() + 1);
        let half = R::constant(0.5) * self.flows[cell];
        let here = look_up(tables, spot(self.temperatures[cell].high + self.first[cell]), GAS_COLUMNS, rise);
        let next = look_up(tables, spot(self.temperatures[cell + 1].high + self.first[cell + 1]), GAS_COLUMNS, rise);
        [-(half * here), half * next]
    }

    /// Heat capacity of the gas in the pores of a cell, J/m²/K.
    #[inline(always)]
    pub(super) fn gas_capacity(&self, cell: usize) -> R {
        let at = spot(self.temperatures[cell].high + self.first[cell]);
        let rise_j_kg_k = look_up(&self.rows.tables, at, GAS_COLUMNS, self.plan.gas_table() + 1);
        self.pores[cell].storage * self.pressures[cell].high * rise_j_kg_k
    }

    /// Pressure over density of the gas in a cell, J/kg.
    #[inline(always)]
    pub(super) fn gas_work(&self, cell: usize) -> R {
        let temperature_k = self.temperatures[cell].high + self.first[cell];
        temperature_k / look_up(&self.rows.tables, spot(temperature_k), GAS_COLUMNS, self.plan.gas_table() + 2)
    }

    /// Heat that the gas of a cell holds over that at the start, J/m²; its mass is noted too.
    #[inline(always)]
    pub(super) fn gas_gained(&mut self, p: usize, cell: usize) -> R {
        let zero = R::constant(0.0);
        if self.plan.gas != Some(GasPath::Darcy) {
            return zero;
        }
        let now_kg_m2 = self.pores[cell].storage * self.pressures[cell].high;
        let now_j_kg = self.gas_enthalpy_in(cell) - self.gas_work(cell);
        let then_kg_m2 = self.first_storage(p, cell) * R::of(self.rows.drives[0].pressure_pa);
        let start_k = R::of(self.rows.cells[cell].start_k);
        let (tables, molar) = (&self.rows.tables, self.plan.gas_table() + 2);
        let work_j_kg = start_k / look_up(tables, spot(start_k), GAS_COLUMNS, molar);
        let then_j_kg = self.gas_enthalpy_at(spot(start_k)) - work_j_kg;
        self.lost_and_stored[1] = self.lost_and_stored[1] + keep(now_kg_m2 - then_kg_m2);
        now_kg_m2 * now_j_kg - then_kg_m2 * then_j_kg
    }

    /// Mass over pressure of the gas in a cell at the start.
    #[inline(always)]
    fn first_storage(&self, p: usize, cell: usize) -> R {
        let start_k = R::of(self.rows.cells[cell].start_k);
        let molar = look_up(&self.rows.tables, spot(start_k), GAS_COLUMNS, self.plan.gas_table() + 2);
        let virgin = self.rows.substances[self.plan.plies[p].first_state as usize];
        let volume_m = R::of(self.rows.cells[cell].width_m) * self.plies[p].thickness;
        volume_m * R::of(virgin.porosity) * (molar / start_k)
    }

    /// Add the heat of reactions and gas to the imbalance of every cell, and to what held faces must supply.
    #[inline(always)]
    pub(super) fn warm(&mut self, step: usize, stage: usize, ends: Ends<R>) -> Ends<R> {
        let last = self.second.len() - 1;
        let half = R::constant(0.5);
        let is_darcy = self.plan.gas == Some(GasPath::Darcy);
        let is_unhindered = self.plan.gas == Some(GasPath::Unhindered);
        let mut out = R::constant(0.0);
        let mut given = R::constant(0.0);
        let mut drawn = [R::constant(0.0); 2];
        for p in 0..self.plies.len() {
            let ply = self.plan.plies[p];
            for i in ply.first_cell as usize..ply.end_cell as usize {
                if ply.end_reaction > ply.first_reaction {
                    let [absorbed, beyond, rises] = self.reaction_heat(p, i);
                    if stage == 0 {
                        self.restraints[i] = rises.max(R::constant(0.0));
                    }
                    self.second[i] = self.second[i] - absorbed;
                    given = given + beyond;
                    if i == 0 {
                        drawn[0] = drawn[0] - beyond;
                    }
                    if i == last {
                        drawn[1] = drawn[1] - beyond;
                    }
                    if is_unhindered {
                        let leaves = self.made_in(p, i) * self.gas_enthalpy_in(i);
                        out = out + leaves;
                        if i == 0 {
                            drawn[0] = drawn[0] + leaves;
                        }
                        if i == last {
                            drawn[1] = drawn[1] + leaves;
                        }
                    }
                }
                if is_darcy {
                    let swept = self.pores[i].storage * self.gas_work(i) * self.pressure_rates[i];
                    self.second[i] = self.second[i] + swept;
                }
            }
        }
        if !is_unhindered {
            let mut above = self.gas_enthalpy_in(0);
            out = self.leaving[stage] * above;
            drawn[0] = drawn[0] + out;
            for i in 0..last {
                let below = self.gas_enthalpy_in(i + 1);
                let gained = half * self.flows[i] * (below - above);
                self.second[i] = self.second[i] + gained;
                self.second[i + 1] = self.second[i + 1] + gained;
                let carried = half * self.flows[i] * (below + above);
                if i == 0 {
                    drawn[0] = drawn[0] - carried;
                }
                if i + 1 == last {
                    drawn[1] = drawn[1] + carried;
                }
                above = below;
            }
            let back = self.back_leaving * above;
            out = out + back;
            drawn[1] = drawn[1] + back;
        }
        self.tally(step, stage, out, given);
        let held = [R::of(self.rows.faces[0].held), R::of(self.rows.faces[1].held)];
        Ends {
            hot: FaceFlux { flux: ends.hot.flux + held[0] * drawn[0], slope: ends.hot.slope },
            back: FaceFlux { flux: ends.back.flux + held[1] * drawn[1], slope: ends.back.slope },
        }
    }

    /// Take the heat that gas carried out, and what reactions gave beyond enthalpies, into the accounts: the mean of
    /// the stages.
    #[inline(always)]
    fn tally(&mut self, step: usize, stage: usize, out: R, given: R) {
        if stage == 0 {
            self.stage_heat = [out, given];
            return;
        }
        let half_length = R::constant(0.5) * R::of(self.rows.lengths_s[step]);
        self.gas_heat = advanced(self.gas_heat, half_length * (self.stage_heat[0] + out));
        self.reaction_gain = advanced(self.reaction_gain, half_length * (self.stage_heat[1] + given));
    }
}
