//! Thermocouple readings.

use super::Real;
use super::compensated::{add_compensated, add_unnormalized, difference};
use super::double_word::DoubleWord;
use crate::layout::{Bead, Sensor};

/// Smallest bend of a parabola between two nodes, K/m: below it temperatures are equal to rounding.
pub(super) const BEND_MIN_K_M: f64 = 1e-6;

/// Temperature on the face between two nodes, weighted between its upper and its lower side.
///
/// The flux between the nodes, extrapolated over half a cell, gives either side to second order, and keeps the jump
/// across a contact, which the mean of the nodes would smear.
#[inline(always)]
pub fn interface_temperature<R: Real>(
    upper: DoubleWord<R>,
    lower: DoubleWord<R>,
    conductivity: R,
    next: R,
    conductance: R,
    sensor: Sensor<R::Scalar>,
) -> DoubleWord<R> {
    let drop = difference(upper, lower);
    let flux = conductance * drop;
    let to_face = flux * R::splat(sensor.above_m) / conductivity;
    let from_face = drop - flux * R::splat(sensor.below_m) / next;
    let fall = R::splat(sensor.above) * to_face + R::splat(sensor.below) * from_face;
    add_unnormalized(upper, -fall)
}

/// Temperature between two nodes of a ply whose conductivity may jump between their temperatures.
///
/// It then follows two straight lines that meet where the conductivity jumps: in falling, the higher one of both where
/// the lower node conducts better, and the lower one elsewhere; in rising the other way round. It lies between those of
/// the nodes, beyond which a third conductivity between theirs would take the lines.
#[inline(always)]
pub fn temperature_within_steep_ply<R: Real>(
    upper: DoubleWord<R>,
    lower: DoubleWord<R>,
    conductivity: R,
    next: R,
    conductance: R,
    sensor: Sensor<R::Scalar>,
) -> DoubleWord<R> {
    let (zero, one) = (R::from_f64(0.0), R::from_f64(1.0));
    let drop = difference(upper, lower);
    let flux = conductance * drop;
    let to_face = flux * R::splat(sensor.above_m) / conductivity;
    let from_face = drop - flux * R::splat(sensor.below_m) / next;
    let (falls, conducts_better) = (drop.ge_mask(zero), next.ge_mask(conductivity));
    let is_least = falls * conducts_better + (one - falls) * (one - conducts_better);
    let fall = is_least * to_face.min(from_face) + (one - is_least) * to_face.max(from_face);
    add_unnormalized(upper, -fall.max(drop.min(zero)).min(drop.max(zero)))
}

/// Height of a peak between two nodes above the upper one, K, from the slopes above, between and below the nodes, K/m,
/// and the lengths of these stretches, m; zero without a peak.
///
/// It is the lower one of two parabolas, through the upper node and its neighbours and through the lower one and its
/// neighbours: one alone would overshoot where a held face jumps.
#[inline(always)]
pub fn peak_excess<R: Real>(slopes_k_m: [R; 3], lengths_m: [R; 3]) -> R {
    let [above, between, below] = slopes_k_m;
    let [above_m, between_m, below_m] = lengths_m;
    let upper = (above * between_m + between * above_m) / (above_m + between_m);
    let lower = (between * below_m + below * between_m) / (between_m + below_m);
    // The slope of a parabola between two points is the mean of its slopes at the points.
    let twice = between + between;
    parabola_excess(upper, twice - upper, between_m).min(parabola_excess(twice - lower, lower, between_m))
}

/// Height of the vertex of a parabola above its start, from the slopes at the start and at the end; zero if the vertex
/// does not lie between them.
#[inline(always)]
pub fn parabola_excess<R: Real>(start_k_m: R, end_k_m: R, length_m: R) -> R {
    let zero = R::from_f64(0.0);
    let is_peak = start_k_m.ge_mask(zero) * (-end_k_m).ge_mask(zero);
    let bend_k_m = R::from_f64(2.0) * (start_k_m - end_k_m);
    is_peak * (start_k_m * start_k_m * length_m / bend_k_m.max(R::from_f64(BEND_MIN_K_M)))
}

/// Part of a stretch that a depth shift covers, m. The stretch begins at `start_m` and is `length_m` long. Without a
/// shift, the parts of the two stretches next to a sensor each have half the derivative, so that the derivative of the
/// reading is the mean of both slopes. An extended stretch may have a negative part: a sensor on an outer face has one
/// stretch only, and the derivative of its reading is the slope into the layup.
#[inline(always)]
pub fn covered_length<R: Real>(shift_m: R, start_m: R, length_m: R, is_extended: bool) -> R {
    let part_m = shift_m - start_m;
    if is_extended {
        return part_m.min(length_m);
    }
    part_m.max(R::from_f64(0.0)).min(length_m)
}

/// Bead temperature after a step between two readings.
#[inline(always)]
pub fn bead_response<R: Real>(
    bead: DoubleWord<R>,
    before: DoubleWord<R>,
    now: DoubleWord<R>,
    weights: Bead<R::Scalar>,
) -> DoubleWord<R> {
    let start = R::splat(weights.start) * difference(before, bead);
    let end = R::splat(weights.end) * difference(now, bead);
    add_compensated(bead, start + end)
}
