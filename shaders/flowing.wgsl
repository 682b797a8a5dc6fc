// A member's gas: twin of src/physics/flowing.rs, where the scheme is written out.

// A column where gas flows through pores; of one cell where not.
alias PoreColumn = array<real, PORE_CELLS>;

var<COLUMNS> flows: GasColumn;
var<private> leaving: array<real, 2>;
var<private> back_leaving: real;
// Out of the hot face at the stage at hand; means of the last two steps.
var<private> outflow: real;
var<private> recent: array<real, 2>;
var<private> gas_in: Pair;
var<private> gas_out: Pair;
// Solid lost and gas stored since the start.
var<private> lost_and_stored: array<real, 2>;
var<COLUMNS> pressures: array<Pair, PORE_CELLS>;
var<COLUMNS> pressure_rates: PoreColumn;
var<COLUMNS> pores: array<Porous, PORE_CELLS>;
var<COLUMNS> later: array<Porous, PORE_CELLS>;
var<COLUMNS> mean_flows: PoreColumn;
var<private> mean_leaving: real;
var<COLUMNS> supply: PoreColumn;
var<COLUMNS> surges: PoreColumn;
var<COLUMNS> first_flows: PoreColumn;
var<COLUMNS> slopes_above: PoreColumn;
var<COLUMNS> slopes_below: PoreColumn;
var<COLUMNS> pressed_first: PoreColumn;
var<COLUMNS> pressed_second: PoreColumn;
var<COLUMNS> pressure_lower: PoreColumn;
var<COLUMNS> pressure_diagonal: PoreColumn;
var<COLUMNS> pressure_upper: PoreColumn;

fn flow(step: u32, stage: u32) {
    if DARCY {
        if stage == 0u {
            settle(step);
        } else {
            percolate(step);
        }
        return;
    }
    let carries = select(real(0.0), real(1.0), QUASI_STEADY);
    var risen = made_behind(stage);
    for (var up = 0u; up < end_cell() - first_cell(); up++) {
        let i = end_cell() - 1u - up;
        let here = made_at(i, stage);
        flows[i] = carries * risen;
        risen = risen + here;
    }
    leaving[stage] = at_hot_face(risen);
    if stage == 1u {
        let mean = 0.5 * (leaving[0] + leaving[1]);
        let_out(step, mean, 0.0);
    }
}

fn let_out(step: u32, hot_kg_m2_s: real, back_kg_m2_s: real) {
    let length_s = lengths[step];
    if lane == 0u {
        pass_out(hot_kg_m2_s * length_s, back_kg_m2_s * length_s);
    }
    recent = array<real, 2>(recent[1], hot_kg_m2_s);
}

fn pass_out(hot_kg_m2: real, back_kg_m2: real) {
    gas_in = advanced(gas_in, max(-hot_kg_m2, 0.0) + max(-back_kg_m2, 0.0));
    gas_out = advanced(gas_out, max(hot_kg_m2, 0.0) + max(back_kg_m2, 0.0));
}

fn porous(p: u32, i: u32, stage: u32) -> Porous {
    let ply = plan.plies[p];
    let temperature_k = temperatures[i].high + moved(i, stage);
    let at = spot(temperature_k);
    let gas = gas_of(p, row_of(p, at));
    let molar_kg_k_j = value(gas, 2u);
    let viscosity_pa_s = value(gas, 3u);
    var phases = phases_of(p, i);
    let stretch = stretch_of(p, mass_left(p, phases));
    var porosity = real(0.0);
    var permeability = real(0.0);
    var slip = real(0.0);
    var inertia = real(0.0);
    for (var state = 0u; state < ply.states; state++) {
        let row = plan.substances[ply.first_state + state];
        porosity = porosity + phases[state] * row.porosity;
        permeability = permeability + phases[state] * row.permeability_m2;
        slip = slip + phases[state] * row.slip_pa_k;
        inertia = inertia + phases[state] * row.inertia_1_m;
    }
    let ease = ply_scales[p].permeability * permeability / (viscosity_pa_s * stretch);
    let density_s2_m2 = molar_kg_k_j / temperature_k;
    let volume_m = cells[i].width_m * ply_scales[p].thickness * stretch;
    return Porous(
        max(volume_m * porosity * density_s2_m2, real(1e-18)),
        ease * density_s2_m2,
        slip * temperature_k,
        4.0 * inertia * ease * ease * density_s2_m2,
    );
}

