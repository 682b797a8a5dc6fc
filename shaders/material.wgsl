// Properties of a ply as one member scales them: twin of src/physics/material.rs.

struct PlyScale {
    density_kg_m3: real,
    heat_capacity: real,
    mass_kg_m3: real,
    thickness: real,
    pre_exponential: real,
    activation: real,
    pyrolysis_heat: real,
    loss: real,
    per_loss: real,
    permeability: real,
    holder_w_m3_k: real,
}

struct ConductivityParts {
    solid: real,
    gas: real,
    radiative: real,
}

fn times(whole: ConductivityParts, many: real, parts: u32) -> ConductivityParts {
    var product = whole;
    product.solid = many * whole.solid;
    if PARTS > 1u && parts > 1u {
        product.radiative = many * whole.radiative;
        if PARTS == 3u && parts == 3u {
            product.gas = many * whole.gas;
        }
    }
    return product;
}

fn plus(whole: ConductivityParts, more: ConductivityParts, parts: u32) -> ConductivityParts {
    var sum = whole;
    sum.solid = whole.solid + more.solid;
    if PARTS > 1u && parts > 1u {
        sum.radiative = whole.radiative + more.radiative;
        if PARTS == 3u && parts == 3u {
            sum.gas = whole.gas + more.gas;
        }
    }
    return sum;
}

struct StateScale {
    conductivity: ConductivityParts,
    remains: real,
    enthalpy_scale: real,
    formation_j_kg: real,
}

fn less(own: StateScale, virgin: StateScale) -> StateScale {
    return StateScale(
        ConductivityParts(
            own.conductivity.solid - virgin.conductivity.solid,
            own.conductivity.gas - virgin.conductivity.gas,
            own.conductivity.radiative - virgin.conductivity.radiative,
        ),
        own.remains - virgin.remains,
        own.enthalpy_scale - virgin.enthalpy_scale,
        own.formation_j_kg - virgin.formation_j_kg,
    );
}

struct PressureIndex {
    level_below: u32,
    fraction: real,
}

fn ply_scale(ply: Ply, bulk: BulkProperties, char: StateProperties) -> PlyScale {
    let thickness = column(ply.thickness);
    let density = bulk.density_kg_m3 * column(ply.density);
    let remains = char.remains;
    let loss = (1.0 - column(ply.char_yield) * remains) / max(1.0 - remains, real(1e-6));
    return PlyScale(
        density * column(ply.heat_capacity) * thickness,
        column(ply.heat_capacity),
        density * thickness,
        thickness,
        column(ply.pre_exponential),
        column(ply.activation),
        column(ply.pyrolysis_heat),
        loss,
        1.0 / max(loss * (1.0 - remains), real(1e-6)),
        column(ply.permeability) / thickness,
        bulk.holder_w_m3_k * column(ply.holder) * thickness,
    );
}

fn state_scale(
    row: ConductivityColumns,
    substance: StateProperties,
    bulk: BulkProperties,
    ply: PlyScale,
) -> StateScale {
    let remains = opaque(1.0 - ply.loss * (1.0 - substance.remains));
    let weight = select(remains, 1.0, bulk.by_volume == 1.0);
    let whole = weight * (substance.conductivity * column(row.whole) / ply.thickness);
    return StateScale(
        ConductivityParts(
            whole * column(row.solid),
            whole * column(row.gas),
            whole * column(row.radiative) / column(row.extinction),
        ),
        remains,
        remains * (ply.heat_capacity * substance.heat_capacity),
        remains * substance.formation_j_kg,
    );
}

fn at_pressure_levels(at: TableIndex, rows: u32, pressure: PressureIndex) -> array<TableIndex, 2> {
    let under = pressure.level_below * rows + at.row;
    return array<TableIndex, 2>(TableIndex(under, at.fraction), TableIndex(under + rows, at.fraction));
}

struct SolidProperties {
    conductivity: real,
    slope: real,
    heat_capacity: real,
}

fn solid_properties(here: TableSegment, parts: u32, scale: ConductivityParts, with_slope: bool) -> SolidProperties {
    var conductivity = scale.solid * interpolate(here, 0u);
    var slope = real(0.0);
    if with_slope {
        slope = scale.solid * interpolate(here, 2u);
    }
    if PARTS > 1u && parts > 1u {
        if PARTS == 3u && parts == 3u {
            conductivity = conductivity + scale.gas * interpolate(here, 6u);
        }
        conductivity = conductivity + scale.radiative * interpolate(here, 4u);
        if with_slope {
            if PARTS == 3u && parts == 3u {
                slope = slope + scale.gas * interpolate(here, 7u);
            }
            slope = slope + scale.radiative * interpolate(here, 5u);
        }
    }
    return SolidProperties(conductivity, slope, interpolate(here, 1u));
}

fn conductance_within(conductivity: real, next: real, half_over_next_1_m: real) -> real {
    return (conductivity + next) * half_over_next_1_m;
}

fn conductance_across(conductivity: real, below_m: real, next: real, above_m: real, contact_m2_k_w: real) -> real {
    let both = conductivity * next;
    return both / (below_m * next + above_m * conductivity + contact_m2_k_w * both);
}

fn conductance_slope_across(conductance: real, conductivity: real, length_m: real) -> real {
    let ratio = conductance / conductivity;
    return ratio * ratio * length_m;
}

fn flux_slopes(conductance: real, conductivity_slopes: array<real, 2>) -> array<real, 2> {
    return array<real, 2>(
        max(conductance + conductivity_slopes[0], 0.0),
        max(conductance - conductivity_slopes[1], 0.0),
    );
}
