//! Kernels as lists of parts.
//!
//! WGSL asks for no order of declaration, so a kernel is its parts one after another, each under a comment
//! with its path, which is where naga's excerpts then point. Precision is one line, sizes are constants:
//! private arrays cannot be sized by pipeline constants, so that text is made for each plan, and serves those of fewer cells.

use super::layout::declarations;
use crate::march::Precision;
use crate::physics::constants;
use crate::plan::layout::{
    ABREAST, AIR_PROPERTIES, FACE_COLUMNS, GAUGES, HEATS, NO_INSTANT, Ply, STATES_MAX, TABLE_NODES, TABLE_STEP_K,
};
use crate::plan::{GasPath, Plan};
use std::fmt::Write;
use std::time::Duration;

/// Invocations in a workgroup, so many of which carry a member: where each carries one, two subgroups of hardware, and no matter to a
/// software device.
pub fn workgroup(lanes: u32) -> u32 {
    if lanes == 1 { 64 } else { lanes }
}

/// Texels in a row of the tables: as wide as any device takes them.
pub const TEXELS_ABREAST: u32 = 4096;

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
    part!("exponential"),
    part!("table"),
    part!("material"),
    part!("decomposition"),
    part!("gas"),
    part!("faces"),
    part!("tridiagonal"),
    part!("reading"),
    part!("member"),
    part!("mixing"),
    part!("holder"),
    part!("reacting"),
    part!("flowing"),
    part!("carrying"),
    part!("conducting"),
    part!("system"),
    part!("sensors"),
    part!("gauges"),
    part!("energy"),
    part!("step"),
];

/// The entry point that carries members.
pub const MARCH: (&str, &str) = part!("march");

/// What the threads of a member hand to each other: nothing where one carries it, and much where a workgroup does.
pub const SINGLE_THREAD: (&str, &str) = part!("single_thread");
pub const COOPERATIVE: (&str, &str) = part!("cooperative");

/// A part with its columns where so many lanes of a member reach them; WGSL has no word of one's own for that.
pub fn placed(part: &str, lanes: u32) -> String {
    part.replace("<COLUMNS>", if lanes == 1 { "<private>" } else { "<workgroup>" })
}

/// What all parts use: the real number, its binary digits behind the first, a number so large that the next is one more,
/// whether tiny results are flushed to zero, and the constants of the physics.
pub fn head(precision: Precision) -> String {
    let (real, digits, whole, settles) = match precision {
        Precision::F32 => ("f32", 23, "12582912.0", true),
        Precision::F64 => ("f64", 52, "6755399441055744.0", false),
    };
    let constants = constants().into_iter().map(|(name, value)| format!("const {name} = {value:?};\n"));
    format!("alias real = {real};\nconst DIGITS = {digits}u;\nconst WHOLE = {whole};\nconst SETTLES = {settles};\n")
        + &constants.collect::<String>()
}

#[cfg(test)]
/// The text of a kernel that has room for a plan.
pub fn kernel(plan: &Plan, precision: Precision, texels: bool, lanes: u32, entry: (&str, &str)) -> String {
    columns(plan, lanes) + &of_any_length(plan, precision, texels, lanes, entry)
}

/// Lengths of the columns of a kernel, which may be longer than a plan has cells.
pub(super) fn columns(plan: &Plan, lanes: u32) -> String {
    let (cells, gas, pores, nodes) = (plan.cells(), gas_cells(plan), pore_cells(plan), node_cells(plan, lanes));
    format!(
        "const CELLS = {cells}u;\nconst GAS_CELLS = {gas}u;\nconst PORE_CELLS = {pores}u;\nconst NODE_CELLS = {nodes}u;\n"
    )
}

