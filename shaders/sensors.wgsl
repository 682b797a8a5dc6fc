// Temperatures between nodes and thermocouple beads: twin of src/physics/sensors.rs.

fn read_sensor(sensor: u32, step: u32) -> DoubleWord {
    // Not one loop for both, as the processor has: a march on lavapipe would take 1.05 times as long.
    if LIMITS == 0u || !is_limit_row(sensor) {
        return read_face(sensor, step);
    }
    var hottest = hottest_node(sensor);
    for (var face = sensor + 1u; face < sensor + 1u + plan.sensor_locations[sensor].faces; face++) {
        let there = read_face(face, step);
        hottest = max(hottest, there.high + there.low);
    }
    return DoubleWord(hottest, 0.0);
}

fn is_limit_row(sensor: u32) -> bool {
    return plan.sensor_locations[sensor].end_node + plan.sensor_locations[sensor].faces > 0u;
}

fn hottest_node(sensor: u32) -> real {
    let location = plan.sensor_locations[sensor];
    var hottest = real(0.0);
    for (var i = location.first_node; i < location.end_node; i++) {
        var excess = real(0.0);
        if i > location.first_node && i + 2u < location.end_node {
            let above = stretch(i - 1u);
            let between = stretch(i);
            let below = stretch(i + 1u);
            excess = peak_excess(
                array<real, 3>(above[0], between[0], below[0]),
                array<real, 3>(above[1], between[1], below[1]),
            );
        }
        hottest = max(hottest, temperatures[i].high + excess);
    }
    return hottest;
}

fn stretch(i: u32) -> array<real, 2> {
    let length_m = distance_to_next_m(i);
    return array<real, 2>(difference(temperatures[i + 1u], temperatures[i]) / length_m, length_m);
}

fn read_face(sensor: u32, step: u32) -> DoubleWord {
    let location = plan.sensor_locations[sensor];
    let i = location.cell;
    let ply = location.ply_above;
    let conductivity = conductivity_now(ply, i, step);
    let next = conductivity_now(location.ply_below, i + 1u, step);
    let upper = temperatures[i];
    let lower = temperatures[i + 1u];
    let row = plan.sensors[sensor];
    let is_between_nodes = location.node_above < location.node_below;
    let is_steep = STEEP_CONDUCTIVITIES && ply == location.ply_below && is_between_nodes
        && plan.tables[ply].conductivity_integral > 0u;
    let half_over_next_1_m = half_over_distance_1_m(i);
    var conductance = conductance_within(conductivity, next, half_over_next_1_m);
    if is_steep {
        let integral_correction = conductivity_by_integral(ply, i, difference(upper, lower), step, 0u)[0];
        conductance = conductance + integral_correction * (half_over_next_1_m + half_over_next_1_m);
    }
    if ply != location.ply_below {
        let lengths_m = lengths_to_next_m(i);
        conductance = conductance_across(conductivity, lengths_m[0], next, lengths_m[1], contact_scales[ply]);
    }
    var nominal = interface_temperature(upper, lower, conductivity, next, conductance, row);
    if is_steep {
        nominal = temperature_within_steep_ply(upper, lower, conductivity, next, conductance, row);
    }
    if DEPTHS == 1u {
        let flux = conductance * difference(upper, lower);
        return add_unnormalized(nominal, depth_correction(sensor, flux / conductivity, flux / next));
    }
    return nominal;
}

fn depth_correction(sensor: u32, fall_above_k_m: real, fall_below_k_m: real) -> real {
    let location = plan.sensor_locations[sensor];
    let row = plan.sensors[sensor];
    let shift_m = row.depth_m * (column(location.depth) - 1.0);
    let is_inside = location.node_above < location.node_below;
    var start_m = row.below_m;
    var rise = real(0.0);
    if is_inside {
        rise = -(fall_below_k_m * covered_length(shift_m, 0.0, start_m, false));
    }
    for (var step = 0u; step < location.steps_below; step++) {
        let j = location.node_below + step;
        let length_m = distance_to_next_m(j);
        let gain = difference(temperatures[j + 1u], temperatures[j]) / length_m;
        rise = rise + gain * covered_length(shift_m, start_m, length_m, !is_inside && step == 0u);
        start_m = start_m + length_m;
    }
    start_m = row.above_m;
    if is_inside {
        rise = rise + fall_above_k_m * covered_length(-shift_m, 0.0, start_m, false);
    }
    for (var step = 0u; step < location.steps_above; step++) {
        let j = location.node_above - step;
        let length_m = distance_to_next_m(j - 1u);
        let gain = difference(temperatures[j - 1u], temperatures[j]) / length_m;
        rise = rise + gain * covered_length(-shift_m, start_m, length_m, !is_inside && step == 0u);
        start_m = start_m + length_m;
    }
    return rise;
}

fn initial_temperature_k(sensor: u32) -> real {
    let row = plan.sensors[sensor];
    var start_k = row.start_k;
    if DEPTHS == 1u {
        let shift_m = row.depth_m * (column(plan.sensor_locations[sensor].depth) - 1.0);
        for (var i = 0u; i < INITIAL_BENDS; i++) {
            let bend = plan.initial_bends[i];
            let below_bend_m = row.depth_m - bend.depth_m;
            let added_m = max(below_bend_m + shift_m, 0.0) - max(below_bend_m, 0.0);
            start_k = start_k + bend.slope_change_k_m * added_m;
        }
    }
    return start_k;
}

fn update_sensors(step: u32) {
    for (var s = thread; s < run.sensors; s += THREADS_PER_MEMBER) {
        let now = read_sensor(s, step);
        if step == 0u {
            beads_now[s] = now;
            if plan.sensors[s].start_k != 0.0 {
                beads_now[s] = DoubleWord(initial_temperature_k(s), 0.0);
            }
        } else {
            beads_now[s] = bead_response(beads_now[s], readings[s], now, beads[(step - 1u) * SENSORS + s]);
        }
        readings[s] = now;
    }
}
