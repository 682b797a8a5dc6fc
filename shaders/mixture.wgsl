// Mixture rules: twin of src/physics/mixture.rs.

alias Phases = array<real, STATES>;

fn scale_of(ply: u32, state: u32) -> StateScale {
    return state_scales[plan.plies[ply].first_state + state];
}

fn current_phases(ply: u32, cell: u32) -> Phases {
    let row = plan.plies[ply];
    var phases = virgin();
    for (var j = row.first_reaction; j < row.end_reaction; j++) {
        let place = cell * REACTIONS + j - row.first_reaction;
        let moved_fraction = plan.reactions[j].share * advancements[place].high;
        phases = transfer_volume(phases, plan.reaction_paths[j], moved_fraction);
    }
    return phases;
}

fn stage_phases(ply: u32, cell: u32, stage: u32) -> Phases {
    var phases = virgin();
    for (var state = 0u; GAS && state < plan.plies[ply].states; state++) {
        if stage == 0u {
            phases[state] = first_stage_phases[cell * STATES + state];
        } else {
            phases[state] = second_stage_phases[cell * STATES + state];
        }
    }
    return phases;
}

fn virgin() -> Phases {
    var phases: Phases;
    phases[0] = 1.0;
    return phases;
}

fn mass_ratio(ply: u32, phases: Phases) -> real {
    var each = phases;
    var density = each[0];
    for (var state = 1u; state < plan.plies[ply].states; state++) {
        density = density + each[state] * scale_of(ply, state).remains;
    }
    return opaque(density);
}

fn lost_mass_ratio(ply: u32, cell: u32) -> real {
    let row = plan.plies[ply];
    var lost = real(0.0);
    for (var j = row.first_reaction; j < row.end_reaction; j++) {
        lost = lost + advancements[cell * REACTIONS + j - row.first_reaction].high * plan.reactions[j].loss;
    }
    return ply_scales[ply].loss * lost;
}

fn face_emissivity(face: u32, ply: u32, cell: u32, seen: TableSegment, stage: u32) -> real {
    var phases = stage_phases(ply, cell, stage);
    let first_property = AIR_PROPERTIES + face * MAX_STATES;
    let by_volume = plan.bulk_properties[ply].by_volume == 1.0;
    var sum = real(0.0);
    for (var state = 0u; state < plan.plies[ply].states; state++) {
        var own = phases[state] * interpolate(seen, first_property + state);
        if !by_volume {
            own = own * scale_of(ply, state).remains;
        }
        sum = sum + own;
    }
    if by_volume {
        return sum;
    }
    return sum / mass_ratio(ply, phases);
}

fn ply_index(ply: u32, temperature_k: real) -> TableIndex {
    return table_index(temperature_k, plan.tables[ply]);
}

fn row_at(ply: u32, at: TableIndex) -> TableSegment {
    return table_segment(at, plan.tables[ply]);
}

fn ply_row(ply: u32, temperature_k: real) -> TableSegment {
    return row_at(ply, ply_index(ply, temperature_k));
}

fn state_columns(state: u32, row: TableSegment) -> TableSegment {
    return column_offset(row, state * PROPERTIES);
}

fn gas_columns(ply: u32, row: TableSegment) -> TableSegment {
    return state_columns(plan.plies[ply].rows, row);
}

fn state_enthalpy(ply: u32, state: u32, risen_j_kg: real) -> real {
    let own = scale_of(ply, state);
    return own.enthalpy_scale * risen_j_kg + own.formation_j_kg;
}

fn store_enthalpy_rises(p: u32, i: u32, row: TableSegment) {
    for (var state = 0u; state < plan.plies[p].rows; state++) {
        let own = state_columns(state, row);
        enthalpy_rises[i * STATES + state] = array<real, 2>(integral(own, 1u), interpolate(own, 1u));
    }
}

fn mixture(p: u32, temperature_k: real, pressure_pa: real, phases: Phases, with_slope: bool) -> SolidProperties {
    let per_left = 1.0 / conductivity_divisor(p, mass_ratio(p, phases));
    let pressure = pressure_index(p, pressure_pa);
    let rows = at_pressure_levels(ply_index(p, temperature_k), plan.tables[p].rows, pressure);
    let conditions = array<real, 2>(temperature_k, pressure_pa);
    var here = mixture_at_level(p, row_at(p, rows[0]), conditions, phases, with_slope);
    if DEPENDS_ON_PRESSURE && plan.plies[p].levels > 1u {
        let over = mixture_at_level(p, row_at(p, rows[1]), conditions, phases, with_slope);
        here.conductivity = here.conductivity + pressure.fraction * (over.conductivity - here.conductivity);
        here.slope = here.slope + pressure.fraction * (over.slope - here.slope);
    }
    return SolidProperties(here.conductivity * per_left, here.slope * per_left, here.heat_capacity);
}

