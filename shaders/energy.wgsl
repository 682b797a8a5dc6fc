// Heat stored since the start: twin of src/physics/energy.rs.

fn sum_stored_heat() {
    for (var p = first_ply(); p < end_ply(); p++) {
        for (var i = first_cell_of(p); i < end_cell_of(p); i++) {
            let more = stored_heat_gain(p, i);
            stored_j_m2 = stored_j_m2 + more;
            let hot = select(0.0, plan.faces[0].held * more, i == 0u);
            let back = select(0.0, plan.faces[1].held * more, i == run.last_cell);
            heat[0] = add_compensated(heat[0], max(hot, 0.0));
            heat[1] = add_compensated(heat[1], max(-hot, 0.0));
            heat[2] = add_compensated(heat[2], max(back, 0.0));
            heat[3] = add_compensated(heat[3], max(-back, 0.0));
        }
    }
}

fn stored_heat_gain(p: u32, i: u32) -> real {
    let ply = plan.plies[p];
    let width_m = cell_width_m(i);
    let now = ply_row(p, temperatures[i].high);
    let then = ply_row(p, cells[i].start_k);
    if ply.states == 1u {
        let now_j_kg = integral(now, 1u);
        let then_j_kg = integral(then, 1u);
        return opaque(now_j_kg - then_j_kg) * ply_scales[p].density_kg_m3 * width_m + gas_heat_gain(p, i);
    }
    let phases = current_phases(p, i);
    let mass_kg_m2 = ply_scales[p].mass_kg_m3 * width_m;
    let lost_kg_m2 = mass_kg_m2 * lost_mass_ratio(p, i);
    lost_and_stored[0] = lost_and_stored[0] + lost_kg_m2;
    let then_j_kg = state_enthalpy(p, 0u, integral(then, 1u));
    let now_j_kg = solid_enthalpy(p, phases, now);
    return opaque(now_j_kg - then_j_kg) * mass_kg_m2 + gas_heat_gain(p, i);
}
