// Heat stored since the start: twin of src/physics/energy.rs.

fn finish() {
    for (var p = first_ply(); p < end_ply(); p++) {
        for (var i = first_cell_of(p); i < end_cell_of(p); i++) {
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
