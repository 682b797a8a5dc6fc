// Pyrolysis reactions: twin of src/physics/pyrolysis.rs.

// A column for gas; of one cell without gas, as WGSL has no empty arrays.
alias GasColumn = array<real, GAS_CELLS>;

// Cell × reaction.
var<COLUMNS> advancements: array<DoubleWord, GAS_CELLS * REACTIONS>;
// Cell × state: volume fractions for the first stage of the next step, and for the second stage of this one.
var<COLUMNS> first_stage_phases: array<real, GAS_CELLS * STATES>;
var<COLUMNS> second_stage_phases: array<real, GAS_CELLS * STATES>;
var<COLUMNS> next_phases: array<real, NEXT_PHASE_CELLS * STATES>;
var<COLUMNS> enthalpy_rises: array<array<real, 2>, GAS_CELLS * STATES>;
var<COLUMNS> gas_source: GasColumn;
var<COLUMNS> absorbed_heat: GasColumn;
var<COLUMNS> mean_gas_source: GasColumn;
var<COLUMNS> mean_absorbed_heat: GasColumn;
var<COLUMNS> heat_slopes: GasColumn;
var<private> released_heat: real;
var<private> released_heat_ends: array<real, 2>;

fn stiffness_damping(rises_w_m2_k: real, capacity: real, damping_rate_1_s: real) -> real {
    let stiff = rises_w_m2_k * opaque(real(GAMMA));
    return stiff * (stiff / (capacity * damping_rate_1_s + stiff));
}

fn remaining(before: real, done: DoubleWord) -> real {
    return difference(DoubleWord(before, 0.0), done);
}

fn advance_reactions(step: u32, stage: u32) {
    released_heat = 0.0;
    released_heat_ends = array<real, 2>(0.0, 0.0);
    if stage == 0u {
        return;
    }
    let length_s = step_length_s(step);
    var next_s = real(0.0);
    if step + 1u < run.steps {
        next_s = step_length_s(step + 1u);
    }
    for (var p = first_ply(); p < end_ply(); p++) {
        let ply = plan.plies[p];
        if ply.end_reaction == ply.first_reaction {
            continue;
        }
        for (var i = first_cell_of(p); i < end_cell_of(p); i++) {
            advance_cell_reactions(p, i, length_s, next_s);
        }
    }
}

fn midpoint_enthalpies(p: u32, i: u32, rise_k: real) -> Phases {
    let ply = plan.plies[p];
    var enthalpies_j_kg: Phases;
    var risen_j_kg = enthalpy_rises[i * STATES][0] + enthalpy_rises[i * STATES][1] * rise_k;
    for (var state = 0u; state < ply.states; state++) {
        if state > 0u && ply.rows > 1u {
            risen_j_kg = enthalpy_rises[i * STATES + state][0] + enthalpy_rises[i * STATES + state][1] * rise_k;
        }
        enthalpies_j_kg[state] = state_enthalpy(p, state, risen_j_kg);
    }
    return enthalpies_j_kg;
}

fn store_phases(p: u32, i: u32, second_stage: Phases, first_stage: Phases) {
    for (var state = 0u; state < plan.plies[p].states; state++) {
        if ENTHALPY_STEPS {
            next_phases[i * STATES + state] = first_stage[state];
        } else {
            first_stage_phases[i * STATES + state] = first_stage[state];
        }
        second_stage_phases[i * STATES + state] = second_stage[state];
    }
}

fn adopt_next_phases() {
    for (var place = first_cell() * STATES; place < end_cell() * STATES; place++) {
        first_stage_phases[place] = next_phases[place];
    }
}

