// All bindings, and the functions that read them. The structs are generated from src/plan/layout.rs and
// src/march/gpu/layout.rs. Data that is the same for all members and steps is uniform: hardware reads it from constant
// caches, and a software device once instead of member by member.

@group(0) @binding(0) var<uniform> run: DispatchParameters;
@group(0) @binding(1) var<uniform> cells: array<Cell, CELLS>;
@group(0) @binding(2) var<uniform> plan: Plan;
// Contact resistance of each interface, m²K/W.
@group(0) @binding(3) var<storage, read> contacts_m2_k_w: array<real>;
// Four a step: hot at the start, hot at the end, back at the start, back at the end; and four for the end of the march.
@group(0) @binding(4) var<storage, read> boundary_forcing: array<BoundaryForcing>;
@group(0) @binding(5) var<storage, read> step_lengths_s: array<real>;
// Two properties in four words, each with its rise to the next node; zeros if the tables are texels.
@group(0) @binding(6) var<storage, read> tables: array<vec4<real>>;
// The tables with TEXELS_ABREAST column groups in a row of texels, where the device reads texels faster; else a row of
// zeros.
@group(0) @binding(7) var texels: texture_storage_2d<rgba32float, read>;
// Step × sensor.
@group(0) @binding(8) var<storage, read> beads: array<Bead>;
// The instant at the start of each step, and at the end of the last.
@group(0) @binding(9) var<storage, read> instants: array<u32>;
// Factor × member.
@group(0) @binding(10) var<storage, read> factors: array<real>;
// Slot × member: the blocks of src/march/gpu/state.rs.
@group(0) @binding(11) var<storage, read_write> state: array<real>;
// Instant × sensor × word × member.
@group(0) @binding(12) var<storage, read_write> traces: array<real>;
// Steps done by each member; then the step after which each diverged, or zero.
@group(0) @binding(13) var<storage, read_write> progress: array<u32>;

// One group of four columns of the tables.
fn column_group(place: u32) -> vec4<real> {
    if TEXELS {
        return vec4<real>(textureLoad(texels, vec2<u32>(place % TEXELS_PER_ROW, place / TEXELS_PER_ROW)));
    }
    return tables[place];
}

// A column of the ensemble for this member; column 0 is one.
fn column(index: u32) -> real {
    if index == 0u {
        return 1.0;
    }
    return factors[(index - 1u) * run.members + member];
}

// Place of a slot of this member in `state`.
fn slot(index: u32) -> u32 {
    return index * run.members + member;
}
