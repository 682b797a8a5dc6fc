//! Peak rate of multiplications and additions of the CPU, to compare the march with.

use bondline::march::Precision;
use pulp::{Simd, WithSimd};
use std::array::from_fn;
use std::hint::black_box;
use std::time::Instant;

/// Iterations of a chain between two clock readings: some tens of milliseconds.
const TURNS: usize = 4_000_000;
const ROUNDS: usize = 5;

/// Multiplications and additions per second on `threads` threads, with the widest vectors.
///
/// Each is a separate instruction, as in the march, where fusing would break the bit-identity of the Rust and WGSL
/// twins. The number of independent chains that hides the latency depends on the machine, so several are tried and the
/// best counts.
pub(crate) fn flops_per_s(precision: Precision, threads: usize) -> f64 {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap_or_else(|error| panic!("{error}"));
    let rates = [rate::<4>(&pool, precision), rate::<8>(&pool, precision), rate::<12>(&pool, precision)];
    rates.into_iter().fold(0.0, f64::max)
}

fn rate<const CHAINS: usize>(pool: &rayon::ThreadPool, precision: Precision) -> f64 {
    let turn = || {
        let began = Instant::now();
        let flops: usize = pool.broadcast(|_| pulp::Arch::new().dispatch(Chains::<CHAINS>(precision))).iter().sum();
        flops as f64 / began.elapsed().as_secs_f64()
    };
    (0..ROUNDS).map(|_| turn()).fold(0.0, f64::max)
}

/// `N` vectors, each multiplied and added to in turn.
struct Chains<const N: usize>(Precision);

impl<const N: usize> WithSimd for Chains<N> {
    /// Number of multiplications and additions.
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> usize {
        // Different start values and a used result keep the compiler from removing chains.
        match self.0 {
            Precision::F64 => {
                let (factor, term) = (simd.splat_f64s(black_box(0.999)), simd.splat_f64s(black_box(1e-3)));
                let mut chains: [S::f64s; N] = from_fn(|chain| simd.splat_f64s(black_box(chain as f64)));
                for _ in 0..TURNS {
                    for chain in &mut chains {
                        *chain = simd.add_f64s(simd.mul_f64s(*chain, factor), term);
                    }
                }
                black_box(chains);
                2 * TURNS * N * S::F64_LANES
            }
            Precision::F32 => {
                let (factor, term) = (simd.splat_f32s(black_box(0.999)), simd.splat_f32s(black_box(1e-3)));
                let mut chains: [S::f32s; N] = from_fn(|chain| simd.splat_f32s(black_box(chain as f32)));
                for _ in 0..TURNS {
                    for chain in &mut chains {
                        *chain = simd.add_f32s(simd.mul_f32s(*chain, factor), term);
                    }
                }
                black_box(chains);
                2 * TURNS * N * S::F32_LANES
            }
        }
    }
}
