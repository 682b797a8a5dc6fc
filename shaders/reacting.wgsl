// A member's reactions: twin of src/physics/reacting.rs.

// A column where gas is made; of one cell where not, as columns that nobody reads still want room.
alias GasColumn = array<real, GAS_CELLS>;

// Cell × reaction.
var<COLUMNS> advancements: array<Pair, GAS_CELLS * REACTIONS>;
// Cell × state: what the first stage of the next step sees, and the second of this.
var<COLUMNS> phases_onward: array<real, GAS_CELLS * STATES>;
var<COLUMNS> phases_behind: array<real, GAS_CELLS * STATES>;
var<COLUMNS> risen: array<array<real, 2>, GAS_CELLS * STATES>;
var<COLUMNS> made: GasColumn;
var<COLUMNS> absorbed: GasColumn;
var<COLUMNS> made_mean: GasColumn;
var<COLUMNS> absorbed_mean: GasColumn;
var<COLUMNS> restraints: GasColumn;
var<private> given: real;
var<private> given_ends: array<real, 2>;

fn restraint(rises_w_m2_k: real, capacity: real, eased_1_s: real) -> real {
    let stiff = rises_w_m2_k * keep(real(GAMMA));
    return stiff * (stiff / (capacity * eased_1_s + stiff));
}

fn react(step: u32, stage: u32) {
    given = 0.0;
    given_ends = array<real, 2>(0.0, 0.0);
    if stage == 0u {
        return;
    }
    let length_s = lengths[step];
    var next_s = real(0.0);
    if step + 1u < run.steps {
        next_s = lengths[step + 1u];
    }
    for (var p = first_ply(); p < end_ply(); p++) {
        let ply = plan.plies[p];
        if ply.end_reaction == ply.first_reaction {
            continue;
        }
        for (var i = first_of(p); i < end_of(p); i++) {
            react_cell(p, i, length_s, next_s);
        }
    }
}

fn react_cell(p: u32, i: u32, length_s: real, next_s: real) {
    let scale = ply_scales[p];
    let ply = plan.plies[p];
    let rise_k = 0.5 * first[i];
    let temperature_k = temperatures[i].high + rise_k;
    let gas_here_j_kg = gas_j_kg[i] + gas_rises[i] * rise_k;
    let is_absolute = plan.bulks[p].absolute == 1.0;
    var held_j_kg: Phases;
    var risen_j_kg = risen[i * STATES][0] + risen[i * STATES][1] * rise_k;
    for (var state = 0u; state < ply.states; state++) {
        if state > 0u && ply.rows > 1u {
            risen_j_kg = risen[i * STATES + state][0] + risen[i * STATES + state][1] * rise_k;
        }
        held_j_kg[state] = enthalpy_of(p, state, risen_j_kg);
    }
    let per_kelvin = 1.0 / temperature_k;
    let per_length = 1.0 / length_s;
    let growth = next_s * per_length;
    let steepness_k = scale.activation * per_kelvin;
    var before = real(1.0);
    var fed = real(0.0);
    var gas_made = real(0.0);
    var heat_absorbed = real(0.0);
    var freed = real(0.0);
    var rises = real(0.0);
    var behind = virgin();
    var onward = virgin();
    for (var j = ply.first_reaction; j < ply.end_reaction; j++) {
        let place = i * REACTIONS + j - ply.first_reaction;
        let reaction = plan.reactions[j];
        let steepness = reaction.activation_k * steepness_k;
        let path = plan.paths[j];
        let before_it = advancements[place];
        let is_chained = reaction.chained == 1.0;
        let ahead = select(1.0, before, is_chained);
        var reactant = keep(keep(ahead - before_it.high) - before_it.low);
        if is_chained {
            reactant = reactant + 0.5 * fed;
        }
        reactant = max(reactant, 0.0);
        before = before_it.high;
        if reaction.idle < steepness || reactant < real(LEAST_LEFT) {
            fed = 0.0;
            let moved = before_it.high * reaction.share;
            behind = transferred(behind, path, moved);
            onward = transferred(onward, path, moved);
            continue;
        }
        let exposure = length_s * rate(reaction, temperature_k, scale.kinetics, steepness);
        let used = consumed(reactant, exposure, reaction.order);
        let spent = reactant * used;
        fed = spent;
        let done = advanced(before_it, spent);
        advancements[place] = done;
        let lag = spent * keep(real(GAMMA));
        let lead = min(lag * growth, (1.0 - done.high) * real(GAMMA));
        behind = transferred(behind, path, (done.high - lag) * reaction.share);
        onward = transferred(onward, path, (done.high + lead) * reaction.share);
        let gas = spent * (reaction.loss * scale.loss);
        let lost = spent * (reaction.share * (held_j_kg[path.source] - held_j_kg[path.product]));
        var of_reaction = gas * reaction.heat_j_kg;
        if is_absolute {
            of_reaction = gas * gas_here_j_kg - lost;
        }
        let heat_taken = scale.pyrolysis_heat * of_reaction;
        gas_made = gas_made + gas;
        heat_absorbed = heat_absorbed + heat_taken;
        freed = freed + lost;
        rises = rises + heat_taken * ((1.0 - used) * steepness);
    }
    for (var state = 0u; state < ply.states; state++) {
        phases_onward[i * STATES + state] = onward[state];
        phases_behind[i * STATES + state] = behind[state];
    }
    let flux_kg_m2_s = scale.mass_kg_m3 * cells[i].width_m * per_length;
    let heat_given = keep(keep(gas_made * gas_here_j_kg - freed) - heat_absorbed);
    take_stage(i, flux_kg_m2_s * gas_made, flux_kg_m2_s * heat_absorbed, 2.0 * (flux_kg_m2_s * heat_given));
    restraints[i] = max(flux_kg_m2_s * (rises * per_kelvin), 0.0);
}

fn made_at(i: u32, stage: u32) -> real {
    return select(made[i], made_mean[i], stage == 0u);
}

fn absorbed_at(i: u32, stage: u32) -> real {
    if !GAS {
        return 0.0;
    }
    return select(absorbed[i], absorbed_mean[i], stage == 0u);
}

fn take_stage(i: u32, gas_made: real, heat_absorbed: real, heat_given: real) {
    made[i] = 2.0 * gas_made - made_mean[i];
    absorbed[i] = 2.0 * heat_absorbed - absorbed_mean[i];
    made_mean[i] = gas_made;
    absorbed_mean[i] = heat_absorbed;
    given = given + heat_given;
    if i == 0u {
        given_ends[0] = heat_given;
    }
    if i == run.last_cell {
        given_ends[1] = heat_given;
    }
}
