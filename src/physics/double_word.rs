//! A number in two words, of which f64 needs only the first: see `compensated`.

use super::Real;

/// Storage of the second word of a [`DoubleWord`].
pub trait SecondWord<T>: Copy + Send + Sync {
    fn of(word: T) -> Self;
    /// The word, or `zero` where it is omitted.
    fn word(self, zero: T) -> T;
}

/// The second word in f32, which is stored.
#[derive(Clone, Copy)]
pub struct Stored<T>(T);

impl<T: Copy + Send + Sync> SecondWord<T> for Stored<T> {
    #[inline(always)]
    fn of(word: T) -> Self {
        Self(word)
    }
    #[inline(always)]
    fn word(self, _zero: T) -> T {
        self.0
    }
}

/// The second word in f64, which would be zero: it is not read and written at each step (time ratio of a march 0.94).
#[derive(Clone, Copy)]
pub struct Omitted;

impl<T> SecondWord<T> for Omitted {
    #[inline(always)]
    fn of(_word: T) -> Self {
        Self
    }
    #[inline(always)]
    fn word(self, zero: T) -> T {
        zero
    }
}

/// Unevaluated sum of two words, the second below the last place of the first.
#[derive(Clone, Copy)]
pub struct DoubleWord<R: Real> {
    pub high: R,
    second_word: R::SecondWord<R>,
}

impl<R: Real> DoubleWord<R> {
    /// The number with these words; in f64 the second must be zero.
    #[inline(always)]
    pub fn new(high: R, low: R) -> Self {
        Self { high, second_word: R::SecondWord::of(low) }
    }

    /// The number with this first word and a second word of zero.
    #[inline(always)]
    pub fn single(high: R) -> Self {
        Self::new(high, R::from_f64(0.0))
    }

    /// The second word.
    #[inline(always)]
    pub fn low(self) -> R {
        self.second_word.word(R::from_f64(0.0))
    }

    /// Sum of both words in one lane.
    #[inline(always)]
    pub fn lane(self, lane: usize) -> f64 {
        self.high.lane(lane) + self.low().lane(lane)
    }
}
