// A member's conduction: twin of src/physics/conducting.rs.

fn properties(step: u32, stage: u32) {
    for (var p = 0u; p < run.plies; p++) {
        let ply = plies[p];
        if ply.states > 1u || LEVELS > 1u {
            for (var i = ply.first_cell; i < ply.end_cell; i++) {
                blend(p, i, spot(temperatures[i].high + first[i]), step, stage);
            }
        } else {
            plain(p, stage);
        }
        if DARCY {
            for (var i = ply.first_cell; i < ply.end_cell; i++) {
                evaluated[i] = evaluated[i] + gas_capacity(i);
            }
        }
        for (var i = ply.first_cell; i < ply.end_cell - 1u; i++) {
            conductances[i] =
                conductance_within(conductivities[i], conductivities[i + 1u], cells[i].half_over_next_1_m);
            if stage == 0u {
                let half_over_next_1_m = cells[i].half_over_next_1_m;
                incline(i, slopes[i] * half_over_next_1_m, slopes[i + 1u] * half_over_next_1_m);
            }
        }
        if p > 0u {
            let i = ply.first_cell - 1u;
            conductances[i] = conductance_across(
                conductivities[i],
                cells[i].below_m,
                conductivities[i + 1u],
                cells[i + 1u].above_m,
                contact_scales[p - 1u],
            );
            if stage == 0u {
                let above = gain_across(conductances[i], conductivities[i], cells[i].below_m);
                let below = gain_across(conductances[i], conductivities[i + 1u], cells[i + 1u].above_m);
                incline(i, above * slopes[i], below * slopes[i + 1u]);
            }
        }
    }
}

fn plain(p: u32, stage: u32) {
    let ply = plies[p];
    for (var i = ply.first_cell; i < ply.end_cell; i++) {
        let row = row_of(p, spot(temperatures[i].high + first[i]));
        let here = solid(row, state_scales[ply.first_state], stage == 0u);
        conductivities[i] = here.conductivity;
        slopes[i] = here.slope;
        evaluated[i] = cells[i].width_m * (ply_scales[p].density_kg_m3 * here.heat_capacity);
        if GAS {
            gas_at(i, gas_of(p, row));
        }
    }
}

fn incline(i: u32, above_w_m2_k2: real, below_w_m2_k2: real) {
    let drop = difference(temperatures[i], temperatures[i + 1u]);
    var carried: array<real, 2>;
    if GAS {
        carried = carried_slopes(i);
    }
    lower[i] = flux_slope(conductances[i], above_w_m2_k2, drop, carried[0]);
    upper[i] = flux_slope(conductances[i], below_w_m2_k2, -drop, carried[1]);
}

fn staged(cell: u32) -> Pair {
    let pair = temperatures[cell];
    return Pair(pair.high, pair.low + first[cell]);
}

fn through(face: u32, drive: Drive, cell: u32, neighbour: u32) -> FaceFlux {
    let temperature_k = temperatures[cell].high + first[cell];
    let at = spot(temperature_k);
    let emissivity = face_emissivity(face, face * (PLIES - 1u), cell, at);
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

fn imbalance(hot: Drive, back: Drive) -> Ends {
    let ends = Ends(through(0u, hot, 0u, 1u), through(1u, back, LAST_CELL, LAST_CELL - 1u));
    var above = ends.hot.flux;
    for (var i = 0u; i < LAST_CELL; i++) {
        let below = conductances[i] * difference(staged(i), staged(i + 1u));
        second[i] = above - below;
        above = below;
    }
    second[LAST_CELL] = above + ends.back.flux;
    return ends;
}
