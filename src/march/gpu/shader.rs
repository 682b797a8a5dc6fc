//! Assembly of the kernel sources.
//!
//! WGSL needs no order of declaration, so a kernel is the concatenation of its source files, each after a comment with
//! its path, to which naga's excerpts then point. The precision is one line, sizes are constants: private arrays cannot
//! be sized by pipeline constants, so the source depends on the plan, and also serves plans with fewer cells.

use super::layout::declarations;
use super::spirv::MAX_INITIALISED_LENGTH;
use crate::march::Precision;
use crate::physics::constants;
use crate::physics::layout::{
    AIR_PROPERTIES, COLUMNS_PER_LOAD, ENTHALPY_COLUMNS, GAUGES, GasTransport, HEAT_TOTALS, MAX_STATES, NO_INSTANT, Ply,
    STEEP_COLUMNS, TABLE_STEP_K, TABLE_STEPS, TableLocation,
};
use crate::physics::step::CAPACITY_REDUCTIONS;
use crate::plan::Plan;
use std::fmt::Write;
use std::time::Duration;

/// Threads in a workgroup: of one member in the cooperative kernel; otherwise two subgroups of most hardware, which a
/// software device does not mind.
pub fn workgroup_size(threads: u32) -> u32 {
    if threads == 1 { 64 } else { threads }
}

/// Texels in a row of the table texture: the largest width that every device supports.
pub const TEXELS_PER_ROW: u32 = 4096;

macro_rules! source {
    ($name:literal) => {
        ($name, include_str!(concat!("../../../shaders/", $name, ".wgsl")))
    };
}

/// Source files of pure functions and their data, in reading order.
pub const SOURCES: &[(&str, &str)] = &[
    source!("prelude"),
    source!("layout"),
    source!("compensated"),
    source!("exponential"),
    source!("table"),
    source!("material"),
    source!("decomposition"),
    source!("gas"),
    source!("surface_flux"),
    source!("tridiagonal"),
    source!("thermocouple"),
    source!("member"),
    source!("mixture"),
    source!("holder"),
    source!("pyrolysis"),
    source!("darcy_flow"),
    source!("gas_advection"),
    source!("conduction"),
    source!("system"),
    source!("sensors"),
    source!("gauges"),
    source!("energy"),
    source!("step"),
];

/// The entry point that marches members.
pub const MARCH: (&str, &str) = source!("march");

/// Communication between the threads of a member: none in the single-thread kernel, through workgroup memory in the
/// cooperative one.
pub const SINGLE_THREAD: (&str, &str) = source!("single_thread");
pub const COOPERATIVE: (&str, &str) = source!("cooperative");

/// A source with its columns in the address space of the kernel, which WGSL cannot parametrise.
pub fn with_address_space(part: &str, threads: u32) -> String {
    part.replace("<COLUMNS>", if threads == 1 { "<private>" } else { "<workgroup>" })
}

/// Common declarations: the real type, its mantissa digits, the constant that rounds to an integer when added, whether
/// tiny results are flushed to zero, and the constants of the physics.
pub fn preamble(precision: Precision) -> String {
    let (real, digits, rounding, settles) = match precision {
        Precision::F32 => ("f32", 23, "12582912.0", true),
        Precision::F64 => ("f64", 52, "6755399441055744.0", false),
    };
    let constants = constants().into_iter().map(|(name, value)| format!("const {name} = {value:?};\n"));
    format!(
        "alias real = {real};\nconst MANTISSA_BITS = {digits}u;\nconst ROUNDING_CONSTANT = {rounding};\n\
         const FLUSHES_TINY = {settles};\n"
    ) + &constants.collect::<String>()
}

#[cfg(test)]
/// The source of a kernel whose columns have the cells of a plan.
pub fn kernel(plan: &Plan, precision: Precision, texels: bool, threads: u32, entry: (&str, &str)) -> String {
    column_lengths(plan, plan.cells(), threads) + &source_without_lengths(plan, precision, texels, threads, entry)
}

/// The lengths of columns that are private to a thread are multiples of this, so that one kernel serves plans of
/// similar size. It exceeds [`MAX_INITIALISED_LENGTH`], as initialised columns of a few cells compile twice as long.
const COLUMN_STEP: usize = 64;
const _: () = assert!(COLUMN_STEP > MAX_INITIALISED_LENGTH as usize);

/// Length of the columns for a plan, at most `most` unless the plan has more cells. Workgroup memory is scarce: there
/// it is the number of cells.
pub(super) fn column_cells(plan: &Plan, most: usize, threads: u32) -> usize {
    let cells = plan.cells();
    if threads == 1 { cells.next_multiple_of(COLUMN_STEP).min(most).max(cells) } else { cells }
}

