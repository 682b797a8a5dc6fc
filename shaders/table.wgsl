// Look-up in tables on the uniform temperature grid: twin of src/physics/table.rs.
// There is one array of tables, as WGSL passes no storage by reference.

struct Spot {
    row: u32,
    share: real,
}

fn spot(temperature_k: real) -> Spot {
    let position = temperature_k * real(1.0 / TABLE_STEP_K);
    let row = min(u32(clamp(position, 0.0, real(TABLE_NODES))), TABLE_NODES - 2u);
    return Spot(row, position - real(row));
}

struct Segment {
    first: u32,
    columns: u32,
    share: real,
}

fn segment(spot: Spot, columns: u32, offset: u32) -> Segment {
    return Segment(offset + columns * spot.row, columns, spot.share);
}

fn value(segment: Segment, column: u32) -> real {
    let under = tables[segment.first + column];
    let over = tables[segment.first + segment.columns + column];
    return under + segment.share * (over - under);
}

fn integral(segment: Segment, column: u32) -> real {
    let under = tables[segment.first + column];
    let over = tables[segment.first + segment.columns + column];
    let mean = under + 0.5 * segment.share * (over - under);
    return tables[segment.first + column + 1u] + TABLE_STEP_K * segment.share * mean;
}
