// Assembly and forward elimination of the linear system: twin of src/physics/system.rs.

struct BoundaryRow {
    held: real,
    rise_k: real,
    flux: real,
    rhs_correction: real,
    slope: real,
}

struct MatrixRow {
    lower: real,
    diagonal: real,
    slope: real,
    upper: real,
    rhs: real,
}

// State carried by the forward elimination from cell to cell.
struct ForwardSweep {
    conducted: real,
    advected: real,
    from_holder: real,
    slopes: array<real, 2>,
    reciprocal: real,
    upper: real,
    rhs: real,
    share: real,
}

struct Position {
    ply: u32,
    cell: u32,
    face: u32,
}

// The face of a cell that lies at none.
const NO_FACE = 2u;

var<private> boundary_rows: array<BoundaryRow, 2>;
var<private> face_conduction: array<real, 2>;
var<private> face_conduction_slopes: array<array<real, 2>, 2>;

fn position(ply: u32, cell: u32) -> Position {
    return Position(ply, cell, select(NO_FACE, 0u, cell == 0u));
}

// A block begins with a reciprocal pivot of one, so that its first `lower` keeps the coupling to the unknown above the
// block.
fn forward_sweep() -> ForwardSweep {
    return ForwardSweep(0.0, 0.0, 0.0, array<real, 2>(0.0, 0.0), 1.0, 0.0, 0.0, 1.0);
}

fn apply_boundary(boundary_row: BoundaryRow, row: MatrixRow, outflow_slope: real) -> MatrixRow {
    let free = 1.0 - boundary_row.held;
    return MatrixRow(
        row.lower * free,
        (row.diagonal + outflow_slope - boundary_row.slope) * free + boundary_row.held,
        row.slope * free,
        row.upper * free,
        (row.rhs + boundary_row.rhs_correction) * free + boundary_row.held * boundary_row.rise_k,
    );
}

fn apply_boundary_rhs(boundary_row: BoundaryRow, rhs: real) -> real {
    return (rhs - boundary_row.rhs_correction) * (1.0 - boundary_row.held) - boundary_row.held * boundary_row.rise_k;
}

// A dynamic index into structs of several fields becomes so much code that compiling takes ten times as long.
fn boundary_row_of(face: u32) -> BoundaryRow {
    if face == 0u {
        return boundary_rows[0];
    }
    return boundary_rows[1];
}

fn held_face_rise(face: u32, step: u32) -> real {
    return forcing(face, step, 1u).held_k - forcing(face, step, 0u).held_k;
}

fn boundary_row(face: u32, cell: u32, step: u32, stage: u32) -> BoundaryRow {
    let surface_state = surface_state(face, cell, stage);
    let now = open_face_flux(face, forcing(face, step, stage), surface_state);
    var boundary_row = boundary_row_of(face);
    if stage == 0u {
        let end = open_face_flux(face, forcing(face, step, 1u), surface_state);
        boundary_row.held = plan.faces[face].held;
        boundary_row.rise_k = held_face_rise(face, step);
        boundary_row.rhs_correction = (end.flux - now.flux) * real(GAMMA);
        boundary_row.slope = now.slope * opaque(real(GAMMA));
    }
    boundary_row.flux = now.flux;
    return boundary_row;
}

fn net_heat_flux(at: Position, below: InteriorFaceFlux, from_holder: real, stage: u32, sweep: ForwardSweep) -> real {
    var flux = sweep.conducted - below.conducted;
    if GAS {
        flux = ((sweep.conducted + sweep.advected) - (below.conducted - below.advected))
            - absorbed_heat_at(at.cell, stage);
    }
    if at.face != NO_FACE {
        flux = flux + boundary_row_of(at.face).flux;
    }
    if DARCY {
        flux = flux + pressure_work(at.ply, at.cell, stage);
    }
    if HOLDER == 1u {
        flux = flux + from_holder;
    }
    return flux;
}

