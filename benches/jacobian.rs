//! Cost of a Jacobian relative to one march of the nominal member: see benches/README.md.
//!
//! `cargo bench --bench jacobian [-- CASE]...` prints the table. The CPU uses one thread, a device all it has.

#[expect(dead_code, reason = "this bench runs on one thread")]
mod common;
#[path = "common/single_threaded.rs"]
mod single_threaded;

use bondline::adapt::adapt;
use bondline::ensemble::Ensemble;
use bondline::march::cpu::Cpu;
use bondline::march::richardson::RichardsonMarch;
use bondline::march::{March, Precision};
use bondline::study::sensitivity::difference_step;
use common::{BenchBackend, gpu_backends, shortest};
use single_threaded::SingleThreaded;
use std::hint::black_box;
use std::time::Instant;

const CASES: [&str; 2] = ["lcat-2259", "lcat-2259-pyrolysis"];
/// Repetitions; the measurements alternate.
const ROUNDS: usize = 30;

fn main() {
    let requested: Vec<String> = std::env::args().skip(1).filter(|arg| !arg.starts_with("--")).collect();
    let cases = if requested.is_empty() { CASES.map(str::to_owned).to_vec() } else { requested };
    println!("| case | march | factors | a member, ms | derivatives, ms | marches | differences, ms | marches |");
    println!("|---|---|---|---|---|---|---|---|");
    for id in cases {
        let case = common::case(&id);
        let plan = adapt(&case).unwrap_or_else(|error| panic!("{error}"));
        let nominal: Vec<f64> = case.factors().iter().map(|factor| factor.nominal).collect();
        let factors: Vec<usize> = (0..nominal.len()).collect();
        let point = Ensemble::from_values(nominal.len(), nominal.clone());
        let processor = |precision| BenchBackend::new("processor", Some(1), SingleThreaded::new(Cpu::new(precision)));
        let processors = [Precision::F64, Precision::F32].map(processor).into_iter();
        for backend in processors.chain(gpu_backends(Some(false))).chain(gpu_backends(Some(true))) {
            let title = backend.title();
            let stencil = stencil(&nominal, difference_step(backend.precision));
            let mut both = RichardsonMarch::new(Box::new(backend.march));
            let mut seconds = [vec![], vec![], vec![]];
            // The first round is warm-up: it compiles kernels and touches memory.
            for round in 0..=ROUNDS {
                let mut turn = |which: usize, work: &mut dyn FnMut() -> bool| {
                    let began = Instant::now();
                    let done = work();
                    if round > 0 && done {
                        seconds[which].push(began.elapsed().as_secs_f64());
                    }
                };
                let march = |both: &mut RichardsonMarch, ensemble: &Ensemble| {
                    let traces = both.march(&plan, ensemble, 0..ensemble.len());
                    black_box(traces.unwrap_or_else(|error| panic!("{error}")));
                    true
                };
                turn(0, &mut || march(&mut both, &point));
                turn(1, &mut || {
                    let tangents = both.tangents(&plan, &point, &factors);
                    black_box(tangents.unwrap_or_else(|error| panic!("{error}"))).is_some()
                });
                turn(2, &mut || march(&mut both, &stencil));
            }
            let [member, tangents, differences] = seconds.map(|seconds| shortest(&seconds).0);
            // A device whose threads have too little memory has no derivatives.
            let known = |value: f64| if value.is_finite() { format!("{value:.2}") } else { "none".to_owned() };
            println!(
                "| {id} | {} | {} | {:.2} | {} | {} | {:.2} | {:.2} |",
                title,
                factors.len(),
                1e3 * member,
                known(1e3 * tangents),
                known(tangents / member),
                1e3 * differences,
                differences / member
            );
        }
    }
}

/// The point and two neighbours a factor, for central differences.
fn stencil(point: &[f64], step: f64) -> Ensemble {
    let mut rows = point.to_vec();
    for factor in 0..point.len() {
        for perturbation in [1.0 - step, 1.0 + step] {
            rows.extend_from_slice(point);
            let last = rows.len() - point.len() + factor;
            rows[last] *= perturbation;
        }
    }
    Ensemble::from_values(point.len(), rows)
}
