//! Double-word arithmetic for temperatures and pressures.
//!
//! At short steps a temperature changes by less than the spacing of f32, and increments would be lost. The second word
//! holds the remainder, and temperature differences use both words. Compilers may simplify error-free transformations
//! algebraically; `opaque` prevents that in the shader and does nothing here.

use super::Real;

/// Unevaluated sum of two words, the second below the last place of the first.
#[derive(Clone, Copy, Debug)]
pub struct DoubleWord<R> {
    pub high: R,
    pub low: R,
}

impl<R: Real> DoubleWord<R> {
    /// Sum of both words in one lane.
    #[inline(always)]
    pub fn lane(self, lane: usize) -> f64 {
        self.high.lane(lane) + self.low.lane(lane)
    }
}

/// The value, hidden from algebraic simplification in the shader.
#[inline(always)]
pub fn opaque<R: Real>(value: R) -> R {
    value
}

/// `a + b` and its rounding error (Knuth 1969, TwoSum).
#[inline(always)]
pub fn two_sum<R: Real>(a: R, b: R) -> DoubleWord<R> {
    let sum = opaque(a + b);
    let b_there = opaque(sum - a);
    let a_there = opaque(sum - b_there);
    let b_lost = opaque(b - b_there);
    let a_lost = opaque(a - a_there);
    DoubleWord { high: sum, low: a_lost + b_lost }
}

/// The pair plus an increment. In f64 the first word alone is precise enough.
#[inline(always)]
pub fn add_compensated<R: Real>(pair: DoubleWord<R>, increment: R) -> DoubleWord<R> {
    if R::MANTISSA_BITS > 23 {
        return DoubleWord { high: pair.high + increment, low: pair.low };
    }
    two_sum(pair.high, pair.low + opaque(increment))
}

/// The pair plus a temporary increment, without renormalization.
#[inline(always)]
pub fn add_unnormalized<R: Real>(pair: DoubleWord<R>, by: R) -> DoubleWord<R> {
    if R::MANTISSA_BITS > 23 {
        return DoubleWord { high: pair.high + by, low: pair.low };
    }
    DoubleWord { high: pair.high, low: pair.low + by }
}

/// `a − b`. In f64 the second words are zero.
#[inline(always)]
pub fn difference<R: Real>(a: DoubleWord<R>, b: DoubleWord<R>) -> R {
    if R::MANTISSA_BITS > 23 {
        return a.high - b.high;
    }
    (a.high - b.high) + (a.low - b.low)
}
