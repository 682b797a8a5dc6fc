//! `bondline devices`: what there is to march on.

use crate::command::exit::{Ending, Failure};
use bondline::march::Precision;
use bondline::march::gpu::device::{self, Adapter, Device};
use bondline::march::gpu::self_tests::SelfTests;
use bondline::report::summary::wrapped;
use serde_json::{Value, json};
use std::fmt::Write;

/// List adapters, limits, self-tests and what `auto` takes.
pub(crate) fn print(as_json: bool) -> Result<Ending, Failure> {
    let found: Vec<(Adapter, Result<SelfTests, String>)> = device::adapters()
        .into_iter()
        .map(|adapter| {
            let tests = Device::open(adapter.clone(), false).and_then(|device| device.self_tests());
            (adapter, tests.map_err(|error| error.to_string()))
        })
        .collect();
    let auto = verdict(&found);
    let text = if as_json { as_values(&found, &auto) } else { as_text(&found, &auto) };
    Ok(Ending { text, why: None })
}

fn passes(tests: &SelfTests) -> bool {
    tests.transforms.iter().all(|(precision, wrong, _)| *precision != Precision::F32 || *wrong == 0)
}

/// What `--backend auto` takes, and why.
fn verdict(found: &[(Adapter, Result<SelfTests, String>)]) -> String {
    let hardware = found.iter().find(|(adapter, _)| !adapter.is_software());
    match hardware {
        Some((adapter, Ok(tests))) if passes(tests) => format!(
            "{} for work of more than about a second on the processor, else the processor: opening a device and \
             compiling for it takes that long",
            adapter.name
        ),
        Some((adapter, _)) => format!("the processor: {} does not pass its self-tests", adapter.name),
        None if found.is_empty() => {
            "the processor: no Vulkan driver was found. For a GPU install its vendor's driver; for the software \
             rasteriser on Debian or Ubuntu: apt-get install mesa-vulkan-drivers libvulkan1"
                .to_owned()
        }
        None => "the processor: there is no hardware device, and a software one uses the processor less well; \
                 --backend gpu takes it all the same"
            .to_owned(),
    }
}

fn as_text(found: &[(Adapter, Result<SelfTests, String>)], auto: &str) -> String {
    let mut text = format!("processor: {} threads, f64 and f32 in lanes\n", rayon::current_num_threads());
    for (adapter, tests) in found {
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "\n{} ({})\n  driver          {}\n  f64 in shaders  {}\n  one binding     {} MiB\n  one buffer      {} MiB\n",
            adapter.name,
            adapter.kind,
            adapter.driver,
            if adapter.has_f64 { "yes" } else { "no" },
            adapter.binding_bytes() >> 20,
            adapter.buffer_bytes() >> 20,
        );
        match tests {
            Ok(tests) => {
                for (precision, wrong, tried) in &tests.transforms {
                    let name = if *precision == Precision::F32 { "f32" } else { "f64" };
                    let verdict = if *wrong == 0 {
                        format!("exact in {tried} of {tried} sums")
                    } else {
                        format!("WRONG in {wrong} of {tried} sums: refused")
                    };
                    let _ = writeln!(text, "  rounding {name}    {verdict}");
                }
                let turns = tests.loop_turns;
                let verdict = if turns < 1_000_000 {
                    format!("end unannounced after {turns} turns; dispatches stay below")
                } else {
                    "of 1,000,000 turns run to their end".to_owned()
                };
                let _ = writeln!(text, "  loops           {verdict}");
            }
            Err(error) => {
                let _ = writeln!(text, "  self-tests      failed: {error}");
            }
        }
    }
    text + "\n" + &wrapped("", &format!("auto takes {auto}")).join("\n") + "\n"
}

fn as_values(found: &[(Adapter, Result<SelfTests, String>)], auto: &str) -> String {
    let adapters: Vec<Value> = found
        .iter()
        .map(|(adapter, tests)| {
            let tests = match tests {
                Ok(tests) => json!({
                    "loop_turns": tests.loop_turns,
                    "wrong_sums": tests.transforms.iter().map(|(_, wrong, _)| wrong).collect::<Vec<_>>(),
                }),
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
