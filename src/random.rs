//! Counter-based random numbers (ChaCha8). A seed and a stream number determine every draw, and streams share no state,
//! so results do not depend on evaluation order or on the number of threads.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use statrs::distribution::{ContinuousCDF, Normal};

/// One stream of random numbers.
pub(crate) struct RandomStream(ChaCha8Rng);

impl RandomStream {
    pub(crate) fn new(seed: u64, stream: u64) -> Self {
        let mut numbers = ChaCha8Rng::seed_from_u64(seed);
        numbers.set_stream(stream);
        Self(numbers)
    }

    /// 64 bits.
    pub(crate) fn next_u64(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Uniform on (0, 1): the midpoint of one of 2⁵³ equal intervals. The ends are excluded because inverse
    /// distribution functions are infinite there.
    pub(crate) fn uniform(&mut self) -> f64 {
        ((self.next_u64() >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    /// Standard normal.
    pub(crate) fn normal(&mut self) -> f64 {
        Normal::standard().inverse_cdf(self.uniform())
    }

    /// Uniform index in `0..count`.
    pub(crate) fn uniform_index(&mut self, count: usize) -> usize {
        // Rounding can raise the product to `count`.
        ((self.uniform() * count as f64) as usize).min(count - 1)
    }
}
/// Mixes the bits of a word: the finaliser of SplitMix64 (Steele, Lea & Flood, OOPSLA 2014).
pub(crate) fn splitmix64(word: u64) -> u64 {
    let word = word.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    word ^ (word >> 31)
}
