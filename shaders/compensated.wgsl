// Double-word arithmetic: twin of src/physics/compensated.rs.

struct DoubleWord {
    high: real,
    low: real,
}

// The value, hidden from algebraic simplification: `one` comes from the host at run time, so no compiler can know that
// the product is its first factor.
fn opaque(x: real) -> real {
    return x * one;
}

fn two_sum(a: real, b: real) -> DoubleWord {
    let sum = opaque(a + b);
    let b_there = opaque(sum - a);
    let a_there = opaque(sum - b_there);
    let b_lost = opaque(b - b_there);
    let a_lost = opaque(a - a_there);
    return DoubleWord(sum, a_lost + b_lost);
}

fn add_compensated(pair: DoubleWord, increment: real) -> DoubleWord {
    if MANTISSA_BITS > 23u {
        return DoubleWord(pair.high + increment, pair.low);
    }
    return two_sum(pair.high, pair.low + opaque(increment));
}

fn add_unnormalized(pair: DoubleWord, by: real) -> DoubleWord {
    if MANTISSA_BITS > 23u {
        return DoubleWord(pair.high + by, pair.low);
    }
    return DoubleWord(pair.high, pair.low + by);
}

fn difference(a: DoubleWord, b: DoubleWord) -> real {
    if MANTISSA_BITS > 23u {
        return a.high - b.high;
    }
    return (a.high - b.high) + (a.low - b.low);
}
