// Begins every kernel, after `alias real` and the sizes of the plan, which the host writes: CELLS, PLIES, SENSORS,
// PARTS and the constants of the tables.

// One, loaded at run time: see `opaque`.
var<private> one: real;
// The member of this thread.
var<private> member: u32;

// The operations of the trait `Real`.

fn reached(x: real, mark: real) -> real {
    return select(real(0.0), real(1.0), x >= mark);
}

fn nearest(x: real) -> real {
    return keep(x + real(WHOLE)) - real(WHOLE);
}

fn two_to(whole: real) -> real {
    return real(bitcast<f32>(u32(i32(whole) + 127) << 23u));
}

fn twos_of(x: real) -> real {
    return real(i32(bitcast<u32>(f32(x)) >> 23u) - 127);
}

fn mantissa_of(x: real) -> real {
    return real(bitcast<f32>((bitcast<u32>(f32(x)) & 0x007fffffu) | 0x3f800000u));
}
