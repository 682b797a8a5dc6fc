//! Numbers drawn by chance, counter-based: a seed and the number of a stream tell all that comes out of it, and nothing is
//! remembered between streams. What draws from a stream of its own is the same in any order and on any number of threads.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use statrs::distribution::{ContinuousCDF, Normal};

/// The numbers of one stream.
pub(crate) struct Numbers(ChaCha8Rng);

impl Numbers {
    pub(crate) fn of(seed: u64, stream: u64) -> Self {
        let mut numbers = ChaCha8Rng::seed_from_u64(seed);
        numbers.set_stream(stream);
        Self(numbers)
    }

    /// 64 bits.
    pub(crate) fn word(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// The middle of one of 2⁵³ equal strata: never nought or one, where the inverse of a distribution is not finite.
    pub(crate) fn unit(&mut self) -> f64 {
        ((self.word() >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    /// Of mean zero and deviation one.
    pub(crate) fn normal(&mut self) -> f64 {
        Normal::standard().inverse_cdf(self.unit())
    }

    /// One of `0..count`, each as likely.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        // Rounding may carry a unit just short of one to the count itself.
        ((self.unit() * count as f64) as usize).min(count - 1)
    }
}
