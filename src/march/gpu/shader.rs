//! Kernels as lists of parts.
//!
//! WGSL asks for no order of declaration, so a kernel is its parts one after another, each under a comment
//! with its path, which is where naga's excerpts then point. Precision is one line, sizes are constants:
//! private arrays cannot be sized by pipeline constants, so that text is made for each plan.

use crate::march::Precision;
use crate::plan::Plan;
use crate::plan::layout::{AIR_COLUMNS, GAS_COLUMNS, GAUGES, HEATS, NO_INSTANT, TABLE_NODES, TABLE_STEP_K};
use std::fmt::Write;

/// Invocations in a workgroup: two subgroups of hardware, and no matter to a software device.
pub const WORKGROUP: u32 = 64;

macro_rules! part {
    ($name:literal) => {
        ($name, include_str!(concat!("../../../shaders/", $name, ".wgsl")))
    };
}

/// Pure functions and the rows they read, in reading order.
pub const PARTS: &[(&str, &str)] = &[
    part!("prelude"),
    part!("layout"),
    part!("compensated"),
    part!("table"),
    part!("material"),
    part!("faces"),
    part!("tridiagonal"),
    part!("reading"),
    part!("member"),
    part!("holder"),
    part!("step"),
];

/// The entry point that carries one member in an invocation.
pub const MARCH: (&str, &str) = part!("march");

/// The text of a kernel: the parts for a plan, and an entry point.
pub fn kernel(plan: &Plan, precision: Precision, entry: (&str, &str)) -> String {
    let mut text = String::new();
    let real = match precision {
        Precision::F32 => "f32",
        Precision::F64 => "f64",
    };
    let sizes = [
        ("CELLS", plan.cells() as u32),
        ("PLIES", plan.plies.len() as u32),
        ("SENSORS", plan.sensor_cells.len() as u32),
        ("PARTS", plan.parts as u32),
        ("HOLDER", u32::from(plan.has_holder)),
        ("HEATS", HEATS as u32),
        ("TABLE_NODES", TABLE_NODES as u32),
        ("AIR_COLUMNS", AIR_COLUMNS as u32),
        ("GAS_COLUMNS", GAS_COLUMNS as u32),
        ("GAUGES", GAUGES as u32),
        ("NO_INSTANT", NO_INSTANT),
        ("WORKGROUP", WORKGROUP),
    ];
    let mut line = |words: std::fmt::Arguments<'_>| {
        text.write_fmt(words).expect("writing to a string cannot fail");
        text.push('\n');
    };
    line(format_args!("alias real = {real};"));
    for (name, value) in sizes {
        line(format_args!("const {name} = {value}u;"));
    }
    line(format_args!("const TABLE_STEP_K = {TABLE_STEP_K:?};"));
    for (name, part) in PARTS.iter().chain([&entry]) {
        line(format_args!("// shaders/{name}.wgsl\n{part}"));
    }
    text
}

/// Turns of all loops of one step, and of all that surrounds the steps of a dispatch: what a driver that
/// counts loops would count.
pub fn loop_turns(plan: &Plan) -> (u32, u32) {
    let (cells, plies, sensors) = (plan.cells() as u32, plan.plies.len() as u32, plan.sensor_cells.len() as u32);
    let properties = 2 * cells + plies;
    let stage = properties + cells + 2 * cells;
    let step = 2 * stage + cells + cells + cells + 2 + 2 + 2 + cells + (cells + plies) + 2 * sensors + 2 + 1;
    let sideways = if plan.has_holder { 4 * (cells + plies) } else { 0 };
    let around = 2 * (cells + sensors + plies + HEATS as u32) + (plies + cells) + 2;
    (step + sideways, around)
}

/// Loop turns a dispatch may take on a software device, which silently ends all loops of an invocation
/// after 65,535, and on hardware, where some tens of milliseconds keep clear of time-outs.
const TURNS_SOFTWARE: u32 = 60_000;
const TURNS_HARDWARE: u32 = 1_000_000;

/// Steps that one dispatch takes: as many as its loop turns allow, and one at least.
pub fn steps_a_dispatch(plan: &Plan, is_software: bool) -> u32 {
    let (turns_step, turns_around) = loop_turns(plan);
    let turns = if is_software { TURNS_SOFTWARE } else { TURNS_HARDWARE };
    (turns.saturating_sub(turns_around) / turns_step).max(1)
}
