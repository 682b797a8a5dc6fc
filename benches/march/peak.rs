//! How fast the processor multiplies and adds, and nothing else: what a march is measured against.

use bondline::physics::Real;
use std::hint::black_box;
use std::time::Instant;

/// Turns of a chain between two readings of the clock: some tens of milliseconds.
const TURNS: usize = 4_000_000;

/// Multiplications and additions a second, in lanes of `R`, on so many threads at once, with the widest vectors that
/// the processor has.
///
/// Each is an instruction of its own, as in the march, which may not fuse them: both twins must round alike. The
/// number of independent chains that hides the latency is the machine's affair, so several are tried and the best
/// counts.
pub(crate) fn flops_per_s<R: Real>(threads: usize) -> f64 {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap_or_else(|error| panic!("{error}"));
    let rates = [rate::<R, 4>(&pool), rate::<R, 6>(&pool), rate::<R, 8>(&pool), rate::<R, 12>(&pool)];
    rates.into_iter().fold(0.0, f64::max)
}

fn rate<R: Real, const CHAINS: usize>(pool: &rayon::ThreadPool) -> f64 {
    let turn = || {
        let began = Instant::now();
        pool.broadcast(|_| pulp::Arch::new().dispatch(|| multiply_and_add::<R, CHAINS>()));
        began.elapsed().as_secs_f64()
    };
    let seconds = (0..5).map(|_| turn()).fold(f64::INFINITY, f64::min);
    (2 * TURNS * CHAINS * R::LANES * pool.current_num_threads()) as f64 / seconds
}

#[inline(always)]
fn multiply_and_add<R: Real, const CHAINS: usize>() {
    let (factor, term) = (R::constant(black_box(0.999)), R::constant(black_box(1e-3)));
    let mut chains = [R::constant(black_box(1.0)); CHAINS];
    for _ in 0..TURNS {
        for chain in &mut chains {
            *chain = *chain * factor + term;
        }
    }
    black_box(chains.map(|chain| chain.lane(0)));
}
