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

fn temperature_within_steep_ply(
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
    let falls = ge_mask(drop, 0.0);
    let conducts_better = ge_mask(next, conductivity);
    let is_least = falls * conducts_better + (1.0 - falls) * (1.0 - conducts_better);
    let fall = is_least * min(to_face, from_face) + (1.0 - is_least) * max(to_face, from_face);
    return add_unnormalized(upper, -min(max(fall, min(drop, real(0.0))), max(drop, real(0.0))));
}

fn peak_excess(slopes_k_m: array<real, 3>, lengths_m: array<real, 3>) -> real {
    let above = slopes_k_m[0];
    let between = slopes_k_m[1];
    let below = slopes_k_m[2];
    let above_m = lengths_m[0];
    let between_m = lengths_m[1];
    let below_m = lengths_m[2];
    let upper = (above * between_m + between * above_m) / (above_m + between_m);
    let lower = (between * below_m + below * between_m) / (between_m + below_m);
    let twice = between + between;
    return min(
        parabola_excess(upper, twice - upper, between_m),
        parabola_excess(twice - lower, lower, between_m),
    );
}

fn parabola_excess(start_k_m: real, end_k_m: real, length_m: real) -> real {
    let is_peak = ge_mask(start_k_m, 0.0) * ge_mask(-end_k_m, 0.0);
    let bend_k_m = 2.0 * (start_k_m - end_k_m);
    return is_peak * (start_k_m * start_k_m * length_m / max(bend_k_m, real(BEND_MIN_K_M)));
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
