// Heat conduction: twin of src/physics/conduction.rs.

struct Node {
    temperature: DoubleWord,
    increment: real,
    conductivity: real,
    slope: real,
    capacity: real,
    gas_enthalpy_j_kg: real,
    gas_heat_capacity: real,
}

// Properties common to the cells of a ply that is one substance, or whose states are multiples of one.
struct PlyProperties {
    location: TableLocation,
    parts: u32,
    conductivity: ConductivityParts,
    density_kg_m3: real,
}

struct InteriorFaceFlux {
    conducted: real,
    advected: real,
    slopes: array<real, 2>,
}

struct SurfaceState {
    temperature_k: real,
    emissivity: real,
    enthalpy_j_kg: real,
    enthalpy_slope_j_kg_k: real,
}

// A column of properties that the passes over the cells read; of one cell where they look the properties up themselves.
alias NodeColumn = array<real, NODE_CELLS>;

var<COLUMNS> conductivities: Column;
var<COLUMNS> slopes: NodeColumn;
var<COLUMNS> stage_capacities: NodeColumn;

fn subtract_advection(conductivity_slopes: array<real, 2>, advection: array<real, 2>) -> array<real, 2> {
    return array<real, 2>(conductivity_slopes[0] - advection[0], conductivity_slopes[1] - advection[1]);
}

fn no_flux() -> InteriorFaceFlux {
    return InteriorFaceFlux(0.0, 0.0, array<real, 2>(0.0, 0.0));
}

fn properties(step: u32, stage: u32) {
    if PROPERTIES_IN_SWEEP {
        return;
    }
    for (var p = first_ply(); p < end_ply(); p++) {
        let end = end_cell_of(p);
        if plan.plies[p].rows > 1u || (DEPENDS_ON_PRESSURE && plan.plies[p].depends_on_pressure == 1u) {
            for (var i = first_cell_of(p); i < end; i++) {
                mixture_properties(p, i, step, stage);
            }
        } else {
            let ply = ply_properties(p);
            for (var i = first_cell_of(p); i < end; i++) {
                let here = single_substance_properties(p, ply, i, stage);
                conductivities[i] = here.conductivity;
                slopes[i] = here.slope;
                stage_capacities[i] = here.heat_capacity;
            }
        }
        let keeps_first = ENTHALPY_STEPS && stage == 1u && plan.tables[p].enthalpy_search_span > 0u;
        if keeps_first {
            for (var i = first_cell_of(p); i < end; i++) {
                stage_capacities[i] = first_stage_capacities[i] * composition_ratio(p, i);
            }
        }
        if DARCY && !keeps_first {
            for (var i = first_cell_of(p); i < end; i++) {
                stage_capacities[i] = stage_capacities[i] + gas_capacity(i);
            }
        }
    }
}

fn mixture_properties(p: u32, i: u32, step: u32, stage: u32) {
    let temperature_k = temperatures[i].high + stage_increment(i, stage);
    let row = ply_row(p, temperature_k);
    let here = mixture(p, temperature_k, cell_pressure_pa(i, step, stage), stage_phases(p, i, stage), stage == 0u);
    conductivities[i] = here.conductivity;
    slopes[i] = here.slope;
    stage_capacities[i] = cell_width_m(i) * here.heat_capacity;
    if reads_gas_tables(stage) {
        gas_enthalpy(i, gas_columns(p, row));
    }
    if GAS && stage == 0u && plan.plies[p].end_reaction > plan.plies[p].first_reaction {
        store_enthalpy_rises(p, i, row);
    }
}

// Read once a ply: a software device reads a uniform by a variable index lane by lane.
fn ply_properties(p: u32) -> PlyProperties {
    let ply = plan.plies[p];
    let conductivity = state_scales[ply.first_state].conductivity;
    return PlyProperties(plan.tables[p], ply.parts, conductivity, ply_scales[p].density_kg_m3);
}

