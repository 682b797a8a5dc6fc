// A member on its way: twin of src/physics/member.rs.

var<private> ply_scales: array<PlyScale, PLIES>;
var<private> state_scales: array<StateScale, SUBSTANCES>;
var<private> contact_scales: array<real, PLIES>;
var<private> face_scales: array<FaceScale, 2>;
var<COLUMNS> temperatures: array<Pair, CELLS>;
var<private> readings: array<Pair, SENSORS>;
var<private> beads_now: array<Pair, SENSORS>;
var<private> heat: array<Pair, HEATS>;
var<private> stored_j_m2: real;
var<private> coldest: array<real, PLIES>;
var<private> hottest: array<real, PLIES>;
var<private> strayed: u32;
var<COLUMNS> capacities: Column;
var<COLUMNS> lower: Column;
var<COLUMNS> diagonal: Column;
var<COLUMNS> upper: Column;
var<COLUMNS> first: Column;
var<COLUMNS> second: Column;

// What does not change over the march.
fn scale() {
    for (var p = 0u; p < run.plies; p++) {
        ply_scales[p] = ply_scale(plan.plies[p], plan.bulks[p], plan.substances[plan.plies[p].first_state + plan.plies[p].states - 1u]);
        if p > 0u {
            contact_scales[p - 1u] = contacts[p - 1u] / column(plan.plies[p - 1u].contact);
        }
    }
    for (var p = 0u; p < run.plies; p++) {
        for (var state = 0u; state < plan.plies[p].states; state++) {
            let row = plan.plies[p].first_state + state;
            state_scales[row] = state_scale(plan.conductions[row], plan.substances[row], plan.bulks[p], ply_scales[p]);
        }
    }
    face_scales[0] = face_scale(plan.scalings[0]);
    face_scales[1] = face_scale(plan.scalings[1]);
    // That of an insulated back face stays so.
    edges[1] = Edge(0.0, 0.0, 0.0, 0.0, 0.0);
}

fn start() {
    for (var i = first_cell(); i < end_cell(); i++) {
        temperatures[i] = Pair(cells[i].start_k, 0.0);
        if DARCY {
            pressures[i] = Pair(drives[0].pressure_pa, 0.0);
        }
    }
    for (var p = 0u; p < run.plies; p++) {
        coldest[p] = 1e9;
        hottest[p] = 0.0;
    }
}

fn hold(step: u32) {
    for (var face = 0u; face < run.faces; face++) {
        let cell = face * run.last_cell;
        if has(cell) {
            let held = plan.faces[face].held;
            let free = 1.0 - held;
            let held_k = drives[4u * step + 2u * face].held_k;
            let pair = temperatures[cell];
            temperatures[cell] = Pair(held * held_k + free * pair.high, free * pair.low);
        }
    }
}

fn read_sensor(sensor: u32, step: u32) -> Pair {
    let place = plan.places[sensor];
    let i = place.cell;
    let ply = place.ply_above;
    let conductivity = conductivity_now(ply, i, step);
    let next = conductivity_now(place.ply_below, i + 1u, step);
    var conductance = conductance_within(conductivity, next, cells[i].half_over_next_1_m);
    if place.ply_above != place.ply_below {
        conductance =
            conductance_across(conductivity, cells[i].below_m, next, cells[i + 1u].above_m, contact_scales[ply]);
    }
    let nominal = reading(temperatures[i], temperatures[i + 1u], conductivity, next, conductance, plan.sensors[sensor]);
    if DEPTHS == 1u {
        let flux = conductance * difference(temperatures[i], temperatures[i + 1u]);
        return raised(nominal, displaced(sensor, flux / conductivity, flux / next));
    }
    return nominal;
}

