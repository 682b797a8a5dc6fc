// Systems with one neighbour on each side: twin of src/physics/tridiagonal.rs.

alias Column = array<real, CELLS>;

fn settled(value: real) -> real {
    return select(value, 0.0, SETTLES && abs(value) < LEAST);
}

// The ratio `l/d'` of a row, and the reciprocal of its pivot.
struct Eliminated {
    under: real,
    reciprocal: real,
}

fn eliminated(lower: real, diagonal: real, before: real, upper_before: real) -> Eliminated {
    let product = lower * upper_before;
    return Eliminated(lower * before, 1.0 / (diagonal - product * before));
}

fn descended(side: real, under: real, before: real) -> real {
    return settled(side - under * before);
}

fn ascended(side: real, reciprocal: real, over: real, before: real) -> real {
    return settled(side * reciprocal - over * before);
}
