// Entry point: one invocation a member. A dispatch carries every member a few steps further (past the last
// step it only reads the sensors and sums up); all it needs to go on is in `state`, so that no dispatch is long and none runs out of the loops a driver allows it.

const OUTCOME = 2u * CELLS + 4u * SENSORS;
const EXTREMES = OUTCOME + 2u * HEATS + 1u;

fn slot(index: u32) -> u32 {
    return index * run.members + member;
}

fn load() {
    for (var i = 0u; i < CELLS; i++) {
        temperatures[i] = Pair(state[slot(2u * i)], state[slot(2u * i + 1u)]);
    }
    for (var s = 0u; s < run.sensors; s++) {
        let base = 2u * CELLS + 4u * s;
        readings[s] = Pair(state[slot(base)], state[slot(base + 1u)]);
        beads_now[s] = Pair(state[slot(base + 2u)], state[slot(base + 3u)]);
    }
    for (var h = 0u; h < HEATS; h++) {
        heat[h] = Pair(state[slot(OUTCOME + 2u * h)], state[slot(OUTCOME + 2u * h + 1u)]);
    }
    for (var p = 0u; p < run.plies; p++) {
        coldest[p] = state[slot(EXTREMES + 2u * p)];
        hottest[p] = state[slot(EXTREMES + 1u + 2u * p)];
    }
    strayed = progress[run.members + member];
}

// The cells come last: drivers that stop counting loops stop all that follow, so that if this loop is whole,
// all before it were.
fn save() -> u32 {
    for (var s = 0u; s < run.sensors; s++) {
        let base = 2u * CELLS + 4u * s;
        state[slot(base)] = readings[s].high;
        state[slot(base + 1u)] = readings[s].low;
        state[slot(base + 2u)] = beads_now[s].high;
        state[slot(base + 3u)] = beads_now[s].low;
    }
    for (var h = 0u; h < HEATS; h++) {
        state[slot(OUTCOME + 2u * h)] = heat[h].high;
        state[slot(OUTCOME + 2u * h + 1u)] = heat[h].low;
    }
    state[slot(OUTCOME + 2u * HEATS)] = stored_j_m2;
    for (var p = 0u; p < run.plies; p++) {
        state[slot(EXTREMES + 2u * p)] = coldest[p];
        state[slot(EXTREMES + 1u + 2u * p)] = hottest[p];
    }
    progress[run.members + member] = strayed;
    var saved = 0u;
    for (var i = 0u; i < CELLS; i++) {
        state[slot(2u * i)] = temperatures[i].high;
        state[slot(2u * i + 1u)] = temperatures[i].low;
        saved++;
    }
    return saved;
}

@compute @workgroup_size(WORKGROUP)
fn march(@builtin(global_invocation_id) id: vec3<u32>) {
    member = id.x;
    one = real(run.one);
    // A member that a dispatch cut short stays where it is.
    if member >= run.members || progress[member] != run.first_step {
        return;
    }
    scale();
    if run.first_step == 0u {
        start();
    } else {
        load();
    }
    var step = run.first_step;
    for (; step < run.end_step; step++) {
        advance(step);
    }
    if save() == CELLS {
        progress[member] = step;
    }
}