/// All else of the text of a kernel: the parts for a plan, whose tables are texels or not and whose members are carried by so many lanes each, and
/// an entry point. It is the same at both resolutions.
pub(super) fn of_any_length(
    plan: &Plan,
    precision: Precision,
    texels: bool,
    lanes: u32,
    entry: (&str, &str),
) -> String {
    let mut text = head(precision);
    let sizes = [
        ("LANES", lanes),
        ("PLIES", plan.plies.len() as u32),
        ("SENSORS", plan.places.len() as u32),
        ("PARTS", plan.parts as u32),
        ("SUBSTANCES", plan.rows.substances.len() as u32),
        ("STATES", plan.states as u32),
        ("LEVELS", plan.levels as u32),
        ("REACTIONS", plan.reactions.max(1) as u32),
        ("PATHS", plan.paths.len().max(1) as u32),
        ("HOLDER", u32::from(plan.has_holder)),
        ("DEPTHS", u32::from(plan.has_depths)),
        ("HEATS", HEATS as u32),
        ("TABLE_NODES", TABLE_NODES as u32),
        ("ABREAST", ABREAST as u32),
        ("TEXELS_ABREAST", TEXELS_ABREAST),
        ("AIR_PROPERTIES", AIR_PROPERTIES as u32),
        ("PROPERTIES", plan.properties() as u32),
        ("FACE_TABLE", plan.face_table() as u32),
        ("FACE_COLUMNS", FACE_COLUMNS as u32),
        ("STATES_MAX", STATES_MAX as u32),
        ("GAUGES", GAUGES as u32),
        ("NO_INSTANT", NO_INSTANT),
        ("WORKGROUP", workgroup(lanes)),
    ];
    let mut line = |words: std::fmt::Arguments<'_>| {
        text.write_fmt(words).expect("writing to a string cannot fail");
        text.push('\n');
    };
    for (name, value) in sizes {
        line(format_args!("const {name} = {value}u;"));
    }
    let has = |path| plan.gas == Some(path);
    let is = [
        ("TEXELS", texels),
        ("LOOKED_UP", node_cells(plan, lanes) == 1),
        ("GAS", plan.gas.is_some()),
        ("UNHINDERED", has(GasPath::Unhindered)),
        ("QUASI_STEADY", has(GasPath::QuasiSteady)),
        ("DARCY", has(GasPath::Darcy)),
        ("BACK_IS_OPEN", plan.back_is_open),
    ];
    for (name, value) in is {
        line(format_args!("const {name} = {value};"));
    }
    line(format_args!("const MIDDLE_PA = {:?};", plan.middle_pa));
    line(format_args!("const TABLE_STEP_K = {TABLE_STEP_K:?};"));
    line(format_args!(
        "// Generated from src/plan/layout.rs, src/march/gpu/layout.rs and src/march/gpu/state.rs.\n{}",
        declarations()
    ));
    let across = if lanes == 1 { SINGLE_THREAD } else { COOPERATIVE };
    for (name, part) in PARTS.iter().chain([&across, &entry]) {
        line(format_args!("// shaders/{name}.wgsl\n{}", placed(part, lanes)));
    }
    text
}

/// Cells of the columns of what the passes over the cells need of each: one where an invocation carries a member whose plies are one substance each at one
/// pressure, as it looks that up on its way.
fn node_cells(plan: &Plan, lanes: u32) -> usize {
    let is_plain = plan.gas.is_none() && plan.levels == 1 && plan.plies.iter().all(|ply| ply.rows == 1);
    if lanes == 1 && is_plain { 1 } else { plan.cells() }
}

/// Cells of columns for gas, and for what flows through pores: one where a plan has none, as WGSL has no array of none.
fn gas_cells(plan: &Plan) -> usize {
    if plan.gas.is_some() { plan.cells() } else { 1 }
}

fn pore_cells(plan: &Plan) -> usize {
    if plan.gas == Some(GasPath::Darcy) { plan.cells() } else { 1 }
}

/// Turns of all loops of one step, and of all that surrounds the steps of a dispatch, in one of so many lanes of a member: what a driver that
/// counts loops would count. Every loop takes a turn more, on which it ends. At most: passes over cells that have become one are counted
/// apart, which costs a dispatch more now and then, where a turn too few would cost a march.
pub fn loop_turns(plan: &Plan, lanes: u32) -> (u32, u32) {
    let (cells, plies, sensors) = (block(plan, lanes), plan.plies.len() as u32, plan.places.len() as u32);
    let whole = |turns: u32| turns + 1;
    let (cells_by_ply, faces) = (whole(2 * plies + cells), whole(2));
    // Properties, and on the way down a block's cells with those on both sides of it.
    let stage = cells_by_ply + cells_by_ply + 2 + faces;
    let advance = faces + whole(2) + 2 * stage + whole(cells) + cells_by_ply;
    let seen = 2 * whole(sensors);
    let sideways = if plan.has_holder { 4 * cells_by_ply } else { 0 };
    let steps = plan.places.iter().map(|place| 2 + place.steps_above + place.steps_below);
    let displaced = if plan.has_depths { steps.sum() } else { 0 };
    let carried = whole(cells) + whole(sensors) + whole(plies) + whole(HEATS as u32);
    let around = whole(cells) + 2 * carried + whole(plies) + whole(cells) + whole(plies) + cells_by_ply + 1;
    let (gas, gas_around) = gas_turns(plan, lanes);
    let (across, across_around) = if lanes == 1 { (0, 0) } else { turns_across(plan, lanes) };
    (1 + advance + seen + sideways + displaced + gas + across, around + gas_around + across_around)
}

/// Cells of the largest block.
fn block(plan: &Plan, lanes: u32) -> u32 {
    (plan.cells() as u32).div_ceil(lanes)
}

/// Those of what crosses from lane to lane.
fn turns_across(plan: &Plan, lanes: u32) -> (u32, u32) {
    let (cells, plies) = (plan.cells() as u32, plan.plies.len() as u32);
    let whole = |turns: u32| turns + 1;
    let solved = 2 * whole(block(plan, lanes)) + whole(lanes.ilog2() + 1);
    let behind = whole(block(plan, lanes)) + whole(lanes);
    // Two systems for either stage, what is behind at both, gauges, and a holder.
    let step = 4 * solved + 2 * behind + whole(cells) + 5 * whole(lanes);
    (step, 2 * whole(plies) + whole(sums(plan)) + (sums(plan) + 2 * plies + 2) * whole(lanes))
}

