//! `bondline devices`: the devices of this machine.

use crate::command::exit::{Failure, Output};
use crate::march::Precision;
use crate::march::gpu::device::{self, Adapter, Device};
use crate::march::gpu::self_tests::{PAIRS, RoundingTest, SelfTests};
use crate::report::terminal::wrap;
use serde_json::{Value, json};
use std::fmt::Write;

/// List Vulkan devices with their limits and self-tests, and the choice of `--backend auto`.
pub(crate) fn run(as_json: bool) -> Result<Output, Failure> {
    let found: Vec<(Adapter, Result<SelfTests, String>)> = device::adapters()
        .into_iter()
        .map(|adapter| {
            let tests = Device::open(adapter.clone(), false).and_then(|device| device.self_tests());
            (adapter, tests.map_err(|error| error.to_string()))
        })
        .collect();
    let auto = verdict(&found);
    let text = if as_json { as_values(&found, &auto) } else { as_text(&found, &auto) };
    Ok(Output { text, failure: None })
}

fn passes(tests: &SelfTests) -> bool {
    tests.rounding.iter().all(|test| test.precision != Precision::F32 || test.own.sums == 0)
}

/// The choice of `--backend auto`, with its reason.
fn verdict(found: &[(Adapter, Result<SelfTests, String>)]) -> String {
    let hardware = found.iter().find(|(adapter, _)| !adapter.is_software());
    match hardware {
        Some((adapter, Ok(tests))) if passes(tests) => format!(
            "{} for runs that take more than about a second on the CPU, otherwise the CPU: opening a device and \
             compiling shaders takes about as long",
            adapter.name
        ),
        Some((adapter, _)) => format!("the CPU: {} fails its self-tests", adapter.name),
        None if found.is_empty() => {
            "the CPU: no Vulkan driver was found. For a GPU, install the driver of its vendor; for the software \
             rasteriser on Debian or Ubuntu: apt-get install mesa-vulkan-drivers libvulkan1"
                .to_owned()
        }
        None => "the CPU: there is no hardware device, and a software device is slower than the CPU; --backend gpu \
                 uses it all the same"
            .to_owned(),
    }
}

fn as_text(found: &[(Adapter, Result<SelfTests, String>)], auto: &str) -> String {
    let mut text = format!("CPU: {} threads, f64 and f32 in SIMD lanes\n", rayon::current_num_threads());
    for (adapter, tests) in found {
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "\n{} ({})\n  driver          {}\n  f64 in shaders  {}\n  largest binding {} MiB\n  largest buffer  \
             {} MiB\n",
            adapter.name,
            adapter.kind,
            adapter.driver,
            if adapter.has_f64 { "yes" } else { "no" },
            adapter.binding_bytes() >> 20,
            adapter.buffer_bytes() >> 20,
        );
        match tests {
            Ok(tests) => {
                for test in &tests.rounding {
                    let name = if test.precision == Precision::F32 { "f32" } else { "f64" };
                    let _ = writeln!(text, "  rounding {name}    {}", verdict_of_rounding(test));
                }
                let iterations = tests.loop_iterations;
                let verdict = if iterations < 1_000_000 {
                    format!("end silently after {iterations} iterations; dispatches stay below")
                } else {
                    "of 1,000,000 iterations run to their end".to_owned()
                };
                let _ = writeln!(text, "  loops           {verdict}");
            }
            Err(error) => {
                let _ = writeln!(text, "  self-tests      failed: {error}");
            }
        }
    }
    text + "\n" + &wrap("", &format!("--backend auto chooses {auto}")).join("\n") + "\n"
}

/// Consequence of the rounding of one precision for marches.
fn verdict_of_rounding(RoundingTest { own, used, .. }: &RoundingTest) -> String {
    let of = |count: usize, what: &str| format!("{count} of {PAIRS} {what} are wrong");
    let inexact = [of(own.quotients, "quotients"), of(own.roots, "square roots")].join(", ");
    if own.sums > 0 {
        format!("{}: the device is refused", of(own.sums, "sums"))
    } else if own.divides_exactly() {
        format!("exact in {PAIRS} sums, quotients and square roots")
    } else if used.divides_exactly() {
        format!("{inexact}; kernels correct them")
    } else {
        format!("{inexact}: results are not those of the CPU to the bit")
    }
}

fn as_values(found: &[(Adapter, Result<SelfTests, String>)], auto: &str) -> String {
    let adapters: Vec<Value> = found
        .iter()
        .map(|(adapter, tests)| {
            let tests = match tests {
                Ok(tests) => {
                    let of = |kind: fn(&RoundingTest) -> usize| tests.rounding.iter().map(kind).collect::<Vec<_>>();
                    json!({
                        "loop_iterations": tests.loop_iterations,
                        "inexact_sums": of(|test| test.own.sums),
                        "inexact_quotients": of(|test| test.own.quotients),
                        "inexact_roots": of(|test| test.own.roots),
                        "inexact_after_correction": of(|test| test.used.quotients + test.used.roots),
                    })
                }
                Err(error) => json!({ "error": error }),
            };
            json!({
                "name": adapter.name,
                "kind": adapter.kind,
                "driver": adapter.driver,
                "f64": adapter.has_f64,
                "binding_bytes": adapter.binding_bytes(),
                "buffer_bytes": adapter.buffer_bytes(),
                "self_tests": tests,
            })
        })
        .collect();
    format!("{:#}\n", json!({ "adapters": adapters, "auto": auto }))
}