/// Declarations of the column lengths, for a number of cells that may exceed that of the plan.
pub(super) fn column_lengths(plan: &Plan, cells: usize, threads: u32) -> String {
    let gas = if plan.rows.gas.is_some() { cells } else { 1 };
    let pores = if plan.rows.gas == Some(GasTransport::Darcy) { cells } else { 1 };
    let nodes = if looks_up_in_sweep(plan, threads) { 1 } else { cells };
    let enthalpies = if plan.rows.has_enthalpy_steps { cells } else { 1 };
    let next_phases = if plan.rows.gas.is_some() { enthalpies } else { 1 };
    format!(
        "const CELLS = {cells}u;\nconst GAS_CELLS = {gas}u;\nconst PORE_CELLS = {pores}u;\n\
         const NODE_CELLS = {nodes}u;\nconst ENTHALPY_CELLS = {enthalpies}u;\n\
         const NEXT_PHASE_CELLS = {next_phases}u;\n"
    )
}

/// The rest of the source, with the given table access, threads per member and entry point. It is the same at both
/// resolutions.
pub(super) fn source_without_lengths(
    plan: &Plan,
    precision: Precision,
    texels: bool,
    threads: u32,
    entry: (&str, &str),
) -> String {
    let mut text = preamble(precision);
    let sizes = [
        ("THREADS_PER_MEMBER", threads),
        ("PLIES", plan.rows.plies.len() as u32),
        ("SENSORS", plan.rows.sensor_locations.len() as u32),
        ("PARTS", plan.rows.conductivity_parts as u32),
        ("STATE_ROWS", plan.rows.data.state_properties.len() as u32),
        ("STATES", plan.rows.max_states as u32),
        ("TABLES", plan.rows.tables.len() as u32),
        ("PRESSURE_LEVELS", plan.rows.data.pressure_levels.len() as u32),
        ("PORE_CLASSES", plan.rows.data.pore_classes.len().max(1) as u32),
        ("INITIAL_BENDS", plan.rows.data.initial_bends.len().max(1) as u32),
        ("REACTIONS", plan.rows.max_reactions.max(1) as u32),
        ("REACTION_ROWS", plan.rows.reaction_paths.len().max(1) as u32),
        ("HOLDER", u32::from(plan.rows.has_holder)),
        ("DEPTHS", u32::from(plan.rows.has_depth_factors)),
        ("LIMITS", u32::from(plan.rows.has_limit_rows())),
        ("HEAT_TOTALS", HEAT_TOTALS as u32),
        ("TABLE_STEPS", TABLE_STEPS as u32),
        ("COLUMNS_PER_LOAD", COLUMNS_PER_LOAD as u32),
        ("TEXELS_PER_ROW", TEXELS_PER_ROW),
        ("AIR_PROPERTIES", AIR_PROPERTIES as u32),
        ("PROPERTIES", plan.rows.properties() as u32),
        ("ENTHALPY_COLUMNS", ENTHALPY_COLUMNS as u32),
        ("STEEP_COLUMNS", STEEP_COLUMNS as u32),
        ("MAX_STATES", MAX_STATES as u32),
        ("GAUGES", GAUGES as u32),
        ("NO_INSTANT", NO_INSTANT),
        ("WORKGROUP", workgroup_size(threads)),
    ];
    let mut line = |words: std::fmt::Arguments<'_>| {
        text.write_fmt(words).expect("writing to a string cannot fail");
        text.push('\n');
    };
    for (name, value) in sizes {
        line(format_args!("const {name} = {value}u;"));
    }
    let has = |path| plan.rows.gas == Some(path);
    let is = [
        ("TEXELS", texels),
        ("PROPERTIES_IN_SWEEP", looks_up_in_sweep(plan, threads)),
        ("GAS", plan.rows.gas.is_some()),
        ("UNHINDERED", has(GasTransport::Instantaneous)),
        ("QUASI_STEADY", has(GasTransport::QuasiSteady)),
        ("DARCY", has(GasTransport::Darcy)),
        ("BACK_IS_OPEN", plan.rows.back_is_open),
        ("DIRECTORIES", plan.rows.tables.iter().any(|table| table.directory > 0)),
        ("ENTHALPY_STEPS", plan.rows.has_enthalpy_steps),
        ("STEEP_CONDUCTIVITIES", plan.rows.has_steep_conductivities),
        ("DEPENDS_ON_PRESSURE", plan.rows.plies.iter().any(|ply| ply.depends_on_pressure == 1)),
    ];
    for (name, value) in is {
        line(format_args!("const {name} = {value};"));
    }
    line(format_args!("const TABLE_STEP_K = {TABLE_STEP_K:?};"));
    line(format_args!(
        "// Generated from src/physics/layout.rs, src/march/gpu/layout.rs and src/march/gpu/state.rs.\n{}",
        declarations()
    ));
    let across = if threads == 1 { SINGLE_THREAD } else { COOPERATIVE };
    for (name, part) in SOURCES.iter().chain([&across, &entry]) {
        line(format_args!("// shaders/{name}.wgsl\n{}", with_address_space(part, threads)));
    }
    text
}

