//! Mutants read, planned and marched in this process.

use super::seeds::Seeds;
use super::watchdog::Watchdog;
use super::{Input, mutants};
use bondline::case::Case;
use bondline::ensemble::{Ensemble, Sampling, SamplingKind};
use bondline::march::cpu::Cpu;
use bondline::march::{March, Precision};
use bondline::plan::Plan;
use bondline::traces::{Gauge, MemberStatus};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// Members of a march, the first nominal.
const MEMBERS: usize = 3;

/// Read an input, and march its case if it is valid. Returns whether it was.
///
/// # Errors
/// What is wrong with the answer.
pub(super) fn answer(input: &Input) -> Result<bool, String> {
    let answered = catch_unwind(AssertUnwindSafe(|| match Case::from_toml(&input["case.toml"], "mutant", input) {
        Err(refusal) if refusal.diagnostics.is_empty() => Err("a refusal without a reason".to_owned()),
        Err(_) => Ok(false),
        Ok(case) => coarse(&case).map_or(Ok(false), |case| march(&case).map(|()| true)),
    }));
    answered.unwrap_or_else(|_| Err("a panic".to_owned()))
}

/// The case with few cells and steps; `None` if its schedules need more steps than the limit.
fn coarse(case: &Case) -> Option<Case> {
    let mut builder = case.to_builder();
    let (duration_s, resolution) = (builder.exposure.duration_s, &mut builder.resolution);
    resolution.tolerance_k = None;
    resolution.cells = (4 * builder.layup.plies.len()).max(16);
    resolution.first_step_s = duration_s / 400.0;
    resolution.max_step_s = duration_s / 40.0;
    resolution.step_growth = 0.5;
    resolution.output_interval_s = duration_s / 10.0;
    builder.build().ok()
}

fn march(case: &Case) -> Result<(), String> {
    let plan = Plan::new(case);
    let sampling = Sampling { kind: SamplingKind::Uniform, seed: 1 };
    let drawn = Ensemble::sample(case.factors(), case.estimate().bounds, &sampling, MEMBERS - 1);
    let mut rows = Ensemble::nominal(case.factors()).member(0);
    (0..drawn.len()).for_each(|member| rows.extend(drawn.member(member)));
    let members = Ensemble::from_values(case.factors().len(), rows);
    for precision in [Precision::F64, Precision::F32] {
        let traces = Cpu::new(precision).march(&plan, &members, 0..members.len());
        let traces = traces.map_err(|error| format!("the march fails: {error}"))?;
        for member in (0..traces.members()).filter(|&member| traces.statuses[member] == MemberStatus::Completed) {
            let balance = traces.balances[member];
            let gauges = Gauge::ALL.into_iter().filter_map(|gauge| traces.gauge(member, gauge)).flatten();
            let numbers = traces.member(member).iter().chain(gauges).copied();
            let residuals = [balance.residual(), balance.mass_residual()];
            if let Some(number) = numbers.chain(residuals).find(|number| !number.is_finite()) {
                return Err(format!("{number} in a completed member in {precision:?}"));
            }
        }
    }
    Ok(())
}

#[test]
fn no_mutant_panics_hangs_or_gives_a_number_that_is_not_finite() {
    let (seeds, faults, marched) = (Seeds::new(), Mutex::new(Vec::new()), AtomicU64::new(0));
    for input in seeds.inputs() {
        assert_eq!(answer(input), Ok(true), "an input that is not mutated:\n{}", input["case.toml"]);
    }
    let numbers = mutants(1);
    Watchdog::run(numbers.clone(), |number| match answer(&seeds.mutant(number)) {
        Ok(is_valid) => drop(marched.fetch_add(u64::from(is_valid), Ordering::Relaxed)),
        Err(fault) => {
            let text = format!("{number}: {fault}: {}\n", seeds.description(number));
            faults.lock().expect("no thread panics with it").push(text);
        }
    });
    let (faults, marched) = (faults.into_inner().expect("no thread panics with it"), marched.into_inner());
    assert!(faults.is_empty(), "{} mutants:\n{}", faults.len(), faults.concat());
    let all = numbers.end - numbers.start;
    assert!(
        all < 100 || 10 * marched > all,
        "only {marched} of {all} mutants are valid: the others test the reader alone"
    );
}

/// The fuzzer notices what it looks for.
#[test]
fn a_panic_is_a_fault() {
    assert_eq!(answer(&Input::from([("case.toml".to_owned(), "duration = 1".to_owned())])), Ok(false));
    // Without its case file an input cannot be read.
    assert_eq!(answer(&Input::new()), Err("a panic".to_owned()));
}
