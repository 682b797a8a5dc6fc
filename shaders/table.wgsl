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

fn look_up(spot: Spot, columns: u32, offset: u32) -> real {
    let under = tables[offset + columns * spot.row];
    let over = tables[offset + columns * spot.row + columns];
    return under + spot.share * (over - under);
}

fn integral(spot: Spot, columns: u32, offset: u32) -> real {
    let under = tables[offset + columns * spot.row];
    let over = tables[offset + columns * spot.row + columns];
    let mean = under + 0.5 * spot.share * (over - under);
    return tables[offset + columns * spot.row + 1u] + TABLE_STEP_K * spot.share * mean;
}
