// Heat advected by pyrolysis gas: twin of src/physics/gas_advection.rs.

var<private> gas_heat: DoubleWord;
var<private> reaction_gain: DoubleWord;
var<private> first_stage_gas_heat: real;
var<COLUMNS> gas_enthalpy_j_kg: GasColumn;
var<COLUMNS> gas_heat_capacities: GasColumn;

fn advected_heat_gain(mass_flux: real, here_j_kg: real, below_j_kg: real) -> real {
    return 0.5 * mass_flux * (below_j_kg - here_j_kg);
}

fn advected_heat_slopes(mass_flux: real, rise: real, next_rise: real) -> array<real, 2> {
    let half = 0.5 * mass_flux;
    return array<real, 2>(half * rise, half * next_rise);
}

fn gas_enthalpy(cell: u32, here: TableSegment) {
    gas_enthalpy_j_kg[cell] = interpolate(here, 0u);
    gas_heat_capacities[cell] = interpolate(here, 1u);
}

fn reads_gas_tables(stage: u32) -> bool {
    return GAS && (stage == 0u || DARCY);
}

fn stage_gas_enthalpy(cell: u32, stage: u32) -> real {
    let start = gas_enthalpy_j_kg[cell];
    if stage == 0u || reads_gas_tables(stage) {
        return start;
    }
    return start + gas_heat_capacities[cell] * first_increments[cell];
}

fn gas_capacity(cell: u32) -> real {
    return pores[cell].storage * pressures[cell].high * gas_heat_capacities[cell];
}

fn gas_flow_work(p: u32, cell: u32, stage: u32) -> real {
    let temperature_k = temperatures[cell].high + stage_increment(cell, stage);
    return temperature_k / interpolate(gas_columns(p, ply_row(p, temperature_k)), 2u);
}

fn gas_heat_gain(p: u32, cell: u32) -> real {
    if !DARCY {
        return 0.0;
    }
    let now_kg_m2 = pores[cell].storage * pressures[cell].high;
    let now_j_kg = gas_enthalpy_j_kg[cell] - gas_flow_work(p, cell, 0u);
    let then_kg_m2 = initial_gas_storage(p, cell) * forcing(0u, 0u, 0u).pressure_pa;
    let start_k = cells[cell].start_k;
    let then = gas_columns(p, ply_row(p, start_k));
    let then_j_kg = interpolate(then, 0u) - start_k / interpolate(then, 2u);
    lost_and_stored[1] = lost_and_stored[1] + opaque(now_kg_m2 - then_kg_m2);
    return now_kg_m2 * now_j_kg - then_kg_m2 * then_j_kg;
}

fn initial_gas_storage(p: u32, cell: u32) -> real {
    let start_k = cells[cell].start_k;
    let molar = interpolate(gas_columns(p, ply_row(p, start_k)), 2u);
    let virgin = plan.state_properties[plan.plies[p].first_state];
    let volume_m = ply_scales[p].thickness * cell_width_m(cell);
    return max(volume_m * virgin.porosity * (molar / start_k), real(STORAGE_MIN));
}

fn pressure_work(p: u32, cell: u32, stage: u32) -> real {
    return pores[cell].storage * gas_flow_work(p, cell, stage) * pressure_rates[cell];
}

fn gas_heat_outflow(step: u32, stage: u32) -> array<real, 2> {
    var drawn = array<real, 2>(-released_heat_ends[0], -released_heat_ends[1]);
    var out = real(0.0);
    if UNHINDERED {
        for (var i = first_cell(); i < end_cell(); i++) {
            let leaves = gas_source_at(i, stage) * stage_gas_enthalpy(i, stage);
            out = out + leaves;
            if i == 0u {
                drawn[0] = drawn[0] + leaves;
            }
            if i == run.last_cell {
                drawn[1] = drawn[1] + leaves;
            }
        }
    } else {
        if has_cell(0u) {
            out = hot_outflow[stage] * stage_gas_enthalpy(0u, stage);
            drawn[0] = drawn[0] + (out - advected_heat(0u, stage));
        }
        if has_cell(run.last_cell) {
            let last = run.last_cell;
            let back = back_outflow * stage_gas_enthalpy(last, stage);
            drawn[1] = drawn[1] + (advected_heat(last - 1u, stage) + back);
            out = out + back;
        }
    }
    account_gas_heat(step, stage, out);
    return array<real, 2>(plan.faces[0].held * drawn[0], plan.faces[1].held * drawn[1]);
}

fn advected_heat(cell: u32, stage: u32) -> real {
    return 0.5 * mass_fluxes[cell] * (stage_gas_enthalpy(cell + 1u, stage) + stage_gas_enthalpy(cell, stage));
}

fn account_gas_heat(step: u32, stage: u32, out: real) {
    if stage == 0u {
        first_stage_gas_heat = out;
        return;
    }
    let half_step_s = 0.5 * step_length_s(step);
    gas_heat = add_compensated(gas_heat, half_step_s * (first_stage_gas_heat + out));
    reaction_gain = add_compensated(reaction_gain, half_step_s * released_heat);
}

fn outflow_heat_slope(face: u32, cell: u32) -> real {
    if UNHINDERED {
        return 0.0;
    }
    let out = select(back_outflow, hot_outflow[0], face == 0u);
    // A constant would be folded into the product, which rounds differently.
    return max(out, 0.0) * gas_heat_capacities[cell] * opaque(real(GAMMA));
}
