// Entry point: LANES invocations a member. A dispatch carries every member a few steps further (past the last
// step it only reads the sensors and sums up); all it needs to go on is in `state`, so that no dispatch is long and none runs out of the loops a driver allows it.

// Where what comes after the cells and sensors begins in `state`.
fn outcome_slot() -> u32 {
    return 2u * run.cells + 4u * SENSORS;
}

fn extremes_slot() -> u32 {
    return outcome_slot() + 2u * HEATS + 1u;
}

// Where there is gas: what it took along and what is on its way, then reactions, cells, and pressures.
fn gone_slot() -> u32 {
    return extremes_slot() + 2u * PLIES;
}

fn advanced_slot() -> u32 {
    return gone_slot() + 14u;
}

fn seen_slot() -> u32 {
    return advanced_slot() + 2u * run.cells * REACTIONS;
}

fn made_slot() -> u32 {
    return seen_slot() + run.cells * STATES;
}

fn pressed_slot() -> u32 {
    return made_slot() + 3u * run.cells;
}

fn slot(index: u32) -> u32 {
    return index * run.members + member;
}

// Columns begin as the memory held them (see src/march/gpu/spirv.rs), so that those of gas are cleared here: what no step before has written is nothing.
// All others are written before what is read of them counts.
fn clear_gas(i: u32) {
    flows[i] = 0.0;
    made[i] = 0.0;
    absorbed[i] = 0.0;
    made_mean[i] = 0.0;
    absorbed_mean[i] = 0.0;
    restraints[i] = 0.0;
    gas_j_kg[i] = 0.0;
    gas_rises[i] = 0.0;
    for (var r = 0u; r < REACTIONS; r++) {
        let reaction = i * REACTIONS + r;
        advancements[reaction] = Pair(0.0, 0.0);
    }
    for (var s = 0u; s < STATES; s++) {
        let place = i * STATES + s;
        phases_onward[place] = virgin()[s];
        phases_behind[place] = virgin()[s];
        risen[place] = array<real, 2>(0.0, 0.0);
    }
    if DARCY {
        pressures[i] = Pair(0.0, 0.0);
        pressure_rates[i] = 0.0;
        first_flows[i] = 0.0;
        mean_flows[i] = 0.0;
        supply[i] = 0.0;
        surges[i] = 0.0;
        pores[i] = Porous();
        later[i] = Porous();
        slopes_above[i] = 0.0;
        slopes_below[i] = 0.0;
        pressed_first[i] = 0.0;
        pressed_second[i] = 0.0;
        pressure_lower[i] = 0.0;
        pressure_diagonal[i] = 0.0;
        pressure_upper[i] = 0.0;
    }
}

fn load() {
    for (var i = first_cell(); i < end_cell(); i++) {
        temperatures[i] = Pair(state[slot(2u * i)], state[slot(2u * i + 1u)]);
    }
    for (var s = lane; s < run.sensors; s += LANES) {
        let base = 2u * run.cells + 4u * s;
        readings[s] = Pair(state[slot(base)], state[slot(base + 1u)]);
        beads_now[s] = Pair(state[slot(base + 2u)], state[slot(base + 3u)]);
    }
    // Of a sum that lanes have in parts the first takes what there is.
    for (var h = 0u; h < HEATS && lane == 0u; h++) {
        heat[h] = Pair(state[slot(outcome_slot() + 2u * h)], state[slot(outcome_slot() + 2u * h + 1u)]);
    }
    for (var p = 0u; p < run.plies; p++) {
        coldest[p] = state[slot(extremes_slot() + 2u * p)];
        hottest[p] = state[slot(extremes_slot() + 1u + 2u * p)];
    }
    strayed = progress[run.members + member];
    if GAS {
        load_gas();
    }
}

fn load_gas() {
    if lane == 0u {
        gas_in = Pair(state[slot(gone_slot())], state[slot(gone_slot() + 1u)]);
        gas_out = Pair(state[slot(gone_slot() + 2u)], state[slot(gone_slot() + 3u)]);
        gas_heat = Pair(state[slot(gone_slot() + 4u)], state[slot(gone_slot() + 5u)]);
        reaction_gain = Pair(state[slot(gone_slot() + 6u)], state[slot(gone_slot() + 7u)]);
        lost_and_stored = array<real, 2>(state[slot(gone_slot() + 8u)], state[slot(gone_slot() + 9u)]);
    }
    recent = array<real, 2>(state[slot(gone_slot() + 10u)], state[slot(gone_slot() + 11u)]);
    mean_leaving = state[slot(gone_slot() + 12u)];
    back_leaving = state[slot(gone_slot() + 13u)];
    for (var i = first_cell() * REACTIONS; i < end_cell() * REACTIONS; i++) {
        let base = advanced_slot() + 2u * i;
        advancements[i] = Pair(state[slot(base)], state[slot(base + 1u)]);
    }
    for (var i = first_cell() * STATES; i < end_cell() * STATES; i++) {
        phases_onward[i] = state[slot(seen_slot() + i)];
    }
    for (var i = first_cell(); i < end_cell(); i++) {
        let base = made_slot() + 3u * i;
        made_mean[i] = state[slot(base)];
        absorbed_mean[i] = state[slot(base + 1u)];
        restraints[i] = state[slot(base + 2u)];
    }
    if DARCY {
        for (var i = first_cell(); i < end_cell(); i++) {
            let base = pressed_slot() + 6u * i;
            pressures[i] = Pair(state[slot(base)], state[slot(base + 1u)]);
            pressure_rates[i] = state[slot(base + 2u)];
            pores[i].storage = state[slot(base + 3u)];
            mean_flows[i] = state[slot(base + 4u)];
            supply[i] = state[slot(base + 5u)];
        }
    }
}

