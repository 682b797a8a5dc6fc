// Temperature in two words: twin of src/physics/compensated.rs.

struct Pair {
    high: real,
    low: real,
}

// The value, out of reach of the compiler's algebra: `one` comes from the host at run time, so no driver can
// know that the product is its first factor.
fn keep(value: real) -> real {
    return value * one;
}

fn two_sum(a: real, b: real) -> Pair {
    let sum = keep(a + b);
    let b_there = keep(sum - a);
    let a_there = keep(sum - b_there);
    let b_lost = keep(b - b_there);
    let a_lost = keep(a - a_there);
    return Pair(sum, a_lost + b_lost);
}

fn advanced(pair: Pair, increment: real) -> Pair {
    if DIGITS > 23u {
        return Pair(pair.high + increment, pair.low);
    }
    return two_sum(pair.high, pair.low + keep(increment));
}

fn raised(pair: Pair, by: real) -> Pair {
    if DIGITS > 23u {
        return Pair(pair.high + by, pair.low);
    }
    return Pair(pair.high, pair.low + by);
}

fn difference(a: Pair, b: Pair) -> real {
    if DIGITS > 23u {
        return a.high - b.high;
    }
    return (a.high - b.high) + (a.low - b.low);
}
