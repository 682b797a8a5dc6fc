//! Heat stored in a member since the start, for its energy balance.

use super::Real;
use super::compensated::{advanced, keep};
use super::member::Member;
use super::table::{integral, spot};

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Sums the heat stored since the start. The heat stored in a held cell counts as heat through its face.
    #[inline(always)]
    pub(super) fn finish(&mut self) {
        let rows = self.rows;
        let last = self.thermal.temperatures.len() - 1;
        let zero = R::constant(0.0);
        for p in 0..self.scales.plies.len() {
            let ply = &self.plan.plies[p];
            for i in ply.first_cell as usize..ply.end_cell as usize {
                let gained = self.gained(p, i);
                self.accounts.stored_j_m2 = self.accounts.stored_j_m2 + gained;
                let hot = if i == 0 { R::of(rows.faces[0].held) * gained } else { zero };
                let back = if i == last { R::of(rows.faces[1].held) * gained } else { zero };
                self.accounts.heat[0] = advanced(self.accounts.heat[0], hot.max(zero));
                self.accounts.heat[1] = advanced(self.accounts.heat[1], (-hot).max(zero));
                self.accounts.heat[2] = advanced(self.accounts.heat[2], back.max(zero));
                self.accounts.heat[3] = advanced(self.accounts.heat[3], (-back).max(zero));
            }
        }
    }

    /// Heat stored in a cell since the start, J/m², including its gas and the solid that it lost.
    #[inline(always)]
    pub(super) fn gained(&mut self, p: usize, i: usize) -> R {
        let rows = self.rows;
        let ply = self.plan.plies[p];
        let width_m = R::of(rows.cells[i].width_m);
        let now = spot(self.thermal.temperatures[i].high);
        let then = spot(R::of(rows.cells[i].start_k));
        if ply.states == 1 {
            let now_j_kg = integral(self.row_of(p, now), 1);
            let then_j_kg = integral(self.row_of(p, then), 1);
            return keep(now_j_kg - then_j_kg) * self.scales.plies[p].density_kg_m3 * width_m + self.gas_gained(p, i);
        }
        let phases = self.phases_of(p, i);
        let mass_kg_m2 = self.scales.plies[p].mass_kg_m3 * width_m;
        let lost_kg_m2 = mass_kg_m2 * (R::constant(1.0) - self.mass_left(p, phases));
        self.accounts.lost_and_stored[0] = self.accounts.lost_and_stored[0] + lost_kg_m2;
        let then = self.row_of(p, then);
        let then_j_kg = self.enthalpy_of(p, 0, integral(then, 1));
        let now_j_kg = self.solid_enthalpy(p, phases, self.row_of(p, now));
        keep(now_j_kg - then_j_kg) * mass_kg_m2 + self.gas_gained(p, i)
    }
}