// Returns the heat capacity of the whole cell, J/m²/K.
fn single_substance_properties(p: u32, ply: PlyProperties, i: u32, stage: u32) -> SolidProperties {
    let at = table_index(temperatures[i].high + stage_increment(i, stage), ply.location);
    let row = table_segment(at, ply.location);
    var scale = ply.conductivity;
    var density_kg_m3 = ply.density_kg_m3;
    if GAS && plan.plies[p].states > 1u {
        let all = mixture_sums(p, stage_phases(p, i, stage), plan.plies[p].states);
        scale = times(all.conductivity, 1.0 / conductivity_divisor(p, all.remains), ply.parts);
        density_kg_m3 = ply_scales[p].mass_kg_m3 * all.enthalpy_scale;
        if stage == 0u {
            store_enthalpy_rises(p, i, row);
        }
    }
    if reads_gas_tables(stage) {
        gas_enthalpy(i, gas_columns(p, row));
    }
    let here = solid_properties(row, ply.parts, scale, stage == 0u);
    return SolidProperties(here.conductivity, here.slope, cell_width_m(i) * (density_kg_m3 * here.heat_capacity));
}

// Node at a stage. Properties are looked up here where one thread marches a member, as storing columns dominates its
// time.
fn node(p: u32, ply: PlyProperties, i: u32, stage: u32) -> Node {
    let by = stage_increment(i, stage);
    let temperature = add_unnormalized(temperatures[i], by);
    if PROPERTIES_IN_SWEEP {
        let here = single_substance_properties(p, ply, i, stage);
        if stage == 0u {
            conductivities[i] = here.conductivity;
        }
        return Node(temperature, by, here.conductivity, here.slope, here.heat_capacity, 0.0, 0.0);
    }
    var node = Node(temperature, by, conductivities[i], 0.0, stage_capacities[i], 0.0, 0.0);
    if stage == 0u {
        node.slope = slopes[i];
    }
    if GAS {
        node.gas_enthalpy_j_kg = stage_gas_enthalpy(i, stage);
        node.gas_heat_capacity = gas_heat_capacities[i];
    }
    return node;
}

fn flux_within_ply(p: u32, cell: u32, here: Node, next: Node, step: u32, stage: u32) -> InteriorFaceFlux {
    let half_over_next_1_m = half_over_distance_1_m(cell);
    var conductance = conductance_within(here.conductivity, next.conductivity, half_over_next_1_m);
    let drop = difference(here.temperature, next.temperature);
    var conductivity_slopes = array<real, 2>(0.0, 0.0);
    if stage == 0u {
        let gain = half_over_next_1_m * drop;
        conductivity_slopes = array<real, 2>(here.slope * gain, next.slope * gain);
    }
    if STEEP_CONDUCTIVITIES && plan.tables[p].conductivity_integral > 0u {
        let over_next_1_m = half_over_next_1_m + half_over_next_1_m;
        let by_integral = conductivity_by_integral(p, cell, drop, step, stage);
        conductance = conductance + by_integral[0] * over_next_1_m;
        if stage == 0u {
            let bound = max(here.conductivity + by_integral[1], next.conductivity + by_integral[2]);
            let slope = bound * over_next_1_m - conductance;
            conductivity_slopes = array<real, 2>(slope, 0.0 - slope);
        }
    }
    return interior_face_flux(cell, here, next, conductance, drop, conductivity_slopes, stage);
}

fn conductivity_by_integral(p: u32, cell: u32, drop: real, step: u32, stage: u32) -> array<real, 3> {
    let ply = plan.plies[p];
    let rows = plan.tables[p].rows;
    let here = ply_index(p, temperatures[cell].high + stage_increment(cell, stage));
    let next = ply_index(p, temperatures[cell + 1u].high + stage_increment(cell + 1u, stage));
    let is_same = here.row == next.row || drop == 0.0;
    let pressure_pa = cell_pressure_pa(cell, step, stage) + cell_pressure_pa(cell + 1u, step, stage);
    let pressure = pressure_index(p, 0.5 * pressure_pa);
    var weights = conductivity_weights(p, cell, stage);
    var next_weights = conductivity_weights(p, cell + 1u, stage);
    let here_rows = at_pressure_levels(here, rows, pressure);
    let next_rows = at_pressure_levels(next, rows, pressure);
    var sums = array<real, 3>(0.0, 0.0, 0.0);
    for (var level = 0u; level < min(ply.levels, 2u); level++) {
        let share = select(1.0 - pressure.fraction, pressure.fraction, level == 1u);
        for (var state = 0u; state < ply.rows; state++) {
            let own = conductivity_integral(p, state, row_at(p, here_rows[level]));
            let other = conductivity_integral(p, state, row_at(p, next_rows[level]));
            var integral_correction = real(0.0);
            if !is_same {
                integral_correction = (own[1] - other[1]) * (1.0 / drop) - 0.5 * (own[0] + other[0]);
            }
            sums[0] = sums[0] + share * (0.5 * (weights[state] + next_weights[state])) * integral_correction;
            sums[1] = sums[1] + share * weights[state] * (own[2] - own[0]);
            sums[2] = sums[2] + share * next_weights[state] * (other[2] - other[0]);
        }
    }
    return sums;
}