/// Whether properties are looked up in the sweep and have no columns: where a single thread marches a member whose
/// plies have one tabulated state, whose conductivity follows no changing pressure and is not integrated, and steps
/// advance temperatures.
fn looks_up_in_sweep(plan: &Plan, threads: u32) -> bool {
    let is_plain =
        plan.rows.gas.is_none() && plan.rows.plies.iter().all(|ply| ply.rows == 1 && ply.depends_on_pressure == 0);
    threads == 1 && is_plain && !plan.rows.has_enthalpy_steps && !plan.rows.has_steep_conductivities
}

/// Loop iterations of one step, and of the code around the steps of a dispatch, in one thread: the count that some
/// drivers limit. Every loop counts one iteration more for its exit. An upper bound: fused loops over cells are counted
/// separately. Overestimating costs a dispatch more now and then; underestimating would cost a march.
pub fn loop_iterations(plan: &Plan, threads: u32) -> (u32, u32) {
    let (cells, plies, sensors) =
        (cells_per_thread(plan, threads), plan.rows.plies.len() as u32, plan.rows.sensor_locations.len() as u32);
    let with_exit = |turns: u32| turns + 1;
    let (cells_by_ply, faces) = (with_exit(2 * plies + cells), with_exit(2));
    // Properties; in the forward elimination the cells of a block and their neighbours on both sides.
    let stage = cells_by_ply + cells_by_ply + 2 + faces;
    let advance = faces + with_exit(2) + 2 * stage + with_exit(cells) + cells_by_ply;
    let readings = 2 * with_exit(sensors);
    let holder = if plan.rows.has_holder { 4 * cells_by_ply } else { 0 };
    let steps = plan.rows.sensor_locations.iter().map(|place| 2 + place.steps_above + place.steps_below);
    let displaced_sensors = if plan.rows.has_depth_factors { steps.sum() } else { 0 };
    let initial_bends = if plan.rows.has_depth_factors {
        sensors * with_exit(plan.rows.data.initial_bends.len().max(1) as u32)
    } else {
        0
    };
    let nodes = plan.rows.sensor_locations.iter().map(|place| 2 + place.end_node - place.first_node + 2 * place.faces);
    let hottest = if plan.rows.has_limit_rows() { nodes.sum() } else { 0 };
    let state = with_exit(cells) + with_exit(sensors) + with_exit(plies) + with_exit(HEAT_TOTALS as u32);
    let around =
        with_exit(cells) + 2 * state + with_exit(plies) + with_exit(cells) + with_exit(plies) + cells_by_ply + 1;
    let (gas, gas_around) = gas_iterations(plan, threads);
    let search = |table: &TableLocation<u32>| table.enthalpy_search_span.checked_ilog2().map_or(0, |log| log + 2);
    let search = plan.rows.tables.iter().map(search).max().unwrap_or(0);
    // Sums over the tabulated states at each row of the search and at eight others, and their weights.
    let states = plan.rows.plies.iter().map(|ply| ply.rows).max().unwrap_or(1);
    let search = if search > 0 { (search + 8) * (1 + states) + 2 * states } else { 0 };
    let rises = cells_by_ply + cells * search;
    let reductions = CAPACITY_REDUCTIONS as u32;
    let enthalpies = if search > 0 {
        reductions * (2 * cells_by_ply + 2 * with_exit(cells) + 2 * rises + 3)
            + 2 * rises
            + with_exit(cells * plan.rows.max_states as u32)
    } else {
        0
    };
    let steep = if plan.rows.has_steep_conductivities { 2 * cells * steep_iterations(plan) } else { 0 };
    let (across, across_around) = if threads == 1 { (0, 0) } else { communication_iterations(plan, threads) };
    (
        1 + advance + readings + holder + displaced_sensors + hottest + enthalpies + steep + gas + across,
        around + initial_bends + gas_around + across_around,
    )
}

