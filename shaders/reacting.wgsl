// A member's reactions: twin of src/physics/reacting.rs.

// A column where gas is made; of one cell where not, as columns that nobody reads still want room.
alias GasColumn = array<real, GAS_CELLS>;

// Cell × reaction.
var<COLUMNS> advancements: array<Pair, GAS_CELLS * REACTIONS>;
var<COLUMNS> paces: array<real, GAS_CELLS * REACTIONS>;
var<private> lead_s: real;
var<COLUMNS> made: GasColumn;
var<COLUMNS> absorbed: GasColumn;
var<COLUMNS> made_mean: GasColumn;
var<COLUMNS> absorbed_mean: GasColumn;
var<COLUMNS> restraints: GasColumn;
var<private> given: real;
var<private> given_ends: array<real, 2>;

const EASE = 0.3;

fn restraint(rises_w_m2_k: real, capacity: real, eased_1_s: real) -> real {
    let stiff = rises_w_m2_k * keep(real(GAMMA));
    return stiff * (stiff / (capacity * eased_1_s + stiff));
}

fn react(step: u32, stage: u32) {
    given = 0.0;
    given_ends = array<real, 2>(0.0, 0.0);
    if step == run.steps {
        lead_s = 0.0;
        return;
    }
    let length_s = lengths[step];
    let lead = keep(real(GAMMA)) * length_s;
    lead_s = select(-lead, lead, stage == 0u);
    if stage == 0u {
        return;
    }
    for (var p = first_ply(); p < end_ply(); p++) {
        let ply = plies[p];
        if ply.end_reaction == ply.first_reaction {
            continue;
        }
        for (var i = first_of(p); i < end_of(p); i++) {
            react_cell(p, i, ply.first_reaction, ply.end_reaction, length_s);
        }
    }
}

fn react_cell(p: u32, i: u32, first_reaction: u32, end_reaction: u32, length_s: real) {
    let scale = ply_scales[p];
    let temperature_k = temperatures[i].high + 0.5 * first[i];
    let here = row_of(p, spot(temperature_k));
    let gas_here_j_kg = value(gas_of(p, here), 0u);
    let absolute = bulks[p].absolute;
    let virgin_j_kg = integral(here, 1u);
    var held_j_kg: Phases;
    for (var state = 0u; state < plies[p].states; state++) {
        held_j_kg[state] = remains_of(p, state) * enthalpy_of(p, state, here, virgin_j_kg);
    }
    let per_kelvin = 1.0 / temperature_k;
    let per_length = 1.0 / length_s;
    let steepness_k = scale.activation * per_kelvin;
    var before = real(1.0);
    var fed = real(0.0);
    var gas_made = real(0.0);
    var heat_absorbed = real(0.0);
    var heat_given = real(0.0);
    var rises = real(0.0);
    for (var j = first_reaction; j < end_reaction; j++) {
        let place = i * REACTIONS + j - first_reaction;
        let reaction = reactions[j];
        let steepness = reaction.activation_k * steepness_k;
        let exposure = length_s * rate(reaction, temperature_k, scale.kinetics, steepness);
        let done = advancements[place];
        var ahead = real(1.0);
        var entering = real(0.0);
        if reaction.chained == 1.0 {
            ahead = before;
            entering = 0.5 * fed;
        }
        let left = keep(keep(ahead - done.high) - done.low);
        let reactant = max(left + entering, 0.0);
        let used = consumed(reactant, exposure, reaction.order);
        let spent = reactant * used;
        before = done.high;
        fed = spent;
        advancements[place] = advanced(done, spent);
        paces[place] = spent * per_length;
        let from_state = paths[j].source;
        let to_state = paths[j].product;
        let lost = held_j_kg[from_state] - held_j_kg[to_state];
        let gas = spent * (reaction.loss * scale.loss);
        let risen = gas * gas_here_j_kg - spent * (reaction.share * lost);
        let of_reaction = gas * reaction.heat_j_kg;
        let heat_taken = scale.pyrolysis_heat * (of_reaction + absolute * (risen - of_reaction));
        gas_made = gas_made + gas;
        heat_absorbed = heat_absorbed + heat_taken;
        heat_given = heat_given + keep(risen - heat_taken);
        rises = rises + heat_taken * ((1.0 - used) * steepness);
    }
    let flux_kg_m2_s = scale.mass_kg_m3 * cells[i].width_m * per_length;
    take_stage(i, flux_kg_m2_s * gas_made, flux_kg_m2_s * heat_absorbed, 2.0 * (flux_kg_m2_s * heat_given));
    restraints[i] = max(flux_kg_m2_s * (rises * per_kelvin), 0.0);
}

fn made_at(i: u32, stage: u32) -> real {
    return select(made[i], made_mean[i], stage == 0u);
}

fn absorbed_at(i: u32, stage: u32) -> real {
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
    if i == LAST_CELL {
        given_ends[1] = heat_given;
    }
}
