// Systems with one neighbour on each side: twin of src/physics/tridiagonal.rs.

const LEAST = 1e-25;

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

fn factorise(lower: ptr<private, Column>, diagonal: ptr<private, Column>, upper: ptr<private, Column>) {
    (*diagonal)[0] = 1.0 / (*diagonal)[0];
    for (var i = 1u; i < CELLS; i++) {
        let before = (*diagonal)[i - 1u];
        let row = eliminated((*lower)[i], (*diagonal)[i], before, (*upper)[i - 1u]);
        (*lower)[i] = row.under;
        (*diagonal)[i] = row.reciprocal;
        (*upper)[i - 1u] = (*upper)[i - 1u] * before;
    }
}

fn substitute(
    under: ptr<private, Column>,
    reciprocals: ptr<private, Column>,
    over: ptr<private, Column>,
    side: ptr<private, Column>,
) {
    const LAST = CELLS - 1u;
    var before = (*side)[0];
    for (var i = 1u; i <= LAST; i++) {
        before = descended((*side)[i], (*under)[i], before);
        (*side)[i] = before;
    }
    before = settled(before * (*reciprocals)[LAST]);
    (*side)[LAST] = before;
    for (var back = 1u; back <= LAST; back++) {
        let i = LAST - back;
        before = ascended((*side)[i], (*reciprocals)[i], (*over)[i], before);
        (*side)[i] = before;
    }
}