fn flux_across_interface(p: u32, here: Node, next: Node, stage: u32) -> InteriorFaceFlux {
    let cell = plan.plies[p].first_cell - 1u;
    let lengths_m = lengths_to_next_m(cell);
    let below_m = lengths_m[0];
    let above_m = lengths_m[1];
    let conductance =
        conductance_across(here.conductivity, below_m, next.conductivity, above_m, contact_scales[p - 1u]);
    let drop = difference(here.temperature, next.temperature);
    var conductivity_slopes = array<real, 2>(0.0, 0.0);
    if stage == 0u {
        let own = conductance_slope_across(conductance, here.conductivity, below_m) * here.slope;
        let below = conductance_slope_across(conductance, next.conductivity, above_m) * next.slope;
        conductivity_slopes = array<real, 2>(own * drop, below * drop);
    }
    return interior_face_flux(cell, here, next, conductance, drop, conductivity_slopes, stage);
}

fn interior_face_flux(
    cell: u32,
    here: Node,
    next: Node,
    conductance: real,
    drop: real,
    slopes_by_conductivity: array<real, 2>,
    stage: u32,
) -> InteriorFaceFlux {
    var flux = InteriorFaceFlux(conductance * drop, 0.0, array<real, 2>(0.0, 0.0));
    if GAS {
        flux.advected = advected_heat_gain(mass_fluxes[cell], here.gas_enthalpy_j_kg, next.gas_enthalpy_j_kg);
    }
    if stage == 0u {
        var conductivity_slopes = slopes_by_conductivity;
        if GAS {
            let advection = advected_heat_slopes(mass_fluxes[cell], here.gas_heat_capacity, next.gas_heat_capacity);
            conductivity_slopes = subtract_advection(conductivity_slopes, advection);
        }
        flux.slopes = flux_slopes(conductance, conductivity_slopes);
    }
    return flux;
}

fn surface_state(face: u32, cell: u32, stage: u32) -> SurfaceState {
    let temperature_k = temperatures[cell].high + stage_increment(cell, stage);
    let here = ply_row(PLIES, temperature_k);
    let emissivity = face_emissivity(face, face * (PLIES - 1u), cell, here, stage);
    return SurfaceState(temperature_k, emissivity, interpolate(here, 0u), interpolate(here, 1u));
}

fn open_face_flux(face: u32, forcing: BoundaryForcing, surface_state: SurfaceState) -> SurfaceFlux {
    let open = surface_flux(
        forcing,
        face_scales[face],
        surface_state.temperature_k,
        surface_state.emissivity,
        surface_state.enthalpy_j_kg,
        surface_state.enthalpy_slope_j_kg_k,
        stage_outflow,
    );
    let free = 1.0 - plan.faces[face].held;
    return SurfaceFlux(free * open.flux, free * open.slope);
}

fn face_heat_flux(face: u32, cell: u32, step: u32, stage: u32) -> real {
    var conducted_on = face_conduction[face];
    if HOLDER == 1u {
        let outside = forcing(face, step, stage);
        let conductance = holder_conductance(face * (PLIES - 1u), cell);
        conducted_on = conducted_on - lateral_heat_flux(conductance, outside.holder_k, stage_temperature(cell, stage));
    }
    return boundary_rows[face].flux + plan.faces[face].held * conducted_on;
}
