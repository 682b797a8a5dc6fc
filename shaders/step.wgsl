// One time step of one member: twin of src/physics/step.rs, which states the scheme.

fn exceeds_increment(rise_k: real, increment: real) -> real {
    return select(real(1.0), 0.0, increment * increment * real(EXCESS_ALLOWED) >= rise_k * rise_k);
}

fn advance(step: u32) {
    apply_held_faces(step);
    var start: array<real, 2>;
    var start_holder_heat = real(0.0);
    for (var stage = 0u; stage < run.stages; stage++) {
        if GAS {
            advance_reactions(step, stage);
            update_gas_flow(step, stage);
            stage_outflow = hot_outflow[stage];
        }
        properties(step, stage);
        synchronize();
        for (var face = 0u; face < run.open_faces; face++) {
            boundary_rows[face] = boundary_row(face, face * run.last_cell, step, stage);
        }
        var holder_heat = assemble_stage(step, stage);
        var face_heat = array<real, 2>(
            face_heat_flux(0u, 0u, step, stage),
            face_heat_flux(1u, run.last_cell, step, stage),
        );
        if GAS {
            let drawn = gas_heat_outflow(step, stage);
            face_heat = array<real, 2>(face_heat[0] + drawn[0], face_heat[1] + drawn[1]);
        }
        if stage == 0u {
            update_sensors(step);
            record(step);
            if step == run.steps {
                sum_stored_heat();
                return;
            }
            start = face_heat;
            start_holder_heat = holder_heat;
            solve_first_increments();
            if ENTHALPY_STEPS {
                for (var reduction = 0u; reduction < run.reductions; reduction++) {
                    reduce_capacities(reduction);
                    synchronize();
                    holder_heat = assemble_stage(step, 0u);
                    solve_first_increments();
                }
                rise_by_increments();
            }
        } else {
            update_temperatures(step);
            if GAS && ENTHALPY_STEPS {
                adopt_next_phases();
            }
            synchronize();
            if has_cell(0u) {
                account_face_heat(0u, step, start[0], face_heat[0], 0u, 1u);
            }
            if has_cell(run.last_cell) {
                account_face_heat(1u, step, start[1], face_heat[1], run.last_cell, run.last_cell - 1u);
            }
            if HOLDER == 1u {
                account_holder_heat(step, start_holder_heat, holder_heat);
            }
        }
    }
}

fn solve_first_increments() {
    var before = unknown_below_block();
    for (var end = end_cell(); end > first_cell(); end--) {
        let i = end - 1u;
        before = back_substitute(rhs_or_increment[i], reciprocal_pivots[i], upper_ratios[i], before);
        first_increments[i] = before;
    }
}

fn rise_by_increments() -> real {
    var exceeds = real(0.0);
    for (var p = first_ply(); p < end_ply(); p++) {
        for (var i = first_cell_of(p); i < end_cell_of(p); i++) {
            let solution = first_increments[i];
            first_solution[i] = solution;
            let rise_k = temperature_rise(p, i, temperatures[i].high, solution, reduced[i])[0];
            first_increments[i] = reduced[i] * rise_k + (1.0 - reduced[i]) * solution;
            exceeds = max(exceeds, exceeds_increment(rise_k, solution) * (1.0 - reduced[i]));
        }
    }
    return exceeds;
}

// As the twin, but for its end: control flow is the same for all members, and solving anew changes nothing where no
// heat capacity was reduced.
fn reduce_capacities(reduction: u32) {
    if reduction == 0u {
        for (var i = first_cell(); i < end_cell(); i++) {
            reduced[i] = 0.0;
        }
    }
    let exceeds = reduce_max(rise_by_increments());
    for (var p = first_ply(); p < end_ply(); p++) {
        for (var i = first_cell_of(p); i < end_cell_of(p); i++) {
            let solution = first_solution[i];
            let rise = temperature_rise(p, i, temperatures[i].high, solution, reduced[i]);
            var reduces = exceeds_increment(rise[0], solution);
            if reduction + 1u == run.reductions {
                reduces = exceeds;
            }
            reduces = reduces * (1.0 - reduced[i]);
            stage_capacities[i] = stage_capacities[i] * (1.0 - reduces + reduces * rise[1]);
            reduced[i] = reduced[i] + reduces;
        }
    }
}

fn account_face_heat(face: u32, step: u32, start: real, end: real, cell: u32, neighbour: u32) {
    let sum = rhs_or_increment[cell];
    let neighbour_sum = rhs_or_increment[neighbour];
    let row = boundary_row_of(face);
    let slopes = face_conduction_slopes[face];
    let implicit = row.slope * sum - row.held * (slopes[0] * sum - slopes[1] * neighbour_sum);
    let half_step_s = 0.5 * step_length_s(step);
    let amount = half_step_s * (start + end + implicit);
    heat[2u * face] = add_compensated(heat[2u * face], max(amount, 0.0));
    heat[2u * face + 1u] = add_compensated(heat[2u * face + 1u], max(-amount, 0.0));
}

fn update_temperatures(step: u32) {
    var before = unknown_below_block();
    for (var plies_end = end_ply(); plies_end > first_ply(); plies_end--) {
        let p = plies_end - 1u;
        let first = first_cell_of(p);
        var low = coldest[p];
        var top = hottest[p];
        for (var end = end_cell_of(p); end > first; end--) {
            let i = end - 1u;
            before = back_substitute(rhs_or_increment[i], reciprocal_pivots[i], upper_ratios[i], before);
            var start = first_increments[i];
            if ENTHALPY_STEPS {
                start = first_solution[i];
            }
            var increment = 1.5 * start + 0.5 * before;
            if ENTHALPY_STEPS {
                increment = temperature_rise(p, i, temperatures[i].high, increment, reduced[i])[0];
            }
            rhs_or_increment[i] = start + before;
            let now = add_compensated(temperatures[i], increment);
            temperatures[i] = now;
            low = min(low, now.high);
            top = max(top, now.high);
        }
        coldest[p] = low;
        hottest[p] = top;
        // The bits of NaN, or of a negative float, are above those of every float in range.
        let watched = vec3<u32>(
            bitcast<u32>(f32(low + DIVERGENCE_MARGIN_K)),
            bitcast<u32>(f32(top + DIVERGENCE_MARGIN_K)),
            bitcast<u32>(f32(temperatures[first].high + DIVERGENCE_MARGIN_K)),
        );
        let span = bitcast<u32>(f32(DIVERGENCE_SPAN_K));
        if any(watched > vec3<u32>(span, span, 0x7f7fffffu)) && diverged == 0u {
            diverged = step + 1u;
        }
    }
}