fn save_gas() {
    for (var i = first_cell() * REACTIONS; i < end_cell() * REACTIONS; i++) {
        let base = advanced_slot() + 2u * i;
        state[slot(base)] = advancements[i].high;
        state[slot(base + 1u)] = advancements[i].low;
    }
    for (var i = first_cell() * STATES; i < end_cell() * STATES; i++) {
        state[slot(seen_slot() + i)] = phases_onward[i];
    }
    for (var i = first_cell(); i < end_cell(); i++) {
        let base = made_slot() + 3u * i;
        state[slot(base)] = made_mean[i];
        state[slot(base + 1u)] = absorbed_mean[i];
        state[slot(base + 2u)] = restraints[i];
    }
    if DARCY {
        for (var i = first_cell(); i < end_cell(); i++) {
            let base = pressed_slot() + 6u * i;
            state[slot(base)] = pressures[i].high;
            state[slot(base + 1u)] = pressures[i].low;
            state[slot(base + 2u)] = pressure_rates[i];
            state[slot(base + 3u)] = pores[i].storage;
            state[slot(base + 4u)] = mean_flows[i];
            state[slot(base + 5u)] = supply[i];
        }
    }
}

// What a member has but once.
fn save_whole() {
    for (var h = 0u; h < HEATS; h++) {
        state[slot(outcome_slot() + 2u * h)] = heat[h].high;
        state[slot(outcome_slot() + 2u * h + 1u)] = heat[h].low;
    }
    state[slot(outcome_slot() + 2u * HEATS)] = stored_j_m2;
    for (var p = 0u; p < run.plies; p++) {
        state[slot(extremes_slot() + 2u * p)] = coldest[p];
        state[slot(extremes_slot() + 1u + 2u * p)] = hottest[p];
    }
    progress[run.members + member] = strayed;
    if GAS {
        state[slot(gone_slot())] = gas_in.high;
        state[slot(gone_slot() + 1u)] = gas_in.low;
        state[slot(gone_slot() + 2u)] = gas_out.high;
        state[slot(gone_slot() + 3u)] = gas_out.low;
        state[slot(gone_slot() + 4u)] = gas_heat.high;
        state[slot(gone_slot() + 5u)] = gas_heat.low;
        state[slot(gone_slot() + 6u)] = reaction_gain.high;
        state[slot(gone_slot() + 7u)] = reaction_gain.low;
        state[slot(gone_slot() + 8u)] = lost_and_stored[0];
        state[slot(gone_slot() + 9u)] = lost_and_stored[1];
        state[slot(gone_slot() + 10u)] = recent[0];
        state[slot(gone_slot() + 11u)] = recent[1];
        state[slot(gone_slot() + 12u)] = mean_leaving;
        state[slot(gone_slot() + 13u)] = back_leaving;
    }
}

// The cells come last: drivers that stop counting loops stop all that follow, so that if this loop is whole,
// all before it were.
fn save() -> u32 {
    unite();
    if lane == 0u {
        save_whole();
    }
    for (var s = lane; s < run.sensors; s += LANES) {
        let base = 2u * run.cells + 4u * s;
        state[slot(base)] = readings[s].high;
        state[slot(base + 1u)] = readings[s].low;
        state[slot(base + 2u)] = beads_now[s].high;
        state[slot(base + 3u)] = beads_now[s].low;
    }
    if GAS {
        save_gas();
    }
    var saved = 0u;
    for (var i = first_cell(); i < end_cell(); i++) {
        state[slot(2u * i)] = temperatures[i].high;
        state[slot(2u * i + 1u)] = temperatures[i].low;
        saved++;
    }
    return u32(summed(real(saved)));
}

@compute @workgroup_size(WORKGROUP)
fn march(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    // The early returns depend on this value and on that of `steps_done`, which all threads of a workgroup that
    // meet at barriers have alike: a private variable is not uniform to a compiler.
    let carried = member_of(group.x, thread);
    one = real(run.one);
    member = carried;
    if carried >= run.members {
        return;
    }
    stand(thread);
    // A member that a dispatch cut short stays where it is.
    if steps_done() != run.first_step {
        return;
    }
    for (var i = first_cell(); GAS && i < end_cell(); i++) {
        clear_gas(i);
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
    if save() == run.cells && lane == 0u {
        progress[member] = step;
    }
}
