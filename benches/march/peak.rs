//! Peak rate of multiplications and additions of the CPU, to compare the march with.

use bondline::march::Precision;
use simdeez::engines::scalar::Scalar;
use simdeez::prelude::*;
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
        let flops: usize = pool.broadcast(|_| widest_chains::<CHAINS>(precision)).iter().sum();
        flops as f64 / began.elapsed().as_secs_f64()
    };
    (0..ROUNDS).map(|_| turn()).fold(0.0, f64::max)
}

/// [`chains`] with the widest vectors of the processor.
fn widest_chains<const N: usize>(precision: Precision) -> usize {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512dq")
        {
            return chains::<simdeez::engines::avx512::Avx512, N>(precision);
        }
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            return chains::<simdeez::engines::avx2::Avx2, N>(precision);
        }
    }
    #[cfg(target_arch = "aarch64")]
    return chains::<simdeez::engines::neon::Neon, N>(precision);
    #[cfg(not(target_arch = "aarch64"))]
    chains::<Scalar, N>(precision)
}

/// Multiply and add to `N` vectors in turn; returns the number of multiplications and additions.
fn chains<S: Simd, const N: usize>(precision: Precision) -> usize {
    S::invoke(
        #[inline(always)]
        || match precision {
            Precision::F64 => run::<S::Vf64, N>(0.999, 1e-3, |chain| chain as f64),
            Precision::F32 => run::<S::Vf32, N>(0.999, 1e-3, |chain| chain as f32),
        },
    )
}

/// Different start values and a used result keep the compiler from removing chains.
#[inline(always)]
fn run<V: SimdFloat, const N: usize>(factor: V::Scalar, term: V::Scalar, start: impl Fn(usize) -> V::Scalar) -> usize {
    let (factor, term) = (V::set1(black_box(factor)), V::set1(black_box(term)));
    let mut chains: [V; N] = from_fn(|chain| V::set1(black_box(start(chain))));
    for _ in 0..TURNS {
        for chain in &mut chains {
            *chain = *chain * factor + term;
        }
    }
    black_box(chains);
    2 * TURNS * N * V::WIDTH
}
