// What every kernel begins with. Before it the host writes `alias real` and the sizes of the plan:
// CELLS, PLIES, SENSORS, PARTS and the constants of the tables.

// One, loaded at run time: see `keep`.
var<private> one: real;
// The member that this invocation carries.
var<private> member: u32;

// What `Real` gives the other twin.

fn reached(value: real, mark: real) -> real {
    return select(real(0.0), real(1.0), value >= mark);
}

fn nearest(value: real) -> real {
    return keep(value + real(WHOLE)) - real(WHOLE);
}

fn two_to(whole: real) -> real {
    return real(bitcast<f32>(u32(i32(whole) + 127) << 23u));
}

fn twos_of(value: real) -> real {
    return real(i32(bitcast<u32>(f32(value)) >> 23u) - 127);
}

fn mantissa_of(value: real) -> real {
    return real(bitcast<f32>((bitcast<u32>(f32(value)) & 0x007fffffu) | 0x3f800000u));
}
