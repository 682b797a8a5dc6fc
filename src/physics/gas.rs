//! Gas in pores: storage and Darcy's law.
//!
//! Ideal gas with Klinkenberg slip, per area of layup, positive upwards to the hot face:
//!
//! ```text
//! G = (M/RT) (K/μ) (p + b) dp/dx,    b = slip T
//! ```
//!
//! With equal mobility on both sides G is the difference of (p + b)²/2, which the mean pressure on a face gives
//! exactly. Forchheimer's inertia divides it by `(1 + √(1 + 4 β ρ K² |dp/dx|/μ²))/2`, the root of `−dp/dx = μ q/K + β ρ
//! q²`.

use super::Real;
use super::compensated::difference;
use super::double_word::DoubleWord;

/// Storage and mobility of the gas in a cell's pores.
#[derive(Clone, Copy)]
pub struct PoreState<R> {
    /// Mass over pressure, `w ε M/RT`, kg/m²/Pa.
    pub storage: R,
    /// `K M/(R T μ)`, s.
    pub mobility_s: R,
    /// Klinkenberg's b, Pa.
    pub slip_pa: R,
    /// `4 β K² M/(R T μ²)`, m/Pa². Inertia matters where this times `p dp/dx` is near one.
    pub inertia_m_pa2: R,
}

/// Upward mass flux through a face (kg/m²/s) and its slopes by the pressures above (negated) and below (kg/m²/s/Pa).
#[derive(Clone, Copy)]
pub struct GasFlux<R> {
    pub flux: R,
    pub above: R,
    pub below: R,
}

/// Mean of the pores at the start and at the end of a step, for fluxes, which do not depend on the storage.
#[inline(always)]
pub fn midpoint_pores<R: Real>(start: PoreState<R>, end: PoreState<R>) -> PoreState<R> {
    let half = R::from_f64(0.5);
    PoreState {
        storage: start.storage,
        mobility_s: half * (start.mobility_s + end.mobility_s),
        slip_pa: half * (start.slip_pa + end.slip_pa),
        inertia_m_pa2: half * (start.inertia_m_pa2 + end.inertia_m_pa2),
    }
}

/// Mass flux through the face between two cells: half a cell of each in series.
#[inline(always)]
pub fn gas_flux<R: Real>(
    upper: PoreState<R>,
    upper_m: R,
    upper_pa: DoubleWord<R>,
    lower: PoreState<R>,
    lower_m: R,
    lower_pa: DoubleWord<R>,
) -> GasFlux<R> {
    let tiny = R::from_f64(1e-30);
    // The increment of a stage lies in the low words.
    let mean_pa = R::from_f64(0.5) * ((upper_pa.high + upper_pa.low()) + (lower_pa.high + lower_pa.low()));
    let drop_pa = difference(lower_pa, upper_pa);
    let gradient = drop_pa.max(-drop_pa) / (upper_m + lower_m);
    let inertia = R::from_f64(0.5) * (upper.inertia_m_pa2 + lower.inertia_m_pa2);
    let inertia_root = R::from_f64(1.0) + (R::from_f64(1.0) + inertia * mean_pa * gradient).sqrt();
    let inertia_factor = R::from_f64(2.0) / inertia_root;
    let above_pa = mean_pa + upper.slip_pa;
    let below_pa = mean_pa + lower.slip_pa;
    let above = upper.mobility_s * above_pa;
    let below = lower.mobility_s * below_pa;
    // Mobilities of sealed plies are zero, and so is the flux.
    let resistance = upper_m * below + lower_m * above;
    let conductance = inertia_factor * above * (below / resistance.max(tiny));
    // Relative slope of the conductance by the mean pressure, 1/Pa.
    let gain = (upper_m * below / above_pa + lower_m * above / below_pa) / resistance.max(tiny);
    let half = R::from_f64(0.5) * conductance * gain * drop_pa;
    let zero = R::from_f64(0.0);
    GasFlux {
        flux: conductance * drop_pa,
        above: (conductance - half).max(zero),
        below: (conductance + half).max(zero),
    }
}
