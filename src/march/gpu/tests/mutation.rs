//! Mutation test of every function of the kernels against the processor: a change that is not detected here is one by
//! which a twin could drift.

#![expect(clippy::print_stdout, reason = "scripts/mutants.sh prints the figures")]

use super::mutants::{Change, Mutant, mutants, mutated};
use super::{Target, device, probes, short_marches};
use crate::march::Precision;
use crate::march::gpu::device::Device;
use crate::physics::TWINS;
use crate::random::RandomStream;
use std::collections::{BTreeMap, HashSet};
use std::time::Instant;

/// Mutants compiled into one kernel: compile time grows more than in proportion.
const AT_ONCE: usize = 250;
/// Number of mutants, unless the environment sets it, and of functions removed unless it is set.
const SAMPLE: usize = 40;
/// Required share of detected mutants.
const REQUIRED_SHARE: f64 = 0.98;

/// Functions whose removal has no effect, and why.
const IDLE_FUNCTIONS: &[(&str, &str)] = &[
    ("single_thread conversion_above:", "one thread has all cells: no cell above"),
    ("single_thread mean_flux_into_block:", "one thread has all cells: none below"),
    ("single_thread first_cell:", "returns zero"),
    ("single_thread first_halo_cell:", "returns zero"),
    ("single_thread first_halo_ply:", "returns zero"),
    ("single_thread first_ply:", "returns zero"),
    ("single_thread gas_source_below:", "one thread has all cells: none below"),
    ("single_thread synchronize:", "one thread needs no barrier"),
    ("single_thread pressure_below_block:", "one thread has all cells: none below"),
    ("single_thread assign_block:", "one thread has all cells"),
    ("single_thread unknown_below_block:", "one thread has all cells: none below"),
    ("single_thread reduce_sums:", "one thread has the whole of each sum"),
    ("conduction no_flux:", "returns zeros"),
    ("cooperative first_halo_cell:", "a thread then loops over all cells above its block, without effect"),
    ("cooperative first_halo_ply:", "a thread then loops over all plies above its block, without effect"),
    ("cooperative synchronize:", "threads of one vector do not lose this race; Chromium checks barriers"),
    ("generated load_stored:", "stored heat is summed once, after the last step"),
];

/// Mutants that are not detected, by the beginning of their keys, and why.
const UNDETECTED: &[(&str, &str)] = &[
    ("compensated opaque: Operator(Divide)", "multiplying and dividing by one are the same"),
    ("conduction open_face_flux: Operator(Add)", "a held face has no flux from outside"),
    ("decomposition mean_decay:", "the first terms of the series are below the rounding of its sum"),
    ("exponential exp_parts: Nudge `", "a millionth of the last term is below the rounding of f32"),
    ("surface_flux blowing_share: Operator(Divide) `ratio *", "multiplying and dividing by ±1 are the same"),
    ("darcy_flow pass_mask:", "the block at the back has no flux from below"),
    ("gauges gauges: Nudge `real(", "a threshold of conversion, changed by 1e-6"),
    ("member step_length_s: Operator(Add)", "the length after the last step is not used"),
    ("member start: Nudge `1e9`", "an initial value above any temperature"),
    ("mixture temperature_rise: Operator(Add) `1.0 - held` 1", "the heat capacity of a held cell is not used"),
    ("sensors is_limit_row: Operator(Subtract)", "an unsigned difference is above zero unless both are equal"),
    ("sensors depth_correction: Negate `step == 0u` 0", "a sensor on the hot face has no depth factor"),
    ("step update_temperatures: Nudge `", "a margin of one kelvin, changed by 1e-6"),
    ("step update_temperatures: Operator(Subtract) `low + DIVERGENCE_MARGIN_K", "no member is colder than a kelvin"),
    (
        "step update_temperatures: Operator(Subtract) `top + DIVERGENCE_MARGIN_K",
        "a member that diverges leaves the tables by more",
    ),
    ("step update_temperatures: Operator(Subtract) `temperatures[first]", "tests for NaN"),
];

