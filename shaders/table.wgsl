// Linear interpolation in the tables of a plan: twin of src/physics/table.rs. There is one array of tables, as WGSL
// does not pass storage by reference.

struct TableIndex {
    row: u32,
    fraction: real,
}

fn table_index(temperature_k: real, location: TableLocation) -> TableIndex {
    let position = temperature_k * real(1.0 / TABLE_STEP_K);
    if !DIRECTORIES || location.directory == 0u {
        let row = min(u32(clamp(position, 0.0, real(TABLE_STEPS))), location.last_bucket);
        return TableIndex(row, position - real(row));
    }
    if location.list_length > 0u {
        let first = location.directory / COLUMNS_PER_LOAD;
        let origin = column_group(first).x;
        let step = min(u32(clamp(position - origin, 0.0, real(TABLE_STEPS))), TABLE_STEPS - 1u);
        var row = step;
        var own_start = real(step) + origin;
        // A group of starts at a time: those past the end of the list are beyond all temperatures.
        for (var listed = 1u; listed < location.list_length; listed += COLUMNS_PER_LOAD) {
            let starts = column_group(first + (listed + COLUMNS_PER_LOAD - 1u) / COLUMNS_PER_LOAD);
            if position >= starts.x {
                row = row + 1u;
                own_start = max(own_start, starts.x);
            }
            if position >= starts.y {
                row = row + 1u;
                own_start = max(own_start, starts.y);
            }
            if position >= starts.z {
                row = row + 1u;
                own_start = max(own_start, starts.z);
            }
            if position >= starts.w {
                row = row + 1u;
                own_start = max(own_start, starts.w);
            }
        }
        return TableIndex(row, position - own_start);
    }
    let scaled = position * real(location.buckets_per_step);
    let bucket = u32(clamp(scaled, 0.0, real(location.last_bucket)));
    let entry = column_group(location.directory / COLUMNS_PER_LOAD + bucket);
    if position >= entry.w {
        return TableIndex(u32(entry.x) + 2u, position - entry.w);
    }
    if position >= entry.z {
        return TableIndex(u32(entry.x) + 1u, position - entry.z);
    }
    return TableIndex(u32(entry.x), position - entry.y);
}

struct TableSegment {
    first_group: u32,
    fraction: real,
}

fn table_segment(table_index: TableIndex, location: TableLocation) -> TableSegment {
    let first_group = (location.offset + location.columns * table_index.row) / COLUMNS_PER_LOAD;
    return TableSegment(first_group, table_index.fraction);
}

fn column_offset(table_segment: TableSegment, properties: u32) -> TableSegment {
    return TableSegment(table_segment.first_group + 2u * properties / COLUMNS_PER_LOAD, table_segment.fraction);
}

fn interpolate(table_segment: TableSegment, property: u32) -> real {
    let pair = column_pair(table_segment, property);
    return pair[0] + table_segment.fraction * pair[1];
}

fn integral(table_segment: TableSegment, property: u32) -> real {
    let pair = column_pair(table_segment, property);
    let integrated = column_pair(table_segment, property + 2u);
    let mean = pair[0] + 0.5 * table_segment.fraction * pair[1];
    return integrated[0] + TABLE_STEP_K * table_segment.fraction * mean;
}

fn first_integral(table_segment: TableSegment, steep: TableSegment) -> array<real, 3> {
    let pair = column_pair(table_segment, 0u);
    let mean = pair[0] + 0.5 * table_segment.fraction * pair[1];
    return array<real, 3>(
        interpolate(table_segment, 0u),
        column_pair(steep, 0u)[0] + TABLE_STEP_K * table_segment.fraction * mean,
        interpolate(steep, 1u),
    );
}

struct TabulatedStates {
    count: u32,
    properties: u32,
    weights: Phases,
}

