// Rows and bindings: twin of src/plan/layout.rs, field for field; the only file with bindings. Rows begin on 16 bytes,
// as arrays of uniforms must: what is the same for all members and steps is uniform, which a software device reads at
// once where it picks storage up member by member, and hardware from memory made for it.

// Lengths of short loops come at run time, so that drivers do not unroll a step of many plies and so that one text
// serves every clock. What compiling costs (seconds on lavapipe, cold) comes with the private arrays.
struct Run {
    @align(16) first_step: u32,
    end_step: u32,
    steps: u32,
    members: u32,
    one: f32,
    plies: u32,
    sensors: u32,
    faces: u32,
    open_faces: u32,
    stages: u32,
    gauges: u32,
    lanes: u32,
    sums: u32,
    // Not more than CELLS, which columns have room for.
    cells: u32,
    last_cell: u32,
}

struct Cell {
    @align(16) width_m: real,
    above_m: real,
    below_m: real,
    half_over_next_1_m: real,
    start_k: real,
}

struct Face {
    @align(16) film_w_m2_k: real,
    hot_wall_kg_j: real,
    blowing: real,
    held: real,
}

struct Drive {
    @align(16) flux_w_m2: real,
    radiant_w_m2: real,
    gas_k: real,
    surroundings_k: real,
    pressure_pa: real,
    held_k: real,
    holder_k: real,
}

struct Sensor {
    @align(16) above: real,
    below: real,
    above_m: real,
    below_m: real,
    depth_m: real,
}

struct Place {
    @align(16) cell: u32,
    ply_above: u32,
    ply_below: u32,
    depth: u32,
    node_above: u32,
    steps_above: u32,
    node_below: u32,
    steps_below: u32,
}

struct Bead {
    @align(16) start: real,
    end: real,
}

struct Ply {
    @align(16) first_cell: u32,
    end_cell: u32,
    table: u32,
    columns: u32,
    states: u32,
    rows: u32,
    parts: u32,
    first_state: u32,
    first_reaction: u32,
    end_reaction: u32,
    heat_capacity: u32,
    density: u32,
    thickness: u32,
    kinetics: u32,
    activation: u32,
    pyrolysis_heat: u32,
    char_yield: u32,
    permeability: u32,
    holder: u32,
    contact: u32,
}

struct Conduction {
    @align(16) whole: u32,
    solid: u32,
    gas: u32,
    radiative: u32,
    extinction: u32,
}

struct Scaling {
    @align(16) heating: u32,
    film: u32,
    exchange: u32,
    emissivity: u32,
}

struct Bulk {
    @align(16) density_kg_m3: real,
    shrinkage: real,
    by_volume: real,
    absolute: real,
    holder_w_m3_k: real,
}

struct Substance {
    @align(16) remains: real,
    porosity: real,
    permeability_m2: real,
    slip_pa_k: real,
    inertia_1_m: real,
    formation_j_kg: real,
    conductivity: real,
    heat_capacity: real,
}

struct Reaction {
    @align(16) rate_1_s: real,
    activation_k: real,
    order: real,
    onset_k: real,
    idle: real,
    loss: real,
    share: real,
    heat_j_kg: real,
    chained: real,
}

struct Path {
    @align(16) source: u32,
    product: u32,
}

// What is the same for all members and steps, but for cells, of which there may be as many as fill a buffer. One buffer, as lavapipe
// of Mesa 22.3 writes beyond its own memory while it compiles a condition on a word of the fourth uniform buffer or a later one.
struct Plan {
    plies: array<Ply, PLIES>,
    bulks: array<Bulk, PLIES>,
    // Hot, back.
    faces: array<Face, 2>,
    scalings: array<Scaling, 2>,
    sensors: array<Sensor, SENSORS>,
    places: array<Place, SENSORS>,
    // Ply × state, ply × state, ply × reaction, ply × reaction.
    substances: array<Substance, SUBSTANCES>,
    conductions: array<Conduction, SUBSTANCES>,
    reactions: array<Reaction, PATHS>,
    paths: array<Path, PATHS>,
}

@group(0) @binding(0) var<uniform> run: Run;
@group(0) @binding(1) var<uniform> cells: array<Cell, CELLS>;
@group(0) @binding(2) var<uniform> plan: Plan;
// Of each interface, m²K/W.
@group(0) @binding(3) var<storage, read> contacts: array<real>;
// Four a step: hot at the start, hot at the end, back at the start, back at the end; and four for the end.
@group(0) @binding(4) var<storage, read> drives: array<Drive>;
@group(0) @binding(5) var<storage, read> lengths: array<real>;
// Two properties in four words, each with its rise to the next node; or zeros, where they are texels.
@group(0) @binding(6) var<storage, read> tables: array<vec4<real>>;
// The tables, TEXELS_ABREAST of their fours in a row, where the device reads texels faster; or a row of zeros, where they are not.
@group(0) @binding(7) var texels: texture_storage_2d<rgba32float, read>;
// Step × sensor.
@group(0) @binding(8) var<storage, read> beads: array<Bead>;
// The instant at the start of each step, and at the end of the last.
@group(0) @binding(9) var<storage, read> instants: array<u32>;
// Factor × member.
@group(0) @binding(10) var<storage, read> factors: array<real>;
// Slot × member: temperatures, readings and beads in two words each; then what a member leaves behind:
// sums of heat in two words each, heat stored, coldest and hottest of each ply.
@group(0) @binding(11) var<storage, read_write> state: array<real>;
// Instant × sensor × word × member.
@group(0) @binding(12) var<storage, read_write> traces: array<real>;
// Steps done by each member; then the step after which each strayed, or zero.
@group(0) @binding(13) var<storage, read_write> progress: array<u32>;

// A four of the columns of the tables.
fn four(place: u32) -> vec4<real> {
    if TEXELS {
        return vec4<real>(textureLoad(texels, vec2<u32>(place % TEXELS_ABREAST, place / TEXELS_ABREAST)));
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
