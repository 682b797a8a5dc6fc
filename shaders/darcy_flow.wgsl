// Darcy flow of gas: twin of src/physics/darcy_flow.rs, which states the scheme.

// A column for Darcy flow; of one cell without it.
alias PoreColumn = array<real, PORE_CELLS>;

var<COLUMNS> mass_fluxes: GasColumn;
var<private> hot_outflow: array<real, 2>;
var<private> back_outflow: real;
// Outflow through the hot face at this stage; means of the last two steps.
var<private> stage_outflow: real;
var<private> recent_outflows: array<real, 2>;
var<private> gas_in: DoubleWord;
var<private> gas_out: DoubleWord;
// Solid lost and gas stored since the start.
var<private> lost_and_stored: array<real, 2>;
var<COLUMNS> pressures: array<DoubleWord, PORE_CELLS>;
var<COLUMNS> pressure_rates: PoreColumn;
var<COLUMNS> pores: array<PoreState, PORE_CELLS>;
var<COLUMNS> pores_at_end: array<PoreState, PORE_CELLS>;
var<COLUMNS> mean_mass_fluxes: PoreColumn;
var<private> mean_hot_outflow: real;
var<COLUMNS> supply: PoreColumn;
var<COLUMNS> source_corrections: PoreColumn;
var<COLUMNS> first_stage_fluxes: PoreColumn;
var<COLUMNS> slopes_above: PoreColumn;
var<COLUMNS> slopes_below: PoreColumn;
var<COLUMNS> first_pressure_increments: PoreColumn;
var<COLUMNS> pressure_unknowns: PoreColumn;
var<COLUMNS> pressure_lower: PoreColumn;
var<COLUMNS> pressure_diagonal: PoreColumn;
var<COLUMNS> pressure_upper: PoreColumn;

fn update_gas_flow(step: u32, stage: u32) {
    if DARCY {
        if stage == 0u {
            update_pores(step);
        } else {
            advance_pressures(step);
        }
        return;
    }
    let carries = select(real(0.0), real(1.0), QUASI_STEADY);
    var upward_flux = gas_source_below(stage);
    for (var end = end_cell(); end > first_cell(); end--) {
        let i = end - 1u;
        let here = gas_source_at(i, stage);
        mass_fluxes[i] = carries * upward_flux;
        upward_flux = upward_flux + here;
    }
    hot_outflow[stage] = first_block_outflow(upward_flux);
    if stage == 1u {
        let mean = 0.5 * (hot_outflow[0] + hot_outflow[1]);
        account_outflow(step, mean, 0.0);
    }
}

fn account_outflow(step: u32, hot_kg_m2_s: real, back_kg_m2_s: real) {
    let length_s = step_length_s(step);
    if thread == 0u {
        add_gas_exchange(hot_kg_m2_s * length_s, back_kg_m2_s * length_s);
    }
    recent_outflows = array<real, 2>(recent_outflows[1], hot_kg_m2_s);
}

fn add_gas_exchange(hot_kg_m2: real, back_kg_m2: real) {
    gas_in = add_compensated(gas_in, max(-hot_kg_m2, 0.0) + max(-back_kg_m2, 0.0));
    gas_out = add_compensated(gas_out, max(hot_kg_m2, 0.0) + max(back_kg_m2, 0.0));
}

fn pore_state(p: u32, i: u32, stage: u32) -> PoreState {
    let ply = plan.plies[p];
    let temperature_k = temperatures[i].high + stage_increment(i, stage);
    let gas = gas_columns(p, ply_row(p, temperature_k));
    let molar_kg_k_j = interpolate(gas, 2u);
    let viscosity_pa_s = interpolate(gas, 3u);
    var phases = current_phases(p, i);
    let thickness_ratio = thickness_ratio_of(p, mass_ratio(p, phases));
    var porosity = real(0.0);
    var permeability = real(0.0);
    var slip = real(0.0);
    var inertia = real(0.0);
    for (var state = 0u; state < ply.states; state++) {
        let row = plan.state_properties[ply.first_state + state];
        porosity = porosity + phases[state] * row.porosity;
        permeability = permeability + phases[state] * row.permeability_m2;
        slip = slip + phases[state] * row.slip_pa_k;
        inertia = inertia + phases[state] * row.forchheimer_1_m;
    }
    let mobility = ply_scales[p].permeability * permeability / (viscosity_pa_s * thickness_ratio);
    let density_s2_m2 = molar_kg_k_j / temperature_k;
    let volume_m = ply_scales[p].thickness * cell_width_m(i) * thickness_ratio;
    return PoreState(
        max(volume_m * porosity * density_s2_m2, real(STORAGE_MIN)),
        mobility * density_s2_m2,
        slip * temperature_k,
        4.0 * inertia * mobility * mobility * density_s2_m2,
    );
}

