//! Loop iterations of kernels: those that the kernels count against those that limit a dispatch.

use super::super::device::Device;
use super::super::shader::loop_iterations;
use super::short_marches::{CASES, MEMBERS, STRIDE, ShortMarch, THREADS};
use crate::march::Precision;
use crate::support::runs_all;

/// The source of a kernel that counts the iterations of its loops, the last comparison of each included. The largest
/// count of all dispatches takes the place of the hottest temperature of the first ply.
fn counting(source: &str) -> String {
    let mut counted = String::new();
    for line in source.lines() {
        let is_loop = line.trim_start().starts_with("for (");
        if is_loop {
            counted += "loop_turns++;\n";
        }
        counted += line;
        counted += if is_loop { "\nloop_turns++;\n" } else { "\n" };
    }
    assert!(!source.contains("while ") && !source.contains("loop {"), "the kernel has loops that are not counted");
    for (place, added) in [
        ("        load();\n", "        most_turns = hottest[0];\n"),
        // Sums are reduced before anything is saved.
        ("    reduce_sums();\n    if thread == 0u {\n", "        hottest[0] = max(most_turns, real(loop_turns));\n"),
        (
            "        progress[member] = step;\n",
            "    }\n    hottest[0] = max(most_turns, real(loop_turns));\n    {\n        \
             save_extremes(0u, run.plies, 1u);\n",
        ),
    ] {
        assert!(counted.contains(place), "the kernel has no {place:?}");
        counted = counted.replacen(place, &format!("{place}{added}"), 1);
    }
    counted + "var<private> loop_turns: u32;\nvar<private> most_turns: real;\n"
}

/// The largest number of iterations in a dispatch that a kernel counts, and the number that limits its steps.
fn turns(device: &Device, text: &str, threads: u32, change: impl Fn(String) -> String) -> (f64, u32) {
    let short = ShortMarch::new(device, text, Precision::F64, threads);
    let kernel = device.kernel(change(counting(&short.source()))).expect("the kernel is sound");
    let pipeline = device.pipeline(&kernel, "march").expect("the driver compiles it");
    let traces = short.march(&pipeline, 0).expect("no dispatch is cut short");
    let plies = short.plan.rows.plies.len();
    let counted = (0..MEMBERS).map(|member| traces.extremes_k[member * plies].1).fold(0.0, f64::max);
    let (step, around) = loop_iterations(&short.plan, threads);
    (counted, STRIDE * step + around)
}

/// Cases with and without gas, latent heat and steep conductivities, or with `BONDLINE_ALL` all.
#[test]
fn a_dispatch_turns_its_loops_no_more_often_than_its_limit_counts() {
    let device = super::device(false);
    for (place, (name, text)) in CASES.iter().enumerate().filter(|(place, _)| runs_all() || place % 5 == 0) {
        let threads = if runs_all() && place % 2 == 1 { THREADS } else { 1 };
        let (counted, limit) = turns(&device, text, threads, |source| source);
        assert!(counted > 100.0 && counted <= f64::from(limit), "{name}: {counted} of {limit} iterations");
    }
}

#[test]
fn a_loop_that_the_limit_does_not_count_is_caught() {
    let device = super::device(false);
    let more = |source: String| {
        let step = "        advance(step);\n";
        assert!(source.contains(step), "the kernel advances steps");
        source.replacen(step, &format!("{step}for (var i = 0u; i < 2000u; i++) {{\nloop_turns++;\n}}\n"), 1)
    };
    let (counted, limit) = turns(&device, CASES[4].1, 1, more);
    assert!(counted > f64::from(limit), "{counted} of {limit} iterations");
}
