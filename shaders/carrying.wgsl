// The heat of a member's reactions and of its gas: twin of src/physics/carrying.rs.

var<private> gas_heat: Pair;
var<private> reaction_gain: Pair;
var<private> stage_heat: array<real, 2>;

fn gas_enthalpy_in(cell: u32) -> real {
    return gas_enthalpy_at(spot(temperatures[cell].high + first[cell]));
}

fn carried_slopes(cell: u32) -> array<real, 2> {
    let half = 0.5 * flows[cell];
    let here = look_up(spot(temperatures[cell].high + first[cell]), GAS_COLUMNS, GAS_TABLE + 1u);
    let next = look_up(spot(temperatures[cell + 1u].high + first[cell + 1u]), GAS_COLUMNS, GAS_TABLE + 1u);
    return array<real, 2>(-(half * here), half * next);
}

fn gas_capacity(cell: u32) -> real {
    let at = spot(temperatures[cell].high + first[cell]);
    let rise_j_kg_k = look_up(at, GAS_COLUMNS, GAS_TABLE + 1u);
    return pores[cell].storage * pressures[cell].high * rise_j_kg_k;
}

fn gas_work(cell: u32) -> real {
    let temperature_k = temperatures[cell].high + first[cell];
    return temperature_k / look_up(spot(temperature_k), GAS_COLUMNS, GAS_TABLE + 2u);
}

fn gas_gained(p: u32, cell: u32) -> real {
    if !DARCY {
        return 0.0;
    }
    let now_kg_m2 = pores[cell].storage * pressures[cell].high;
    let now_j_kg = gas_enthalpy_in(cell) - gas_work(cell);
    let then_kg_m2 = first_storage(p, cell) * drives[0].pressure_pa;
    let start_k = cells[cell].start_k;
    let work_j_kg = start_k / look_up(spot(start_k), GAS_COLUMNS, GAS_TABLE + 2u);
    let then_j_kg = gas_enthalpy_at(spot(start_k)) - work_j_kg;
    lost_and_stored[1] = lost_and_stored[1] + keep(now_kg_m2 - then_kg_m2);
    return now_kg_m2 * now_j_kg - then_kg_m2 * then_j_kg;
}

fn first_storage(p: u32, cell: u32) -> real {
    let start_k = cells[cell].start_k;
    let molar = look_up(spot(start_k), GAS_COLUMNS, GAS_TABLE + 2u);
    let virgin = substances[plies[p].first_state];
    let volume_m = cells[cell].width_m * ply_scales[p].thickness;
    return volume_m * virgin.porosity * (molar / start_k);
}

fn warm(step: u32, stage: u32, ends: Ends) -> Ends {
    var out = real(0.0);
    var given = real(0.0);
    var drawn: array<real, 2>;
    for (var p = 0u; p < run.plies; p++) {
        let ply = plies[p];
        for (var i = ply.first_cell; i < ply.end_cell; i++) {
            if ply.end_reaction > ply.first_reaction {
                let heat_of = reaction_heat(p, i);
                if stage == 0u {
                    restraints[i] = max(heat_of[2], 0.0);
                }
                let beyond = heat_of[1];
                second[i] = second[i] - heat_of[0];
                given = given + beyond;
                if i == 0u {
                    drawn[0] = drawn[0] - beyond;
                }
                if i == LAST_CELL {
                    drawn[1] = drawn[1] - beyond;
                }
                if UNHINDERED {
                    let leaves = made_in(p, i) * gas_enthalpy_in(i);
                    out = out + leaves;
                    if i == 0u {
                        drawn[0] = drawn[0] + leaves;
                    }
                    if i == LAST_CELL {
                        drawn[1] = drawn[1] + leaves;
                    }
                }
            }
            if DARCY {
                let swept = pores[i].storage * gas_work(i) * pressure_rates[i];
                second[i] = second[i] + swept;
            }
        }
    }
    if !UNHINDERED {
        var above = gas_enthalpy_in(0u);
        out = leaving[stage] * above;
        drawn[0] = drawn[0] + out;
        for (var i = 0u; i < LAST_CELL; i++) {
            let below = gas_enthalpy_in(i + 1u);
            let gained = 0.5 * flows[i] * (below - above);
            second[i] = second[i] + gained;
            second[i + 1u] = second[i + 1u] + gained;
            let carried = 0.5 * flows[i] * (below + above);
            if i == 0u {
                drawn[0] = drawn[0] - carried;
            }
            if i + 1u == LAST_CELL {
                drawn[1] = drawn[1] + carried;
            }
            above = below;
        }
        let back = back_leaving * above;
        out = out + back;
        drawn[1] = drawn[1] + back;
    }
    tally(step, stage, out, given);
    return Ends(
        FaceFlux(ends.hot.flux + faces[0].held * drawn[0], ends.hot.slope),
        FaceFlux(ends.back.flux + faces[1].held * drawn[1], ends.back.slope),
    );
}

fn tally(step: u32, stage: u32, out: real, given: real) {
    if stage == 0u {
        stage_heat = array<real, 2>(out, given);
        return;
    }
    let half_length = 0.5 * lengths[step];
    gas_heat = advanced(gas_heat, half_length * (stage_heat[0] + out));
    reaction_gain = advanced(reaction_gain, half_length * (stage_heat[1] + given));
}