fn advance_cell_reactions(p: u32, i: u32, step_length_s: real, next_s: real) {
    let scale = ply_scales[p];
    let ply = plan.plies[p];
    let rise_k = 0.5 * first_increments[i];
    let temperature_k = temperatures[i].high + rise_k;
    let gas_here_j_kg = gas_enthalpy_j_kg[i] + gas_heat_capacities[i] * rise_k;
    let is_absolute = plan.bulk_properties[p].absolute == 1.0;
    let state_enthalpies = midpoint_enthalpies(p, i, rise_k);
    let per_kelvin = 1.0 / temperature_k;
    let inverse_step_1_s = 1.0 / step_length_s;
    let growth = next_s * inverse_step_1_s;
    let steepness_k = scale.activation * per_kelvin;
    let scaled_step_s = scale.pre_exponential * step_length_s;
    let released_j_kg = scale.loss * gas_here_j_kg;
    var before = real(1.0);
    var inflow = real(0.0);
    var gas_sum = real(0.0);
    var heat_sum = real(0.0);
    var solid_released = real(0.0);
    var slope_sum = real(0.0);
    var second_stage = virgin();
    var first_stage = virgin();
    let has_one_path = ply.states == 2u;
    var second_stage_transfer = real(0.0);
    var first_stage_transfer = real(0.0);
    for (var j = ply.first_reaction; j < ply.end_reaction; j++) {
        let place = i * REACTIONS + j - ply.first_reaction;
        let reaction = plan.reactions[j];
        let steepness = reaction.activation_k * steepness_k;
        let path = plan.reaction_paths[j];
        let before_it = advancements[place];
        let is_chained = reaction.chained == 1.0;
        let ahead = select(1.0, before, is_chained);
        var reactant = remaining(ahead, before_it);
        if is_chained {
            reactant = reactant + 0.5 * inflow;
        }
        reactant = max(reactant, 0.0);
        before = before_it.high;
        var lag = before_it.high;
        var lead = before_it.high;
        inflow = 0.0;
        if reaction.idle >= steepness && reactant >= real(REACTANT_MIN) {
            let exposure = arrhenius_rate(reaction, temperature_k, scaled_step_s, steepness);
            let used = consumed_share(reactant, exposure, reaction.order);
            let spent = reactant * used;
            inflow = spent;
            let done = add_compensated(before_it, spent);
            advancements[place] = done;
            let behind = spent * opaque(real(GAMMA));
            lag = done.high - behind;
            lead = done.high + min(behind * growth, (1.0 - done.high) * real(GAMMA));
            let gas = spent * reaction.loss;
            let fall_j_kg = state_enthalpies[path.source] - state_enthalpies[path.product];
            let lost = spent * reaction.share * fall_j_kg;
            var heat_taken = gas * reaction.heat_j_kg;
            if is_absolute {
                heat_taken = gas * released_j_kg - lost;
            }
            gas_sum = gas_sum + gas;
            heat_sum = heat_sum + heat_taken;
            solid_released = solid_released + lost;
            slope_sum = slope_sum + heat_taken * ((1.0 - used) * reaction.activation_k);
        }
        lag = lag * reaction.share;
        lead = lead * reaction.share;
        if has_one_path {
            second_stage_transfer = second_stage_transfer + lag;
            first_stage_transfer = first_stage_transfer + lead;
        } else {
            second_stage = transfer_volume(second_stage, path, lag);
            first_stage = transfer_volume(first_stage, path, lead);
        }
    }
    if has_one_path {
        let path = plan.reaction_paths[ply.first_reaction];
        second_stage = transfer_volume(second_stage, path, second_stage_transfer);
        first_stage = transfer_volume(first_stage, path, first_stage_transfer);
    }
    store_phases(p, i, second_stage, first_stage);
    let gas_made = scale.loss * gas_sum;
    var heat_scale = scale.pyrolysis_heat;
    if !is_absolute {
        heat_scale = scale.pyrolysis_heat * scale.loss;
    }
    let heat_absorbed = heat_scale * heat_sum;
    let flux_kg_m2_s = scale.mass_kg_m3 * cell_width_m(i) * inverse_step_1_s;
    let heat_given = opaque(opaque(gas_made * gas_here_j_kg - solid_released) - heat_absorbed);
    let heat_slope = flux_kg_m2_s * (heat_scale * slope_sum * (steepness_k * per_kelvin));
    store_stage_sources(
        i,
        flux_kg_m2_s * gas_made,
        flux_kg_m2_s * heat_absorbed,
        2.0 * (flux_kg_m2_s * heat_given),
        max(heat_slope, 0.0),
    );
}

fn gas_source_at(i: u32, stage: u32) -> real {
    return select(gas_source[i], mean_gas_source[i], stage == 0u);
}

fn absorbed_heat_at(i: u32, stage: u32) -> real {
    if !GAS {
        return 0.0;
    }
    return select(absorbed_heat[i], mean_absorbed_heat[i], stage == 0u);
}

fn store_stage_sources(i: u32, gas_made: real, heat_absorbed: real, heat_given: real, heat_slope: real) {
    gas_source[i] = 2.0 * gas_made - mean_gas_source[i];
    absorbed_heat[i] = 2.0 * heat_absorbed - mean_absorbed_heat[i];
    mean_gas_source[i] = gas_made;
    mean_absorbed_heat[i] = heat_absorbed;
    heat_slopes[i] = heat_slope;
    released_heat = released_heat + heat_given;
    if i == 0u {
        released_heat_ends[0] = heat_given;
    }
    if i == run.last_cell {
        released_heat_ends[1] = heat_given;
    }
}
