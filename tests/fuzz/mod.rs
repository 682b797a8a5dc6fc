//! A seeded fuzzer of all text that bondline reads: cases, tables, materials, gases and files to merge.
//!
//! Every mutant has a number, from which it is made again. A mutant must not cause a panic, a hang of 20 s, memory
//! above 2 GiB, or a number that is not finite in an answer. `BONDLINE_FUZZ` is the number of mutants in this process;
//! one in fifty runs through the command besides. `BONDLINE_FUZZ_FIRST` is the number of the first, to repeat one.

mod by_command;
mod corpus;
mod in_process;
mod mutation;
mod seeds;
mod watchdog;

use std::collections::BTreeMap;

/// The files of an input by their names: `case.toml` and the files that it names.
type Input = BTreeMap<String, String>;

/// Mutants of a run in this process; scripts/test.sh --all sets 100,000.
const MUTANTS: u64 = 4_000;
/// Mutants in this process for each that runs through the command.
const MUTANTS_PER_COMMAND: u64 = 50;

/// The numbers of the mutants of this run: `every` of them is one.
fn mutants(every: u64) -> std::ops::Range<u64> {
    let number = |name: &str, standard: u64| {
        std::env::var(name).map_or(standard, |text| text.parse().unwrap_or_else(|_| panic!("{name}: {text:?}")))
    };
    let first = number("BONDLINE_FUZZ_FIRST", 0);
    first..first + number("BONDLINE_FUZZ", MUTANTS).div_ceil(every)
}
