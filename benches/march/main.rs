//! Speed of the march on every backend: see benches/README.md.
//!
//! `cargo bench --bench march [-- MEMBERS]` prints the table; MEMBERS is the largest ensemble.

#[path = "../common/mod.rs"]
mod common;
mod counting;
mod peak;
#[path = "../common/single_threaded.rs"]
mod single_threaded;

use bondline::case::Bounds;
use bondline::ensemble::{Ensemble, Sampling};
use bondline::march::cpu::{Cpu, ScalarReference};
use bondline::march::{Precision, march_all};
use bondline::plan::Plan;
#[cfg(target_arch = "x86_64")]
use bondline_physics::{lanes::F64Lanes, member::Member};
use common::{BenchBackend, gpu_backends, shortest, simd_backends};
use counting::OperationCounts;
#[cfg(target_arch = "x86_64")]
use simdeez::engines::{avx2::Avx2, avx512::Avx512};
use single_threaded::SingleThreaded;
use std::hint::black_box;
use std::time::Instant;

/// Ensemble sizes: one prediction, a Jacobian of seven factors, and sweeps.
const MEMBERS: [usize; 5] = [1, 15, 100, 1000, 5000];

/// Largest ensemble for a workgroup per member on a software device: larger ones take minutes.
const MAX_WORKGROUP_MEMBERS: usize = 100;

/// Repetitions for an ensemble size; the backends alternate.
fn rounds(members: usize) -> usize {
    if members <= 100 { 5 } else { 2 }
}

fn main() {
    let most = std::env::args().skip(1).find_map(|arg| arg.parse().ok()).unwrap_or(usize::MAX);
    let case = common::case("lcat-2259");
    let plan = Plan::new(&case);
    let work = OperationCounts::of(&plan, &Ensemble::nominal(case.factors()));
    let (steps, cells) = (plan.steps(), plan.cells());
    println!("lcat-2259: {cells} cells, {steps} steps, {} factors\n", case.factors().len());
    println!("A cell-step is {work}.");
    let reacting = common::case("lcat-2259-pyrolysis");
    let reacting = OperationCounts::of(&Plan::new(&reacting), &Ensemble::nominal(reacting.factors()));
    println!("Where plies decompose, in lcat-2259-pyrolysis, it is {reacting}.\n");
    #[cfg(target_arch = "x86_64")]
    for (vectors, bytes) in [
        ("four members in f64 (AVX2)", Member::<F64Lanes<Avx2>, false>::BYTES_PER_CELL),
        ("eight members in f64 (AVX-512)", Member::<F64Lanes<Avx512>, false>::BYTES_PER_CELL),
    ] {
        println!("Columns of a cell of {vectors}: {bytes} bytes, {:.0} KiB in all.", (bytes * cells) as f64 / 1024.0);
    }
    println!();

    // The baseline is one member at a time in f64; lanes on one thread show the gain of SIMD alone.
    let mut backends = vec![BenchBackend::new("scalar", Some(1), SingleThreaded::new(ScalarReference(Precision::F64)))];
    let in_lanes = |precision| BenchBackend::new("lanes", Some(1), SingleThreaded::new(Cpu::new(precision)));
    backends.extend([Precision::F64, Precision::F32].map(in_lanes));
    backends.extend(simd_backends());
    backends.extend(gpu_backends(Some(false)));
    let first_workgroup = backends.len();
    backends.extend(gpu_backends(Some(true)));
    let peaks: Vec<Option<f64>> = backends.iter().map(peak).collect();
    println!("| march | multiplications and additions, Gflop/s |\n|---|---|");
    for (backend, peak) in backends.iter().zip(&peaks) {
        println!("| {} | {} |", backend.title(), peak.map_or("not measured".to_owned(), gigaflops));
    }

    println!("\n| members | march | s | ns a cell-step | million cell-steps/s | × scalar | of peak | longest |");
    println!("|---|---|---|---|---|---|---|---|");
    // Warm-up: compiles kernels and touches memory.
    for backend in &mut backends {
        time(backend, &plan, &sweep(case.factors(), 15));
    }
    for members in MEMBERS.into_iter().filter(|&members| members <= most) {
        let ensemble = sweep(case.factors(), members);
        let mut seconds = vec![vec![]; backends.len()];
        for _ in 0..rounds(members) {
            for (place, (backend, seconds)) in backends.iter_mut().zip(&mut seconds).enumerate() {
                if place >= first_workgroup && backend.threads.is_some() && members > MAX_WORKGROUP_MEMBERS {
                    continue;
                }
                seconds.push(time(backend, &plan, &ensemble));
            }
        }
        let (scalar_s, _) = shortest(&seconds[0]);
        let timed = backends.iter().zip(&seconds).zip(&peaks).filter(|((_, seconds), _)| !seconds.is_empty());
        for ((backend, seconds), peak) in timed {
            let (least_s, spread) = shortest(seconds);
            let rate = (cells * steps * members) as f64 / least_s;
            println!(
                "| {members} | {} | {least_s:.4} | {:.2} | {:.1} | {:.2} | {} | +{:.0} % |",
                backend.title(),
                1e9 / rate,
                1e-6 * rate,
                scalar_s / least_s,
                peak.map_or("–".to_owned(), |peak| format!("{:.1} %", 100.0 * rate * work.flops() / peak)),
                100.0 * spread,
            );
        }
    }
}

/// A sweep as in `bondline uncertainty`.
fn sweep(factors: &[bondline::case::Factor], members: usize) -> Ensemble {
    Ensemble::sample(factors, Bounds::Small, &Sampling { kind: Default::default(), seed: 1 }, members)
}

/// March an ensemble and drop its traces; returns the time, s.
fn time(backend: &mut BenchBackend, plan: &Plan, ensemble: &Ensemble) -> f64 {
    let began = Instant::now();
    let marched = march_all(&mut backend.march, plan, ensemble, &mut |traces| drop(black_box(traces)));
    marched.unwrap_or_else(|error| panic!("{}: {error}", backend.title()));
    began.elapsed().as_secs_f64()
}

/// Peak rate of the threads of a backend, flop/s; not measured for hardware devices.
fn peak(backend: &BenchBackend) -> Option<f64> {
    backend.threads.map(|threads| peak::flops_per_s(backend.precision, threads))
}

fn gigaflops(flops_per_s: f64) -> String {
    format!("{:.0}", 1e-9 * flops_per_s)
}