/// Iterations of the integral of the conductivities between two cells: their phases and weights, the pressure levels,
/// and the states at two of these.
fn steep_iterations(plan: &Plan) -> u32 {
    let of = |ply: &Ply<u32>| 2 * (4 * ply.states + 6) + ply.levels + 2 * (ply.rows + 2) + 1;
    plan.rows.plies.iter().map(of).max().unwrap_or(0)
}

/// Cells of a thread, at most.
fn cells_per_thread(plan: &Plan, threads: u32) -> u32 {
    (plan.cells() as u32).div_ceil(threads)
}

/// Iterations of the communication between threads, per step and around.
fn communication_iterations(plan: &Plan, threads: u32) -> (u32, u32) {
    let (cells, plies) = (plan.cells() as u32, plan.rows.plies.len() as u32);
    let with_exit = |turns: u32| turns + 1;
    let solved = 2 * with_exit(cells_per_thread(plan, threads)) + with_exit(threads.ilog2() + 1);
    let neighbours = with_exit(cells_per_thread(plan, threads)) + with_exit(threads);
    // Two systems per stage, those with lower heat capacities, the neighbour blocks at both, gauges, and the holder.
    let reductions = if plan.rows.has_enthalpy_steps { CAPACITY_REDUCTIONS as u32 } else { 0 };
    let step = 4 * solved
        + reductions * (solved + with_exit(threads))
        + 2 * neighbours
        + with_exit(cells)
        + 5 * with_exit(threads);
    (
        step,
        2 * with_exit(plies)
            + with_exit(partial_sums(plan))
            + (partial_sums(plan) + 2 * plies + 2) * with_exit(threads),
    )
}

/// Number of sums that the threads of a member accumulate in parts.
pub(super) fn partial_sums(plan: &Plan) -> u32 {
    HEAT_TOTALS as u32 + if plan.rows.gas.is_some() { 7 } else { 1 }
}

/// Iterations of mixtures, reactions and gas, per step and around. Loop exits count too, which matters for short loops
/// inside a loop over cells.
fn gas_iterations(plan: &Plan, threads: u32) -> (u32, u32) {
    let (cells, plies) = (cells_per_thread(plan, threads), plan.rows.plies.len() as u32);
    let each = |turns: &dyn Fn(u32, u32) -> u32| {
        let of = |ply: &Ply<u32>| turns(ply.states, ply.end_reaction - ply.first_reaction);
        let of_cells = |ply: &Ply<u32>| (ply.end_cell - ply.first_cell) * of(ply);
        let most = plan.rows.plies.iter().map(of).max().unwrap_or(0);
        (plan.rows.plies.iter().map(of_cells).sum::<u32>().min(cells * most), most)
    };
    let cells_by_ply = 2 * plies + cells + 1;
    // Volumes, density, weights, properties, enthalpies; at an instant the volumes follow from the reactions.
    let (mixture, _) = each(&|states, _| 5 * states + 5);
    let (_, face) = each(&|states, reactions| reactions + 3 * states + 4);
    let depends_on_pressure = plan.rows.plies.iter().any(|ply| ply.depends_on_pressure == 1);
    let mixture = if plan.rows.max_states > 1 || depends_on_pressure { 2 * mixture } else { 0 };
    // Loops over each cell at both stages and at a sensor: levels, and pores of every state at two levels.
    let most = |of: &dyn Fn(&Ply<u32>) -> u32| plan.rows.plies.iter().map(of).max().unwrap_or(0);
    let classes = plan.rows.data.pore_classes.len() as u32;
    let levels = most(&|ply| ply.levels + 2 * ply.rows * (classes + 1));
    let sensors = plan.rows.sensor_locations.len() as u32;
    let mixture = mixture + if depends_on_pressure { 2 * (cells + 2 * sensors) * levels } else { 0 };
    // Each stage evaluates both faces and looks ahead in both schedules; a sensor reads the cells on both sides.
    let faces = (6 + 2 * plan.rows.sensor_locations.len() as u32) * face;
    if plan.rows.gas.is_none() {
        return (mixture + faces, 0);
    }
    let (kinetics, _) = each(&|states, reactions| 2 * states + reactions + 3);
    let by_ply = if plan.rows.gas == Some(GasTransport::Darcy) { 10 } else { 8 };
    let advection = by_ply * cells_by_ply + kinetics + 3 * (cells + 1) + 3;
    let (pores, _) = each(&|states, reactions| reactions + 2 * states + 2);
    let darcy =
        if plan.rows.gas == Some(GasTransport::Darcy) { 2 * (cells_by_ply + pores) + 13 * cells + 15 } else { 0 };
    let (state, _) = each(&|states, reactions| reactions + 3 * states + 3);
    (
        mixture + faces + advection + darcy,
        3 * cells * ((plan.rows.max_reactions.max(1) + plan.rows.max_states) as u32 + 3) + state,
    )
}

