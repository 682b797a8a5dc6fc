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
//! vanishes. Factored once, solved for two right-hand sides a step.

use super::Real;

/// What is nearer zero than this is zero, in K or W/m². Ahead of a front the unknowns fall off by powers until
/// they are subnormal, which some devices flush and others carry; a rounding that this turns, far below
/// anything that matters, grows with the front into a last bit.
const LEAST: f64 = 1e-25;

/// The value, or zero where it is negligible.
#[inline(always)]
pub fn settled<R: Real>(value: R) -> R {
    value.settled(R::constant(LEAST))
}

/// Turn the lower coefficients into ratios `l/d'` and the diagonal into reciprocals of the pivots `d'`.
#[inline(always)]
pub fn factorise<R: Real>(lower: &mut [R], diagonal: &mut [R], upper: &[R]) {
    diagonal[0] = R::constant(1.0) / diagonal[0];
    for i in 1..diagonal.len() {
        let ratio = lower[i] * diagonal[i - 1];
        lower[i] = ratio;
        diagonal[i] = R::constant(1.0) / (diagonal[i] - ratio * upper[i - 1]);
    }
}

/// Turn a right-hand side into the solution, from ratios and reciprocal pivots.
#[inline(always)]
pub fn substitute<R: Real>(ratios: &[R], reciprocals: &[R], upper: &[R], side: &mut [R]) {
    let last = side.len() - 1;
    for i in 1..=last {
        side[i] = settled(side[i] - ratios[i] * side[i - 1]);
    }
    side[last] = settled(side[last] * reciprocals[last]);
    for back in 1..=last {
        let i = last - back;
        side[i] = settled((side[i] - upper[i] * side[i + 1]) * reciprocals[i]);
    }
}
