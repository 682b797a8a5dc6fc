// Double-word arithmetic: twin of src/physics/compensated.rs.

struct DoubleWord {
    high: real,
    low: real,
}

// The value, hidden from algebraic simplification: `one` comes from the host at run time, so no compiler can know that
// the product is its first factor.
fn keep(x: real) -> real {
    return x * one;
}

fn two_sum(a: real, b: real) -> DoubleWord {
    let sum = keep(a + b);
    let b_there = keep(sum - a);
    let a_there = keep(sum - b_there);
    let b_lost = keep(b - b_there);
    let a_lost = keep(a - a_there);
    return DoubleWord(sum, a_lost + b_lost);
}

fn advanced(pair: DoubleWord, increment: real) -> DoubleWord {
    if DIGITS > 23u {
        return DoubleWord(pair.high + increment, pair.low);
    }
    return two_sum(pair.high, pair.low + keep(increment));
}

fn raised(pair: DoubleWord, by: real) -> DoubleWord {
    if DIGITS > 23u {
        return DoubleWord(pair.high + by, pair.low);
    }
    return DoubleWord(pair.high, pair.low + by);
}

fn difference(a: DoubleWord, b: DoubleWord) -> real {
    if DIGITS > 23u {
        return a.high - b.high;
    }
    return (a.high - b.high) + (a.low - b.low);
}