// For a cell of another thread, only the state that continues into the block.
fn first_stage_row(
    above: ForwardSweep,
    at: Position,
    node: Node,
    below: InteriorFaceFlux,
    inverse_step_1_s: real,
    step: u32,
) -> ForwardSweep {
    let own_slope = below.slopes[0] * -GAMMA;
    let next_slope = below.slopes[1] * -GAMMA;
    var next = forward_sweep();
    next.conducted = below.conducted;
    next.advected = below.advected;
    next.from_holder = above.from_holder;
    next.slopes = array<real, 2>(own_slope, next_slope);
    if !has_cell(at.cell) {
        return next;
    }
    var from_holder = real(0.0);
    if HOLDER == 1u {
        from_holder = holder_flux(at.ply, at.cell, step, 0u);
        next.from_holder = above.from_holder + from_holder;
    }
    var row = MatrixRow(
        above.slopes[0],
        0.0,
        own_slope,
        next_slope,
        net_heat_flux(at, below, from_holder, 0u, above),
    );
    let storage = node.capacity * inverse_step_1_s;
    if FLUSHES_TINY {
        row.diagonal = storage - above.slopes[1] * above.share;
    } else {
        row.diagonal = storage - (above.slopes[1] + own_slope);
    }
    if HOLDER == 1u {
        row.diagonal = row.diagonal + holder_conductance(at.ply, at.cell) * opaque(real(GAMMA));
    }
    if GAS && plan.plies[at.ply].end_reaction > plan.plies[at.ply].first_reaction {
        let damping_rate_1_s = inverse_step_1_s * DAMPING_SHARE;
        row.diagonal = row.diagonal + stiffness_damping(heat_slopes[at.cell], node.capacity, damping_rate_1_s);
    }
    if at.face == 0u {
        face_conduction[0] = below.conducted;
        face_conduction_slopes[0] = array<real, 2>(own_slope, next_slope);
    }
    if at.face == 1u {
        face_conduction[1] = -above.conducted;
        face_conduction_slopes[1] = array<real, 2>(above.slopes[1], above.slopes[0]);
    }
    if at.face != NO_FACE {
        var outflow_slope = real(0.0);
        if GAS {
            outflow_slope = outflow_heat_slope(at.face, at.cell);
        }
        row = apply_boundary(boundary_row_of(at.face), row, outflow_slope);
    }
    var eliminated_row: EliminatedRow;
    if FLUSHES_TINY {
        eliminated_row = eliminate_conducting_row(row.lower, row.diagonal, row.slope, above.reciprocal);
    } else {
        eliminated_row = eliminate_row(row.lower, row.diagonal, above.reciprocal, above.upper);
    }
    next.share = eliminated_row.share;
    next.reciprocal = eliminated_row.reciprocal;
    next.upper = row.upper;
    next.rhs = forward_eliminate(row.rhs, eliminated_row.lower_ratio, above.rhs);
    lower_ratios[at.cell] = eliminated_row.lower_ratio;
    reciprocal_pivots[at.cell] = eliminated_row.reciprocal;
    upper_ratios[at.cell] = row.upper * eliminated_row.reciprocal;
    rhs_or_increment[at.cell] = next.rhs;
    first_stage_capacities[at.cell] = node.capacity;
    return next;
}

fn second_stage_row(
    above: ForwardSweep,
    at: Position,
    node: Node,
    below: InteriorFaceFlux,
    twice_inverse_step_1_s: real,
    step: u32,
) -> ForwardSweep {
    var next = forward_sweep();
    next.conducted = below.conducted;
    next.advected = below.advected;
    next.from_holder = above.from_holder;
    if !has_cell(at.cell) {
        return next;
    }
    var from_holder = real(0.0);
    if HOLDER == 1u {
        from_holder = holder_flux(at.ply, at.cell, step, 1u);
        next.from_holder = above.from_holder + from_holder;
    }
    if at.face == 0u {
        face_conduction[0] = below.conducted;
    }
    if at.face == 1u {
        face_conduction[1] = -above.conducted;
    }
    let capacity = first_stage_capacities[at.cell];
    let heat = net_heat_flux(at, below, from_holder, 1u, above);
    var solution = node.increment;
    if ENTHALPY_STEPS {
        solution = first_solution[at.cell];
    }
    var rhs = capacity / node.capacity * heat - capacity * twice_inverse_step_1_s * solution;
    if at.face != NO_FACE {
        rhs = apply_boundary_rhs(boundary_row_of(at.face), rhs);
    }
    next.rhs = forward_eliminate(rhs, lower_ratios[at.cell], above.rhs);
    rhs_or_increment[at.cell] = next.rhs;
    return next;
}

// `rate_1_s`: the reciprocal length of the step, twice that at the second stage.
fn eliminate_stage_row(
    above: ForwardSweep,
    at: Position,
    here: Node,
    below: InteriorFaceFlux,
    rate_1_s: real,
    step: u32,
    stage: u32,
) -> ForwardSweep {
    if stage == 0u {
        return first_stage_row(above, at, here, below, rate_1_s, step);
    }
    return second_stage_row(above, at, here, below, rate_1_s, step);
}

fn assemble_stage(step: u32, stage: u32) -> real {
    let rate_1_s = select(real(2.0), real(1.0), stage == 0u) / step_length_s(step);
    var sweep = forward_sweep();
    var here: Node;
    for (var p = first_halo_ply(); p < end_halo_ply(); p++) {
        let start = max(plan.plies[p].first_cell, first_halo_cell());
        let end = min(plan.plies[p].end_cell, end_halo_cell());
        let ply = ply_properties(p);
        let entry = node(p, ply, start, stage);
        if start > first_halo_cell() {
            let below = flux_across_interface(p, here, entry, stage);
            sweep = eliminate_stage_row(sweep, position(p - 1u, start - 1u), here, below, rate_1_s, step, stage);
        }
        here = entry;
        for (var i = start + 1u; i < end; i++) {
            let next = node(p, ply, i, stage);
            let below = flux_within_ply(p, i - 1u, here, next, step, stage);
            sweep = eliminate_stage_row(sweep, position(p, i - 1u), here, below, rate_1_s, step, stage);
            here = next;
        }
    }
    let last = Position(PLIES - 1u, run.last_cell, 1u);
    sweep = eliminate_stage_row(sweep, last, here, no_flux(), rate_1_s, step, stage);
    return sweep.from_holder;
}
