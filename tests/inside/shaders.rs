//! Tests of the shaders without a device: kernels compile, functions match their twins, and no dispatch exceeds the
//! loop limit.

use crate::support::{LAVAPIPE_LOOP_LIMIT, UNIFORM_BUFFERS, case, cases, modified, text, with_factor};
use bondline::case::{Case, Property};
use bondline::march::Precision;
use bondline::march::gpu::COOPERATIVE_THREADS;
use bondline::march::gpu::shader::{self, loop_iterations};
use bondline::physics::TWINS;
use bondline::plan::Plan;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{AddressSpace, Module};

/// Every shipped case, and one with factors on the parts of a conductivity.
pub(crate) fn all() -> Vec<Case> {
    let mut cases = cases();
    cases.push(with_factor(&case("lcat-2259"), "INS", Property::ConductivityGas));
    cases
}

pub(crate) fn kernel(case: &Case, precision: Precision) -> String {
    in_lanes(case, precision, 1)
}

fn in_lanes(case: &Case, precision: Precision, lanes: u32) -> String {
    shader::kernel(&Plan::new(case), precision, precision == Precision::F32, lanes, shader::MARCH)
}

/// The module of a text that parses and validates.
pub(crate) fn compiled(text: &str) -> Result<Module, String> {
    let module = naga::front::wgsl::parse_str(text).map_err(|error| error.emit_to_string(text))?;
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::FLOAT64);
    validator.validate(&module).map_err(|error| error.emit_to_string(text))?;
    Ok(module)
}

#[test]
fn the_kernel_of_every_case_compiles_in_both_precisions() {
    for case in all() {
        for precision in [Precision::F32, Precision::F64] {
            for lanes in [1, COOPERATIVE_THREADS] {
                if let Err(error) = compiled(&in_lanes(&case, precision, lanes)) {
                    panic!("{} in {precision:?} on {lanes} threads: {error}", case.id());
                }
            }
        }
    }
    assert_eq!(
        Plan::new(&all()[cases().len()]).rows.conductivity_parts,
        3,
        "the last case has a conductivity in three parts"
    );
}

#[test]
fn a_kernel_that_mixes_precisions_is_refused() {
    let text = kernel(&case("slab"), Precision::F64);
    let invalid = text.replace("now.flux) * real(GAMMA)", "now.flux) * f32(GAMMA)");
    assert_ne!(text, invalid);
    assert!(compiled(&invalid).is_err());
}

fn uniform_buffers(text: &str) -> usize {
    let module = compiled(text).unwrap_or_else(|error| panic!("{error}"));
    module.global_variables.iter().filter(|(_, variable)| variable.space == AddressSpace::Uniform).count()
}

#[test]
fn no_kernel_binds_more_uniform_buffers_than_lavapipe_compiles_correctly() {
    for case in all() {
        for precision in [Precision::F32, Precision::F64] {
            for lanes in [1, COOPERATIVE_THREADS] {
                let text = in_lanes(&case, precision, lanes);
                assert!(uniform_buffers(&text) <= UNIFORM_BUFFERS, "{} in {precision:?} on {lanes} threads", case.id());
                let more = text.replacen(
                    "var<storage, read> contacts_m2_k_w: array<real>",
                    "var<uniform> contacts_m2_k_w: array<vec4<real>, 2>",
                    1,
                );
                let more = more.replace("contacts_m2_k_w[p - 1u]", "contacts_m2_k_w[p - 1u].x");
                assert!(uniform_buffers(&more) > UNIFORM_BUFFERS, "one more passed");
            }
        }
    }
}

/// Functions that only one of two twins has, and why.
const ONE_SIDED: &[(&str, &str, &str)] = &[
    ("member", "width_m", "the processor reads slices of rows, to spare bounds checks; the device has `cell_width_m`"),
    ("member", "record", "the processor passes readings to its caller, the device writes them to a buffer"),
    ("member", "bead_temperature_k", "the host reads results with it; the device writes them to buffers"),
    ("tridiagonal", "factorise", "WGSL does not pass workgroup memory by reference: see the one of darcy_flow"),
    ("tridiagonal", "substitute", "see the one of darcy_flow"),
    ("darcy_flow", "factorise", "see the one of tridiagonal"),
    ("darcy_flow", "substitute", "see the one of tridiagonal"),
    ("table", "row_segment", "the processor evaluates the offsets of a ply before it reads any row"),
    ("pyrolysis", "reaction_exposures", "a device hides the latency of exponentials by its other threads"),
    ("system", "boundary_row_of", "dynamic indexing is slow to compile in WGSL"),
    ("conduction", "ply_properties", "the processor evaluates a ply at once, with these values in registers"),
    ("conduction", "node_columns", "the processor slices columns first, to spare bounds checks"),
    ("member", "heat_j_m2", "the host reads results with it; the device writes them to buffers"),
    ("member", "stored_j_m2", "the host reads results with it; the device writes them to buffers"),
    ("member", "gas_balance", "the host reads results with it; the device writes them to buffers"),
    ("member", "extremes_k", "the host reads results with it; the device writes them to buffers"),
    ("member", "diverged_at", "the host reads results with it; the device writes them to buffers"),
    ("member", "plan", "the device reads the plan from its buffers"),
    ("member", "plies", "the host reads results with it; the device writes them to buffers"),
    ("system", "node_above", "one copy of a row's code for the processor; the device calls its rows"),
    ("system", "cells_and_covered_faces", "see node_above"),
    ("system", "integrates_conductivity", "a copy of the sweeps for either kind of conductivity"),
    ("system", "assemble_within", "see integrates_conductivity"),
    ("table", "new", "a loop of the processor for each kind of search; the device branches"),
    ("table", "in_steps", "see new"),
    ("table", "index_by_steps", "see new"),
    ("table", "index_by_list", "see new"),
    ("table", "index_by_directory", "see new"),
];