fn update_pores(step: u32) {
    for (var p = first_ply(); p < end_ply(); p++) {
        for (var i = first_cell_of(p); i < end_cell_of(p); i++) {
            var held = pores[i].storage;
            if step == 0u {
                held = initial_gas_storage(p, i);
            }
            mass_fluxes[i] = mean_mass_fluxes[i];
            pores[i] = pore_state(p, i, 0u);
            pores[i].storage = held;
        }
    }
    hot_outflow[0] = mean_hot_outflow;
    apply_face_pressures(step);
}

fn apply_face_pressures(step: u32) {
    for (var face = 0u; face < run.faces; face++) {
        let cell = face * run.last_cell;
        if has_cell(cell) && (face == 0u || BACK_IS_OPEN) {
            let outside = DoubleWord(forcing(face, step, 0u).pressure_pa, 0.0);
            let taken = pores[cell].storage * difference(pressures[cell], outside);
            add_gas_exchange(taken, 0.0);
            pressures[cell] = outside;
        }
    }
}

fn gas_flux_below(i: u32, at_end: bool) -> GasFlux {
    var upper = pores_at_end[i];
    var under = pores_at_end[i + 1u];
    if !at_end {
        upper = midpoint_pores(pores[i], upper);
        under = midpoint_pores(pores[i + 1u], under);
    }
    let lengths_m = lengths_to_next_m(i);
    return gas_flux(upper, lengths_m[0], stage_pressure(i), under, lengths_m[1], stage_pressure(i + 1u));
}

fn stage_pressure(cell: u32) -> DoubleWord {
    return add_unnormalized(pressures[cell], first_pressure_increments[cell]);
}

// On columns of its own, as WGSL does not pass workgroup memory by reference.
fn factorise() {
    var reciprocal = real(1.0);
    var upper_before = real(0.0);
    for (var i = first_cell(); i < end_cell(); i++) {
        let row = eliminate_row(pressure_lower[i], pressure_diagonal[i], reciprocal, upper_before);
        reciprocal = row.reciprocal;
        upper_before = pressure_upper[i];
        pressure_lower[i] = row.lower_ratio;
        pressure_diagonal[i] = reciprocal;
        pressure_upper[i] = upper_before * reciprocal;
    }
}

fn substitute() {
    var before = real(0.0);
    for (var i = first_cell(); i < end_cell(); i++) {
        before = forward_eliminate(pressure_unknowns[i], pressure_lower[i], before);
        pressure_unknowns[i] = before;
    }
    before = pressure_below_block();
    for (var end = end_cell(); end > first_cell(); end--) {
        let i = end - 1u;
        before = back_substitute(pressure_unknowns[i], pressure_diagonal[i], pressure_upper[i], before);
        pressure_unknowns[i] = before;
    }
}

fn update_gas_supply(step: u32) {
    let inverse_step_1_s = 1.0 / step_length_s(step);
    let length_s = step_length_s(step);
    let before_s = step_length_s(max(step, 1u) - 1u);
    let share = (real(PRESSURE_GAMMA) - 0.5) * 2.0 * length_s / (length_s + before_s);
    for (var p = first_ply(); p < end_ply(); p++) {
        for (var i = first_cell_of(p); i < end_cell_of(p); i++) {
            pores_at_end[i] = pore_state(p, i, 1u);
            let expansion = (pores_at_end[i].storage - pores[i].storage) * inverse_step_1_s;
            let next = mean_gas_source[i] - pressures[i].high * expansion;
            source_corrections[i] = share * (next - supply[i]);
            supply[i] = next;
        }
    }
}

