// Entry point: LANES threads a member. A dispatch advances every member by a few steps; after the last step it only
// reads the sensors and sums up. All it needs to resume is in `state`, so that dispatches are short and none exceeds
// the loop count that a driver allows.

// Columns begin with whatever the memory held (see src/march/gpu/spirv.rs). Columns of gas are read before they are
// written, so they are cleared here.
fn clear_gas(i: u32) {
    mass_fluxes[i] = 0.0;
    gas_source[i] = 0.0;
    absorbed_heat[i] = 0.0;
    mean_gas_source[i] = 0.0;
    mean_absorbed_heat[i] = 0.0;
    heat_slopes[i] = 0.0;
    gas_enthalpy_j_kg[i] = 0.0;
    gas_heat_capacities[i] = 0.0;
    for (var r = 0u; r < REACTIONS; r++) {
        let reaction = i * REACTIONS + r;
        advancements[reaction] = DoubleWord(0.0, 0.0);
    }
    for (var s = 0u; s < STATES; s++) {
        let place = i * STATES + s;
        first_stage_phases[place] = virgin()[s];
        second_stage_phases[place] = virgin()[s];
        if ENTHALPY_STEPS {
            next_phases[place] = virgin()[s];
        }
        enthalpy_rises[place] = array<real, 2>(0.0, 0.0);
    }
    if DARCY {
        pressures[i] = DoubleWord(0.0, 0.0);
        pressure_rates[i] = 0.0;
        first_stage_fluxes[i] = 0.0;
        mean_mass_fluxes[i] = 0.0;
        supply[i] = 0.0;
        source_corrections[i] = 0.0;
        pores[i] = PoreState();
        pores_at_end[i] = PoreState();
        slopes_above[i] = 0.0;
        slopes_below[i] = 0.0;
        first_pressure_increments[i] = 0.0;
        pressure_unknowns[i] = 0.0;
        pressure_lower[i] = 0.0;
        pressure_diagonal[i] = 0.0;
        pressure_upper[i] = 0.0;
    }
}

// The functions `load_…` and `save_…` are generated from the blocks of src/march/gpu/state.rs.
fn load() {
    load_temperatures(first_cell(), end_cell(), 1u);
    load_readings(thread, run.sensors, THREADS_PER_MEMBER);
    // The first thread loads the whole of a sum that is kept in parts.
    if thread == 0u {
        load_heat(0u, HEAT_TOTALS, 1u);
    }
    load_extremes(0u, run.plies, 1u);
    diverged = progress[run.members + member];
    if GAS {
        if thread == 0u {
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

// Temperatures come last: drivers that end long loops end all later loops too, so if this loop is complete, all before
// it were.
fn save() -> u32 {
    reduce_sums();
    if thread == 0u {
        save_heat(0u, HEAT_TOTALS, 1u);
        save_stored(0u, 1u, 1u);
        save_extremes(0u, run.plies, 1u);
        progress[run.members + member] = diverged;
    }
    save_readings(thread, run.sensors, THREADS_PER_MEMBER);
    if GAS {
        if thread == 0u {
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
    return u32(reduce_sum(real(saved)));
}

@compute @workgroup_size(WORKGROUP)
fn march(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) invocation: u32) {
    // The early returns depend on this value and on that of `steps_done`, which are the same in all threads of a
    // workgroup. A private variable would not be uniform to a compiler.
    let own_member = member_of(group.x, invocation);
    one = real(run.one);
    member = own_member;
    if own_member >= run.members {
        return;
    }
    assign_block(invocation);
    // Skips a member whose last dispatch was cut short.
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
    if save() == run.cells && thread == 0u {
        progress[member] = step;
    }
}
