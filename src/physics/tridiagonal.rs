//! Systems with one neighbour on each side, by elimination without pivoting (Thomas).
//!
//! ```text
//! │ d₀ u₀          │ │ x₀ │   │ r₀ │
//! │ l₁ d₁ u₁       │ │ x₁ │ = │ r₁ │
//! │    l₂ d₂ …     │ │ …  │   │ …  │
//! │       …  …     │
//! ```
//!
//! `l[0]` and the last `u` are not read. The march's matrices are diagonally dominant, so that no pivot
//! vanishes. Factored once, solved for two right-hand sides a step. Every cell waits for the one before it, so what
//! can be multiplied beforehand is: on a processor the wait is what a system costs. A step goes down and up row by row, each
//! with what else is to be done to its cell; where there is nothing else, the functions over all rows do.

use super::Real;

/// What is nearer zero than this is zero in f32, in K, Pa or W/m². Ahead of a front the unknowns fall off by powers until
/// they are subnormal, which some devices flush and others carry; a rounding that this turns, far below
/// anything that matters, grows with the front into a last bit. Two words of f32 tell a temperature to about as much; and where what is kept of it was
/// as small as 1e-25, more products of two such were subnormal, and took a processor a tenth of the time of all derivatives (benches/LOG.md). In f64 nothing is left of a number so small
/// when it meets a temperature.
pub(super) const LEAST: f64 = 1e-12;

/// The value, or zero where it is negligible.
#[inline(always)]
pub fn settled<R: Real>(value: R) -> R {
    value.settled(R::constant(LEAST))
}

/// Of a row on the way down the ratio `l/d'` and the reciprocal of the pivot `d'`, from the reciprocal pivot and the upper
/// coefficient of the row above.
#[inline(always)]
pub fn eliminated<R: Real>(lower: R, diagonal: R, before: R, upper_before: R) -> [R; 2] {
    let product = lower * upper_before;
    [lower * before, R::constant(1.0) / (diagonal - product * before)]
}

/// The right-hand side of a row on the way down, from that of the row above, to be settled where it is kept. The row under it may have it as it is:
/// whether it is negligible is then found while it is multiplied, where settling it first would be waited for in every row.
#[inline(always)]
pub fn descended<R: Real>(side: R, under: R, before: R) -> R {
    side.less_times(under, before, R::constant(LEAST))
}

/// The unknown of a row on the way up, from that of the row below, likewise.
#[inline(always)]
pub fn ascended<R: Real>(side: R, reciprocal: R, over: R, before: R) -> R {
    (side * reciprocal).less_times(over, before, R::constant(LEAST))
}

/// Turn the lower coefficients into ratios `l/d'`, the diagonal into reciprocals of the pivots `d'` and the upper
/// coefficients into ratios `u/d'`.
#[inline(always)]
pub fn factorise<R: Real>(lower: &mut [R], diagonal: &mut [R], upper: &mut [R]) {
    diagonal[0] = R::constant(1.0) / diagonal[0];
    for i in 1..diagonal.len() {
        let before = diagonal[i - 1];
        [lower[i], diagonal[i]] = eliminated(lower[i], diagonal[i], before, upper[i - 1]);
        upper[i - 1] = upper[i - 1] * before;
    }
}

/// Turn a right-hand side into the solution, from the ratios under the diagonal, reciprocal pivots, and the ratios over it.
#[inline(always)]
pub fn substitute<R: Real>(under: &[R], reciprocals: &[R], over: &[R], side: &mut [R]) {
    let last = side.len() - 1;
    // Held on to, as to write it and read it again takes longer than to work it out.
    let mut before = side[0];
    for i in 1..=last {
        before = descended(side[i], under[i], before);
        side[i] = settled(before);
    }
    before = settled(before) * reciprocals[last];
    side[last] = settled(before);
    for back in 1..=last {
        let i = last - back;
        before = ascended(side[i], reciprocals[i], over[i], before);
        side[i] = settled(before);
    }
}
