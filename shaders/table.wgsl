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
    first_four: u32,
    share: real,
}

fn segment(spot: Spot, columns: u32, offset: u32) -> Segment {
    return Segment((offset + columns * spot.row) / ABREAST, spot.share);
}

fn beyond(segment: Segment, properties: u32) -> Segment {
    return Segment(segment.first_four + 2u * properties / ABREAST, segment.share);
}

fn value(segment: Segment, property: u32) -> real {
    let under = two(segment, property);
    return under[0] + segment.share * under[1];
}

fn integral(segment: Segment, property: u32) -> real {
    let under = two(segment, property);
    let risen = two(segment, property + 2u);
    let mean = under[0] + 0.5 * segment.share * under[1];
    return risen[0] + TABLE_STEP_K * segment.share * mean;
}

fn two(segment: Segment, property: u32) -> array<real, 2> {
    let column = 2u * property;
    let four = four(segment.first_four + column / ABREAST);
    if column % ABREAST == 0u {
        return array<real, 2>(four.x, four.y);
    }
    return array<real, 2>(four.z, four.w);
}
