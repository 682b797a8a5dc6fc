// A member's conduction: twin of src/physics/conducting.rs.

struct Node {
    temperature: Pair,
    moved: real,
    conductivity: real,
    slope: real,
    capacity: real,
    gas_j_kg: real,
    gas_rise: real,
}

struct Link {
    conducted: real,
    gained: real,
    slopes: array<real, 2>,
}

struct Surface {
    temperature_k: real,
    emissivity: real,
    enthalpy_j_kg: real,
    rise_j_kg_k: real,
}

// A column of what the passes over the cells otherwise look up on their way; of one cell where they do.
alias NodeColumn = array<real, NODE_CELLS>;

var<COLUMNS> conductivities: Column;
var<COLUMNS> slopes: NodeColumn;
var<COLUMNS> evaluated: NodeColumn;

fn less(gained: array<real, 2>, carried: array<real, 2>) -> array<real, 2> {
    return array<real, 2>(gained[0] - carried[0], gained[1] - carried[1]);
}

fn no_link() -> Link {
    return Link(0.0, 0.0, array<real, 2>(0.0, 0.0));
}

fn properties(step: u32, stage: u32) {
    if GAS && !reads_gas(stage) {
        gas_onward();
    }
    if LOOKED_UP {
        return;
    }
    for (var p = first_ply(); p < end_ply(); p++) {
        if plan.plies[p].rows > 1u || LEVELS > 1u {
            for (var i = first_of(p); i < end_of(p); i++) {
                blend(p, i, step, stage);
            }
        } else {
            for (var i = first_of(p); i < end_of(p); i++) {
                let here = plain(p, i, stage);
                conductivities[i] = here.conductivity;
                slopes[i] = here.slope;
                evaluated[i] = here.heat_capacity;
            }
        }
        if DARCY {
            for (var i = first_of(p); i < end_of(p); i++) {
                evaluated[i] = evaluated[i] + gas_capacity(i);
            }
        }
    }
}

fn blend(p: u32, i: u32, step: u32, stage: u32) {
    let at = spot(temperatures[i].high + moved(i, stage));
    let level_here = level_of(i, step, stage);
    let row = row_of(p, levelled(at, level_here)[0]);
    let here = mixture(p, at, row, level_here, phases_at(p, i, stage), stage == 0u);
    conductivities[i] = here.conductivity;
    slopes[i] = here.slope;
    evaluated[i] = cells[i].width_m * here.heat_capacity;
    if reads_gas(stage) {
        gas_enthalpy(i, gas_of(p, row));
    }
    if GAS && stage == 0u && plan.plies[p].end_reaction > plan.plies[p].first_reaction {
        rise_at(p, i, row);
    }
}

// Its heat capacity is that of the whole cell, J/m²/K.
fn plain(p: u32, i: u32, stage: u32) -> Solid {
    let ply = plan.plies[p];
    let row = row_of(p, spot(temperatures[i].high + moved(i, stage)));
    var scale = state_scales[ply.first_state].conductivity;
    var density_kg_m3 = ply_scales[p].density_kg_m3;
    if GAS && ply.states > 1u {
        let all = together(p, phases_at(p, i, stage), ply.states);
        scale = times(all.conductivity, 1.0 / left_of(p, all.remains), ply.parts);
        density_kg_m3 = ply_scales[p].mass_kg_m3 * all.stores;
        if stage == 0u {
            rise_at(p, i, row);
        }
    }
    if reads_gas(stage) {
        gas_enthalpy(i, gas_of(p, row));
    }
    let here = solid(row, ply.parts, scale, stage == 0u);
    return Solid(here.conductivity, here.slope, cells[i].width_m * (density_kg_m3 * here.heat_capacity));
}

