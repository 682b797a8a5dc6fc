// Thermocouple readings: twin of src/physics/thermocouple.rs.

fn interface_temperature(
    upper: DoubleWord,
    lower: DoubleWord,
    conductivity: real,
    next: real,
    conductance: real,
    sensor: Sensor,
) -> DoubleWord {
    let drop = difference(upper, lower);
    let flux = conductance * drop;
    let to_face = flux * sensor.above_m / conductivity;
    let from_face = drop - flux * sensor.below_m / next;
    let fall = sensor.above * to_face + sensor.below * from_face;
    return add_unnormalized(upper, -fall);
}

fn covered_length(shift_m: real, start_m: real, length_m: real, is_extended: bool) -> real {
    let part_m = shift_m - start_m;
    if is_extended {
        return min(part_m, length_m);
    }
    return min(max(part_m, 0.0), length_m);
}

fn bead_response(bead: DoubleWord, before: DoubleWord, now: DoubleWord, weights: Bead) -> DoubleWord {
    let start = weights.start * difference(before, bead);
    let end = weights.end * difference(now, bead);
    return add_compensated(bead, start + end);
}
