// Tridiagonal systems: twin of src/physics/tridiagonal.rs.

alias Column = array<real, CELLS>;

fn settled(x: real) -> real {
    return select(x, 0.0, SETTLES && abs(x) < FLUSH_THRESHOLD);
}

// Lower ratio `l/d'` of a row, and its reciprocal pivot.
struct EliminatedRow {
    lower_ratio: real,
    reciprocal: real,
}

fn eliminated(lower: real, diagonal: real, before: real, upper_before: real) -> EliminatedRow {
    let product = lower * upper_before;
    return EliminatedRow(lower * before, 1.0 / (diagonal - product * before));
}

fn descended(rhs: real, lower_ratio: real, before: real) -> real {
    return settled(rhs - lower_ratio * before);
}

fn ascended(rhs: real, reciprocal: real, upper_ratio: real, before: real) -> real {
    return settled(rhs * reciprocal - upper_ratio * before);
}