fn advance_pressures(step: u32) {
    let gamma = real(PRESSURE_GAMMA);
    let inverse_step_1_s = 1.0 / step_length_s(step);
    let open = array<real, 2>(1.0, select(real(0.0), real(1.0), BACK_IS_OPEN));
    for (var i = first_cell(); i < end_cell(); i++) {
        first_pressure_increments[i] = 0.0;
    }
    update_gas_supply(step);
    synchronize();
    var slope_above = real(0.0);
    var slope_below = real(0.0);
    var above = real(0.0);
    var correction_above = real(0.0);
    let correction_factor = 2.0 * gamma - 1.0;
    for (var i = first_halo_cell(); i < end_cell(); i++) {
        var under: GasFlux;
        var ending = real(0.0);
        if i < run.last_cell {
            under = gas_flux_below(i, false);
            ending = gas_flux_below(i, true).flux;
        } else {
            under = GasFlux(0.0, 0.0, 0.0);
        }
        let correction = correction_factor * (ending - under.flux);
        if has_cell(i) {
            source_corrections[i] = source_corrections[i] + opaque(correction - correction_above);
            slopes_above[i] = under.above;
            slopes_below[i] = under.below;
            first_stage_fluxes[i] = under.flux;
            pressure_unknowns[i] = under.flux - above + opaque(supply[i] + source_corrections[i]);
            pressure_diagonal[i] = pores_at_end[i].storage * inverse_step_1_s + gamma * (under.above + slope_below);
            pressure_lower[i] = -(gamma * slope_above);
            pressure_upper[i] = -(gamma * under.below);
        }
        correction_above = correction;
        slope_above = under.above;
        slope_below = under.below;
        above = under.flux;
    }
    let rises = ambient_pressure_rises(step);
    for (var face = 0u; face < run.faces; face++) {
        let cell = face * run.last_cell;
        let is_open = select(open[1], open[0], face == 0u);
        let rise = select(rises[1], rises[0], face == 0u);
        let free = 1.0 - is_open;
        if has_cell(cell) {
            pressure_diagonal[cell] = is_open + free * pressure_diagonal[cell];
            pressure_lower[cell] = free * pressure_lower[cell];
            pressure_upper[cell] = free * pressure_upper[cell];
            pressure_unknowns[cell] = is_open * rise + free * pressure_unknowns[cell];
        }
    }
    factorise();
    substitute();
    for (var i = first_cell(); i < end_cell(); i++) {
        first_pressure_increments[i] = pressure_unknowns[i];
    }
    synchronize();
    above = 0.0;
    for (var i = first_halo_cell(); i < end_cell(); i++) {
        var under = real(0.0);
        if i < run.last_cell {
            under = gas_flux_below(i, false).flux;
        }
        if has_cell(i) {
            let stored = pores_at_end[i].storage * inverse_step_1_s * first_pressure_increments[i];
            pressure_unknowns[i] = under - above + opaque(supply[i] - source_corrections[i]) - (stored + stored);
            first_stage_fluxes[i] = first_stage_fluxes[i] + under;
        }
        above = under;
    }
    for (var face = 0u; face < run.faces; face++) {
        let cell = face * run.last_cell;
        let is_open = select(open[1], open[0], face == 0u);
        let rise = select(rises[1], rises[0], face == 0u);
        let free = 1.0 - is_open;
        if has_cell(cell) {
            pressure_unknowns[cell] = free * pressure_unknowns[cell] - is_open * rise;
        }
    }
    substitute();
    synchronize();
    update_mean_fluxes(step);
}

fn ambient_pressure_rises(step: u32) -> array<real, 2> {
    let hot = forcing(0u, step, 1u).pressure_pa - forcing(0u, step, 0u).pressure_pa;
    let back = forcing(1u, step, 1u).pressure_pa - forcing(1u, step, 0u).pressure_pa;
    return array<real, 2>(hot, back);
}

fn pressure_increment(cell: u32) -> real {
    return 1.5 * first_pressure_increments[cell] + 0.5 * pressure_unknowns[cell];
}

fn net_gas_release(cell: u32, inverse_step_1_s: real) -> real {
    let storage = pores_at_end[cell].storage;
    let held = storage * pressure_increment(cell) + (storage - pores[cell].storage) * pressures[cell].high;
    return mean_gas_source[cell] - held * inverse_step_1_s;
}

fn mean_darcy_flux(cell: u32) -> real {
    let here = first_pressure_increments[cell] + pressure_unknowns[cell];
    let next = first_pressure_increments[cell + 1u] + pressure_unknowns[cell + 1u];
    let implicit = real(PRESSURE_GAMMA) * (slopes_below[cell] * next - slopes_above[cell] * here);
    return 0.5 * (first_stage_fluxes[cell] + implicit);
}

fn pass_mask(cell: u32) -> real {
    if cell == run.last_cell {
        return 1.0;
    }
    if cell + 1u == run.last_cell && BACK_IS_OPEN {
        return 0.0;
    }
    return ge_mask(slopes_above[cell] + slopes_below[cell], real(CONDUCTANCE_MIN));
}

fn mean_flux_below(cell: u32, behind: real, inverse_step_1_s: real) -> real {
    if cell == run.last_cell {
        return behind;
    }
    if cell + 1u == run.last_cell && BACK_IS_OPEN {
        return mean_darcy_flux(cell);
    }
    return pass_mask(cell) * (behind + net_gas_release(cell + 1u, inverse_step_1_s));
}

fn update_mean_fluxes(step: u32) {
    let inverse_step_1_s = 1.0 / step_length_s(step);
    var mean = mean_flux_into_block(inverse_step_1_s);
    for (var end = end_cell(); end > first_cell(); end--) {
        let i = end - 1u;
        mean = mean_flux_below(i, mean, inverse_step_1_s);
        mass_fluxes[i] = 2.0 * mean - mean_mass_fluxes[i];
        mean_mass_fluxes[i] = mean;
    }
    synchronize();
    var left = array<real, 2>(mean_mass_fluxes[0] + net_gas_release(0u, inverse_step_1_s), 0.0);
    if BACK_IS_OPEN {
        let last = run.last_cell;
        left[1] = net_gas_release(last, inverse_step_1_s) - mean_mass_fluxes[last - 1u];
    }
    hot_outflow = array<real, 2>(mean_hot_outflow, 2.0 * left[0] - mean_hot_outflow);
    mean_hot_outflow = left[0];
    back_outflow = left[1];
    account_outflow(step, left[0], left[1]);
    synchronize();
    for (var i = first_cell(); i < end_cell(); i++) {
        let rise = pressure_increment(i);
        pressures[i] = add_compensated(pressures[i], rise);
        pores[i] = pores_at_end[i];
        pressure_rates[i] = rise * inverse_step_1_s;
    }
}
