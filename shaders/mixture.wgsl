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
        phases = transfer_volume(phases, plan.paths[j], moved_fraction);
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

fn current_mass_ratio(ply: u32, cell: u32) -> real {
    let row = plan.plies[ply];
    var lost = real(0.0);
    for (var j = row.first_reaction; j < row.end_reaction; j++) {
        lost = lost + advancements[cell * REACTIONS + j - row.first_reaction].high * plan.reactions[j].loss;
    }
    return opaque(1.0 - ply_scales[ply].loss * lost);
}

fn face_emissivity(face: u32, ply: u32, cell: u32, at: TableIndex, stage: u32) -> real {
    var phases = stage_phases(ply, cell, stage);
    let seen = table_segment(at, FACE_COLUMNS, FACE_TABLE);
    let first_property = AIR_PROPERTIES + face * MAX_STATES;
    let by_volume = plan.bulks[ply].by_volume == 1.0;
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

fn ply_row(ply: u32, at: TableIndex) -> TableSegment {
    return table_segment(at, plan.plies[ply].columns, plan.plies[ply].table);
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

fn mixture(
    p: u32,
    at: TableIndex,
    row: TableSegment,
    pressure: PressureIndex,
    phases: Phases,
    with_slope: bool,
) -> SolidProperties {
    let per_left = 1.0 / conductivity_divisor(p, mass_ratio(p, phases));
    var here = mixture_at_level(p, row, phases, with_slope);
    if LEVELS > 1u {
        let over = mixture_at_level(p, ply_row(p, at_pressure_levels(at, pressure)[1]), phases, with_slope);
        here.conductivity = here.conductivity + pressure.fraction * (over.conductivity - here.conductivity);
        here.slope = here.slope + pressure.fraction * (over.slope - here.slope);
    }
    return SolidProperties(here.conductivity * per_left, here.slope * per_left, here.heat_capacity);
}

fn mixture_at_level(p: u32, row: TableSegment, of_phases: Phases, with_slope: bool) -> SolidProperties {
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
    let virgin = solid_properties(row, ply.parts, alike.conductivity, with_slope);
    let capacity = alike.enthalpy_scale * (mass_kg_m3 * virgin.heat_capacity);
    var sum = SolidProperties(virgin.conductivity, virgin.slope, capacity);
    for (var state = 1u; state < ply.rows; state++) {
        let own = scale_of(p, state);
        let here = solid_properties(state_columns(state, row), ply.parts, own.conductivity, with_slope);
        sum.conductivity = sum.conductivity + phases[state] * here.conductivity;
        sum.slope = sum.slope + phases[state] * here.slope;
        let scale = phases[state] * own.enthalpy_scale;
        sum.heat_capacity = sum.heat_capacity + scale * (mass_kg_m3 * here.heat_capacity);
    }
    return sum;
}

fn conductivity_now(p: u32, i: u32, step: u32) -> real {
    let ply = plan.plies[p];
    if ply.end_reaction == ply.first_reaction {
        return conductivities[i];
    }
    let at = table_index(temperatures[i].high);
    let pressure = pressure_index(i, step, 0u);
    let row = ply_row(p, at_pressure_levels(at, pressure)[0]);
    return mixture(p, at, row, pressure, current_phases(p, i), false).conductivity;
}

fn pressure_index(i: u32, step: u32, stage: u32) -> PressureIndex {
    if LEVELS == 1u {
        return PressureIndex(0u, 0.0);
    }
    var pressure_pa = boundary_forcing[4u * step + stage].pressure_pa;
    if DARCY {
        pressure_pa = pressures[i].high;
    }
    const LAST = max(LEVELS, 2u) - 2u;
    let position = real(LAST + 1u) * pressure_coordinate(pressure_pa, real(MIDDLE_PA));
    let under = min(u32(max(position, 0.0)), LAST);
    return PressureIndex(under, position - real(under));
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
    if plan.bulks[ply].by_volume == 1.0 {
        return thickness_ratio;
    }
    return density * thickness_ratio;
}

fn degree_of_conversion(ply: u32, density: real) -> real {
    return (1.0 - density) * ply_scales[ply].per_loss;
}

fn thickness_ratio_of(ply: u32, density: real) -> real {
    return 1.0 - (1.0 - density) * (ply_scales[ply].per_loss * plan.bulks[ply].shrinkage);
}

fn transfer_volume(phases: Phases, path: ReactionPath, moved_fraction: real) -> Phases {
    var after = phases;
    after[path.source] = after[path.source] - moved_fraction;
    after[path.product] = after[path.product] + moved_fraction;
    return after;
}
