// Heat flux through an open face, positive into the layup: twin of src/physics/surface_flux.rs.

struct FaceScale {
    heating: real,
    film: real,
    exchange: real,
    emissivity: real,
}

struct SurfaceFlux {
    flux: real,
    slope: real,
}

fn face_scale(scaling: FaceColumns) -> FaceScale {
    return FaceScale(
        column(scaling.heating),
        column(scaling.film),
        column(scaling.exchange),
        column(scaling.emissivity),
    );
}

fn blowing_share(film_kg_m2_s: real, twice_blowing_kg_m2_s: real) -> real {
    let ratio = twice_blowing_kg_m2_s / max(film_kg_m2_s, real(1e-12));
    let outward = ge_mask(ratio, 0.0);
    let size = min(ratio * (outward + outward - 1.0), 60.0);
    let decay = exponential(-size);
    return (decay + (1.0 - outward) * (1.0 - decay)) / mean_decay(size);
}

fn surface_flux(
    forcing: BoundaryForcing,
    scale: FaceScale,
    temperature_k: real,
    emissivity: real,
    enthalpy_j_kg: real,
    enthalpy_slope_j_kg_k: real,
    blown_kg_m2_s: real,
) -> SurfaceFlux {
    let capped_emissivity = min(scale.emissivity * emissivity, 1.0);
    let hot_wall = forcing.hot_wall;
    var convected = scale.heating * forcing.convection;
    if forcing.blowing != 0.0 {
        convected = convected * blowing_share(convected * hot_wall, forcing.blowing * blown_kg_m2_s);
    }
    let film = scale.film * forcing.film_w_m2_k;
    let radiance = scale.exchange * capped_emissivity * real(STEFAN_BOLTZMANN);
    let surroundings = forcing.surroundings_k;
    let square = temperature_k * temperature_k;
    let surroundings_square = surroundings * surroundings;
    var flux = convected * (forcing.recovery - hot_wall * enthalpy_j_kg);
    flux = flux + scale.heating * capped_emissivity * forcing.radiant_w_m2;
    flux = flux + film * (forcing.gas_k - temperature_k);
    flux = flux + radiance * (surroundings_square * surroundings_square - square * square);
    var slope = -(convected * hot_wall * enthalpy_slope_j_kg_k);
    slope = slope - film;
    slope = slope - 4.0 * radiance * square * temperature_k;
    return SurfaceFlux(flux, slope);
}
