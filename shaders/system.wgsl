// The system of a step, made and eliminated on the way down: twin of src/physics/system.rs.

struct Edge {
    held: real,
    rise_k: real,
    flux: real,
    driven: real,
    slope: real,
}

struct Row {
    lower: real,
    diagonal: real,
    upper: real,
    side: real,
}

// What the way down has with it from cell to cell.
struct Way {
    conducted: real,
    gained: real,
    taken: real,
    slopes: array<real, 2>,
    reciprocal: real,
    upper: real,
    side: real,
}

struct Position {
    ply: u32,
    cell: u32,
    face: u32,
}

// The face of a cell that lies at none.
const NOWHERE = 2u;

var<private> edges: array<Edge, 2>;
var<private> passed: array<real, 2>;
var<private> passed_slopes: array<array<real, 2>, 2>;

fn position(ply: u32, cell: u32) -> Position {
    return Position(ply, cell, select(NOWHERE, 0u, cell == 0u));
}

// A block begins with a reciprocal of one, so that its first `lower` keeps what the cell owes to the one above it.
fn way() -> Way {
    return Way(0.0, 0.0, 0.0, array<real, 2>(0.0, 0.0), 1.0, 0.0, 0.0);
}

fn bounds(edge: Edge, row: Row, let_out: real) -> Row {
    let free = 1.0 - edge.held;
    return Row(
        row.lower * free,
        (row.diagonal + let_out - edge.slope) * free + edge.held,
        row.upper * free,
        (row.side + edge.driven) * free + edge.held * edge.rise_k,
    );
}

fn corrects(edge: Edge, side: real) -> real {
    return (side - edge.driven) * (1.0 - edge.held) - edge.held * edge.rise_k;
}

// By a number that is not known beforehand a driver picks rows of several fields up in so many words that compiling takes ten times
// as long.
fn edge_of(face: u32) -> Edge {
    if face == 0u {
        return edges[0];
    }
    return edges[1];
}

fn rise(face: u32, step: u32) -> real {
    return drives[4u * step + 2u * face + 1u].held_k - drives[4u * step + 2u * face].held_k;
}

fn edge(face: u32, cell: u32, step: u32, stage: u32) -> Edge {
    let start = 4u * step + 2u * face;
    let surface = surface(face, cell, stage);
    let now = through(face, drives[start + stage], surface);
    var edge = edge_of(face);
    if stage == 0u {
        let end = through(face, drives[start + 1u], surface);
        edge.held = plan.faces[face].held;
        edge.rise_k = rise(face, step);
        edge.driven = (end.flux - now.flux) * real(GAMMA);
        edge.slope = now.slope * keep(real(GAMMA));
    }
    edge.flux = now.flux;
    return edge;
}

fn net(at: Position, link: Link, from_holder: real, stage: u32, way: Way) -> real {
    var net = way.conducted - link.conducted;
    if GAS {
        net = ((way.conducted + way.gained) - (link.conducted - link.gained)) - absorbed_at(at.cell, stage);
    }
    if at.face != NOWHERE {
        net = net + edge_of(at.face).flux;
    }
    if DARCY {
        net = net + swept(at.ply, at.cell, stage);
    }
    if HOLDER == 1u {
        net = net + from_holder;
    }
    return net;
}