fn state_sum(table_segment: TableSegment, property: u32, stride: u32, of_states: TabulatedStates) -> array<real, 2> {
    var states = of_states;
    let first = column_pair(table_segment, property);
    var sum = array<real, 2>(states.weights[0] * first[0], states.weights[0] * first[1]);
    for (var state = 1u; state < states.count; state++) {
        let own = column_pair(table_segment, property + state * stride);
        sum[0] = sum[0] + states.weights[state] * own[0];
        sum[1] = sum[1] + states.weights[state] * own[1];
    }
    return sum;
}

fn heat_capacity_sum(table_segment: TableSegment, states: TabulatedStates) -> real {
    let sum = state_sum(table_segment, 1u, states.properties, states);
    return sum[0] + table_segment.fraction * sum[1];
}

fn rise_by_enthalpy(
    temperature_k: real,
    predicted_k: real,
    reduced: real,
    location: TableLocation,
    states: TabulatedStates,
) -> array<real, 2> {
    let enthalpy_columns = (location.columns - states.count * ENTHALPY_COLUMNS) / 2u;
    let at = table_index(temperature_k, location);
    let here = table_segment(at, location);
    let capacity = state_sum(here, 1u, states.properties, states);
    let heat_capacity = capacity[0] + here.fraction * capacity[1];
    let lower_bound = state_sum(here, enthalpy_columns, ENTHALPY_COLUMNS / 2u, states);
    let least = lower_bound[0] + here.fraction * lower_bound[1];
    let gained_j_kg = predicted_k * (reduced * least + (1.0 - reduced) * heat_capacity);
    let own = rise_within_row(heat_capacity, capacity[1], gained_j_kg);
    let own_start_j_kg = state_sum(here, 3u, states.properties, states)[0];
    let mean = capacity[0] + 0.5 * here.fraction * capacity[1];
    let sought_j_kg = own_start_j_kg + TABLE_STEP_K * here.fraction * mean + gained_j_kg;
    let last = location.rows - 1u;
    let next = table_segment(row_start(min(at.row + 1u, last)), location);
    let passes_end = sought_j_kg - state_sum(next, 3u, states.properties, states)[0] >= 0.0 && at.row < last;
    if sought_j_kg - own_start_j_kg >= 0.0 && !passes_end {
        return array<real, 2>(own, least / heat_capacity);
    }
    var row = 0u;
    for (var span = location.enthalpy_search_span; span > 0u; span = span / 2u) {
        let later = min(row + span, last);
        let start = table_segment(row_start(later), location);
        if sought_j_kg - state_sum(start, 3u, states.properties, states)[0] >= 0.0 {
            row = later;
        }
    }
    let found = table_segment(row_start(row), location);
    let of_row = state_sum(found, 1u, states.properties, states);
    let position = column_pair(found, enthalpy_columns + 1u)[0];
    let start_j_kg = state_sum(found, 3u, states.properties, states)[0];
    let from_start_k = rise_within_row(of_row[0], of_row[1], sought_j_kg - start_j_kg);
    let beyond_k = (from_start_k + position * TABLE_STEP_K) - temperature_k;
    return array<real, 2>(beyond_k, least / heat_capacity);
}

fn row_start(row: u32) -> TableIndex {
    return TableIndex(row, 0.0);
}

fn rise_within_row(heat_capacity: real, slope: real, gained_j_kg: real) -> real {
    let slope_j_kg_k2 = slope * real(1.0 / TABLE_STEP_K);
    let discriminant = heat_capacity * heat_capacity + (gained_j_kg + gained_j_kg) * slope_j_kg_k2;
    return (gained_j_kg + gained_j_kg) / (heat_capacity + sqrt(max(discriminant, 0.0)));
}

fn column_pair(table_segment: TableSegment, property: u32) -> array<real, 2> {
    let column = 2u * property;
    let column_group = column_group(table_segment.first_group + column / COLUMNS_PER_LOAD);
    if column % COLUMNS_PER_LOAD == 0u {
        return array<real, 2>(column_group.x, column_group.y);
    }
    return array<real, 2>(column_group.z, column_group.w);
}
