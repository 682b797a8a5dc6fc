//! Mutants of every function of the kernels, held against the processor: a change that goes unnoticed here is one by
//! which a twin could drift.

#![expect(clippy::print_stdout, reason = "scripts/mutants.sh shows the figures")]

use super::mutants::{Change, Mutant, mutants, mutated};
use super::{Target, device, probes, short_marches};
use crate::chance::Numbers;
use crate::march::Precision;
use crate::march::gpu::device::Device;
use crate::physics::TWINS;
use std::collections::{BTreeMap, HashSet};
use std::time::Instant;

/// Mutants of one kernel at once: compiling takes more than in proportion.
const AT_ONCE: usize = 250;
/// Mutants that are drawn where the environment names no number of them.
const SAMPLE: usize = 40;
/// The share of mutants that has to be noticed.
const NOTICED: f64 = 0.98;

/// Functions that may return at once, and why.
const IDLE_FUNCTIONS: &[(&str, &str)] = &[
    ("single_thread conversion_above:", "one thread has all cells: there is none above"),
    ("single_thread driven_behind:", "one thread has all cells: there is none behind"),
    ("single_thread first_cell:", "returns zero"),
    ("single_thread first_link:", "returns zero"),
    ("single_thread first_linked_ply:", "returns zero"),
    ("single_thread first_ply:", "returns zero"),
    ("single_thread made_behind:", "one thread has all cells: there is none behind"),
    ("single_thread meet:", "one thread meets nobody"),
    ("single_thread pressed_under_block:", "one thread has all cells: there is none under them"),
    ("single_thread stand:", "one thread has all cells"),
    ("single_thread under_block:", "one thread has all cells: there is none under them"),
    ("single_thread unite:", "one thread has all of each sum"),
    ("conducting no_link:", "returns zeros"),
    ("cooperative first_link:", "a thread then passes over all cells above its block, and leaves them out"),
    ("cooperative first_linked_ply:", "a thread then passes over all plies above its block, and leaves them out"),
    (
        "cooperative meet:",
        "a barrier less is a race that threads of one vector do not lose; Chromium looks at barriers",
    ),
    ("generated load_stored:", "the heat stored is summed up once, after the last step"),
];

/// Mutants that go unnoticed, by how their keys begin, and why.
const UNNOTICED: &[(&str, &str)] = &[
    ("compensated keep: Operator(Divide)", "one is as good a divisor as a factor"),
    (
        "conducting surface: Operator(Add) `face *",
        "the last ply of the cases weighs what the hot face is made of alike",
    ),
    ("conducting through: Operator(Add)", "nothing flows through a held face as through an open one"),
    ("decomposition mean_decay:", "the first terms of the series are below the rounding of its sum"),
    ("exponential power_of_e: Nudge `", "a millionth of the last term is below the rounding of f32"),
    ("faces blown: Operator(Divide) `ratio *", "one and minus one are as good as divisors"),
    ("flowing flow: Operator(Add) `end_cell() - first_cell()", "passes on over cells above the block, alike"),
    ("flowing passing:", "of the block at the back, behind which nothing flows"),
    ("gas midway:", "the storage of a middle is not read"),
    (
        "gauges gauges: Extreme(Min) `max`",
        "counts while a front passes from the second ply into a third of the same material",
    ),
    ("gauges gauges: Nudge `real(", "a mark that conversion falls below, but for a millionth of it"),
    ("member length_s: Operator(Add)", "the length after the last step is not used"),
    ("member start: Nudge `1e9`", "colder than any temperature is warm enough"),
    ("sensors displaced: Negate `step == 0u` 0", "a sensor on the hot face has no depth to scale"),
    ("step ascend: Operator(Add) `end_cell() - first_cell()", "passes on over cells above the block, alike"),
    ("step update: Nudge `", "a margin of a kelvin, but for a millionth of it"),
    ("step update: Operator(Subtract) `low + STRAY_MARGIN_K", "no member is colder than a kelvin"),
    ("step update: Operator(Subtract) `top + STRAY_MARGIN_K", "a member that diverges leaves the tables by more"),
    ("step update: Operator(Subtract) `temperatures[first_of(p)]", "watches for numbers that are none"),
];

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
    // Operators and constants of the physics alone: what surrounds it has no twin.
    others.retain(|(_, mutant)| mutant.file == "prelude" || TWINS.contains(&mutant.file.as_str()));
    println!("{} functions, {} mutants", functions.len(), others.len());

    let count = std::env::var("BONDLINE_MUTANTS").map_or(SAMPLE, |count| count.parse().expect("a number of mutants"));
    let mut numbers = Numbers::of(2026, 0);
    let drawn: Vec<String> =
        (0..count.min(others.len())).map(|_| others.swap_remove(numbers.below(others.len())).0).collect();
    // A sample leaves out what the whole finds unnoticed.
    let is_whole = others.is_empty();
    let functions: Vec<String> = functions.into_iter().map(|(key, _)| key).collect();
    let of_run = functions.iter().filter(|key| is_whole || reason(IDLE_FUNCTIONS, key).is_none()).cloned();
    let chosen: Vec<String> = of_run.chain(drawn.iter().cloned()).collect();
    let survivors = survivors(&device, &targets, &chosen);

    let (idle, unnoticed): (Vec<_>, Vec<_>) = survivors.iter().partition(|key| functions.contains(key));
    let noticed = 1.0 - unnoticed.len() as f64 / drawn.len().max(1) as f64;
    println!("{:.2} % of {} mutants noticed; survivors:\n{}", 100.0 * noticed, drawn.len(), survivors.join("\n"));
    let unexplained: Vec<&&String> = idle
        .iter()
        .filter(|key| reason(IDLE_FUNCTIONS, key).is_none())
        .chain(unnoticed.iter().filter(|key| reason(UNNOTICED, key).is_none()))
        .collect();
    assert!(unexplained.is_empty(), "unnoticed without a reason: {unexplained:#?}");
    assert!(noticed >= NOTICED || !is_whole, "{} of {} mutants noticed", drawn.len() - unnoticed.len(), drawn.len());
    for (known, _) in IDLE_FUNCTIONS.iter().chain(UNNOTICED).filter(|_| is_whole) {
        let is_unnoticed = survivors.iter().any(|key| key.starts_with(known));
        assert!(is_unnoticed, "{known} is noticed, and explained all the same");
    }
}
