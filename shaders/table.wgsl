// Linear interpolation on the uniform temperature grid: twin of src/physics/table.rs. There is one array of tables, as
// WGSL does not pass storage by reference.

struct TableIndex {
    row: u32,
    fraction: real,
}

fn spot(temperature_k: real) -> TableIndex {
    let position = temperature_k * real(1.0 / TABLE_STEP_K);
    let row = min(u32(clamp(position, 0.0, real(TABLE_NODES))), TABLE_NODES - 2u);
    return TableIndex(row, position - real(row));
}

struct TableSegment {
    first_four: u32,
    fraction: real,
}

fn segment(spot: TableIndex, columns: u32, offset: u32) -> TableSegment {
    return TableSegment((offset + columns * spot.row) / ABREAST, spot.fraction);
}

fn beyond(segment: TableSegment, properties: u32) -> TableSegment {
    return TableSegment(segment.first_four + 2u * properties / ABREAST, segment.fraction);
}

fn value(segment: TableSegment, property: u32) -> real {
    let pair = two(segment, property);
    return pair[0] + segment.fraction * pair[1];
}

fn integral(segment: TableSegment, property: u32) -> real {
    let pair = two(segment, property);
    let integrated = two(segment, property + 2u);
    let mean = pair[0] + 0.5 * segment.fraction * pair[1];
    return integrated[0] + TABLE_STEP_K * segment.fraction * mean;
}

fn two(segment: TableSegment, property: u32) -> array<real, 2> {
    let column = 2u * property;
    let four = four(segment.first_four + column / ABREAST);
    if column % ABREAST == 0u {
        return array<real, 2>(four.x, four.y);
    }
    return array<real, 2>(four.z, four.w);
}
