// A member's conduction: twin of src/physics/conducting.rs.

fn less(gained: array<real, 2>, carried: array<real, 2>) -> array<real, 2> {
    return array<real, 2>(gained[0] - carried[0], gained[1] - carried[1]);
}

fn properties(step: u32, stage: u32) {
    if GAS && !reads_gas(stage) {
        gas_onward();
    }
    for (var p = first_ply(); p < end_ply(); p++) {
        if plies[p].rows > 1u || LEVELS > 1u {
            for (var i = first_of(p); i < end_of(p); i++) {
                blend(p, i, spot(temperatures[i].high + first[i]), step, stage);
            }
        } else {
            plain(p, stage);
        }
        if DARCY {
            for (var i = first_of(p); i < end_of(p); i++) {
                evaluated[i] = evaluated[i] + gas_capacity(i);
            }
        }
    }
    meet();
    var above = real(0.0);
    for (var p = first_ply(); p < end_ply(); p++) {
        above = link_within(p, stage, above);
        if p + 1u < run.plies && has(plies[p].end_cell - 1u) {
            above = link_across(p + 1u, stage, above);
        }
    }
    hand_down(above, stage);
}

fn plain(p: u32, stage: u32) {
    let ply = plies[p];
    for (var i = first_of(p); i < end_of(p); i++) {
        let row = row_of(p, spot(temperatures[i].high + first[i]));
        var scale = state_scales[ply.first_state].conductivity;
        var density_kg_m3 = ply_scales[p].density_kg_m3;
        if GAS && ply.states > 1u {
            let all = together(p, phases_at(p, i, stage), ply.states);
            scale = times(all.conductivity, 1.0 / left_of(p, all.remains), ply.parts);
            density_kg_m3 = ply_scales[p].mass_kg_m3 * all.stores;
            if stage == 0u {
                rise_at(p, i, row);
            }
        }
        let here = solid(row, ply.parts, scale, stage == 0u);
        conductivities[i] = here.conductivity;
        slopes[i] = here.slope;
        evaluated[i] = cells[i].width_m * (density_kg_m3 * here.heat_capacity);
        if reads_gas(stage) {
            gas_enthalpy(i, gas_of(p, row));
        }
    }
}

fn link_within(p: u32, stage: u32, arriving: real) -> real {
    var above = arriving;
    let end_link = min(end_of(p), plies[p].end_cell - 1u);
    var i = first_of(p);
    var here = raised(temperatures[i], first[i]);
    var slope = slopes[i];
    var conductivity = conductivities[i];
    for (; i < end_link; i++) {
        let half_over_next_1_m = cells[i].half_over_next_1_m;
        let next_conductivity = conductivities[i + 1u];
        let conductance = conductance_within(conductivity, next_conductivity, half_over_next_1_m);
        let next = raised(temperatures[i + 1u], first[i + 1u]);
        let drop = difference(here, next);
        if stage == 0u {
            let next_slope = slopes[i + 1u];
            let gain = half_over_next_1_m * drop;
            var gained = array<real, 2>(slope * gain, next_slope * gain);
            if GAS {
                gained = less(gained, carried_slopes(flows[i], gas_rises[i], gas_rises[i + 1u]));
            }
            let by = flux_slopes(conductance, gained);
            lower[i] = by[0];
            upper[i] = by[1];
            slope = next_slope;
        }
        conductances[i] = conductance;
        let below = conductance * drop;
        if GAS {
            let gained = carried_gain(flows[i], gas_j_kg[i], gas_j_kg[i + 1u]);
            second[i] = (above - (below - gained)) - absorbed_at(i, stage);
            above = below + gained;
        } else {
            second[i] = above - below;
            above = below;
        }
        here = next;
        conductivity = next_conductivity;
    }
    return above;
}

fn link_across(p: u32, stage: u32, above: real) -> real {
    let i = plies[p].first_cell - 1u;
    let below_m = cells[i].below_m;
    let above_m = cells[i + 1u].above_m;
    let conductivity = conductivities[i];
    let next = conductivities[i + 1u];
    let conductance = conductance_across(conductivity, below_m, next, above_m, contact_scales[p - 1u]);
    let drop = difference(staged(i), staged(i + 1u));
    if stage == 0u {
        let own = gain_across(conductance, conductivity, below_m) * slopes[i];
        let next_own = gain_across(conductance, next, above_m) * slopes[i + 1u];
        var gained = array<real, 2>(own * drop, next_own * drop);
        if GAS {
            gained = less(gained, carried_slopes(flows[i], gas_rises[i], gas_rises[i + 1u]));
        }
        let by = flux_slopes(conductance, gained);
        lower[i] = by[0];
        upper[i] = by[1];
    }
    conductances[i] = conductance;
    let below = conductance * drop;
    if !GAS {
        second[i] = above - below;
        return below;
    }
    let gained = carried_gain(flows[i], gas_j_kg[i], gas_j_kg[i + 1u]);
    second[i] = (above - (below - gained)) - absorbed_at(i, stage);
    return below + gained;
}

fn staged(cell: u32) -> Pair {
    return raised(temperatures[cell], first[cell]);
}

fn through(face: u32, drive: Drive, stage: u32, cell: u32, neighbour: u32) -> FaceFlux {
    let temperature_k = temperatures[cell].high + first[cell];
    let at = spot(temperature_k);
    let emissivity = face_emissivity(face, face * (PLIES - 1u), cell, at, stage);
    let air = segment(at, FACE_COLUMNS, FACE_TABLE);
    let enthalpy_j_kg = value(air, 0u);
    let rise_j_kg_k = value(air, 1u);
    let open = face_flux(
        drive,
        faces[face],
        face_scales[face],
        temperature_k,
        emissivity,
        enthalpy_j_kg,
        rise_j_kg_k,
        outflow,
    );
    let held = faces[face].held;
    let free = 1.0 - held;
    let conductance = conductances[min(cell, neighbour)];
    let next = conductance * difference(staged(cell), staged(neighbour));
    let sideways = conductance_sideways(face * (PLIES - 1u), cell);
    let onward = next - flux_sideways(sideways, drive.holder_k, staged(cell));
    return FaceFlux(held * onward + free * open.flux, free * open.slope);
}

fn imbalance(hot: Drive, back: Drive, stage: u32) -> Ends {
    let ends = Ends(through(0u, hot, stage, 0u, 1u), through(1u, back, stage, LAST_CELL, LAST_CELL - 1u));
    if has(0u) {
        second[0] = second[0] + ends.hot.flux;
    }
    if has(LAST_CELL) {
        second[LAST_CELL] = second[LAST_CELL] + ends.back.flux;
    }
    return ends;
}