fn settle(step: u32) {
    for (var p = first_ply(); p < end_ply(); p++) {
        for (var i = first_of(p); i < end_of(p); i++) {
            let held = pores[i].storage;
            flows[i] = mean_flows[i];
            pores[i] = porous(p, i, 0u);
            if step > 0u {
                pores[i].storage = held;
            }
        }
    }
    leaving[0] = mean_leaving;
    face_pressures(step);
}

fn face_pressures(step: u32) {
    for (var face = 0u; face < run.faces; face++) {
        let cell = face * run.last_cell;
        if has(cell) && (face == 0u || BACK_IS_OPEN) {
            let outside = Pair(drives[4u * step + 2u * face].pressure_pa, 0.0);
            let taken = pores[cell].storage * difference(pressures[cell], outside);
            pass_out(taken, 0.0);
            pressures[cell] = outside;
        }
    }
}

fn gas_under(i: u32, at_end: bool) -> GasFlux {
    var upper = later[i];
    var under = later[i + 1u];
    if !at_end {
        upper = midway(pores[i], upper);
        under = midway(pores[i + 1u], under);
    }
    return gas_flux(upper, cells[i].below_m, pressed(i), under, cells[i + 1u].above_m, pressed(i + 1u));
}

fn pressed(cell: u32) -> Pair {
    return raised(pressures[cell], pressed_first[cell]);
}

// On columns of its own, as WGSL passes none by reference where a workgroup shares them.
fn factorise() {
    var reciprocal = real(1.0);
    var upper_before = real(0.0);
    for (var i = first_cell(); i < end_cell(); i++) {
        let row = eliminated(pressure_lower[i], pressure_diagonal[i], reciprocal, upper_before);
        reciprocal = row.reciprocal;
        upper_before = pressure_upper[i];
        pressure_lower[i] = row.under;
        pressure_diagonal[i] = reciprocal;
        pressure_upper[i] = upper_before * reciprocal;
    }
}

fn substitute() {
    var before = real(0.0);
    for (var i = first_cell(); i < end_cell(); i++) {
        before = descended(pressed_second[i], pressure_lower[i], before);
        pressed_second[i] = before;
    }
    before = pressed_under_block();
    for (var up = 0u; up < end_cell() - first_cell(); up++) {
        let i = end_cell() - 1u - up;
        before = ascended(pressed_second[i], pressure_diagonal[i], pressure_upper[i], before);
        pressed_second[i] = before;
    }
}

fn percolate(step: u32) {
    let gamma = real(PRESSURE_GAMMA);
    let per_length = 1.0 / lengths[step];
    let open = array<real, 2>(1.0, select(real(0.0), real(1.0), BACK_IS_OPEN));
    for (var i = first_cell(); i < end_cell(); i++) {
        pressed_first[i] = 0.0;
    }
    let length_s = lengths[step];
    let before_s = lengths[max(step, 1u) - 1u];
    let share = (gamma - 0.5) * 2.0 * length_s / (length_s + before_s);
    for (var p = first_ply(); p < end_ply(); p++) {
        for (var i = first_of(p); i < end_of(p); i++) {
            later[i] = porous(p, i, 1u);
            let expansion = (later[i].storage - pores[i].storage) * per_length;
            let next = made_mean[i] - pressures[i].high * expansion;
            surges[i] = share * (next - supply[i]);
            supply[i] = next;
        }
    }
    meet();
    var arriving = real(0.0);
    var returned = real(0.0);
    var above = real(0.0);
    var surged = real(0.0);
    let surging = 2.0 * gamma - 1.0;
    for (var i = first_link(); i < end_cell(); i++) {
        var under: GasFlux;
        var ending = real(0.0);
        if i < run.last_cell {
            under = gas_under(i, false);
            ending = gas_under(i, true).flux;
        } else {
            under = GasFlux(0.0, 0.0, 0.0);
        }
        let surge = surging * (ending - under.flux);
        if has(i) {
            surges[i] = surges[i] + keep(surge - surged);
            slopes_above[i] = under.above;
            slopes_below[i] = under.below;
            first_flows[i] = under.flux;
            pressed_second[i] = under.flux - above + keep(supply[i] + surges[i]);
            pressure_diagonal[i] = later[i].storage * per_length + gamma * (under.above + returned);
            pressure_lower[i] = -(gamma * arriving);
            pressure_upper[i] = -(gamma * under.below);
        }
        surged = surge;
        arriving = under.above;
        returned = under.below;
        above = under.flux;
    }
    let rises = pressure_rises(step);
    for (var face = 0u; face < run.faces; face++) {
        let cell = face * run.last_cell;
        let is_open = select(open[1], open[0], face == 0u);
        let rise = select(rises[1], rises[0], face == 0u);
        let free = 1.0 - is_open;
        if has(cell) {
            pressure_diagonal[cell] = is_open + free * pressure_diagonal[cell];
            pressure_lower[cell] = free * pressure_lower[cell];
            pressure_upper[cell] = free * pressure_upper[cell];
            pressed_second[cell] = is_open * rise + free * pressed_second[cell];
        }
    }
    factorise();
    substitute();
    for (var i = first_cell(); i < end_cell(); i++) {
        pressed_first[i] = pressed_second[i];
    }
    meet();
    above = 0.0;
    for (var i = first_link(); i < end_cell(); i++) {
        var under = real(0.0);
        if i < run.last_cell {
            under = gas_under(i, false).flux;
        }
        if has(i) {
            let carried = later[i].storage * per_length * pressed_first[i];
            pressed_second[i] = under - above + keep(supply[i] - surges[i]) - (carried + carried);
            first_flows[i] = first_flows[i] + under;
        }
        above = under;
    }
    for (var face = 0u; face < run.faces; face++) {
        let cell = face * run.last_cell;
        let is_open = select(open[1], open[0], face == 0u);
        let rise = select(rises[1], rises[0], face == 0u);
        let free = 1.0 - is_open;
        if has(cell) {
            pressed_second[cell] = free * pressed_second[cell] - is_open * rise;
        }
    }
    substitute();
    meet();
    take_in(step);
}

