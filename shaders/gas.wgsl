// Gas in pores: twin of src/physics/gas.rs.

struct PoreState {
    storage: real,
    mobility_s: real,
    slip_pa: real,
    inertia_m_pa2: real,
}

struct GasFlux {
    flux: real,
    above: real,
    below: real,
}

// Fluxes do not depend on the storage.
fn midpoint_pores(start: PoreState, end: PoreState) -> PoreState {
    return PoreState(
        start.storage,
        0.5 * (start.mobility_s + end.mobility_s),
        0.5 * (start.slip_pa + end.slip_pa),
        0.5 * (start.inertia_m_pa2 + end.inertia_m_pa2),
    );
}

fn gas_flux(
    upper: PoreState,
    upper_m: real,
    upper_pa: DoubleWord,
    lower: PoreState,
    lower_m: real,
    lower_pa: DoubleWord,
) -> GasFlux {
    let tiny = real(1e-30);
    let mean_pa = 0.5 * ((upper_pa.high + upper_pa.low) + (lower_pa.high + lower_pa.low));
    let drop_pa = difference(lower_pa, upper_pa);
    let gradient = max(drop_pa, -drop_pa) / (upper_m + lower_m);
    let inertia = 0.5 * (upper.inertia_m_pa2 + lower.inertia_m_pa2);
    let inertia_root = 1.0 + sqrt(1.0 + inertia * mean_pa * gradient);
    let inertia_factor = 2.0 / inertia_root;
    let above_pa = mean_pa + upper.slip_pa;
    let below_pa = mean_pa + lower.slip_pa;
    let above = upper.mobility_s * above_pa;
    let below = lower.mobility_s * below_pa;
    let resistance = upper_m * below + lower_m * above;
    let conductance = inertia_factor * above * (below / max(resistance, tiny));
    let gain = (upper_m * below / above_pa + lower_m * above / below_pa) / max(resistance, tiny);
    let half = 0.5 * conductance * gain * drop_pa;
    return GasFlux(conductance * drop_pa, max(conductance - half, 0.0), max(conductance + half, 0.0));
}
