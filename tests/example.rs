//! The example of the README gives the numbers of the command.

use crate::cli::say;
use crate::support::{Scratch, root, text};
use bondline::Case;
use bondline::march::{Precision, cpu::Cpu, extrapolated::Extrapolated};
use bondline::pilot::pilot;
use bondline::study::estimate::{Search, estimate};
use bondline::study::nominal::nominal;

/// The steps of the example, which this test takes too. The example itself is compiled and run as a test of the
/// documentation, where no command can be started beside it.
const STEPS: [&str; 5] = [
    "let case = Case::load(\"cases/slab\".as_ref())?;",
    "let plan = pilot(&case)?;",
    "let mut march = Extrapolated::new(Box::new(Cpu::new(Precision::F64)));",
    "let predicted = nominal(&case, &plan, &mut march)?;",
    "let found = estimate(&[(&case, &plan)], &mut march, &Search::of(Precision::F64))?;",
];

#[test]
fn the_example_of_the_readme_gives_the_numbers_of_the_command_to_the_last_bit() {
    let readme = text("README.md");
    for step in STEPS {
        assert!(readme.contains(step), "the example no longer has {step:?}");
    }
    let path = root().join("cases/slab");
    let case = Case::load(&path).expect("a shipped case");
    let plan = pilot(&case).expect("the processor does not fail");
    let mut march = Extrapolated::new(Box::new(Cpu::new(Precision::F64)));
    let predicted = nominal(&case, &plan, &mut march).expect("the processor does not fail");
    let found = estimate(&[(&case, &plan)], &mut march, &Search::of(Precision::F64)).expect("an estimate");

    let scratch = Scratch::new("example");
    let line = format!("estimate {} --json --quiet --backend cpu", path.display());
    let told = say(&scratch, &line).done().json();
    for (factor, value) in found.factors.iter().zip(&found.values) {
        let name = &factor.factor.name;
        let other = told["factors"][name]["value"].as_f64().unwrap_or_else(|| panic!("no {name} in {told:#}"));
        assert_eq!(other.to_bits(), value.to_bits(), "{name}: {value} by the example, {other} by the command");
    }
    for (sensor, peak) in case.sensors.iter().zip(&predicted.peaks) {
        let other = told["sensors"][&sensor.name]["peak_k"].as_f64();
        assert_eq!(other, Some(peak.temperature_k), "{}", sensor.name);
    }
}
