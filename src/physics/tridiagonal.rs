//! Tridiagonal systems by elimination without pivoting (Thomas algorithm).
//!
//! ```text
//! │ d₀ u₀          │ │ x₀ │   │ r₀ │
//! │ l₁ d₁ u₁       │ │ x₁ │ = │ r₁ │
//! │    l₂ d₂ …     │ │ …  │   │ …  │
//! │       …  …     │
//! ```
//!
//! `l[0]` and the last `u` are not read. The march's matrices are diagonally dominant, so no pivot vanishes. They are
//! factored once and solved for two right-hand sides a step. Latency dominates, as every row waits for the one before,
//! so products off the critical path are formed in advance. The march eliminates row by row, interleaved with the other
//! work of a cell; [`factorise`] and [`substitute`] go over all rows.

use super::Real;

/// Magnitudes below this are flushed to zero in f32, in K, Pa or W/m². Ahead of a front the unknowns fall by powers
/// until they are subnormal, which some devices flush and others do not; the front would amplify the difference to a
/// last bit. Two words of f32 resolve a temperature to about this value. With a threshold of 1e-25, products of two
/// such numbers were subnormal and took a tenth of the time of all derivatives (benches/LOG.md). In f64, adding so
/// small a number to a temperature has no effect.
pub(super) const FLUSH_THRESHOLD: f64 = 1e-12;

/// The value, or zero if its magnitude is negligible.
#[inline(always)]
pub fn flush_tiny<R: Real>(value: R) -> R {
    value.flush_tiny(R::from_f64(FLUSH_THRESHOLD))
}

/// Eliminates a row: the ratio `l/d'` and the reciprocal pivot `1/d'`, from the reciprocal pivot and the upper
/// coefficient of the row above.
#[inline(always)]
pub fn eliminate_row<R: Real>(lower: R, diagonal: R, before: R, upper_before: R) -> [R; 2] {
    let product = lower * upper_before;
    [lower * before, R::from_f64(1.0) / (diagonal - product * before)]
}

/// Eliminates a row of conduction, in f32. The diagonal is that of the eliminated row without the slope of the flux
/// to the next cell, which is negated in `slope`; both are sums of positive numbers. Also returns the share of the
/// diagonal in the pivot, by which the next row's slope to this one counts.
///
/// In a foil the slopes are a million times the heat capacity over the step, which their difference would lose.
#[inline(always)]
pub fn eliminate_conducting_row<R: Real>(lower: R, diagonal: R, slope: R, before: R) -> [R; 3] {
    let reciprocal = R::from_f64(1.0) / (diagonal - slope);
    [lower * before, reciprocal, diagonal * reciprocal]
}

/// Forward elimination of a row's right-hand side; flush it where it is stored. The next row takes it as it is: its
/// test for negligible values runs beside the product, where flushing first would lengthen the critical path of every
/// row.
#[inline(always)]
pub fn forward_eliminate<R: Real>(rhs: R, lower_ratio: R, before: R) -> R {
    rhs.sub_mul_flushed(lower_ratio, before, R::from_f64(FLUSH_THRESHOLD))
}

/// Back substitution: the unknown of a row from that of the row below; flush it where it is stored.
#[inline(always)]
pub fn back_substitute<R: Real>(rhs: R, reciprocal: R, upper_ratio: R, before: R) -> R {
    (rhs * reciprocal).sub_mul_flushed(upper_ratio, before, R::from_f64(FLUSH_THRESHOLD))
}

/// Factors a matrix in place: lower coefficients become ratios `l/d'`, the diagonal reciprocal pivots `1/d'`, upper
/// coefficients ratios `u/d'`.
#[inline(always)]
pub fn factorise<R: Real>(lower: &mut [R], diagonal: &mut [R], upper: &mut [R]) {
    diagonal[0] = R::from_f64(1.0) / diagonal[0];
    for i in 1..diagonal.len() {
        let before = diagonal[i - 1];
        [lower[i], diagonal[i]] = eliminate_row(lower[i], diagonal[i], before, upper[i - 1]);
        upper[i - 1] = upper[i - 1] * before;
    }
}

/// Solves for a right-hand side in place, from lower ratios, reciprocal pivots and upper ratios.
#[inline(always)]
pub fn substitute<R: Real>(lower_ratio: &[R], reciprocals: &[R], upper_ratio: &[R], rhs: &mut [R]) {
    let last = rhs.len() - 1;
    // In a register: storing and reloading it would take longer than the arithmetic.
    let mut before = rhs[0];
    for i in 1..=last {
        before = forward_eliminate(rhs[i], lower_ratio[i], before);
        rhs[i] = flush_tiny(before);
    }
    before = flush_tiny(before) * reciprocals[last];
    rhs[last] = flush_tiny(before);
    for back in 1..=last {
        let i = last - back;
        before = back_substitute(rhs[i], reciprocals[i], upper_ratio[i], before);
        rhs[i] = flush_tiny(before);
    }
}
