//! Heat stored in a member since the start, for its energy balance.

use super::Real;
use super::compensated::{add_compensated, opaque};
use super::member::Member;
use super::table::integral;

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Sums the heat stored since the start. The heat stored in a held cell counts as heat through its face.
    #[inline(always)]
    pub(super) fn sum_stored_heat(&mut self) {
        let rows = self.rows;
        let last = self.thermal.temperatures.len() - 1;
        let zero = R::from_f64(0.0);
        for p in 0..self.scales.plies.len() {
            let ply = &self.plan.plies[p];
            for i in ply.first_cell as usize..ply.end_cell as usize {
                let gained = self.stored_heat_gain(p, i);
                self.sums.stored_j_m2 = self.sums.stored_j_m2 + gained;
                let hot = if i == 0 { R::splat(rows.faces[0].held) * gained } else { zero };
                let back = if i == last { R::splat(rows.faces[1].held) * gained } else { zero };
                self.sums.heat[0] = add_compensated(self.sums.heat[0], hot.max(zero));
                self.sums.heat[1] = add_compensated(self.sums.heat[1], (-hot).max(zero));
                self.sums.heat[2] = add_compensated(self.sums.heat[2], back.max(zero));
                self.sums.heat[3] = add_compensated(self.sums.heat[3], (-back).max(zero));
            }
        }
    }

    /// Heat stored in a cell since the start, J/m², including its gas and the solid that it lost.
    #[inline(always)]
    pub(super) fn stored_heat_gain(&mut self, p: usize, i: usize) -> R {
        let rows = self.rows;
        let ply = self.plan.plies[p];
        let width_m = self.cell_width_m(i);
        let now = self.ply_row(p, self.thermal.temperatures[i].high);
        let then = self.ply_row(p, R::splat(rows.cells[i].start_k));
        if ply.states == 1 {
            let now_j_kg = integral(now, 1);
            let then_j_kg = integral(then, 1);
            return opaque(now_j_kg - then_j_kg) * self.scales.plies[p].density_kg_m3 * width_m
                + self.gas_heat_gain(p, i);
        }
        let phases = self.current_phases(p, i);
        let mass_kg_m2 = self.scales.plies[p].mass_kg_m3 * width_m;
        let lost_kg_m2 = mass_kg_m2 * self.lost_mass_ratio(p, i);
        self.sums.lost_and_stored[0] = self.sums.lost_and_stored[0] + lost_kg_m2;
        let then_j_kg = self.state_enthalpy(p, 0, integral(then, 1));
        let now_j_kg = self.solid_enthalpy(p, phases, now);
        opaque(now_j_kg - then_j_kg) * mass_kg_m2 + self.gas_heat_gain(p, i)
    }
}
