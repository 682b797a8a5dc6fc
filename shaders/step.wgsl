// One step of one member: twin of src/physics/step.rs, where the scheme is written out.

fn advance(step: u32) {
    hold(step);
    var start: array<real, 2>;
    var start_sideways = real(0.0);
    for (var stage = 0u; stage < run.stages; stage++) {
        if GAS {
            react(step, stage);
            flow(step, stage);
            outflow = leaving[stage];
        }
        properties(step, stage);
        meet();
        for (var face = 0u; face < run.open_faces; face++) {
            edges[face] = edge(face, face * run.last_cell, step, stage);
        }
        var sideways = real(0.0);
        if stage == 0u {
            sideways = assemble(step);
        } else {
            sideways = correct(step);
        }
        var through = array<real, 2>(
            passed_through(0u, 0u, step, stage),
            passed_through(1u, run.last_cell, step, stage),
        );
        if GAS {
            let drawn = warm(step, stage);
            through = array<real, 2>(through[0] + drawn[0], through[1] + drawn[1]);
        }
        if stage == 0u {
            look(step);
            note(step);
            if step == run.steps {
                finish();
                return;
            }
            start = through;
            start_sideways = sideways;
            ascend();
        } else {
            update(step);
            meet();
            if has(0u) {
                account(0u, step, start[0], through[0], 0u, 1u);
            }
            if has(run.last_cell) {
                account(1u, step, start[1], through[1], run.last_cell, run.last_cell - 1u);
            }
            if HOLDER == 1u {
                account_sideways(step, start_sideways, sideways);
            }
        }
    }
}

fn ascend() {
    var before = under_block();
    for (var up = 0u; up < end_cell() - first_cell(); up++) {
        let i = end_cell() - 1u - up;
        before = ascended(second[i], diagonal[i], upper[i], before);
        first[i] = before;
    }
}

fn account(face: u32, step: u32, start: real, end: real, cell: u32, neighbour: u32) {
    let sum = second[cell];
    let beside = second[neighbour];
    let edge = edge_of(face);
    let implicit = edge.slope * sum - edge.held * (passed_slopes[face][0] * sum - passed_slopes[face][1] * beside);
    let half_length = 0.5 * lengths[step];
    let amount = half_length * (start + end + implicit);
    heat[2u * face] = advanced(heat[2u * face], max(amount, 0.0));
    heat[2u * face + 1u] = advanced(heat[2u * face + 1u], max(-amount, 0.0));
}

fn update(step: u32) {
    var before = under_block();
    for (var from_back = 0u; from_back < end_ply() - first_ply(); from_back++) {
        let p = end_ply() - 1u - from_back;
        var low = coldest[p];
        var top = hottest[p];
        for (var up = 0u; up < end_of(p) - first_of(p); up++) {
            let i = end_of(p) - 1u - up;
            before = ascended(second[i], diagonal[i], upper[i], before);
            let start = first[i];
            let increment = 1.5 * start + 0.5 * before;
            second[i] = start + before;
            let now = advanced(temperatures[i], increment);
            temperatures[i] = now;
            low = min(low, now.high);
            top = max(top, now.high);
        }
        coldest[p] = low;
        hottest[p] = top;
        // The bits of a float that is no number, or below zero, are above those of every one in range.
        let watched = vec3<u32>(
            bitcast<u32>(f32(low + STRAY_MARGIN_K)),
            bitcast<u32>(f32(top + STRAY_MARGIN_K)),
            bitcast<u32>(f32(temperatures[first_of(p)].high + STRAY_MARGIN_K)),
        );
        let span = bitcast<u32>(f32(STRAY_SPAN_K));
        if any(watched > vec3<u32>(span, span, 0x7f7fffffu)) && strayed == 0u {
            strayed = step + 1u;
        }
    }
}
