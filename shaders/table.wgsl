// Linear interpolation on the uniform temperature grid: twin of src/physics/table.rs. There is one array of tables, as
// WGSL does not pass storage by reference.

struct TableIndex {
    row: u32,
    fraction: real,
}

fn table_index(temperature_k: real) -> TableIndex {
    let position = temperature_k * real(1.0 / TABLE_STEP_K);
    let row = min(u32(clamp(position, 0.0, real(TABLE_NODES))), TABLE_NODES - 2u);
    return TableIndex(row, position - real(row));
}

struct TableSegment {
    first_group: u32,
    fraction: real,
}

fn table_segment(table_index: TableIndex, columns: u32, offset: u32) -> TableSegment {
    return TableSegment((offset + columns * table_index.row) / COLUMNS_PER_LOAD, table_index.fraction);
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

fn column_pair(table_segment: TableSegment, property: u32) -> array<real, 2> {
    let column = 2u * property;
    let column_group = column_group(table_segment.first_group + column / COLUMNS_PER_LOAD);
    if column % COLUMNS_PER_LOAD == 0u {
        return array<real, 2>(column_group.x, column_group.y);
    }
    return array<real, 2>(column_group.z, column_group.w);
}