fn conductivity_weights(p: u32, cell: u32, stage: u32) -> Phases {
    let ply = plan.plies[p];
    var weights = stage_phases(p, cell, stage);
    let per_left = 1.0 / conductivity_divisor(p, mass_ratio(p, weights));
    if ply.rows == 1u {
        weights[0] = mixture_sums(p, weights, ply.states).conductivity.solid * per_left;
        return weights;
    }
    for (var state = 0u; state < ply.rows; state++) {
        weights[state] = weights[state] * scale_of(p, state).conductivity.solid * per_left;
    }
    return weights;
}

fn conductivity_integral(p: u32, state: u32, row: TableSegment) -> array<real, 3> {
    let steep = plan.tables[p].conductivity_integral + state * STEEP_COLUMNS / 2u;
    return first_integral(state_columns(state, row), column_offset(row, steep));
}

fn mixture_at_level(
    p: u32,
    row: TableSegment,
    conditions: array<real, 2>,
    of_phases: Phases,
    with_slope: bool,
) -> SolidProperties {
    var phases = of_phases;
    let mass_kg_m3 = ply_scales[p].mass_kg_m3;
    let ply = plan.plies[p];
    let virgin_scale = scale_of(p, 0u);
    var alike = MixtureSums(
        times(virgin_scale.conductivity, phases[0], ply.parts),
        phases[0] * virgin_scale.enthalpy_scale,
        phases[0],
    );
    if ply.rows == 1u {
        alike = mixture_sums(p, phases, ply.states);
    }
    alike.conductivity.gas = pore_factor(p, 0u, conditions) * alike.conductivity.gas;
    let virgin = solid_properties(row, ply.parts, alike.conductivity, with_slope);
    let capacity = alike.enthalpy_scale * (mass_kg_m3 * virgin.heat_capacity);
    var sum = SolidProperties(virgin.conductivity, virgin.slope, capacity);
    for (var state = 1u; state < ply.rows; state++) {
        let own = scale_of(p, state);
        var parts = own.conductivity;
        parts.gas = pore_factor(p, state, conditions) * parts.gas;
        let here = solid_properties(state_columns(state, row), ply.parts, parts, with_slope);
        sum.conductivity = sum.conductivity + phases[state] * here.conductivity;
        sum.slope = sum.slope + phases[state] * here.slope;
        let scale = phases[state] * own.enthalpy_scale;
        sum.heat_capacity = sum.heat_capacity + scale * (mass_kg_m3 * here.heat_capacity);
    }
    return sum;
}

fn pore_factor(p: u32, state: u32, conditions: array<real, 2>) -> real {
    if !DEPENDS_ON_PRESSURE {
        return 1.0;
    }
    let row = plan.plies[p].first_state + state;
    let first = plan.conductivity_columns[row].first_pore;
    let end = plan.conductivity_columns[row].end_pore;
    if first == end {
        return 1.0;
    }
    var factor = real(0.0);
    for (var j = first; j < end; j++) {
        let slip_pa = conditions[0] * plan.pore_classes[j].slip_pa_k;
        factor = factor + conditions[1] * plan.pore_classes[j].share / (conditions[1] + slip_pa);
    }
    return factor;
}

fn conductivity_now(p: u32, i: u32, step: u32) -> real {
    let ply = plan.plies[p];
    if ply.end_reaction == ply.first_reaction {
        return conductivities[i];
    }
    return mixture(p, temperatures[i].high, cell_pressure_pa(i, step, 0u), current_phases(p, i), false).conductivity;
}

fn cell_pressure_pa(i: u32, step: u32, stage: u32) -> real {
    if DARCY {
        return pressures[i].high;
    }
    return forcing(0u, step, stage).pressure_pa;
}

fn pressure_index(p: u32, pressure_pa: real) -> PressureIndex {
    if !DEPENDS_ON_PRESSURE || plan.plies[p].levels < 2u {
        return PressureIndex(0u, 0.0);
    }
    let first = plan.plies[p].first_level;
    let last = first + plan.plies[p].levels - 1u;
    let position = logarithm(pressure_pa);
    var below = 0u;
    var fraction = level_fraction(position, first);
    for (var number = first + 1u; number < last; number++) {
        if position >= plan.pressure_levels[number].log_pressure {
            below = number - first;
            fraction = level_fraction(position, number);
        }
    }
    return PressureIndex(below, clamp(fraction, 0.0, 1.0));
}

