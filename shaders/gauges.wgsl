// What is told of a member as a whole at an instant: twin of src/physics/gauges.rs.

const VIRGIN_LOST = 0.02;
const CHAR_LOST = 0.98;

// How far a cell is converted, where its node lies, and where it ends.
struct Conversion {
    share: real,
    node_m: real,
    end_m: real,
}

fn gauges(step: u32) -> array<real, GAUGES> {
    let outside = drives[4u * step].pressure_pa;
    var lost = real(0.0);
    var virgin_m = real(0.0);
    var char_m = real(0.0);
    let over = conversion_above();
    var before = over.share;
    var before_m = over.node_m;
    var depth_m = over.end_m;
    for (var p = first_ply(); p < end_ply(); p++) {
        for (var i = first_of(p); i < end_of(p); i++) {
            let density = mass_left(p, phases_of(p, i));
            let width_m = cells[i].width_m;
            lost = lost + ply_scales[p].mass_kg_m3 * width_m * (1.0 - density);
            let node_m = depth_m + cells[i].above_m;
            let here = converted(p, density);
            virgin_m = max(virgin_m, crossing(before, before_m, here, node_m, real(VIRGIN_LOST)));
            char_m = max(char_m, crossing(before, before_m, here, node_m, real(CHAR_LOST)));
            before = here;
            before_m = node_m;
            depth_m = depth_m + width_m;
        }
    }
    if has(run.last_cell) {
        virgin_m = max(virgin_m, crossing(before, before_m, 0.0, depth_m, real(VIRGIN_LOST)));
        char_m = max(char_m, crossing(before, before_m, 0.0, depth_m, real(CHAR_LOST)));
    }
    var peak = outside;
    var back = outside;
    if DARCY {
        for (var i = first_cell(); i < end_cell(); i++) {
            peak = max(peak, pressures[i].high);
        }
        back = pressures[run.last_cell].high;
    }
    let flux = 1.5 * recent[1] - 0.5 * recent[0];
    return array<real, GAUGES>(flux, summed(lost), largest(virgin_m), largest(char_m), largest(peak), back);
}

fn crossing(before: real, before_m: real, here: real, here_m: real, mark: real) -> real {
    let falls = reached(before, mark) * (1.0 - reached(here, mark));
    let way = (before - mark) / max(before - here, real(1e-9));
    return falls * (before_m + way * (here_m - before_m));
}
