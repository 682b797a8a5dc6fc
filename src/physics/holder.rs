//! Lateral heat exchange of every cell with the specimen holder.
//!
//! `q = g w (T_h − T)` into a cell of width w, implicit in its temperature. The scheme's γr, the change of q over a
//! step by the holder's schedule, enters through the holder temperature of each stage: ahead of the schedule by γ of
//! the rise at the first stage, behind it by the same at the second, so that it cancels in the heat. Lateral heat from
//! a held cell is made up by its face.

use super::GAMMA;
use super::Real;
use super::compensated::add_compensated;
use super::double_word::DoubleWord;
use super::member::Member;

/// Heat flux from the holder into a cell, W/m².
#[inline(always)]
pub fn lateral_heat_flux<R: Real>(conductance_w_m2_k: R, holder_k: R, cell: DoubleWord<R>) -> R {
    conductance_w_m2_k * ((holder_k - cell.high) - cell.low())
}

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Holder temperature of a stage, K.
    #[inline(always)]
    fn holder_k(&self, step: usize, stage: usize) -> R {
        let start = R::splat(self.forcing(0, step, 0).holder_k);
        let end = R::splat(self.forcing(0, step, 1).holder_k);
        let foreseen = R::from_f64(GAMMA) * (end - start);
        if stage == 0 { start + foreseen } else { end - foreseen }
    }

    /// Conductance between the holder and a cell of a ply, W/m²/K.
    #[inline(always)]
    pub(super) fn holder_conductance(&self, ply: usize, cell: usize) -> R {
        self.scales.plies[ply].holder_w_m3_k * self.cell_width_m(cell)
    }

    /// Heat flux from the holder into a cell at a stage, W/m².
    #[inline(always)]
    pub(super) fn holder_flux(&self, ply: usize, cell: usize, step: usize, stage: usize) -> R {
        let conductance_w_m2_k = self.holder_conductance(ply, cell);
        lateral_heat_flux(conductance_w_m2_k, self.holder_k(step, stage), self.stage_temperature(cell, stage))
    }

    /// Adds the heat from the holder over a step to the balance: mean of both stages, and the implicit part of the
    /// scheme.
    #[inline(always)]
    pub(super) fn account_holder_heat(&mut self, step: usize, start: R, end: R) {
        let mut taken = R::from_f64(0.0);
        for p in 0..self.scales.plies.len() {
            let ply = &self.plan.plies[p];
            for i in ply.first_cell as usize..ply.end_cell as usize {
                taken = taken + self.holder_conductance(p, i) * self.thermal.system[i].rhs_or_increment;
            }
        }
        let half_step_s = R::constant_from_f64(0.5) * self.step_length_s(step);
        let amount = (start + end - R::from_f64(GAMMA) * taken) * half_step_s;
        let zero = R::from_f64(0.0);
        self.sums.heat[4] = add_compensated(self.sums.heat[4], amount.max(zero));
        self.sums.heat[5] = add_compensated(self.sums.heat[5], (-amount).max(zero));
    }
}