/// Loop iterations of a dispatch. A software device silently ends all loops of an invocation after 65,535 iterations by
/// its own count, which for an inert layup exceeds ours by a third for unknown reasons. On hardware the limit is for
/// the first dispatch: some tens of milliseconds, far from time-outs.
const MAX_ITERATIONS_SOFTWARE: u32 = 40_000;
const MAX_ITERATIONS_HARDWARE: u32 = 1_000_000;

/// Steps per dispatch within the limit of loop iterations; at least one.
pub fn steps_per_dispatch(plan: &Plan, threads: u32, is_software: bool) -> u32 {
    let (turns_step, turns_around) = loop_iterations(plan, threads);
    let turns = if is_software { MAX_ITERATIONS_SOFTWARE } else { MAX_ITERATIONS_HARDWARE };
    (turns.saturating_sub(turns_around) / turns_step).max(1)
}

/// Target duration of a dispatch on hardware: long compared with the cost of submission, short compared with display
/// time-outs.
const DISPATCH_TIME: Duration = Duration::from_millis(20);

/// Steps per dispatch for the target duration, given that `steps` steps took `took`; at least one.
pub(super) fn steps_in_time(steps: u32, took: Duration) -> u32 {
    // A lower bound on the time, as a clock may not advance.
    let share = DISPATCH_TIME.div_duration_f64(took.max(DISPATCH_TIME / 1_000_000));
    ((f64::from(steps) * share) as u32).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;
    use std::path::Path;

    /// Otherwise a device would compile twice, seconds each.
    #[test]
    fn both_resolutions_of_every_shipped_case_have_one_kernel() {
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases");
        let folders =
            shipped.read_dir().expect("cases are shipped").map(|entry| entry.expect("a readable entry").path());
        let text = |plan: &Plan| source_without_lengths(plan, Precision::F32, true, 1, MARCH);
        for folder in folders.filter(|folder| folder.is_dir()) {
            let plan = Plan::new(&Case::load(&folder).expect("a shipped case loads"));
            let coarse = plan.coarse.as_deref().expect("a plan has a coarse one");
            assert!((coarse.cells()..=2 * coarse.cells()).contains(&plan.cells()), "{}", folder.display());
            assert_eq!(text(coarse), text(&plan), "{}", folder.display());
            let mut other = plan.clone();
            other.rows.tables[0].directory = 4;
            other.rows.has_enthalpy_steps = true;
            assert_ne!(text(&other), text(&plan), "{}: same source with other tables", folder.display());
        }
    }

    /// The driver stores compiled kernels by their source, so that a later session need not compile.
    #[test]
    fn plans_of_similar_size_have_one_kernel() {
        let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases");
        let mut case = Case::load(&cases.join("lcat-2259")).expect("a shipped case loads");
        let mut lengths = |cells: usize| {
            case.resolution.cells = cells;
            let plan = Plan::new(&case);
            (plan.cells(), column_lengths(&plan, column_cells(&plan, 1000, 1), 1))
        };
        let [(fewer, short), (more, long), (most, longest)] = [80, 120, 140].map(&mut lengths);
        assert!(64 < fewer && fewer < more && more <= 128 && 128 < most, "{fewer}, {more} and {most} cells");
        assert_eq!(short, long);
        assert_ne!(longest, long);
        let plan = Plan::new(&case);
        assert_eq!(column_cells(&plan, most + 1, 1), most + 1, "more than a device can hold");
        assert_eq!(column_cells(&plan, 100, 1), most, "fewer than the plan has");
        assert_eq!(column_cells(&plan, 1000, 32), most, "in workgroup memory");
    }

    #[test]
    fn dispatches_take_twenty_milliseconds_on_every_device() {
        let ms = Duration::from_millis;
        assert_eq!(steps_in_time(400, ms(200)), 40);
        assert_eq!(steps_in_time(400, ms(2)), 4000);
        assert_eq!(steps_in_time(3, ms(5000)), 1, "at least one step");
        assert!(steps_in_time(400, ms(0)) > 400, "below the resolution of the clock");
    }
}
