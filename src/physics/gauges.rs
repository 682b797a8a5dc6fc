//! What is told of a member as a whole at an instant.

use super::Real;
use super::member::Member;
use super::mixing::converted;
use crate::plan::GasPath;
use crate::plan::layout::GAUGES;

/// What is lost of all that can be, at the fronts of virgin and of char.
const VIRGIN_LOST: f64 = 0.02;
const CHAR_LOST: f64 = 0.98;

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Gas out of the hot face (kg/m²/s), solid lost (kg/m²), depth of the virgin and of the char front in the virgin
    /// layup (m), largest pressure and that at the back (Pa).
    #[inline(always)]
    pub fn gauges(&self, step: usize) -> [R; GAUGES] {
        let zero = R::constant(0.0);
        let last = self.temperatures.len() - 1;
        let outside = R::of(self.rows.drives[4 * step].pressure_pa);
        let mut lost = zero;
        let mut virgin_m = zero;
        let mut char_m = zero;
        let mut depth_m = zero;
        let mut before = zero;
        let mut before_m = zero;
        for p in 0..self.plies.len() {
            let ply = self.plan.plies[p];
            for i in ply.first_cell as usize..ply.end_cell as usize {
                let density = self.mass_left(p, self.phases_of(p, i));
                let width_m = R::of(self.rows.cells[i].width_m);
                lost = lost + self.plies[p].mass_kg_m3 * width_m * (R::constant(1.0) - density);
                let node_m = depth_m + R::of(self.rows.cells[i].above_m);
                let here = converted(density, self.plies[p]);
                virgin_m = virgin_m.max(crossing(before, before_m, here, node_m, R::constant(VIRGIN_LOST)));
                char_m = char_m.max(crossing(before, before_m, here, node_m, R::constant(CHAR_LOST)));
                before = here;
                before_m = node_m;
                depth_m = depth_m + width_m;
            }
        }
        // A front that has passed the last node ends at the back face.
        virgin_m = virgin_m.max(crossing(before, before_m, zero, depth_m, R::constant(VIRGIN_LOST)));
        char_m = char_m.max(crossing(before, before_m, zero, depth_m, R::constant(CHAR_LOST)));
        let mut peak = outside;
        let mut back = outside;
        if self.plan.gas == Some(GasPath::Darcy) {
            for i in 0..=last {
                peak = peak.max(self.pressures[i].high);
            }
            back = self.pressures[last].high;
        }
        // Fluxes are means of steps: those of the last two, continued to the instant.
        let flux = R::constant(1.5) * self.recent[1] - R::constant(0.5) * self.recent[0];
        [flux, lost, virgin_m, char_m, peak, back]
    }
}

/// Where a share falls below a mark between two nodes; nowhere is zero.
#[inline(always)]
fn crossing<R: Real>(before: R, before_m: R, here: R, here_m: R, mark: R) -> R {
    let one = R::constant(1.0);
    let falls = before.reached(mark) * (one - here.reached(mark));
    let way = (before - mark) / (before - here).max(R::constant(1e-9));
    falls * (before_m + way * (here_m - before_m))
}
