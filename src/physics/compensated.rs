//! Double-word arithmetic for temperatures and pressures.
//!
//! At short steps a temperature changes by less than the spacing of f32, and increments would be lost. The second word
//! holds the remainder, and temperature differences use both words. Compilers may simplify error-free transformations
//! algebraically; `opaque` prevents that in the shader and does nothing here.

use super::Real;

/// Unevaluated sum of two words, the second below the last place of the first.
#[derive(Clone, Copy, Debug)]
pub struct Pair<R> {
    pub high: R,
    pub low: R,
}

impl<R: Real> Pair<R> {
    /// Sum of both words in one lane.
    #[inline(always)]
    pub fn lane(self, lane: usize) -> f64 {
        self.high.lane(lane) + self.low.lane(lane)
    }
}

/// The value, hidden from algebraic simplification in the shader.
#[inline(always)]
pub fn keep<R: Real>(value: R) -> R {
    value
}

/// `a + b` and its rounding error (Knuth 1969, TwoSum).
#[inline(always)]
pub fn two_sum<R: Real>(a: R, b: R) -> Pair<R> {
    let sum = keep(a + b);
    let b_there = keep(sum - a);
    let a_there = keep(sum - b_there);
    let b_lost = keep(b - b_there);
    let a_lost = keep(a - a_there);
    Pair { high: sum, low: a_lost + b_lost }
}

/// The pair plus an increment. In f64 the first word alone is precise enough.
#[inline(always)]
pub fn advanced<R: Real>(pair: Pair<R>, increment: R) -> Pair<R> {
    if R::DIGITS > 23 {
        return Pair { high: pair.high + increment, low: pair.low };
    }
    two_sum(pair.high, pair.low + keep(increment))
}

/// The pair plus a temporary increment, without renormalization.
#[inline(always)]
pub fn raised<R: Real>(pair: Pair<R>, by: R) -> Pair<R> {
    if R::DIGITS > 23 {
        return Pair { high: pair.high + by, low: pair.low };
    }
    Pair { high: pair.high, low: pair.low + by }
}

/// `a − b`. In f64 the second words are zero.
#[inline(always)]
pub fn difference<R: Real>(a: Pair<R>, b: Pair<R>) -> R {
    if R::DIGITS > 23 {
        return a.high - b.high;
    }
    (a.high - b.high) + (a.low - b.low)
}
