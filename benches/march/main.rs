//! Speed of the march on every backend: see benches/README.md.
//!
//! `cargo bench --bench march [-- MEMBERS]` prints the table; MEMBERS is the largest ensemble.

#[path = "../common/alone.rs"]
mod alone;
#[path = "../common/mod.rs"]
mod common;
mod counted;
mod peak;

use alone::OnOneThread;
use bondline::case::Bounds;
use bondline::ensemble::{Ensemble, Sampling};
use bondline::march::cpu::{Cpu, Reference};
use bondline::march::{Precision, march_all};
use bondline::plan::Plan;
use common::{Carrier, devices, lanes, shortest};
use counted::Work;
use std::hint::black_box;
use std::time::Instant;

/// Ensemble sizes: one prediction, a Jacobian of seven factors, and sweeps.
const MEMBERS: [usize; 5] = [1, 15, 100, 1000, 5000];

/// Largest ensemble for a workgroup per member on a software device: larger ones take minutes.
const FEW: usize = 100;

/// Repetitions for an ensemble size; the backends alternate.
fn rounds(members: usize) -> usize {
    if members <= 100 { 5 } else { 2 }
}

fn main() {
    let most = std::env::args().skip(1).find_map(|arg| arg.parse().ok()).unwrap_or(usize::MAX);
    let case = common::case("lcat-2259");
    let plan = Plan::new(&case);
    let work = Work::of(&plan, &Ensemble::nominal(case.factors()));
    let (steps, cells) = (plan.steps(), plan.cells());
    println!("lcat-2259: {cells} cells, {steps} steps, {} factors\n", case.factors().len());
    println!("A cell-step is {work}.");
    let reacting = common::case("lcat-2259-pyrolysis");
    let reacting = Work::of(&Plan::new(&reacting), &Ensemble::nominal(reacting.factors()));
    println!("Where plies decompose, in lcat-2259-pyrolysis, it is {reacting}.\n");

    // The baseline is one member at a time in f64; lanes on one thread show the gain of SIMD alone.
    let mut carriers = vec![Carrier::new("scalar", Some(1), OnOneThread::new(Reference(Precision::F64)))];
    let in_lanes = |precision| Carrier::new("lanes", Some(1), OnOneThread::new(Cpu::new(precision)));
    carriers.extend([Precision::F64, Precision::F32].map(in_lanes));
    carriers.extend(lanes());
    carriers.extend(devices(Some(false)));
    let alone = carriers.len();
    carriers.extend(devices(Some(true)));
    let peaks: Vec<Option<f64>> = carriers.iter().map(peak).collect();
    println!("| march | multiplications and additions, Gflop/s |\n|---|---|");
    for (carrier, peak) in carriers.iter().zip(&peaks) {
        println!("| {} | {} |", carrier.title(), peak.map_or("not measured".to_owned(), gigaflops));
    }

    println!("\n| members | march | s | ns a cell-step | million cell-steps/s | × scalar | of peak | longest |");
    println!("|---|---|---|---|---|---|---|---|");
    // Warm-up: compiles kernels and touches memory.
    for carrier in &mut carriers {
        time(carrier, &plan, &sweep(case.factors(), 15));
    }
    for members in MEMBERS.into_iter().filter(|&members| members <= most) {
        let ensemble = sweep(case.factors(), members);
        let mut seconds = vec![vec![]; carriers.len()];
        for _ in 0..rounds(members) {
            for (place, (carrier, seconds)) in carriers.iter_mut().zip(&mut seconds).enumerate() {
                if place >= alone && carrier.threads.is_some() && members > FEW {
                    continue;
                }
                seconds.push(time(carrier, &plan, &ensemble));
            }
        }
        let (scalar_s, _) = shortest(&seconds[0]);
        let timed = carriers.iter().zip(&seconds).zip(&peaks).filter(|((_, seconds), _)| !seconds.is_empty());
        for ((carrier, seconds), peak) in timed {
            let (least_s, spread) = shortest(seconds);
            let rate = (cells * steps * members) as f64 / least_s;
            println!(
                "| {members} | {} | {least_s:.4} | {:.2} | {:.1} | {:.2} | {} | +{:.0} % |",
                carrier.title(),
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
fn time(carrier: &mut Carrier, plan: &Plan, ensemble: &Ensemble) -> f64 {
    let began = Instant::now();
    let marched = march_all(&mut carrier.march, plan, ensemble, &mut |traces| drop(black_box(traces)));
    marched.unwrap_or_else(|error| panic!("{}: {error}", carrier.title()));
    began.elapsed().as_secs_f64()
}

/// Peak rate of the threads of a backend, flop/s; not measured for hardware devices.
fn peak(carrier: &Carrier) -> Option<f64> {
    carrier.threads.map(|threads| peak::flops_per_s(carrier.precision, threads))
}

fn gigaflops(flops_per_s: f64) -> String {
    format!("{:.0}", 1e-9 * flops_per_s)
}
