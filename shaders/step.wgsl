// One step of one member: twin of src/physics/step.rs, where the scheme is written out.

const GAMMA = 0.2928932188134524;
const STRAY_MARGIN_K = 1.0;
const STRAY_SPAN_K = STRAY_MARGIN_K + TABLE_STEP_K * (f32(TABLE_NODES) - 1.0);

fn advance(step: u32) {
    hold(step);
    var start: Ends;
    var onward: array<vec2<real>, 2>;
    var by_schedule: vec2<real>;
    var start_sideways = real(0.0);
    for (var stage = 0u; stage < run.stages; stage++) {
        if GAS {
            react(step, stage);
            flow(step, stage);
            outflow = leaving[stage];
        }
        properties(step, stage);
        if stage == 0u {
            look(step);
            note(step);
            if step == run.steps {
                finish();
                return;
            }
        }
        var ends = imbalance(drives[4u * step + stage], drives[4u * step + 2u + stage]);
        if GAS {
            ends = warm(step, stage, ends);
        }
        var sideways = real(0.0);
        if HOLDER == 1u {
            sideways = exchange(step, stage);
        }
        if stage == 0u {
            start = ends;
            start_sideways = sideways;
            onward[0] = vec2<real>(lower[0], upper[0]);
            onward[1] = vec2<real>(upper[LAST_CELL - 1u], lower[LAST_CELL - 1u]);
            by_schedule = driven(step, start);
            assemble(step, start, by_schedule);
        } else {
            correct(step, by_schedule);
        }
        substitute(&lower, &diagonal, &upper, &second);
        if stage == 0u {
            for (var i = 0u; i <= LAST_CELL; i++) {
                first[i] = second[i];
            }
        } else {
            account(0u, step, start.hot, ends.hot, onward[0], 0u, 1u);
            account(1u, step, start.back, ends.back, onward[1], LAST_CELL, LAST_CELL - 1u);
            if HOLDER == 1u {
                account_sideways(step, start_sideways, sideways);
            }
        }
    }
    update(step);
}

fn rise(face: u32, step: u32) -> real {
    return drives[4u * step + 2u * face + 1u].held_k - drives[4u * step + 2u * face].held_k;
}

fn driven(step: u32, start: Ends) -> vec2<real> {
    let gamma = real(GAMMA);
    let hot = through(0u, drives[4u * step + 1u], 0u, 1u);
    let back = through(1u, drives[4u * step + 3u], LAST_CELL, LAST_CELL - 1u);
    return vec2<real>(gamma * (hot.flux - start.hot.flux), gamma * (back.flux - start.back.flux));
}

fn assemble(step: u32, start: Ends, driven: vec2<real>) {
    let gamma = real(GAMMA);
    let per_length = 1.0 / lengths[step];
    lower[LAST_CELL] = 0.0;
    upper[LAST_CELL] = 0.0;
    var arriving = real(0.0);
    var returned = real(0.0);
    for (var i = 0u; i <= LAST_CELL; i++) {
        let leaving = lower[i];
        capacities[i] = evaluated[i];
        diagonal[i] = capacities[i] * per_length + gamma * (returned + leaving);
        returned = upper[i];
        lower[i] = -(gamma * arriving);
        upper[i] = -(gamma * returned);
        arriving = leaving;
    }
    if HOLDER == 1u {
        brace();
    }
    if GAS {
        restrain(step);
        let_out_heat();
    }
    for (var face = 0u; face < run.faces; face++) {
        let cell = face * LAST_CELL;
        let slope = select(start.hot.slope, start.back.slope, face == 1u);
        let held = faces[face].held;
        let free = 1.0 - held;
        diagonal[cell] = held + free * (diagonal[cell] - gamma * slope);
        second[cell] = held * rise(face, step) + free * (second[cell] + driven[face]);
        lower[cell] = free * lower[cell];
        upper[cell] = free * upper[cell];
    }
    factorise(&lower, &diagonal, &upper);
}

fn correct(step: u32, driven: vec2<real>) {
    let per_length = 1.0 / lengths[step];
    for (var i = 0u; i <= LAST_CELL; i++) {
        let weight = capacities[i] / evaluated[i];
        let carried = capacities[i] * per_length * first[i];
        second[i] = weight * second[i] - (carried + carried);
    }
    for (var face = 0u; face < run.faces; face++) {
        let cell = face * LAST_CELL;
        let held = faces[face].held;
        let free = 1.0 - held;
        second[cell] = free * (second[cell] - driven[face]) - held * rise(face, step);
    }
}

fn account(face: u32, step: u32, start: FaceFlux, end: FaceFlux, onward: vec2<real>, cell: u32, neighbour: u32) {
    let sum = first[cell] + second[cell];
    let beside = first[neighbour] + second[neighbour];
    let held = faces[face].held;
    let implicit = start.slope * sum + held * (onward.x * sum - onward.y * beside);
    let half_length = 0.5 * lengths[step];
    let amount = half_length * (start.flux + end.flux + real(GAMMA) * implicit);
    heat[2u * face] = advanced(heat[2u * face], max(amount, 0.0));
    heat[2u * face + 1u] = advanced(heat[2u * face + 1u], max(-amount, 0.0));
}

fn update(step: u32) {
    for (var p = 0u; p < run.plies; p++) {
        var sum = real(0.0);
        var low = coldest[p];
        var high = hottest[p];
        for (var i = plies[p].first_cell; i < plies[p].end_cell; i++) {
            let increment = 1.5 * first[i] + 0.5 * second[i];
            let now = advanced(temperatures[i], increment);
            temperatures[i] = now;
            first[i] = 0.0;
            low = min(low, now.high);
            high = max(high, now.high);
            sum = sum + now.high;
        }
        coldest[p] = low;
        hottest[p] = high;
        // The bits of a float that is no number, or below zero, are above those of every one in range.
        let watched = vec3<u32>(
            bitcast<u32>(f32(low + STRAY_MARGIN_K)),
            bitcast<u32>(f32(high + STRAY_MARGIN_K)),
            bitcast<u32>(f32(sum + STRAY_MARGIN_K)),
        );
        let span = bitcast<u32>(f32(STRAY_SPAN_K));
        if any(watched > vec3<u32>(span, span, 0x7f7fffffu)) && strayed == 0u {
            strayed = step + 1u;
        }
    }
}