/// Functions of a text in order, without the one-sided ones.
fn functions<'a>(twin: &str, text: &'a str) -> Vec<&'a str> {
    let text = text.split("#[cfg(test)]").next().unwrap_or_default();
    text.lines()
        .map(|line| line.trim_start().trim_start_matches("pub ").trim_start_matches("pub(super) "))
        .filter_map(|line| line.strip_prefix("fn "))
        .filter_map(|rest| rest.split(['(', '<']).next())
        .filter(|name| !ONE_SIDED.iter().any(|(file, function, _)| *file == twin && function == name))
        .collect()
}

#[test]
fn twin_files_hold_the_same_functions_in_the_same_order() {
    for twin in TWINS {
        let (rust, wgsl) = (text(&format!("src/physics/{twin}.rs")), text(&format!("shaders/{twin}.wgsl")));
        assert!(!functions(twin, &rust).is_empty(), "{twin}: no functions found");
        assert_eq!(functions(twin, &rust), functions(twin, &wgsl), "twin {twin}");
    }
}

#[test]
fn every_shader_of_the_physics_has_a_twin() {
    let host_only = ["prelude", "layout"];
    let parts: Vec<&str> = shader::SOURCES.iter().map(|part| part.0).filter(|name| !host_only.contains(name)).collect();
    assert_eq!(parts, TWINS);
    for (file, function, _) in ONE_SIDED {
        let sides = [format!("src/physics/{file}.rs"), format!("shaders/{file}.wgsl")].map(|path| text(&path));
        let there = sides.map(|side| ["(", "<"].iter().any(|open| side.contains(&format!("fn {function}{open}"))));
        assert_ne!(there[0], there[1], "{file}: {function} is listed as one-sided");
    }
}

/// Functions that only the cooperative kernel has.
const COOPERATIVE_ONLY: [&str; 6] =
    ["reduce_sum_pair", "get_sum", "set_sum", "empty_block", "append_row", "solve_reduced"];

/// Functions of the single-thread and of the cooperative text, without those of the latter only.
fn common_functions(shared: &str) -> [Vec<String>; 2] {
    [&text("shaders/single_thread.wgsl"), shared].map(|text| {
        let names = functions("lanes", text).into_iter().filter(|name| !COOPERATIVE_ONLY.contains(name));
        names.map(str::to_owned).collect()
    })
}

#[test]
fn single_thread_and_cooperative_kernels_have_the_same_functions() {
    let shared = text("shaders/cooperative.wgsl");
    let [single, cooperative] = common_functions(&shared);
    assert_eq!(single, cooperative);
    let [single, renamed] = common_functions(&shared.replacen("fn end_halo_cell(", "fn halo_end(", 1));
    assert_ne!(single, renamed);
}

#[test]
fn a_function_missing_or_moved_is_caught() {
    let (rust, wgsl) = (text("src/physics/material.rs"), text("shaders/material.wgsl"));
    let missing = wgsl.replacen("fn conductance_slope_across(", "fn gain_over(", 1);
    assert_ne!(functions("material", &rust), functions("material", &missing));
    let (before, after) = wgsl.split_at(wgsl.find("fn conductance_within(").expect("it is there"));
    let moved = format!("{after}{before}");
    assert_ne!(functions("material", &rust), functions("material", &moved));
}

/// Loop turns of the longest dispatch of a plan on the software device.
fn turns(plan: &Plan, lanes: u32) -> u32 {
    let (turns_step, turns_around) = loop_iterations(plan, lanes);
    shader::steps_per_dispatch(plan, lanes, true) * turns_step + turns_around
}

fn with_cells(cells: usize) -> Case {
    modified(&case("lcat-2259"), |case| case.resolution.cells = cells)
}

#[test]
fn no_dispatch_exceeds_the_loop_limit_of_the_software_device() {
    // The last has the largest number of cells of a case file.
    for case in all().into_iter().chain([with_cells(1024)]) {
        for lanes in [1, COOPERATIVE_THREADS] {
            let turns = turns(&Plan::new(&case), lanes);
            assert!(
                turns < LAVAPIPE_LOOP_LIMIT,
                "{}, {} cells: {turns} loop turns",
                case.id(),
                case.resolution().cells
            );
        }
    }
}

#[test]
fn a_step_that_exceeds_the_loop_limit_is_caught() {
    // Eight times the largest number of cells of a case file.
    assert!(turns(&Plan::with_refinement(&with_cells(1024), 8, 1), 1) > LAVAPIPE_LOOP_LIMIT);
}