// A cell as its links see it: looked up here where columns are a member's own, as to write one and to read it again is what a march costs a device.
fn node(p: u32, i: u32, stage: u32) -> Node {
    let by = moved(i, stage);
    let temperature = raised(temperatures[i], by);
    if LOOKED_UP {
        let here = plain(p, i, stage);
        if stage == 0u {
            conductivities[i] = here.conductivity;
        }
        return Node(temperature, by, here.conductivity, here.slope, here.heat_capacity, 0.0, 0.0);
    }
    var node = Node(temperature, by, conductivities[i], 0.0, evaluated[i], 0.0, 0.0);
    if stage == 0u {
        node.slope = slopes[i];
    }
    if GAS {
        node.gas_j_kg = gas_j_kg[i];
        node.gas_rise = gas_rises[i];
    }
    return node;
}

fn link_within(cell: u32, here: Node, next: Node, stage: u32) -> Link {
    let half_over_next_1_m = cells[cell].half_over_next_1_m;
    let conductance = conductance_within(here.conductivity, next.conductivity, half_over_next_1_m);
    let drop = difference(here.temperature, next.temperature);
    var gained = array<real, 2>(0.0, 0.0);
    if stage == 0u {
        let gain = half_over_next_1_m * drop;
        gained = array<real, 2>(here.slope * gain, next.slope * gain);
    }
    return link(cell, here, next, conductance, drop, gained, stage);
}

fn link_across(p: u32, here: Node, next: Node, stage: u32) -> Link {
    let cell = plan.plies[p].first_cell - 1u;
    let below_m = cells[cell].below_m;
    let above_m = cells[cell + 1u].above_m;
    let conductance =
        conductance_across(here.conductivity, below_m, next.conductivity, above_m, contact_scales[p - 1u]);
    let drop = difference(here.temperature, next.temperature);
    var gained = array<real, 2>(0.0, 0.0);
    if stage == 0u {
        let own = gain_across(conductance, here.conductivity, below_m) * here.slope;
        let below = gain_across(conductance, next.conductivity, above_m) * next.slope;
        gained = array<real, 2>(own * drop, below * drop);
    }
    return link(cell, here, next, conductance, drop, gained, stage);
}

fn link(
    cell: u32,
    here: Node,
    next: Node,
    conductance: real,
    drop: real,
    by_conductivities: array<real, 2>,
    stage: u32,
) -> Link {
    var link = Link(conductance * drop, 0.0, array<real, 2>(0.0, 0.0));
    if GAS {
        link.gained = carried_gain(flows[cell], here.gas_j_kg, next.gas_j_kg);
    }
    if stage == 0u {
        var gained = by_conductivities;
        if GAS {
            gained = less(gained, carried_slopes(flows[cell], here.gas_rise, next.gas_rise));
        }
        link.slopes = flux_slopes(conductance, gained);
    }
    return link;
}

fn surface(face: u32, cell: u32, stage: u32) -> Surface {
    let temperature_k = temperatures[cell].high + moved(cell, stage);
    let at = spot(temperature_k);
    let emissivity = face_emissivity(face, face * (PLIES - 1u), cell, at, stage);
    let air = segment(at, FACE_COLUMNS, FACE_TABLE);
    return Surface(temperature_k, emissivity, value(air, 0u), value(air, 1u));
}

fn through(face: u32, drive: Drive, surface: Surface) -> FaceFlux {
    let open = face_flux(
        drive,
        plan.faces[face],
        face_scales[face],
        surface.temperature_k,
        surface.emissivity,
        surface.enthalpy_j_kg,
        surface.rise_j_kg_k,
        outflow,
    );
    let free = 1.0 - plan.faces[face].held;
    return FaceFlux(free * open.flux, free * open.slope);
}

fn passed_through(face: u32, cell: u32, step: u32, stage: u32) -> real {
    var passed_on = passed[face];
    if HOLDER == 1u {
        let drive = drives[4u * step + 2u * face + stage];
        let sideways = conductance_sideways(face * (PLIES - 1u), cell);
        passed_on = passed_on - flux_sideways(sideways, drive.holder_k, staged(cell, stage));
    }
    return edges[face].flux + plan.faces[face].held * passed_on;
}
