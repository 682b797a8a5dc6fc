// Systems with one neighbour on each side: twin of src/physics/tridiagonal.rs.

const LEAST = 1e-25;

alias Column = array<real, CELLS>;

fn settled(value: real) -> real {
    return select(value, 0.0, SETTLES && abs(value) < LEAST);
}

fn factorise(lower: ptr<private, Column>, diagonal: ptr<private, Column>, upper: ptr<private, Column>) {
    (*diagonal)[0] = 1.0 / (*diagonal)[0];
    for (var i = 1u; i < CELLS; i++) {
        let before = (*diagonal)[i - 1u];
        let product = (*lower)[i] * (*upper)[i - 1u];
        (*lower)[i] = (*lower)[i] * before;
        (*upper)[i - 1u] = (*upper)[i - 1u] * before;
        (*diagonal)[i] = 1.0 / ((*diagonal)[i] - product * before);
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
        before = settled((*side)[i] - (*under)[i] * before);
        (*side)[i] = before;
    }
    before = settled(before * (*reciprocals)[LAST]);
    (*side)[LAST] = before;
    for (var back = 1u; back <= LAST; back++) {
        let i = LAST - back;
        before = settled((*side)[i] * (*reciprocals)[i] - (*over)[i] * before);
        (*side)[i] = before;
    }
}
