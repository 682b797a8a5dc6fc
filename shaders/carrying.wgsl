// The heat of a member's reactions and of its gas: twin of src/physics/carrying.rs.

var<private> gas_heat: Pair;
var<private> reaction_gain: Pair;
var<private> stage_heat: real;
var<COLUMNS> gas_j_kg: GasColumn;
var<COLUMNS> gas_rises: GasColumn;

fn carried_gain(flow: real, here_j_kg: real, below_j_kg: real) -> real {
    return 0.5 * flow * (below_j_kg - here_j_kg);
}

fn carried_slopes(flow: real, rise: real, next_rise: real) -> array<real, 2> {
    let half = 0.5 * flow;
    return array<real, 2>(half * rise, half * next_rise);
}

fn gas_enthalpy(cell: u32, here: Segment) {
    gas_j_kg[cell] = value(here, 0u);
    gas_rises[cell] = value(here, 1u);
}

fn reads_gas(stage: u32) -> bool {
    return GAS && (stage == 0u || DARCY);
}

fn gas_onward() {
    for (var i = first_cell(); i < end_cell(); i++) {
        gas_j_kg[i] = gas_j_kg[i] + gas_rises[i] * first[i];
    }
}

fn gas_capacity(cell: u32) -> real {
    return pores[cell].storage * pressures[cell].high * gas_rises[cell];
}

fn gas_work(p: u32, cell: u32, stage: u32) -> real {
    let temperature_k = temperatures[cell].high + moved(cell, stage);
    return temperature_k / value(gas_of(p, row_of(p, spot(temperature_k))), 2u);
}

fn gas_gained(p: u32, cell: u32) -> real {
    if !DARCY {
        return 0.0;
    }
    let now_kg_m2 = pores[cell].storage * pressures[cell].high;
    let now_j_kg = gas_j_kg[cell] - gas_work(p, cell, 0u);
    let then_kg_m2 = first_storage(p, cell) * drives[0].pressure_pa;
    let start_k = cells[cell].start_k;
    let then = gas_of(p, row_of(p, spot(start_k)));
    let then_j_kg = value(then, 0u) - start_k / value(then, 2u);
    lost_and_stored[1] = lost_and_stored[1] + keep(now_kg_m2 - then_kg_m2);
    return now_kg_m2 * now_j_kg - then_kg_m2 * then_j_kg;
}

fn first_storage(p: u32, cell: u32) -> real {
    let start_k = cells[cell].start_k;
    let molar = value(gas_of(p, row_of(p, spot(start_k))), 2u);
    let virgin = plan.substances[plan.plies[p].first_state];
    let volume_m = cells[cell].width_m * ply_scales[p].thickness;
    return volume_m * virgin.porosity * (molar / start_k);
}

fn swept(p: u32, cell: u32, stage: u32) -> real {
    return pores[cell].storage * gas_work(p, cell, stage) * pressure_rates[cell];
}

fn warm(step: u32, stage: u32) -> array<real, 2> {
    var drawn = array<real, 2>(-given_ends[0], -given_ends[1]);
    var out = real(0.0);
    if UNHINDERED {
        for (var i = first_cell(); i < end_cell(); i++) {
            let leaves = made_at(i, stage) * gas_j_kg[i];
            out = out + leaves;
            if i == 0u {
                drawn[0] = drawn[0] + leaves;
            }
            if i == run.last_cell {
                drawn[1] = drawn[1] + leaves;
            }
        }
    } else {
        if has(0u) {
            out = leaving[stage] * gas_j_kg[0];
            drawn[0] = drawn[0] + (out - carried(0u));
        }
        if has(run.last_cell) {
            let last = run.last_cell;
            let back = back_leaving * gas_j_kg[last];
            drawn[1] = drawn[1] + (carried(last - 1u) + back);
            out = out + back;
        }
    }
    tally(step, stage, out);
    return array<real, 2>(plan.faces[0].held * drawn[0], plan.faces[1].held * drawn[1]);
}

fn carried(cell: u32) -> real {
    return 0.5 * flows[cell] * (gas_j_kg[cell + 1u] + gas_j_kg[cell]);
}

fn tally(step: u32, stage: u32, out: real) {
    if stage == 0u {
        stage_heat = out;
        return;
    }
    let half_length = 0.5 * lengths[step];
    gas_heat = advanced(gas_heat, half_length * (stage_heat + out));
    reaction_gain = advanced(reaction_gain, half_length * given);
}

fn let_out_heat(face: u32, cell: u32) -> real {
    if UNHINDERED {
        return 0.0;
    }
    let out = select(back_leaving, leaving[0], face == 0u);
    // A constant would be moved into the product, which rounds otherwise.
    return max(out, 0.0) * gas_rises[cell] * keep(real(GAMMA));
}
