// State and factors of a member: twin of src/physics/member.rs.

var<private> ply_scales: array<PlyScale, PLIES>;
var<private> state_scales: array<StateScale, STATE_ROWS>;
var<private> contact_scales: array<real, PLIES>;
var<private> face_scales: array<FaceScale, 2>;
var<COLUMNS> temperatures: array<DoubleWord, CELLS>;
var<private> readings: array<DoubleWord, SENSORS>;
var<private> beads_now: array<DoubleWord, SENSORS>;
var<private> heat: array<DoubleWord, HEAT_TOTALS>;
var<private> stored_j_m2: real;
var<private> coldest: array<real, PLIES>;
var<private> hottest: array<real, PLIES>;
var<private> diverged: u32;
var<COLUMNS> first_stage_capacities: Column;
var<COLUMNS> lower_ratios: Column;
var<COLUMNS> reciprocal_pivots: Column;
var<COLUMNS> upper_ratios: Column;
var<COLUMNS> first_increments: Column;
var<COLUMNS> first_solution: array<real, ENTHALPY_CELLS>;
var<COLUMNS> reduced: array<real, ENTHALPY_CELLS>;
var<COLUMNS> rhs_or_increment: Column;

// Half the reciprocal distance from the node of a cell to the next node of its ply, 1/m.
fn half_over_distance_1_m(cell: u32) -> real {
    return cells[cell].half_over_next_1_m;
}

// Evaluates what is constant over the march.
fn scale() {
    for (var p = 0u; p < run.plies; p++) {
        let char = plan.plies[p].first_state + plan.plies[p].states - 1u;
        ply_scales[p] = ply_scale(plan.plies[p], plan.bulk_properties[p], plan.state_properties[char]);
        if p > 0u {
            contact_scales[p - 1u] = contacts_m2_k_w[p - 1u] / column(plan.plies[p - 1u].contact);
        }
    }
    for (var p = 0u; p < run.plies; p++) {
        for (var state = 0u; state < plan.plies[p].states; state++) {
            let row = plan.plies[p].first_state + state;
            let properties = plan.state_properties[row];
            let columns = plan.conductivity_columns[row];
            state_scales[row] = state_scale(columns, properties, plan.bulk_properties[p], ply_scales[p]);
        }
    }
    face_scales[0] = face_scale(plan.face_columns[0]);
    face_scales[1] = face_scale(plan.face_columns[1]);
    // The boundary row of an insulated back face stays so.
    boundary_rows[1] = BoundaryRow(0.0, 0.0, 0.0, 0.0, 0.0);
}

fn start() {
    for (var i = first_cell(); i < end_cell(); i++) {
        temperatures[i] = DoubleWord(cells[i].start_k, 0.0);
        if DARCY {
            pressures[i] = DoubleWord(forcing(0u, 0u, 0u).pressure_pa, 0.0);
        }
    }
    for (var p = 0u; p < run.plies; p++) {
        coldest[p] = 1e9;
        hottest[p] = 0.0;
    }
}

fn apply_held_faces(step: u32) {
    for (var face = 0u; face < run.faces; face++) {
        let cell = face * run.last_cell;
        if has_cell(cell) {
            let held = plan.faces[face].held;
            let free = 1.0 - held;
            let held_k = forcing(face, step, 0u).held_k;
            let pair = temperatures[cell];
            temperatures[cell] = DoubleWord(held * held_k + free * pair.high, free * pair.low);
        }
    }
}

fn stage_increment(cell: u32, stage: u32) -> real {
    return select(first_increments[cell], 0.0, stage == 0u);
}

fn stage_temperature(cell: u32, stage: u32) -> DoubleWord {
    return add_unnormalized(temperatures[cell], stage_increment(cell, stage));
}

// Forcing of a face at the start of a step (`at` 0) or at its end (1).
fn forcing(face: u32, step: u32, at: u32) -> BoundaryForcing {
    return boundary_forcing[4u * step + 2u * face + at];
}

fn cell_width_m(cell: u32) -> real {
    return cells[cell].width_m;
}

// From the node of a cell to the face below it, and from there to the next node.
fn lengths_to_next_m(cell: u32) -> array<real, 2> {
    return array<real, 2>(cells[cell].below_m, cells[cell + 1u].above_m);
}

fn distance_to_next_m(cell: u32) -> real {
    return cells[cell].below_m + cells[cell + 1u].above_m;
}

fn step_length_s(step: u32) -> real {
    return step_lengths_s[min(step, run.steps - 1u)];
}

// If the step begins at a recorded instant, stores the bead temperatures, and the gauges where there is gas.
fn record(step: u32) {
    let instant = instants[step];
    if instant == NO_INSTANT {
        return;
    }
    let traced = instant * (run.sensors + run.gauges);
    for (var s = thread; s < run.sensors; s += THREADS_PER_MEMBER) {
        let base = 2u * (traced + s);
        traces[base * run.members + member] = beads_now[s].high;
        traces[(base + 1u) * run.members + member] = beads_now[s].low;
    }
    if GAS && run.gauges > 0u {
        var read = gauges(step);
        for (var g = thread; g < run.gauges; g += THREADS_PER_MEMBER) {
            let base = 2u * (traced + run.sensors + g);
            traces[base * run.members + member] = read[g];
            traces[(base + 1u) * run.members + member] = 0.0;
        }
    }
}
