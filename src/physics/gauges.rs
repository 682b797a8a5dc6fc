//! Readings of the whole layup at an instant.

use super::Real;
use super::compensated::opaque;
use super::exponential::logarithm;
use super::member::Member;
use super::mixture::degree_of_conversion;
use crate::layout::GAUGES;
use crate::layout::GasTransport;

/// Degree of conversion at the virgin front and at the char front, and its log-odds ln(c/(1 − c)).
pub(super) const VIRGIN_CONVERSION: f64 = 0.02;
pub(super) const CHAR_CONVERSION: f64 = 0.98;
pub(super) const VIRGIN_LOG_ODDS: f64 = -3.891_820_298_110_626_5;
pub(super) const CHAR_LOG_ODDS: f64 = 3.891_820_298_110_626_5;
/// Conversions are clamped to this distance from zero and one before taking log-odds.
pub(super) const CONVERSION_MIN: f64 = 1e-6;

/// Two neighbouring depths between which conversion falls below a threshold: at the upper one it is not below it.
#[derive(Clone, Copy)]
struct Crossing<R> {
    upper: R,
    upper_m: R,
    lower: R,
    lower_m: R,
}

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Mass flux out of the hot face (kg/m²/s), solid mass lost (kg/m²), depths of the virgin and of the char front in
    /// the virgin layup (m), largest pressure and that at the back (Pa).
    #[inline(always)]
    pub fn gauges(&self, step: usize) -> [R; GAUGES] {
        let zero = R::from_f64(0.0);
        let last = self.thermal.temperatures.len() - 1;
        let outside = R::splat(self.forcing(0, step, 0).pressure_pa);
        let mut lost = zero;
        let nowhere = Crossing { upper: zero, upper_m: zero, lower: zero, lower_m: zero };
        let mut virgin = nowhere;
        let mut char = nowhere;
        let mut depth_m = zero;
        let mut before = zero;
        let mut before_m = zero;
        for p in 0..self.scales.plies.len() {
            let ply = self.plan.plies[p];
            for i in ply.first_cell as usize..ply.end_cell as usize {
                let lost_ratio = self.lost_mass_ratio(p, i);
                let density = opaque(R::from_f64(1.0) - lost_ratio);
                let width_m = self.cell_width_m(i);
                lost = lost + self.scales.plies[p].mass_kg_m3 * width_m * lost_ratio;
                let here = degree_of_conversion(density, self.scales.plies[p]);
                let node_m = depth_m + R::splat(self.rows.cells[i].above_m);
                // Conversion jumps between materials: a front between their nodes lies on the interface.
                let jumps = i == ply.first_cell as usize && ply.same_material_above == 0;
                let [upper_m, lower_m] = if jumps { [depth_m, depth_m] } else { [before_m, node_m] };
                let fall = Crossing { upper: before, upper_m, lower: here, lower_m };
                virgin = deepest_crossing(virgin, fall, R::from_f64(VIRGIN_CONVERSION));
                char = deepest_crossing(char, fall, R::from_f64(CHAR_CONVERSION));
                before = here;
                before_m = node_m;
                depth_m = depth_m + width_m;
            }
        }
        // A front that has passed the last node ends at the back face.
        let end = Crossing { upper: before, upper_m: depth_m, lower: zero, lower_m: depth_m };
        virgin = deepest_crossing(virgin, end, R::from_f64(VIRGIN_CONVERSION));
        char = deepest_crossing(char, end, R::from_f64(CHAR_CONVERSION));
        let virgin_m = front_depth_m(virgin, R::from_f64(VIRGIN_LOG_ODDS));
        let char_m = front_depth_m(char, R::from_f64(CHAR_LOG_ODDS));
        let mut peak = outside;
        let mut back = outside;
        if self.plan.gas == Some(GasTransport::Darcy) {
            for i in 0..=last {
                peak = peak.max(self.darcy.pressures[i].high);
            }
            back = self.darcy.pressures[last].high;
        }
        // Linear extrapolation of the mean fluxes of the last two steps to the instant. The first two records have none
        // and are read from those that follow.
        let [before, now] = self.gas.recent_outflows;
        let (last, earlier) = (step.max(1) - 1, step.max(2) - 2);
        let [length_s, before_s] = [last, earlier].map(|step| self.step_length_s(step));
        let flux = now + (now - before) * (length_s / (length_s + before_s));
        [flux, lost, virgin_m, char_m, peak, back]
    }
}

/// `next` if it crosses `threshold`, else `crossing`.
#[inline(always)]
fn deepest_crossing<R: Real>(crossing: Crossing<R>, next: Crossing<R>, threshold: R) -> Crossing<R> {
    let one = R::from_f64(1.0);
    let falls = next.upper.ge_mask(threshold) * (one - next.lower.ge_mask(threshold));
    // One cell in a hundred crosses.
    if !falls.any_nonzero() {
        return crossing;
    }
    let stays = one - falls;
    Crossing {
        upper: stays * crossing.upper + falls * next.upper,
        upper_m: stays * crossing.upper_m + falls * next.upper_m,
        lower: stays * crossing.lower + falls * next.lower,
        lower_m: stays * crossing.lower_m + falls * next.lower_m,
    }
}

/// Depth at which conversion has the log-odds of the threshold, m: log-odds are interpolated linearly between the two
/// depths.
///
/// Ahead of a reaction front conversion falls exponentially with depth (Arrhenius rate, nearly linear temperature).
/// Interpolated linearly, the front would jump by half a cell as it passes a node.
#[inline(always)]
fn front_depth_m<R: Real>(crossing: Crossing<R>, mark_log_odds: R) -> R {
    let upper = log_odds(crossing.upper);
    let lower = log_odds(crossing.lower);
    let fraction = (upper - mark_log_odds) / (upper - lower).max(R::from_f64(1e-9));
    crossing.upper_m + fraction * (crossing.lower_m - crossing.upper_m)
}

/// ln(c/(1 − c)) of a conversion.
#[inline(always)]
fn log_odds<R: Real>(conversion: R) -> R {
    let one = R::from_f64(1.0);
    let inside = conversion.max(R::from_f64(CONVERSION_MIN)).min(R::from_f64(1.0 - CONVERSION_MIN));
    logarithm(inside / (one - inside))
}
