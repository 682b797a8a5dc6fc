//! Lateral heat exchange of every cell with the specimen holder.
//!
//! `q = g w (T_h − T)` into a cell of width w, implicit in its temperature. The scheme's γr, the change of q over a
//! step by the holder's schedule, enters through the holder temperature of each stage: ahead of the schedule by γ of
//! the rise at the first stage, behind it by the same at the second, so that it cancels in the heat. Lateral heat from
//! a held cell is made up by its face.

use super::GAMMA;
use super::Real;
use super::compensated::{Pair, advanced};
use super::member::Member;

/// Heat flux from the holder into a cell, W/m².
#[inline(always)]
pub fn flux_sideways<R: Real>(conductance_w_m2_k: R, holder_k: R, cell: Pair<R>) -> R {
    conductance_w_m2_k * ((holder_k - cell.high) - cell.low)
}

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Holder temperature of a stage, K.
    #[inline(always)]
    fn holder_k(&self, step: usize, stage: usize) -> R {
        let start = R::of(self.rows.drives[4 * step].holder_k);
        let end = R::of(self.rows.drives[4 * step + 1].holder_k);
        let foreseen = R::constant(GAMMA) * (end - start);
        if stage == 0 { start + foreseen } else { end - foreseen }
    }

    /// Conductance between the holder and a cell of a ply, W/m²/K.
    #[inline(always)]
    pub(super) fn conductance_sideways(&self, ply: usize, cell: usize) -> R {
        self.scales.plies[ply].holder_w_m3_k * R::still(self.rows.cells[cell].width_m)
    }

    /// Heat flux from the holder into a cell at a stage, W/m².
    #[inline(always)]
    pub(super) fn sideways(&self, ply: usize, cell: usize, step: usize, stage: usize) -> R {
        let conductance_w_m2_k = self.conductance_sideways(ply, cell);
        flux_sideways(conductance_w_m2_k, self.holder_k(step, stage), self.staged(cell, stage))
    }

    /// Adds the heat from the holder over a step to the balance: mean of both stages, and the implicit part of the
    /// scheme.
    #[inline(always)]
    pub(super) fn account_sideways(&mut self, step: usize, start: R, end: R) {
        let mut taken = R::constant(0.0);
        for p in 0..self.scales.plies.len() {
            let ply = &self.plan.plies[p];
            for i in ply.first_cell as usize..ply.end_cell as usize {
                taken = taken + self.conductance_sideways(p, i) * self.thermal.system[i].second;
            }
        }
        let half_step_s = R::constant(0.5) * R::of(self.rows.lengths_s[step]);
        let amount = half_step_s * (start + end - R::constant(GAMMA) * taken);
        let zero = R::constant(0.0);
        self.accounts.heat[4] = advanced(self.accounts.heat[4], amount.max(zero));
        self.accounts.heat[5] = advanced(self.accounts.heat[5], (-amount).max(zero));
    }
}
