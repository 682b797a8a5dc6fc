// A member's reactions: twin of src/physics/reacting.rs.

alias Phases = array<real, STATES>;
// A column where gas is made; of one cell where not, as columns that nobody reads still want room.
alias GasColumn = array<real, GAS_CELLS>;

var<private> remains: array<real, SUBSTANCES>;
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

fn remains_of(ply: u32, state: u32) -> real {
    return remains[plies[ply].first_state + state];
}

fn phases_of(ply: u32, cell: u32, lead: real) -> Phases {
    let row = plies[ply];
    var phases: Phases;
    phases[0] = 1.0;
    for (var j = row.first_reaction; j < row.end_reaction; j++) {
        let place = cell * REACTIONS + j - row.first_reaction;
        let done = advancements[place].high;
        let ahead = min(lead * paces[place], real(GAMMA) * (1.0 - done));
        let moved = reactions[j].share * (done + ahead);
        let path = paths[j];
        phases[path.source] = phases[path.source] - moved;
        phases[path.product] = phases[path.product] + moved;
    }
    return phases;
}

fn mass_left(ply: u32, phases: Phases) -> real {
    var each = phases;
    var density = each[0];
    for (var state = 1u; state < plies[ply].states; state++) {
        density = density + each[state] * remains_of(ply, state);
    }
    return keep(density);
}

fn weights_of(ply: u32, phases: Phases, per_density: real) -> Phases {
    let by_volume = bulks[ply].by_volume;
    let by_mass = (1.0 - by_volume) * per_density;
    var weights = phases;
    for (var state = 0u; state < plies[ply].states; state++) {
        weights[state] = weights[state] * (by_volume + by_mass * remains_of(ply, state));
    }
    return weights;
}

fn converted(ply: u32, density: real) -> real {
    return (1.0 - density) * ply_scales[ply].per_loss;
}

fn stretch_of(ply: u32, density: real) -> real {
    return 1.0 - bulks[ply].shrinkage * converted(ply, density);
}

fn face_emissivity(face: u32, ply: u32, cell: u32, at: Spot) -> real {
    let phases = phases_of(ply, cell, lead_s);
    var weights = weights_of(ply, phases, 1.0 / mass_left(ply, phases));
    let seen = segment(at, FACE_COLUMNS, FACE_TABLE);
    let first_property = AIR_PROPERTIES + face * STATES_MAX;
    var sum = real(0.0);
    for (var state = 0u; state < plies[ply].states; state++) {
        sum = sum + weights[state] * value(seen, first_property + state);
    }
    return sum;
}

fn row_of(ply: u32, at: Spot) -> Segment {
    return segment(at, plies[ply].columns, plies[ply].table);
}

fn state_of(state: u32, row: Segment) -> Segment {
    return beyond(row, state * PROPERTIES);
}

fn gas_of(ply: u32, row: Segment) -> Segment {
    return state_of(plies[ply].states, row);
}

fn enthalpy_of(ply: u32, state: u32, here: Segment) -> real {
    let risen = integral(state_of(state, here), 1u);
    let row = plies[ply].first_state + state;
    return ply_scales[ply].heat_capacity * risen + substances[row].formation_j_kg;
}

fn blend(p: u32, i: u32, at: Spot, step: u32, stage: u32) {
    let level_here = level_of(i, step, stage);
    let row = row_of(p, levelled(at, level_here)[0]);
    let here = mixture(p, i, at, row, level_here, lead_s, stage == 0u);
    conductivities[i] = here.conductivity;
    slopes[i] = here.slope;
    evaluated[i] = cells[i].width_m * here.heat_capacity;
    if GAS {
        gas_at(i, gas_of(p, row));
    }
}

fn mixture(p: u32, i: u32, at: Spot, row: Segment, level_here: Level, lead: real, with_slope: bool) -> Solid {
    var phases = phases_of(p, i, lead);
    let density = mass_left(p, phases);
    let stretch = stretch_of(p, density);
    let inverse = 1.0 / (density * stretch);
    var weights = weights_of(p, phases, inverse * stretch);
    let per_stretch = inverse * density;
    var here = of_states(p, row, phases, weights, with_slope);
    if LEVELS > 1u {
        let over = of_states(p, row_of(p, levelled(at, level_here)[1]), phases, weights, with_slope);
        here.conductivity = here.conductivity + level_here.share * (over.conductivity - here.conductivity);
        here.slope = here.slope + level_here.share * (over.slope - here.slope);
    }
    return Solid(here.conductivity * per_stretch, here.slope * per_stretch, here.heat_capacity);
}

fn of_states(p: u32, row: Segment, of_phases: Phases, of_weights: Phases, with_slope: bool) -> Solid {
    var phases = of_phases;
    var weights = of_weights;
    var sum: Solid;
    for (var state = 0u; state < plies[p].states; state++) {
        let here = solid(state_of(state, row), state_scales[plies[p].first_state + state], with_slope);
        let volume = phases[state] * remains_of(p, state);
        sum.conductivity = sum.conductivity + weights[state] * here.conductivity;
        sum.slope = sum.slope + weights[state] * here.slope;
        sum.heat_capacity = sum.heat_capacity + volume * (ply_scales[p].density_kg_m3 * here.heat_capacity);
    }
    return sum;
}

fn conductivity_now(p: u32, i: u32, step: u32) -> real {
    let ply = plies[p];
    if ply.end_reaction == ply.first_reaction {
        return conductivities[i];
    }
    let at = spot(temperatures[i].high);
    let level_here = level_of(i, step, 0u);
    let row = row_of(p, levelled(at, level_here)[0]);
    return mixture(p, i, at, row, level_here, 0.0, false).conductivity;
}

fn level_of(i: u32, step: u32, stage: u32) -> Level {
    if LEVELS == 1u {
        return Level(0u, 0.0);
    }
    var pressure_pa = drives[4u * step + stage].pressure_pa;
    if DARCY {
        pressure_pa = pressures[i].high;
    }
    const LAST = max(LEVELS, 2u) - 2u;
    let way = real(LAST + 1u) * level(pressure_pa, real(MIDDLE_PA));
    let under = min(u32(max(way, 0.0)), LAST);
    return Level(under, way - real(under));
}

fn solid_enthalpy(ply: u32, phases: Phases, here: Segment) -> real {
    var each = phases;
    var sum = real(0.0);
    for (var state = 0u; state < plies[ply].states; state++) {
        sum = sum + each[state] * remains_of(ply, state) * enthalpy_of(ply, state, here);
    }
    return sum;
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
    var held_j_kg: Phases;
    for (var state = 0u; state < plies[p].states; state++) {
        held_j_kg[state] = remains_of(p, state) * enthalpy_of(p, state, here);
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
