// A member's reactions: twin of src/physics/reacting.rs.

alias Phases = array<real, STATES>;

// Cell × reaction.
var<private> advancements: array<Pair, CELLS * REACTIONS>;
var<private> releases: array<real, CELLS * REACTIONS>;
var<private> responses: array<real, CELLS * REACTIONS>;
var<private> restraints: Column;

fn remains_of(ply: u32, state: u32) -> real {
    let row = plies[ply].first_state + state;
    return keep(1.0 - ply_scales[ply].loss * (1.0 - substances[row].remains));
}

fn phases_of(ply: u32, cell: u32) -> Phases {
    let row = plies[ply];
    var phases: Phases;
    phases[0] = 1.0;
    for (var j = row.first_reaction; j < row.end_reaction; j++) {
        let place = cell * REACTIONS + j - row.first_reaction;
        let moved = reactions[j].share * advancements[place].high;
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

fn weights_of(ply: u32, phases: Phases) -> Phases {
    let by_volume = bulks[ply].by_volume;
    let by_mass = 1.0 - by_volume;
    let per_density = 1.0 / mass_left(ply, phases);
    var weights = phases;
    for (var state = 0u; state < plies[ply].states; state++) {
        weights[state] = weights[state] * (by_volume + by_mass * (remains_of(ply, state) * per_density));
    }
    return weights;
}

fn converted(ply: u32, density: real) -> real {
    let last = plies[ply].states - 1u;
    return (1.0 - density) / max(1.0 - remains_of(ply, last), real(1e-6));
}

fn stretch_of(ply: u32, density: real) -> real {
    return 1.0 - bulks[ply].shrinkage * converted(ply, density);
}

fn face_emissivity(face: u32, ply: u32, cell: u32, at: Spot) -> real {
    var weights = weights_of(ply, phases_of(ply, cell));
    let first_column = FACE_TABLE + AIR_COLUMNS + face * STATES;
    var sum = real(0.0);
    for (var state = 0u; state < plies[ply].states; state++) {
        sum = sum + weights[state] * look_up(at, FACE_COLUMNS, first_column + state);
    }
    return sum;
}

fn block_of(ply: u32, state: u32) -> u32 {
    return plies[ply].table + state * BLOCK;
}

fn enthalpy_of(ply: u32, state: u32, at: Spot) -> real {
    let risen = integral(at, COLUMNS, block_of(ply, state) + 2u * PARTS);
    let row = plies[ply].first_state + state;
    return ply_scales[ply].heat_capacity * risen + substances[row].formation_j_kg;
}

fn blend(p: u32, i: u32, step: u32, stage: u32) {
    let scale = ply_scales[p];
    let at = spot(temperatures[i].high + first[i]);
    var phases = phases_of(p, i);
    var weights = weights_of(p, phases);
    let per_stretch = 1.0 / stretch_of(p, mass_left(p, phases));
    let here = pressure_level(i, step, stage);
    var conducts = real(0.0);
    var slope = real(0.0);
    var stores = real(0.0);
    for (var state = 0u; state < plies[p].states; state++) {
        let block = block_of(p, state);
        if LEVELS > 1u {
            let spots = levelled(at, here);
            let low = conductivity(spots[0], block, scale);
            let high = conductivity(spots[1], block, scale);
            conducts = conducts + weights[state] * (low + here.share * (high - low));
            if stage == 0u {
                let low_slope = conductivity_slope(spots[0], block, scale);
                let high_slope = conductivity_slope(spots[1], block, scale);
                slope = slope + weights[state] * (low_slope + here.share * (high_slope - low_slope));
            }
        } else {
            conducts = conducts + weights[state] * conductivity(at, block, scale);
            if stage == 0u {
                slope = slope + weights[state] * conductivity_slope(at, block, scale);
            }
        }
        let stored = heat_capacity(at, block, scale);
        stores = stores + phases[state] * remains_of(p, state) * stored;
    }
    conductivities[i] = conducts * per_stretch;
    slopes[i] = slope * per_stretch;
    evaluated[i] = cells[i].width_m * stores;
}

fn pressure_level(i: u32, step: u32, stage: u32) -> Level {
    var pressure_pa = drives[4u * step + stage].pressure_pa;
    if DARCY {
        pressure_pa = pressures[i].high;
    }
    const LAST = max(LEVELS, 2u) - 2u;
    let way = real(LAST + 1u) * level(pressure_pa, real(MIDDLE_PA));
    let under = min(u32(max(way, 0.0)), LAST);
    return Level(under, way - real(under));
}

fn solid_enthalpy(ply: u32, phases: Phases, at: Spot) -> real {
    var each = phases;
    var sum = real(0.0);
    for (var state = 0u; state < plies[ply].states; state++) {
        sum = sum + each[state] * remains_of(ply, state) * enthalpy_of(ply, state, at);
    }
    return sum;
}

fn gas_enthalpy_at(at: Spot) -> real {
    return look_up(at, GAS_COLUMNS, GAS_TABLE);
}

fn react(step: u32, stage: u32) {
    let length_s = lengths[step];
    for (var p = 0u; p < run.plies; p++) {
        let ply = plies[p];
        for (var i = ply.first_cell; i < ply.end_cell; i++) {
            react_cell(p, i, ply.first_reaction, ply.end_reaction, length_s, stage);
        }
    }
}

fn react_cell(p: u32, i: u32, first_reaction: u32, end_reaction: u32, length_s: real, stage: u32) {
    let temperature_k = temperatures[i].high + 0.5 * first[i];
    let mass_kg_m2 = ply_scales[p].mass_kg_m3 * cells[i].width_m * ply_scales[p].loss;
    let flux_kg_m2_s = mass_kg_m2 / length_s;
    let per_kelvin = 1.0 / temperature_k;
    var before = real(1.0);
    var fed = real(0.0);
    for (var j = first_reaction; j < end_reaction; j++) {
        let place = i * REACTIONS + j - first_reaction;
        let reaction = reactions[j];
        let steepness = ply_scales[p].activation * reaction.activation_k * per_kelvin;
        let now_1_s = rate(reaction, temperature_k, ply_scales[p].kinetics, steepness);
        let exposure = length_s * now_1_s;
        let chained = reaction.chained;
        let ahead = 1.0 + chained * (before - 1.0);
        let done = advancements[place];
        let left = keep(keep(ahead - done.high) - done.low);
        let reactant = max(left + chained * 0.5 * fed, 0.0);
        let spent = consumed(reactant, exposure, reaction.order);
        let release = spent * reaction.loss * flux_kg_m2_s;
        before = done.high;
        fed = spent;
        if stage == 0u {
            releases[place] = release;
            let spared = (reactant - spent) / max(reactant, 1e-30);
            responses[place] = release * spared * steepness * per_kelvin;
        } else {
            releases[place] = 2.0 * release - releases[place];
            advancements[place] = advanced(done, spent);
        }
    }
}

const EASE = 0.3;

fn restrain(step: u32) {
    let per_length = EASE / lengths[step];
    for (var i = 0u; i <= LAST_CELL; i++) {
        let stiff = real(GAMMA) * restraints[i];
        diagonal[i] = diagonal[i] + stiff * (stiff / (capacities[i] * per_length + stiff));
    }
}

fn made_in(ply: u32, cell: u32) -> real {
    let row = plies[ply];
    var sum = real(0.0);
    for (var j = 0u; j < row.end_reaction - row.first_reaction; j++) {
        sum = sum + releases[cell * REACTIONS + j];
    }
    return sum;
}

fn reaction_heat(ply: u32, cell: u32) -> array<real, 3> {
    let row = plies[ply];
    let at = spot(temperatures[cell].high + first[cell]);
    let gas_j_kg = gas_enthalpy_at(at);
    let absolute = bulks[ply].absolute;
    var held_j_kg: Phases;
    for (var state = 0u; state < row.states; state++) {
        held_j_kg[state] = remains_of(ply, state) * enthalpy_of(ply, state, at);
    }
    var absorbed = real(0.0);
    var given = real(0.0);
    var rises = real(0.0);
    for (var j = row.first_reaction; j < row.end_reaction; j++) {
        let reaction = reactions[j];
        let from_state = paths[j].source;
        let to_state = paths[j].product;
        let lost = held_j_kg[from_state] - held_j_kg[to_state];
        let solid_j_kg = reaction.share * lost / (ply_scales[ply].loss * reaction.loss);
        let rise = gas_j_kg - solid_j_kg;
        let of_reaction = reaction.heat_j_kg;
        let heat_j_kg = ply_scales[ply].pyrolysis_heat * (of_reaction + absolute * (rise - of_reaction));
        let place = cell * REACTIONS + j - row.first_reaction;
        let release = releases[place];
        absorbed = absorbed + release * heat_j_kg;
        rises = rises + responses[place] * heat_j_kg;
        given = given + release * (rise - heat_j_kg);
    }
    return array<real, 3>(absorbed, given, rises);
}
