// Readings of the whole layup at an instant: twin of src/physics/gauges.rs.

// Two neighbouring depths between which conversion falls below a threshold.
struct Crossing {
    upper: real,
    upper_m: real,
    lower: real,
    lower_m: real,
}

// Degree of conversion of a cell, depth of its node, and depth of its lower face.
struct Conversion {
    degree: real,
    node_m: real,
    end_m: real,
}

fn gauges(step: u32) -> array<real, GAUGES> {
    let outside = forcing(0u, step, 0u).pressure_pa;
    var lost = real(0.0);
    var virgin = Crossing(0.0, 0.0, 0.0, 0.0);
    var char = Crossing(0.0, 0.0, 0.0, 0.0);
    let over = conversion_above();
    var before = over.degree;
    var before_m = over.node_m;
    var depth_m = over.end_m;
    for (var p = first_ply(); p < end_ply(); p++) {
        for (var i = first_cell_of(p); i < end_cell_of(p); i++) {
            let lost_ratio = lost_mass_ratio(p, i);
            let density = opaque(1.0 - lost_ratio);
            let width_m = cell_width_m(i);
            lost = lost + ply_scales[p].mass_kg_m3 * width_m * lost_ratio;
            let here = degree_of_conversion(p, density);
            let node_m = depth_m + cells[i].above_m;
            let jumps = i == plan.plies[p].first_cell && plan.plies[p].same_material_above == 0u;
            let upper_m = select(before_m, depth_m, jumps);
            let lower_m = select(node_m, depth_m, jumps);
            let fall = Crossing(before, upper_m, here, lower_m);
            virgin = deepest_crossing(virgin, fall, real(VIRGIN_CONVERSION));
            char = deepest_crossing(char, fall, real(CHAR_CONVERSION));
            before = here;
            before_m = node_m;
            depth_m = depth_m + width_m;
        }
    }
    if has_cell(run.last_cell) {
        let end = Crossing(before, depth_m, 0.0, depth_m);
        virgin = deepest_crossing(virgin, end, real(VIRGIN_CONVERSION));
        char = deepest_crossing(char, end, real(CHAR_CONVERSION));
    }
    let virgin_m = front_depth_m(virgin, real(VIRGIN_LOG_ODDS));
    let char_m = front_depth_m(char, real(CHAR_LOG_ODDS));
    var peak = outside;
    var back = outside;
    if DARCY {
        for (var i = first_cell(); i < end_cell(); i++) {
            peak = max(peak, pressures[i].high);
        }
        back = pressures[run.last_cell].high;
    }
    let length_s = step_length_s(max(step, 1u) - 1u);
    let before_s = step_length_s(max(step, 2u) - 2u);
    let flux = recent_outflows[1]
        + (recent_outflows[1] - recent_outflows[0]) * (length_s / (length_s + before_s));
    return array<real, GAUGES>(
        flux,
        reduce_sum(lost),
        reduce_max(virgin_m),
        reduce_max(char_m),
        reduce_max(peak),
        back,
    );
}

fn deepest_crossing(crossing: Crossing, next: Crossing, mark: real) -> Crossing {
    let falls = ge_mask(next.upper, mark) * (1.0 - ge_mask(next.lower, mark));
    if falls == 0.0 {
        return crossing;
    }
    let stays = 1.0 - falls;
    return Crossing(
        stays * crossing.upper + falls * next.upper,
        stays * crossing.upper_m + falls * next.upper_m,
        stays * crossing.lower + falls * next.lower,
        stays * crossing.lower_m + falls * next.lower_m,
    );
}

fn front_depth_m(crossing: Crossing, mark_log_odds: real) -> real {
    let upper = log_odds(crossing.upper);
    let lower = log_odds(crossing.lower);
    let fraction = (upper - mark_log_odds) / max(upper - lower, real(1e-9));
    return crossing.upper_m + fraction * (crossing.lower_m - crossing.upper_m);
}

fn log_odds(conversion: real) -> real {
    let inside = min(max(conversion, real(CONVERSION_MIN)), real(1.0 - CONVERSION_MIN));
    return logarithm(inside / (1.0 - inside));
}
