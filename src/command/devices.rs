//! `bondline devices`: the devices of this machine.

use crate::command::exit::{Failure, Output};
use crate::march::Precision;
use crate::march::gpu::device::{self, Adapter, Device};
use crate::march::gpu::self_tests::SelfTests;
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
    tests.error_free_transformations.iter().all(|(precision, wrong, _)| *precision != Precision::F32 || *wrong == 0)
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
                for (precision, wrong, tried) in &tests.error_free_transformations {
                    let name = if *precision == Precision::F32 { "f32" } else { "f64" };
                    let verdict = if *wrong == 0 {
                        format!("exact in {tried} of {tried} sums")
                    } else {
                        format!("WRONG in {wrong} of {tried} sums: the device is refused")
                    };
                    let _ = writeln!(text, "  rounding {name}    {verdict}");
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

fn as_values(found: &[(Adapter, Result<SelfTests, String>)], auto: &str) -> String {
    let adapters: Vec<Value> = found
        .iter()
        .map(|(adapter, tests)| {
            let tests = match tests {
                Ok(tests) => {
                    let sums: Vec<_> = tests.error_free_transformations.iter().map(|(_, wrong, _)| wrong).collect();
                    json!({ "loop_iterations": tests.loop_iterations, "inexact_sums": sums })
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