fn level_fraction(position: real, number: u32) -> real {
    let here = plan.pressure_levels[number].log_pressure;
    return (position - here) / (plan.pressure_levels[number + 1u].log_pressure - here);
}

fn composition_ratio(p: u32, cell: u32) -> real {
    let states = plan.plies[p].states;
    if !GAS || states == 1u {
        return 1.0;
    }
    if plan.plies[p].rows > 1u {
        let row = ply_row(p, temperatures[cell].high + stage_increment(cell, 1u));
        let start = heat_capacity_sum(row, tabulated_states(p, cell, 0u));
        return heat_capacity_sum(row, tabulated_states(p, cell, 1u)) / start;
    }
    let start = mixture_sums(p, stage_phases(p, cell, 0u), states).enthalpy_scale;
    let end = mixture_sums(p, stage_phases(p, cell, 1u), states).enthalpy_scale;
    return end / start;
}

fn tabulated_states(p: u32, cell: u32, stage: u32) -> TabulatedStates {
    let count = plan.plies[p].rows;
    var weights = virgin();
    if GAS && count > 1u {
        weights = stage_phases(p, cell, stage);
        for (var state = 0u; state < count; state++) {
            weights[state] = weights[state] * scale_of(p, state).enthalpy_scale;
        }
    }
    return TabulatedStates(count, PROPERTIES, weights);
}

fn temperature_rise(p: u32, cell: u32, temperature_k: real, increment: real, reduced: real) -> array<real, 2> {
    if !ENTHALPY_STEPS || plan.tables[p].enthalpy_search_span == 0u {
        return array<real, 2>(increment, 1.0);
    }
    let states = tabulated_states(p, cell, 0u);
    let rise = rise_by_enthalpy(temperature_k, increment, reduced, plan.tables[p], states);
    var held = real(0.0);
    if cell == 0u {
        held = held + plan.faces[0].held;
    }
    if cell == run.last_cell {
        held = held + plan.faces[1].held;
    }
    return array<real, 2>(held * increment + (1.0 - held) * rise[0], held + (1.0 - held) * rise[1]);
}

fn solid_enthalpy(ply: u32, phases: Phases, here: TableSegment) -> real {
    var each = phases;
    var risen_j_kg = integral(here, 1u);
    var sum = real(0.0);
    for (var state = 0u; state < plan.plies[ply].states; state++) {
        if state > 0u && plan.plies[ply].rows > 1u {
            risen_j_kg = integral(state_columns(state, here), 1u);
        }
        sum = sum + each[state] * state_enthalpy(ply, state, risen_j_kg);
    }
    return sum;
}

struct MixtureSums {
    conductivity: ConductivityParts,
    enthalpy_scale: real,
    remains: real,
}

fn state_change(ply: u32, state: u32) -> StateScale {
    if state == 0u {
        return scale_of(ply, 0u);
    }
    return less(scale_of(ply, state), scale_of(ply, 0u));
}

fn mixture_sums(ply: u32, of_phases: Phases, states: u32) -> MixtureSums {
    var phases = of_phases;
    let virgin_scale = state_change(ply, 0u);
    let parts = plan.plies[ply].parts;
    var sum = MixtureSums(virgin_scale.conductivity, virgin_scale.enthalpy_scale, virgin_scale.remains);
    for (var state = 1u; state < states; state++) {
        let change = state_change(ply, state);
        sum.conductivity = plus(sum.conductivity, times(change.conductivity, phases[state], parts), parts);
        sum.enthalpy_scale = sum.enthalpy_scale + phases[state] * change.enthalpy_scale;
        sum.remains = sum.remains + phases[state] * change.remains;
    }
    return sum;
}

fn conductivity_divisor(ply: u32, density: real) -> real {
    let thickness_ratio = thickness_ratio_of(ply, density);
    if plan.bulk_properties[ply].by_volume == 1.0 {
        return thickness_ratio;
    }
    return density * thickness_ratio;
}

fn degree_of_conversion(ply: u32, density: real) -> real {
    return (1.0 - density) * ply_scales[ply].per_loss;
}

fn thickness_ratio_of(ply: u32, density: real) -> real {
    return 1.0 - (1.0 - density) * (ply_scales[ply].per_loss * plan.bulk_properties[ply].shrinkage);
}

fn transfer_volume(phases: Phases, path: ReactionPath, moved_fraction: real) -> Phases {
    var after = phases;
    after[path.source] = after[path.source] - moved_fraction;
    after[path.product] = after[path.product] + moved_fraction;
    return after;
}
