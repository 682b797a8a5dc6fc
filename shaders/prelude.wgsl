// Begins every kernel, after `alias real` and the sizes of the plan, which the host writes: CELLS, PLIES, SENSORS,
// PARTS and the constants of the tables.

// One, loaded at run time: see `opaque`.
var<private> one: real;
// The member of this thread.
var<private> member: u32;

// The operations of the trait `Real`.

fn ge_mask(x: real, mark: real) -> real {
    return select(real(0.0), real(1.0), x >= mark);
}

fn round_ties_even(x: real) -> real {
    return opaque(x + real(ROUNDING_CONSTANT)) - real(ROUNDING_CONSTANT);
}

fn power_of_two(whole: real) -> real {
    return real(bitcast<f32>(u32(i32(whole) + 127) << 23u));
}

fn exponent_of(x: real) -> real {
    return real(i32(bitcast<u32>(f32(x)) >> 23u) - 127);
}

fn mantissa_of(x: real) -> real {
    return real(bitcast<f32>((bitcast<u32>(f32(x)) & 0x007fffffu) | 0x3f800000u));
}
