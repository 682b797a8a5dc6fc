//! Time of an estimate on every backend: see benches/README.md.
//!
//! `cargo bench --bench fit` prints the table.

mod common;

use bondline::ensemble::Ensemble;
use bondline::march::March;
use bondline::plan::Plan;
use bondline::study::estimate::{SearchOptions, estimate};
use bondline::work_log::NoLog;
use common::{BenchBackend, gpu_backends, shortest, simd_backends};
use std::hint::black_box;
use std::time::Instant;

const CASES: [&str; 3] = ["twin-tc3", "kaowool-tc", "lcat-2259"];
/// Repetitions; the backends alternate.
const ROUNDS: usize = 2;

fn main() {
    println!("| case | march | Jacobian, s | estimate, s | iterations | members | outside the march | longest |");
    println!("|---|---|---|---|---|---|---|---|");
    for id in CASES {
        let case = common::case(id);
        let plan = Plan::new(&case);
        let mut backends: Vec<BenchBackend> = simd_backends().into_iter().chain(gpu_backends(None)).collect();
        // A Jacobian by finite differences is one ensemble: the point and two neighbours a factor.
        let nominal: Vec<f64> = case.factors().iter().map(|factor| factor.nominal).collect();
        let stencil = Ensemble::from_values(nominal.len(), nominal.repeat(1 + 2 * case.estimate().factors.len()));
        let mut jacobians = vec![vec![]; backends.len()];
        let mut estimates = vec![vec![]; backends.len()];
        let mut rows = vec![(0, 0, 0.0); backends.len()];
        for round in 0..=ROUNDS {
            for (i, backend) in backends.iter_mut().enumerate() {
                let began = Instant::now();
                let traces = backend.march.march(&plan, &stencil, 0..stencil.len());
                drop(black_box(traces.unwrap_or_else(|error| panic!("{error}"))));
                let jacobian_s = began.elapsed().as_secs_f64();

                let (began, before_s) = (Instant::now(), backend.march.seconds);
                let search = SearchOptions::for_precision(backend.precision);
                let found = estimate(&[(&case, &plan)], &mut backend.march, &search, &mut NoLog);
                let found = found.unwrap_or_else(|error| panic!("{id}: {error}"));
                let estimate_s = began.elapsed().as_secs_f64();
                // The first round is warm-up: it compiles kernels and touches memory.
                if round > 0 {
                    jacobians[i].push(jacobian_s);
                    estimates[i].push(estimate_s);
                    let marching_s = backend.march.seconds - before_s;
                    rows[i] = (found.iterations.len() - 1, found.marches, 1.0 - marching_s / estimate_s);
                }
            }
        }
        for (i, backend) in backends.iter().enumerate() {
            let (jacobian_s, _) = shortest(&jacobians[i]);
            let (estimate_s, spread) = shortest(&estimates[i]);
            let (iterations, members, outside) = rows[i];
            println!(
                "| {id} | {} | {jacobian_s:.4} | {estimate_s:.3} | {iterations} | {members} | {:.1} % | +{:.0} % |",
                backend.title(),
                100.0 * outside,
                100.0 * spread
            );
        }
    }
}
