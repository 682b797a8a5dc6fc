//! Mutants of every function of the kernels, held against the processor: a change that goes unnoticed here is one by
//! which a twin could drift.

#![expect(clippy::print_stdout, reason = "scripts/mutants.sh shows the figures")]

use super::mutants::{Change, Mutant, mutants, mutated};
use super::{Target, device, probes, short_marches};
use crate::chance::Numbers;
use crate::march::Precision;
use crate::march::gpu::device::Device;
use std::collections::{BTreeMap, HashSet};
use std::time::Instant;

/// Mutants of one kernel at once: compiling takes more than in proportion.
const AT_ONCE: usize = 250;
/// Mutants that are drawn where the environment names no number of them.
const SAMPLE: usize = 100_000;
/// The share of mutants that has to be noticed.
const NOTICED: f64 = 0.98;

/// Functions that may return at once without notice, by their part and name, and why.
const IDLE_FUNCTIONS: &[(&str, &str)] = &[];

/// Mutants that go unnoticed, by their keys, and why.
const UNNOTICED: &[(&str, &str)] = &[];

/// The mutants that no target notices: each is held against one target after the other until one does.
fn survivors(device: &Device, targets: &[Target], chosen: &[String]) -> Vec<String> {
    let mut left: Vec<&String> = chosen.iter().collect();
    for target in targets {
        let began = Instant::now();
        let own = mutants(&target.kernel).into_iter().filter(|mutant| mutant.is_reached);
        let own: BTreeMap<String, Mutant> = own.map(|mutant| (mutant.key(), mutant)).collect();
        let here: Vec<&String> = left.iter().copied().filter(|key| own.contains_key(*key)).collect();
        if here.is_empty() {
            continue;
        }
        let mut noticed = HashSet::new();
        for some in here.chunks(AT_ONCE) {
            let numbered: Vec<(u32, Mutant)> = (1..).zip(some.iter().map(|key| own[*key].clone())).collect();
            let kernel = mutated(&target.kernel, &numbered);
            let pipeline = device.pipeline(&kernel, target.entry).expect("the driver compiles it");
            assert!((target.agrees)(&pipeline, 0), "{}: differs without a mutant", target.name);
            let differs = |(number, _): &(u32, &String)| !(target.agrees)(&pipeline, *number);
            noticed.extend((1..).zip(some.iter().copied()).filter(differs).map(|(_, key)| key));
        }
        println!("{}: {} of {} noticed, {:.1?}", target.name, noticed.len(), here.len(), began.elapsed());
        left.retain(|key| !noticed.contains(key));
    }
    left.into_iter().cloned().collect()
}

fn targets(device: &Device) -> Vec<Target> {
    let mut targets = probes::targets(device);
    targets.extend(short_marches::targets(device, Precision::F64));
    targets.extend(short_marches::cooperative_targets(device));
    targets.extend(short_marches::targets(device, Precision::F32));
    targets
}

/// The reason in a table for what begins with a key.
fn reason(table: &[(&'static str, &'static str)], key: &str) -> Option<&'static str> {
    table.iter().find(|(known, _)| key.starts_with(known)).map(|(_, reason)| *reason)
}

#[test]
fn what_changes_in_any_function_of_a_kernel_is_noticed_or_explained() {
    let device = device(true);
    let targets = targets(&device);
    let of_target = |target: &Target| mutants(&target.kernel).into_iter().map(|mutant| (mutant.key(), mutant));
    let all: BTreeMap<String, Mutant> = targets.iter().flat_map(of_target).collect();
    let (functions, mut others): (Vec<_>, Vec<_>) =
        all.into_iter().partition(|(_, mutant)| mutant.change == Change::Skip);
    println!("{} functions, {} mutants", functions.len(), others.len());

    let count = std::env::var("BONDLINE_MUTANTS").map_or(SAMPLE, |count| count.parse().expect("a number of mutants"));
    let mut numbers = Numbers::of(2026, 0);
    let drawn: Vec<String> =
        (0..count.min(others.len())).map(|_| others.swap_remove(numbers.below(others.len())).0).collect();
    let functions: Vec<String> = functions.into_iter().map(|(key, _)| key).collect();
    let survivors = survivors(&device, &targets, &[functions.as_slice(), &drawn].concat());

    let (idle, unnoticed): (Vec<_>, Vec<_>) = survivors.iter().partition(|key| functions.contains(key));
    let noticed = 1.0 - unnoticed.len() as f64 / drawn.len().max(1) as f64;
    println!("{:.2} % of {} mutants noticed; survivors:\n{}", 100.0 * noticed, drawn.len(), survivors.join("\n"));
    let unexplained: Vec<&&String> = idle
        .iter()
        .filter(|key| reason(IDLE_FUNCTIONS, key).is_none())
        .chain(unnoticed.iter().filter(|key| reason(UNNOTICED, key).is_none()))
        .collect();
    assert!(unexplained.is_empty(), "unnoticed without a reason: {unexplained:#?}");
    assert!(noticed >= NOTICED, "{} of {} mutants noticed", drawn.len() - unnoticed.len(), drawn.len());
    for (known, _) in IDLE_FUNCTIONS {
        assert!(idle.iter().any(|key| key.starts_with(known)), "{known} is noticed, and explained all the same");
    }
}