/// The mutants that no target detects.
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
        let mut detected = HashSet::new();
        for some in here.chunks(AT_ONCE) {
            let numbered: Vec<(u32, Mutant)> = (1..).zip(some.iter().map(|key| own[*key].clone())).collect();
            let kernel = mutated(&target.kernel, &numbered);
            let pipeline = device.pipeline(&kernel, target.entry).expect("the driver compiles it");
            assert!((target.agrees)(&pipeline, 0), "{}: differs without an active mutant", target.name);
            let differs = |(number, _): &(u32, &String)| !(target.agrees)(&pipeline, *number);
            detected.extend((1..).zip(some.iter().copied()).filter(differs).map(|(_, key)| key));
        }
        println!("{}: {} of {} detected, {:.1?}", target.name, detected.len(), here.len(), began.elapsed());
        left.retain(|key| !detected.contains(key));
    }
    left.into_iter().cloned().collect()
}

/// In single precision some of the cases, as the branches are the same but for flushing tiny results. Cooperative ones,
/// which compile for the longest, last: a target is not compiled for mutants that are already detected.
fn targets(device: &Device) -> Vec<Target> {
    let mut targets = probes::targets(device);
    targets.extend(short_marches::all_targets(device, Precision::F64));
    targets.extend(short_marches::some_targets(device, Precision::F32));
    targets.extend(short_marches::cooperative_targets(device));
    targets
}

/// The reason of the first entry that a key begins with.
fn reason(table: &[(&'static str, &'static str)], key: &str) -> Option<&'static str> {
    table.iter().find(|(known, _)| key.starts_with(known)).map(|(_, reason)| *reason)
}

#[test]
fn every_mutant_of_a_kernel_is_detected_or_explained() {
    let device = device(true);
    let targets = targets(&device);
    let reached = |target: &Target| mutants(&target.kernel).into_iter().filter(|mutant| mutant.is_reached);
    let of_target = |target: &Target| reached(target).map(|mutant| (mutant.key(), mutant));
    let all: BTreeMap<String, Mutant> = targets.iter().flat_map(of_target).collect();
    let (functions, mut others): (Vec<_>, Vec<_>) =
        all.into_iter().partition(|(_, mutant)| mutant.change == Change::Skip);
    // Operators and constants of the physics only: the rest has no twin.
    others.retain(|(_, mutant)| mutant.file == "prelude" || TWINS.contains(&mutant.file.as_str()));
    println!("{} functions, {} mutants", functions.len(), others.len());

    let given = std::env::var("BONDLINE_MUTANTS").map(|count| count.parse().expect("a number of mutants"));
    let count = given.clone().unwrap_or(SAMPLE);
    if given.is_err() {
        others.retain(|(key, _)| reason(UNDETECTED, key).is_none());
    }
    let mut numbers = RandomStream::new(2026, 0);
    let drawn: Vec<String> =
        (0..count.min(others.len())).map(|_| others.swap_remove(numbers.uniform_index(others.len())).0).collect();
    // A sample leaves out what the full run does not detect: it would be compiled for every target.
    let is_whole = others.is_empty();
    let functions: Vec<String> = functions.into_iter().map(|(key, _)| key).collect();
    let of_run = functions.iter().filter(|key| is_whole || reason(IDLE_FUNCTIONS, key).is_none()).cloned();
    let mut of_run: Vec<String> = of_run.collect();
    if given.is_err() {
        of_run = (0..SAMPLE).map(|_| of_run.swap_remove(numbers.uniform_index(of_run.len()))).collect();
    }
    let chosen: Vec<String> = of_run.into_iter().chain(drawn.iter().cloned()).collect();
    let survivors = survivors(&device, &targets, &chosen);

    let (idle, undetected): (Vec<_>, Vec<_>) = survivors.iter().partition(|key| functions.contains(key));
    let detected = 1.0 - undetected.len() as f64 / drawn.len().max(1) as f64;
    println!("{:.2} % of {} mutants detected; survivors:\n{}", 100.0 * detected, drawn.len(), survivors.join("\n"));
    let unexplained: Vec<&&String> = idle
        .iter()
        .filter(|key| reason(IDLE_FUNCTIONS, key).is_none())
        .chain(undetected.iter().filter(|key| reason(UNDETECTED, key).is_none()))
        .collect();
    assert!(unexplained.is_empty(), "undetected without an entry in the tables: {unexplained:#?}");
    assert!(
        detected >= REQUIRED_SHARE || !is_whole,
        "{} of {} mutants detected",
        drawn.len() - undetected.len(),
        drawn.len()
    );
    for (known, _) in IDLE_FUNCTIONS.iter().chain(UNDETECTED).filter(|_| is_whole) {
        let is_undetected = survivors.iter().any(|key| key.starts_with(known));
        assert!(is_undetected, "{known} is detected: remove its entry");
    }
}