/// Sums that lanes of a member have in parts.
pub(super) fn sums(plan: &Plan) -> u32 {
    HEATS as u32 + if plan.gas.is_some() { 7 } else { 1 }
}

/// Those of mixtures, reactions and gas. The look that ends a loop counts too, which short loops in a loop over cells make
/// matter.
fn gas_turns(plan: &Plan, lanes: u32) -> (u32, u32) {
    let (cells, plies) = (block(plan, lanes), plan.plies.len() as u32);
    let each = |turns: &dyn Fn(u32, u32) -> u32| {
        let of = |ply: &Ply<u32>| turns(ply.states, ply.end_reaction - ply.first_reaction);
        let of_cells = |ply: &Ply<u32>| (ply.end_cell - ply.first_cell) * of(ply);
        let most = plan.plies.iter().map(of).max().unwrap_or(0);
        (plan.plies.iter().map(of_cells).sum::<u32>().min(cells * most), most)
    };
    let cells_by_ply = 2 * plies + cells + 1;
    // Volumes, density, weights, properties, enthalpies; of what is seen at an instant the volumes come from the reactions.
    let (blended, _) = each(&|states, _| 5 * states + 5);
    let (_, face) = each(&|states, reactions| reactions + 3 * states + 4);
    let blended = if plan.states > 1 || plan.levels > 1 { 2 * blended } else { 0 };
    // Either stage sees both faces, and the schedules of both are looked ahead; a sensor sees the cells on both sides.
    let faces = (6 + 2 * plan.places.len() as u32) * face;
    if plan.gas.is_none() {
        return (blended + faces, 0);
    }
    let (reacted, _) = each(&|states, reactions| 2 * states + reactions + 3);
    let by_ply = if plan.gas == Some(GasPath::Darcy) { 10 } else { 8 };
    let carried = by_ply * cells_by_ply + reacted + 3 * (cells + 1) + 3;
    let (porous, _) = each(&|states, reactions| reactions + 2 * states + 2);
    let pressed = if plan.gas == Some(GasPath::Darcy) { 2 * (cells_by_ply + porous) + 13 * cells + 15 } else { 0 };
    let (kept, _) = each(&|states, reactions| reactions + 3 * states + 3);
    (blended + faces + carried + pressed, 3 * cells * ((plan.reactions.max(1) + plan.states) as u32 + 3) + kept)
}

/// Loop turns a dispatch may take on a software device, which silently ends all loops of an invocation after 65,535 of
/// its own count (an inert layup's is a third more than ours, for reasons that the driver keeps), and the first dispatch on
/// hardware, where some tens of milliseconds keep clear of time-outs.
const TURNS_SOFTWARE: u32 = 40_000;
const TURNS_HARDWARE: u32 = 1_000_000;

/// Steps that one dispatch takes: as many as its loop turns allow, and one at least.
pub fn steps_a_dispatch(plan: &Plan, lanes: u32, is_software: bool) -> u32 {
    let (turns_step, turns_around) = loop_turns(plan, lanes);
    let turns = if is_software { TURNS_SOFTWARE } else { TURNS_HARDWARE };
    (turns.saturating_sub(turns_around) / turns_step).max(1)
}

/// Time that a dispatch is to take on hardware: long beside what submitting one costs, short beside what a display waits for.
const DISPATCH: Duration = Duration::from_millis(20);

/// Steps that take about that time, when so many took so long; one at least.
pub(super) fn steps_in_time(steps: u32, took: Duration) -> u32 {
    // No device is faster than a millionth of that, and a clock may stand still.
    let share = DISPATCH.div_duration_f64(took.max(DISPATCH / 1_000_000));
    ((f64::from(steps) * share) as u32).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;
    use std::path::Path;

    /// Or a device would compile twice what takes seconds once.
    #[test]
    fn both_resolutions_of_every_shipped_case_have_one_kernel() {
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases");
        let folders = shipped.read_dir().expect("cases are shipped").map(|entry| entry.expect("it can be read").path());
        let text = |plan: &Plan| of_any_length(plan, Precision::F32, true, 1, MARCH);
        for folder in folders.filter(|folder| folder.is_dir()) {
            let plan = Plan::new(&Case::load(&folder).expect("a shipped case loads"));
            let coarse = plan.coarse.as_deref().expect("a plan has both");
            assert!((coarse.cells()..=2 * coarse.cells()).contains(&plan.cells()), "{}", folder.display());
            assert_eq!(text(coarse), text(&plan), "{}", folder.display());
            assert_ne!(columns(coarse, 1), columns(&plan, 1), "{}: one has no room for the other", folder.display());
            let mut other = plan.clone();
            other.levels += 1;
            assert_ne!(text(&other), text(&plan), "{}: of other tables", folder.display());
        }
    }

    #[test]
    fn a_dispatch_takes_a_fiftieth_of_a_second_however_fast_the_device() {
        let ms = Duration::from_millis;
        assert_eq!(steps_in_time(400, ms(200)), 40);
        assert_eq!(steps_in_time(400, ms(2)), 4000);
        assert_eq!(steps_in_time(3, ms(5000)), 1, "a step is not cut");
        assert!(steps_in_time(400, ms(0)) > 400, "too short to be told");
    }
}
