// One step of one member: twin of src/physics/step.rs, where the scheme is written out.

const GAMMA = 0.2928932188134524;
const STRAY_MARGIN_K = 1.0;
const STRAY_SPAN_K = STRAY_MARGIN_K + TABLE_STEP_K * (f32(TABLE_NODES) - 1.0);

struct Edge {
    held: real,
    rise_k: real,
    driven: real,
    slope: real,
    let_out: real,
}

struct Row {
    lower: real,
    diagonal: real,
    upper: real,
    side: real,
}

var<private> edges: array<Edge, 2>;

fn bounds(edge: Edge, row: Row) -> Row {
    let free = 1.0 - edge.held;
    return Row(
        row.lower * free,
        (row.diagonal + edge.let_out - edge.slope) * free + edge.held,
        row.upper * free,
        (row.side + edge.driven) * free + edge.held * edge.rise_k,
    );
}

fn corrects(edge: Edge, side: real) -> real {
    return (side - edge.driven) * (1.0 - edge.held) - edge.held * edge.rise_k;
}

// By a number that is not known beforehand a driver picks rows of several fields up in so many words that compiling takes ten times
// as long.
fn edge_of(cell: u32) -> Edge {
    if cell == 0u {
        return edges[0];
    }
    return edges[1];
}

fn advance(step: u32) {
    hold(step);
    var start: Ends;
    var onward: array<array<real, 2>, 2>;
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
        var ends = imbalance(drives[4u * step + stage], drives[4u * step + 2u + stage], stage);
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
            onward[0] = array<real, 2>(lower[0], upper[0]);
            onward[1] = array<real, 2>(upper[LAST_CELL - 1u], lower[LAST_CELL - 1u]);
            edged(step, start);
            assemble(step);
            ascend();
        } else {
            correct(step);
            update(step);
            meet();
            if has(0u) {
                account(0u, step, start.hot, ends.hot, onward[0], 0u, 1u);
            }
            if has(LAST_CELL) {
                account(1u, step, start.back, ends.back, onward[1], LAST_CELL, LAST_CELL - 1u);
            }
            if HOLDER == 1u {
                account_sideways(step, start_sideways, sideways);
            }
        }
    }
}

fn rise(face: u32, step: u32) -> real {
    return drives[4u * step + 2u * face + 1u].held_k - drives[4u * step + 2u * face].held_k;
}

fn edged(step: u32, start: Ends) {
    let hot = through(0u, drives[4u * step + 1u], 0u, 0u, 1u);
    let back = through(1u, drives[4u * step + 3u], 0u, LAST_CELL, LAST_CELL - 1u);
    for (var face = 0u; face < run.faces; face++) {
        var before = start.hot;
        var after = hot;
        if face == 1u {
            before = start.back;
            after = back;
        }
        edges[face].held = faces[face].held;
        edges[face].rise_k = rise(face, step);
        edges[face].driven = (after.flux - before.flux) * real(GAMMA);
        edges[face].slope = before.slope * keep(real(GAMMA));
        edges[face].let_out = 0.0;
        if GAS {
            edges[face].let_out = let_out_heat(face, face * LAST_CELL);
        }
    }
}

fn assemble(step: u32) {
    let gamma = real(GAMMA);
    let per_length = 1.0 / lengths[step];
    let eased = EASE / lengths[step];
    if has(LAST_CELL) {
        lower[LAST_CELL] = 0.0;
        upper[LAST_CELL] = 0.0;
    }
    // A block begins with a reciprocal of one, so that its first `lower` keeps what the cell owes to the one above it.
    let entered = entering();
    var arriving = entered[0] * -gamma;
    var returned = entered[1] * -gamma;
    var reciprocal = real(1.0);
    var upper_before = real(0.0);
    var before = real(0.0);
    for (var p = first_ply(); p < end_ply(); p++) {
        for (var i = first_of(p); i < end_of(p); i++) {
            let leaving = lower[i] * -gamma;
            let below = upper[i] * -gamma;
            let capacity = evaluated[i];
            capacities[i] = capacity;
            var row = Row(
                arriving,
                capacity * per_length - (returned + leaving),
                below,
                second[i],
            );
            arriving = leaving;
            returned = below;
            if HOLDER == 1u {
                row.diagonal = row.diagonal + conductance_sideways(p, i) * keep(gamma);
            }
            if GAS && plies[p].end_reaction > plies[p].first_reaction {
                row.diagonal = row.diagonal + restraint(restraints[i], capacity, eased);
            }
            if i == 0u || i == LAST_CELL {
                row = bounds(edge_of(i), row);
            }
            let done = eliminated(row.lower, row.diagonal, reciprocal, upper_before);
            before = descended(row.side, done.under, before);
            reciprocal = done.reciprocal;
            upper_before = row.upper;
            lower[i] = done.under;
            diagonal[i] = reciprocal;
            upper[i] = row.upper * reciprocal;
            second[i] = before;
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

fn correct(step: u32) {
    let twice_per_length = 2.0 / lengths[step];
    var before = real(0.0);
    for (var i = first_cell(); i < end_cell(); i++) {
        let capacity = capacities[i];
        let weight = capacity / evaluated[i];
        var side = weight * second[i] - capacity * twice_per_length * first[i];
        if i == 0u || i == LAST_CELL {
            side = corrects(edge_of(i), side);
        }
        before = descended(side, lower[i], before);
        second[i] = before;
    }
}

fn account(
    face: u32,
    step: u32,
    start: FaceFlux,
    end: FaceFlux,
    onward: array<real, 2>,
    cell: u32,
    neighbour: u32,
) {
    let sum = second[cell];
    let beside = second[neighbour];
    let held = faces[face].held;
    let implicit = start.slope * sum + held * (onward[0] * sum - onward[1] * beside);
    let half_length = 0.5 * lengths[step];
    let amount = half_length * (start.flux + end.flux + real(GAMMA) * implicit);
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
            first[i] = 0.0;
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
