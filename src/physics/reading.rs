//! What a thermocouple reads.

use super::Real;
use super::compensated::{Pair, advanced, difference, raised};
use crate::plan::layout::{Bead, Sensor};

/// Temperature on the face between two nodes, as the sensor weighs its upper and lower side.
///
/// The flux from node to node, carried back over half a cell, gives either side to second order, and keeps
/// the jump across a contact that the mean of the nodes would smear.
#[inline(always)]
pub fn reading<R: Real>(
    upper: Pair<R>,
    lower: Pair<R>,
    conductivity: R,
    next: R,
    conductance: R,
    sensor: Sensor<R::Scalar>,
) -> Pair<R> {
    let drop = difference(upper, lower);
    let flux = conductance * drop;
    let to_face = flux * R::of(sensor.above_m) / conductivity;
    let from_face = drop - flux * R::of(sensor.below_m) / next;
    let fall = R::of(sensor.above) * to_face + R::of(sensor.below) * from_face;
    raised(upper, -fall)
}

/// How much of a stretch a shift covers, m: of one that begins at a distance and goes on for a length.
#[inline(always)]
pub fn covered<R: Real>(shift_m: R, start_m: R, length_m: R) -> R {
    (shift_m - start_m).max(R::constant(0.0)).min(length_m)
}

/// The bead after a step over which the layup went from one reading to another.
#[inline(always)]
pub fn followed<R: Real>(bead: Pair<R>, before: Pair<R>, now: Pair<R>, weights: Bead<R::Scalar>) -> Pair<R> {
    let start = R::of(weights.start) * difference(before, bead);
    let end = R::of(weights.end) * difference(now, bead);
    advanced(bead, start + end)
}
