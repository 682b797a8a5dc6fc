//! What can be known of the shaders without a device: they compile, their functions are those of their twins, and no dispatch
//! runs out of loops.

use crate::support::{LOOPS_ENDED, UNIFORM_BUFFERS, case, cases, changed, text, with_factor};
use bondline::case::{Case, Property};
use bondline::march::Precision;
use bondline::march::gpu::LANES;
use bondline::march::gpu::shader::{self, loop_turns};
use bondline::physics::TWINS;
use bondline::plan::Plan;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{AddressSpace, Module};

/// Every shipped case, and one whose factors tell the parts of a conductivity apart.
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
            for lanes in [1, LANES] {
                if let Err(error) = compiled(&in_lanes(&case, precision, lanes)) {
                    panic!("{} in {precision:?} on {lanes} lanes: {error}", case.id());
                }
            }
        }
    }
    assert_eq!(Plan::new(&all()[cases().len()]).parts, 3, "the last case has a conductivity in three parts");
}

#[test]
fn a_kernel_that_mixes_precisions_is_refused() {
    let text = kernel(&case("slab"), Precision::F64);
    let spoiled = text.replace("now.flux) * real(GAMMA)", "now.flux) * f32(GAMMA)");
    assert_ne!(text, spoiled);
    assert!(compiled(&spoiled).is_err());
}

fn uniform_buffers(text: &str) -> usize {
    let module = compiled(text).unwrap_or_else(|error| panic!("{error}"));
    module.global_variables.iter().filter(|(_, variable)| variable.space == AddressSpace::Uniform).count()
}

#[test]
fn no_kernel_binds_more_uniform_buffers_than_a_driver_compiles_without_spoiling_memory() {
    for case in all() {
        for precision in [Precision::F32, Precision::F64] {
            for lanes in [1, LANES] {
                let text = in_lanes(&case, precision, lanes);
                assert!(uniform_buffers(&text) <= UNIFORM_BUFFERS, "{} in {precision:?} on {lanes} lanes", case.id());
                let more = text.replacen(
                    "var<storage, read> contacts: array<real>",
                    "var<uniform> contacts: array<vec4<real>, 2>",
                    1,
                );
                let more = more.replace("contacts[p - 1u]", "contacts[p - 1u].x");
                assert!(uniform_buffers(&more) > UNIFORM_BUFFERS, "another passed");
            }
        }
    }
}

/// Functions that only one side of a twin has, and why.
const ONE_SIDED: &[(&str, &str, &str)] = &[
    ("member", "note", "the processor hands readings to its caller, the device writes them to a binding"),
    ("compensated", "lane", "the host reads a member through it; the device has bindings"),
    ("member", "shown_k", "the host reads a member through it; the device has bindings"),
    (
        "tridiagonal",
        "factorise",
        "the device's are beside their one system, as WGSL lends no memory of a workgroup: see flowing",
    ),
    ("tridiagonal", "substitute", "the device's are beside their one system: see flowing"),
    ("flowing", "factorise", "the host's are lent columns: see tridiagonal"),
    ("flowing", "substitute", "the host's are lent columns: see tridiagonal"),
    ("table", "read", "the processor places all cells of a ply before it reads any row"),
    ("system", "edge_of", "the host picks a row by its number; that costs a driver, see there"),
    ("conducting", "nodes", "the host cuts columns before it reads nodes from them"),
    ("member", "heat_j_m2", "the host reads a member through it; the device has bindings"),
    ("member", "stored_j_m2", "the host reads a member through it; the device has bindings"),
    ("member", "gone", "the host reads a member through it; the device has bindings"),
    ("member", "extremes_k", "the host reads a member through it; the device has bindings"),
    ("member", "strayed", "the host reads a member through it; the device has bindings"),
];

/// Functions in the order of a text, but for those of one side.
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
fn every_part_of_the_physics_has_a_twin() {
    let host_only = ["prelude", "layout"];
    let parts: Vec<&str> = shader::PARTS.iter().map(|part| part.0).filter(|name| !host_only.contains(name)).collect();
    assert_eq!(parts, TWINS);
    for (file, function, _) in ONE_SIDED {
        let sides = [format!("src/physics/{file}.rs"), format!("shaders/{file}.wgsl")].map(|path| text(&path));
        let there = sides.map(|side| ["(", "<"].iter().any(|open| side.contains(&format!("fn {function}{open}"))));
        assert_ne!(there[0], there[1], "{file}: {function} is listed as one-sided");
    }
}

/// Functions that lanes have for themselves where there are many.
const OF_MANY: [&str; 6] = ["summed_pair", "sum_of", "keep_sum", "no_joint", "lengthened", "beside"];

/// Functions of both texts on lanes, but for those of many.
fn on_lanes(shared: &str) -> [Vec<String>; 2] {
    [&text("shaders/single_thread.wgsl"), shared].map(|text| {
        let names = functions("lanes", text).into_iter().filter(|name| !OF_MANY.contains(name));
        names.map(str::to_owned).collect()
    })
}

#[test]
fn one_lane_has_the_functions_of_many() {
    let shared = text("shaders/cooperative.wgsl");
    let [alone, of_both] = on_lanes(&shared);
    assert_eq!(alone, of_both);
    let [alone, renamed] = on_lanes(&shared.replacen("fn end_linked(", "fn linked_to(", 1));
    assert_ne!(alone, renamed);
}

#[test]
fn a_function_missing_or_moved_is_caught() {
    let (rust, wgsl) = (text("src/physics/material.rs"), text("shaders/material.wgsl"));
    let missing = wgsl.replacen("fn gain_across(", "fn gain_over(", 1);
    assert_ne!(functions("material", &rust), functions("material", &missing));
    let (before, after) = wgsl.split_at(wgsl.find("fn conductance_within(").expect("it is there"));
    let moved = format!("{after}{before}");
    assert_ne!(functions("material", &rust), functions("material", &moved));
}

/// Loop turns of the longest dispatch of a plan on the software device.
fn turns(plan: &Plan, lanes: u32) -> u32 {
    let (turns_step, turns_around) = loop_turns(plan, lanes);
    shader::steps_a_dispatch(plan, lanes, true) * turns_step + turns_around
}

fn with_cells(cells: usize) -> Case {
    changed(&case("lcat-2259"), |case| case.resolution.cells = cells)
}

#[test]
fn a_dispatch_of_any_case_ends_before_the_software_device_ends_its_loops() {
    // The last has the most cells that a case file may ask for.
    for case in all().into_iter().chain([with_cells(1024)]) {
        for lanes in [1, LANES] {
            let turns = turns(&Plan::new(&case), lanes);
            assert!(turns < LOOPS_ENDED, "{}, {} cells: {turns} loop turns", case.id(), case.resolution().cells);
        }
    }
}

#[test]
fn a_step_too_long_for_any_dispatch_is_caught() {
    // Eight times the cells that a case may ask for.
    assert!(turns(&Plan::finer(&with_cells(1024), 8, 1), 1) > LOOPS_ENDED);
}
