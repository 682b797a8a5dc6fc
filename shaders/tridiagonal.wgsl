// Tridiagonal systems: twin of src/physics/tridiagonal.rs.

alias Column = array<real, CELLS>;

fn flush_tiny(x: real) -> real {
    return select(x, 0.0, FLUSHES_TINY && abs(x) < FLUSH_THRESHOLD);
}

// Lower ratio `l/d'` of a row, and its reciprocal pivot.
struct EliminatedRow {
    lower_ratio: real,
    reciprocal: real,
    share: real,
}

fn eliminate_row(lower: real, diagonal: real, before: real, upper_before: real) -> EliminatedRow {
    let product = lower * upper_before;
    return EliminatedRow(lower * before, 1.0 / (diagonal - product * before), 0.0);
}

fn eliminate_conducting_row(lower: real, diagonal: real, slope: real, before: real) -> EliminatedRow {
    let reciprocal = 1.0 / (diagonal - slope);
    return EliminatedRow(lower * before, reciprocal, diagonal * reciprocal);
}

fn forward_eliminate(rhs: real, lower_ratio: real, before: real) -> real {
    return flush_tiny(rhs - lower_ratio * before);
}

fn back_substitute(rhs: real, reciprocal: real, upper_ratio: real, before: real) -> real {
    return flush_tiny(rhs * reciprocal - upper_ratio * before);
}
