//! Temperature in two words.
//!
//! A step changes a temperature by less than the spacing of f32 about it once steps are short: increments
//! alone stagnate. The second word keeps what the first cannot hold, and the differences that drive heat
//! use both. Drivers undo error-free transforms by algebra unless they are stopped: `keep` stops them in
//! the shader, and is nothing here.

use super::Real;

/// A value as the sum of two words, the second below the last place of the first.
#[derive(Clone, Copy, Debug)]
pub struct Pair<R> {
    pub high: R,
    pub low: R,
}

impl<R: Real> Pair<R> {
    /// Both words of one lane.
    #[inline(always)]
    pub fn lane(self, lane: usize) -> f64 {
        self.high.lane(lane) + self.low.lane(lane)
    }
}

/// The value, out of reach of the compiler's algebra.
#[inline(always)]
pub fn keep<R: Real>(value: R) -> R {
    value
}

/// `a + b` and what rounding took from it (Knuth 1969, TwoSum).
#[inline(always)]
pub fn two_sum<R: Real>(a: R, b: R) -> Pair<R> {
    let sum = keep(a + b);
    let b_there = keep(sum - a);
    let a_there = keep(sum - b_there);
    let b_lost = keep(b - b_there);
    let a_lost = keep(a - a_there);
    Pair { high: sum, low: a_lost + b_lost }
}

/// The pair after an increment. In f64 the first word keeps all that an answer shows, and the second stays as it is.
#[inline(always)]
pub fn advanced<R: Real>(pair: Pair<R>, increment: R) -> Pair<R> {
    if R::DIGITS > 23 {
        return Pair { high: pair.high + increment, low: pair.low };
    }
    two_sum(pair.high, pair.low + keep(increment))
}

/// The pair with so much added for a while, which need not be kept word by word.
#[inline(always)]
pub fn raised<R: Real>(pair: Pair<R>, by: R) -> Pair<R> {
    if R::DIGITS > 23 {
        return Pair { high: pair.high + by, low: pair.low };
    }
    Pair { high: pair.high, low: pair.low + by }
}

/// `a − b`, rounded once it is small. In f64 the second words hold nothing.
#[inline(always)]
pub fn difference<R: Real>(a: Pair<R>, b: Pair<R>) -> R {
    if R::DIGITS > 23 {
        return a.high - b.high;
    }
    (a.high - b.high) + (a.low - b.low)
}
