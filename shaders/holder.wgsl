// Lateral heat exchange with the specimen holder: twin of src/physics/holder.rs.

fn lateral_heat_flux(conductance_w_m2_k: real, holder_k: real, cell: DoubleWord) -> real {
    return conductance_w_m2_k * ((holder_k - cell.high) - cell.low);
}

fn holder_k(step: u32, stage: u32) -> real {
    let start = forcing(0u, step, 0u).holder_k;
    let end = forcing(0u, step, 1u).holder_k;
    let foreseen = real(GAMMA) * (end - start);
    return select(end - foreseen, start + foreseen, stage == 0u);
}

fn holder_conductance(ply: u32, cell: u32) -> real {
    return ply_scales[ply].holder_w_m3_k * cell_width_m(cell);
}

fn holder_flux(ply: u32, cell: u32, step: u32, stage: u32) -> real {
    return lateral_heat_flux(holder_conductance(ply, cell), holder_k(step, stage), stage_temperature(cell, stage));
}

fn account_holder_heat(step: u32, start: real, end: real) {
    var taken = real(0.0);
    for (var p = first_ply(); p < end_ply(); p++) {
        for (var i = first_cell_of(p); i < end_cell_of(p); i++) {
            taken = taken + holder_conductance(p, i) * rhs_or_increment[i];
        }
    }
    let half_step_s = 0.5 * step_length_s(step);
    let amount = reduce_sum(half_step_s * (start + end - real(GAMMA) * taken));
    if thread == 0u {
        heat[4] = add_compensated(heat[4], max(amount, 0.0));
        heat[5] = add_compensated(heat[5], max(-amount, 0.0));
    }
}
