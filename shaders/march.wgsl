// Entry point: LANES invocations a member. A dispatch carries every member a few steps further (past the last
// step it only reads the sensors and sums up); all it needs to go on is in `state`, so that no dispatch is long and none runs out of the loops a driver allows it.

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

// The functions `load_…` and `save_…` are generated from the blocks of src/march/gpu/state.rs.
fn load() {
    load_temperatures(first_cell(), end_cell(), 1u);
    load_readings(lane, run.sensors, LANES);
    // Of a sum that lanes have in parts the first takes all.
    if lane == 0u {
        load_heat(0u, HEATS, 1u);
    }
    load_extremes(0u, run.plies, 1u);
    strayed = progress[run.members + member];
    if GAS {
        if lane == 0u {
            load_gas_sums(0u, 1u, 1u);
        }
        load_gas_flows(0u, 1u, 1u);
        load_advancements(first_cell() * REACTIONS, end_cell() * REACTIONS, 1u);
        load_phases(first_cell() * STATES, end_cell() * STATES, 1u);
        load_sources(first_cell(), end_cell(), 1u);
        if DARCY {
            load_pressures(first_cell(), end_cell(), 1u);
        }
    }
}

// The cells come last: drivers that stop counting loops stop all that follow, so that if this loop is whole,
// all before it were.
fn save() -> u32 {
    unite();
    if lane == 0u {
        save_heat(0u, HEATS, 1u);
        save_stored(0u, 1u, 1u);
        save_extremes(0u, run.plies, 1u);
        progress[run.members + member] = strayed;
    }
    save_readings(lane, run.sensors, LANES);
    if GAS {
        if lane == 0u {
            save_gas_sums(0u, 1u, 1u);
            save_gas_flows(0u, 1u, 1u);
        }
        save_advancements(first_cell() * REACTIONS, end_cell() * REACTIONS, 1u);
        save_phases(first_cell() * STATES, end_cell() * STATES, 1u);
        save_sources(first_cell(), end_cell(), 1u);
        if DARCY {
            save_pressures(first_cell(), end_cell(), 1u);
        }
    }
    let saved = save_temperatures(first_cell(), end_cell(), 1u);
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