// Of a cell that another lane has only what goes on into the block.
fn row(above: Way, at: Position, node: Node, link: Link, per_length: real, step: u32) -> Way {
    let leaving = link.slopes[0] * -GAMMA;
    let below = link.slopes[1] * -GAMMA;
    var next = way();
    next.conducted = link.conducted;
    next.gained = link.gained;
    next.taken = above.taken;
    next.slopes = array<real, 2>(leaving, below);
    if !has(at.cell) {
        return next;
    }
    var from_holder = real(0.0);
    if HOLDER == 1u {
        from_holder = sideways(at.ply, at.cell, step, 0u);
        next.taken = above.taken + from_holder;
    }
    var row = Row(
        above.slopes[0],
        node.capacity * per_length - (above.slopes[1] + leaving),
        below,
        net(at, link, from_holder, 0u, above),
    );
    if HOLDER == 1u {
        row.diagonal = row.diagonal + conductance_sideways(at.ply, at.cell) * keep(real(GAMMA));
    }
    if GAS && plan.plies[at.ply].end_reaction > plan.plies[at.ply].first_reaction {
        row.diagonal = row.diagonal + restraint(restraints[at.cell], node.capacity, per_length * EASE);
    }
    if at.face == 0u {
        passed[0] = link.conducted;
        passed_slopes[0] = array<real, 2>(leaving, below);
    }
    if at.face == 1u {
        passed[1] = -above.conducted;
        passed_slopes[1] = array<real, 2>(above.slopes[1], above.slopes[0]);
    }
    if at.face != NOWHERE {
        var let_out = real(0.0);
        if GAS {
            let_out = let_out_heat(at.face, at.cell);
        }
        row = bounds(edge_of(at.face), row, let_out);
    }
    let done = eliminated(row.lower, row.diagonal, above.reciprocal, above.upper);
    next.reciprocal = done.reciprocal;
    next.upper = row.upper;
    next.side = descended(row.side, done.under, above.side);
    lower[at.cell] = done.under;
    diagonal[at.cell] = done.reciprocal;
    upper[at.cell] = row.upper * done.reciprocal;
    second[at.cell] = next.side;
    capacities[at.cell] = node.capacity;
    return next;
}

fn side(above: Way, at: Position, node: Node, link: Link, twice_per_length: real, step: u32) -> Way {
    var next = way();
    next.conducted = link.conducted;
    next.gained = link.gained;
    next.taken = above.taken;
    if !has(at.cell) {
        return next;
    }
    var from_holder = real(0.0);
    if HOLDER == 1u {
        from_holder = sideways(at.ply, at.cell, step, 1u);
        next.taken = above.taken + from_holder;
    }
    if at.face == 0u {
        passed[0] = link.conducted;
    }
    if at.face == 1u {
        passed[1] = -above.conducted;
    }
    let capacity = capacities[at.cell];
    let heat = net(at, link, from_holder, 1u, above);
    var side = capacity / node.capacity * heat - capacity * twice_per_length * node.moved;
    if at.face != NOWHERE {
        side = corrects(edge_of(at.face), side);
    }
    next.side = descended(side, lower[at.cell], above.side);
    second[at.cell] = next.side;
    return next;
}

fn assemble(step: u32) -> real {
    let per_length = 1.0 / length_s(step);
    var way = way();
    var here: Node;
    for (var p = first_linked_ply(); p < end_linked_ply(); p++) {
        let start = max(plan.plies[p].first_cell, first_link());
        let entry = node(p, start, 0u);
        if start > first_link() {
            way = row(way, position(p - 1u, start - 1u), here, link_across(p, here, entry, 0u), per_length, step);
        }
        here = entry;
        for (var i = start + 1u; i < min(plan.plies[p].end_cell, end_linked()); i++) {
            let next = node(p, i, 0u);
            way = row(way, position(p, i - 1u), here, link_within(i - 1u, here, next, 0u), per_length, step);
            here = next;
        }
    }
    way = row(way, Position(PLIES - 1u, run.last_cell, 1u), here, no_link(), per_length, step);
    return way.taken;
}

fn correct(step: u32) -> real {
    let twice_per_length = 2.0 / length_s(step);
    var way = way();
    var here: Node;
    for (var p = first_linked_ply(); p < end_linked_ply(); p++) {
        let start = max(plan.plies[p].first_cell, first_link());
        let entry = node(p, start, 1u);
        if start > first_link() {
            way = side(way, position(p - 1u, start - 1u), here, link_across(p, here, entry, 1u), twice_per_length, step);
        }
        here = entry;
        for (var i = start + 1u; i < min(plan.plies[p].end_cell, end_linked()); i++) {
            let next = node(p, i, 1u);
            way = side(way, position(p, i - 1u), here, link_within(i - 1u, here, next, 1u), twice_per_length, step);
            here = next;
        }
    }
    way = side(way, Position(PLIES - 1u, run.last_cell, 1u), here, no_link(), twice_per_length, step);
    return way.taken;
}