fn displaced(sensor: u32, fall_above_k_m: real, fall_below_k_m: real) -> real {
    let place = plan.places[sensor];
    let row = plan.sensors[sensor];
    let shift_m = row.depth_m * (column(place.depth) - 1.0);
    let is_inside = place.node_above < place.node_below;
    var start_m = row.below_m;
    var rise = real(0.0);
    if is_inside {
        rise = -(fall_below_k_m * covered(shift_m, 0.0, start_m, false));
    }
    for (var step = 0u; step < place.steps_below; step++) {
        let j = place.node_below + step;
        let length_m = cells[j].below_m + cells[j + 1u].above_m;
        let gain = difference(temperatures[j + 1u], temperatures[j]) / length_m;
        rise = rise + gain * covered(shift_m, start_m, length_m, !is_inside && step == 0u);
        start_m = start_m + length_m;
    }
    start_m = row.above_m;
    if is_inside {
        rise = rise + fall_above_k_m * covered(-shift_m, 0.0, start_m, false);
    }
    for (var step = 0u; step < place.steps_above; step++) {
        let j = place.node_above - step;
        let length_m = cells[j - 1u].below_m + cells[j].above_m;
        let gain = difference(temperatures[j - 1u], temperatures[j]) / length_m;
        rise = rise + gain * covered(-shift_m, start_m, length_m, !is_inside && step == 0u);
        start_m = start_m + length_m;
    }
    return rise;
}

fn look(step: u32) {
    for (var s = lane; s < run.sensors; s += LANES) {
        let now = read_sensor(s, step);
        if step == 0u {
            beads_now[s] = now;
        } else {
            beads_now[s] = followed(beads_now[s], readings[s], now, beads[(step - 1u) * SENSORS + s]);
        }
        readings[s] = now;
    }
}

// Where an instant falls on the start of a step, what the beads show, and the gauges where there is gas.
fn note(step: u32) {
    let instant = instants[step];
    if instant == NO_INSTANT {
        return;
    }
    let traced = instant * (run.sensors + run.gauges);
    for (var s = lane; s < run.sensors; s += LANES) {
        let base = 2u * (traced + s);
        traces[base * run.members + member] = beads_now[s].high;
        traces[(base + 1u) * run.members + member] = beads_now[s].low;
    }
    if GAS && run.gauges > 0u {
        var read = gauges(step);
        for (var g = lane; g < run.gauges; g += LANES) {
            let base = 2u * (traced + run.sensors + g);
            traces[base * run.members + member] = read[g];
            traces[(base + 1u) * run.members + member] = 0.0;
        }
    }
}

fn finish() {
    for (var p = first_ply(); p < end_ply(); p++) {
        for (var i = first_of(p); i < end_of(p); i++) {
            let more = gained(p, i);
            stored_j_m2 = stored_j_m2 + more;
            let hot = select(0.0, plan.faces[0].held * more, i == 0u);
            let back = select(0.0, plan.faces[1].held * more, i == run.last_cell);
            heat[0] = advanced(heat[0], max(hot, 0.0));
            heat[1] = advanced(heat[1], max(-hot, 0.0));
            heat[2] = advanced(heat[2], max(back, 0.0));
            heat[3] = advanced(heat[3], max(-back, 0.0));
        }
    }
}

fn gained(p: u32, i: u32) -> real {
    let ply = plan.plies[p];
    let width_m = cells[i].width_m;
    let now = spot(temperatures[i].high);
    let then = spot(cells[i].start_k);
    if ply.states == 1u {
        let now_j_kg = integral(row_of(p, now), 1u);
        let then_j_kg = integral(row_of(p, then), 1u);
        return keep(now_j_kg - then_j_kg) * ply_scales[p].density_kg_m3 * width_m + gas_gained(p, i);
    }
    let phases = phases_of(p, i);
    let mass_kg_m2 = ply_scales[p].mass_kg_m3 * width_m;
    let lost_kg_m2 = mass_kg_m2 * (1.0 - mass_left(p, phases));
    lost_and_stored[0] = lost_and_stored[0] + lost_kg_m2;
    let row_then = row_of(p, then);
    let then_j_kg = enthalpy_of(p, 0u, integral(row_then, 1u));
    let now_j_kg = solid_enthalpy(p, phases, row_of(p, now));
    return keep(now_j_kg - then_j_kg) * mass_kg_m2 + gas_gained(p, i);
}
