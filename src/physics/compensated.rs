//! Double-word arithmetic for temperatures and pressures.
//!
//! At short steps a temperature changes by less than the spacing of f32, and increments would be lost. The second word
//! holds the remainder, and temperature differences use both words. Compilers may simplify error-free transformations
//! algebraically; `opaque` prevents that in the shader and does nothing here.

use super::Real;
use super::double_word::DoubleWord;

/// The value, hidden from algebraic simplification in the shader.
#[inline(always)]
pub fn opaque<R: Real>(value: R) -> R {
    value
}

/// `a + b` and its rounding error (Knuth 1969, TwoSum).
#[inline(always)]
pub fn two_sum<R: Real>(a: R, b: R) -> [R; 2] {
    let sum = opaque(a + b);
    let b_there = opaque(sum - a);
    let a_there = opaque(sum - b_there);
    let b_lost = opaque(b - b_there);
    let a_lost = opaque(a - a_there);
    [sum, a_lost + b_lost]
}

/// The pair plus an increment. In f64 the first word alone is precise enough.
#[inline(always)]
pub fn add_compensated<R: Real>(pair: DoubleWord<R>, increment: R) -> DoubleWord<R> {
    if R::MANTISSA_BITS > 23 {
        return DoubleWord::single(pair.high + increment);
    }
    let [high, low] = two_sum(pair.high, pair.low() + opaque(increment));
    DoubleWord::new(high, low)
}

/// The pair plus a temporary increment, without renormalization.
#[inline(always)]
pub fn add_unnormalized<R: Real>(pair: DoubleWord<R>, by: R) -> DoubleWord<R> {
    if R::MANTISSA_BITS > 23 {
        return DoubleWord::single(pair.high + by);
    }
    DoubleWord::new(pair.high, pair.low() + by)
}

/// `a − b`. In f64 the second words are zero.
#[inline(always)]
pub fn difference<R: Real>(a: DoubleWord<R>, b: DoubleWord<R>) -> R {
    if R::MANTISSA_BITS > 23 {
        return a.high - b.high;
    }
    (a.high - b.high) + (a.low() - b.low())
}