fn pressure_rises(step: u32) -> array<real, 2> {
    let hot = drives[4u * step + 1u].pressure_pa - drives[4u * step].pressure_pa;
    let back = drives[4u * step + 3u].pressure_pa - drives[4u * step + 2u].pressure_pa;
    return array<real, 2>(hot, back);
}

fn pressure_rise(cell: u32) -> real {
    return 1.5 * pressed_first[cell] + 0.5 * pressed_second[cell];
}

fn given_off(cell: u32, per_length: real) -> real {
    let storage = later[cell].storage;
    let held = storage * pressure_rise(cell) + (storage - pores[cell].storage) * pressures[cell].high;
    return made_mean[cell] - held * per_length;
}

fn driven_through(cell: u32) -> real {
    let here = pressed_first[cell] + pressed_second[cell];
    let next = pressed_first[cell + 1u] + pressed_second[cell + 1u];
    let implicit = real(PRESSURE_GAMMA) * (slopes_below[cell] * next - slopes_above[cell] * here);
    return 0.5 * (first_flows[cell] + implicit);
}

fn passing(cell: u32) -> real {
    if cell == run.last_cell {
        return 1.0;
    }
    if cell + 1u == run.last_cell && BACK_IS_OPEN {
        return 0.0;
    }
    return reached(slopes_above[cell] + slopes_below[cell], real(LEAST_PASSING));
}

fn driven_into(cell: u32, behind: real, per_length: real) -> real {
    if cell == run.last_cell {
        return behind;
    }
    if cell + 1u == run.last_cell && BACK_IS_OPEN {
        return driven_through(cell);
    }
    return passing(cell) * (behind + given_off(cell + 1u, per_length));
}

fn take_in(step: u32) {
    let per_length = 1.0 / lengths[step];
    var mean = driven_behind(per_length);
    for (var up = 0u; up < end_cell() - first_cell(); up++) {
        let i = end_cell() - 1u - up;
        mean = driven_into(i, mean, per_length);
        flows[i] = 2.0 * mean - mean_flows[i];
        mean_flows[i] = mean;
    }
    meet();
    var left = array<real, 2>(mean_flows[0] + given_off(0u, per_length), 0.0);
    if BACK_IS_OPEN {
        let last = run.last_cell;
        left[1] = given_off(last, per_length) - mean_flows[last - 1u];
    }
    leaving = array<real, 2>(mean_leaving, 2.0 * left[0] - mean_leaving);
    mean_leaving = left[0];
    back_leaving = left[1];
    let_out(step, left[0], left[1]);
    meet();
    for (var i = first_cell(); i < end_cell(); i++) {
        let rise = pressure_rise(i);
        pressures[i] = advanced(pressures[i], rise);
        pores[i] = later[i];
        pressure_rates[i] = rise * per_length;
    }
}
