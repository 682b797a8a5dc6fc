// Systems with one neighbour on each side: twin of src/physics/tridiagonal.rs.

const LEAST = 1e-25;

alias Column = array<real, CELLS>;

fn settled(value: real) -> real {
    return select(value, 0.0, abs(value) < LEAST);
}

fn factorise(lower: ptr<private, Column>, diagonal: ptr<private, Column>, upper: ptr<private, Column>) {
    (*diagonal)[0] = 1.0 / (*diagonal)[0];
    for (var i = 1u; i < CELLS; i++) {
        let ratio = (*lower)[i] * (*diagonal)[i - 1u];
        (*lower)[i] = ratio;
        (*diagonal)[i] = 1.0 / ((*diagonal)[i] - ratio * (*upper)[i - 1u]);
    }
}

fn substitute(
    ratios: ptr<private, Column>,
    reciprocals: ptr<private, Column>,
    upper: ptr<private, Column>,
    side: ptr<private, Column>,
) {
    const LAST = CELLS - 1u;
    for (var i = 1u; i <= LAST; i++) {
        (*side)[i] = settled((*side)[i] - (*ratios)[i] * (*side)[i - 1u]);
    }
    (*side)[LAST] = settled((*side)[LAST] * (*reciprocals)[LAST]);
    for (var back = 1u; back <= LAST; back++) {
        let i = LAST - back;
        (*side)[i] = settled(((*side)[i] - (*upper)[i] * (*side)[i + 1u]) * (*reciprocals)[i]);
    }
}
