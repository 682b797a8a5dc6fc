//! Heat through an open face, positive into the layup.
//!
//! `q = f_h (q_cw (1 − w Δh_w) + ε q_rad) + f_f h (T_g − T) + f_x ε σ (T_s⁴ − T⁴)`, where Δh_w is the
//! enthalpy of air at the wall over that at the cold wall and `w = 1/(h_r − h_w(T_cw))` corrects a
//! cold-wall flux for a hot wall. Fourth powers are squares of squares in both twins.

use super::Real;
use super::decomposition::mean_decay;
use super::exponential::exponential;
use crate::plan::layout::{Drive, Face, Scaling};

/// Stefan–Boltzmann constant, W/m²/K⁴ (CODATA 2018).
pub const STEFAN_BOLTZMANN: f64 = 5.670374419e-8;

/// What one member's factors make of a face.
#[derive(Clone, Copy)]
pub struct FaceScale<R> {
    pub heating: R,
    pub film: R,
    pub exchange: R,
    pub emissivity: R,
}

/// Heat flux and its derivative by the face's temperature, W/m² and W/m²/K.
#[derive(Clone, Copy)]
pub struct FaceFlux<R> {
    pub flux: R,
    pub slope: R,
}

/// The scales of a face from a member's columns.
#[inline(always)]
pub fn face_scale<R: Real>(scaling: &Scaling<u32>, column: impl Fn(u32) -> R) -> FaceScale<R> {
    FaceScale {
        heating: column(scaling.heating),
        film: column(scaling.film),
        exchange: column(scaling.exchange),
        emissivity: column(scaling.emissivity),
    }
}

/// Share that blowing leaves of a film coefficient C (kg/m²/s) against 2λ times the gas flux out: `φ/(eᶲ − 1)` with φ
/// their ratio. It is `ln(1 + 2λB')/(2λB')` with B' in terms of the reduced coefficient, solved for it.
#[inline(always)]
pub fn blown<R: Real>(film_kg_m2_s: R, twice_blowing_kg_m2_s: R) -> R {
    let zero = R::constant(0.0);
    let ratio = twice_blowing_kg_m2_s / film_kg_m2_s.max(R::constant(1e-12));
    let size = ratio.max(-ratio).min(R::constant(60.0));
    let outward = ratio.reached(zero);
    let decay = exponential(-size);
    (decay + (R::constant(1.0) - outward) * (R::constant(1.0) - decay)) / mean_decay(size)
}

/// Heat flux into the layup at a temperature. The slope leaves out that of the emissivity, which is slight;
/// the scheme keeps its order with any slope.
#[inline(always)]
pub fn face_flux<R: Real>(
    drive: Drive<R::Scalar>,
    face: Face<R::Scalar>,
    scale: FaceScale<R>,
    temperature_k: R,
    emissivity: R,
    enthalpy_j_kg: R,
    enthalpy_slope_j_kg_k: R,
    blown_kg_m2_s: R,
) -> FaceFlux<R> {
    let emission = scale.emissivity * emissivity;
    let hot_wall = R::of(face.hot_wall_kg_j);
    let mut convected = scale.heating * R::of(drive.flux_w_m2);
    if face.blowing != R::scalar(0.0) {
        convected = convected * blown(convected * hot_wall, R::of(face.blowing) * blown_kg_m2_s);
    }
    let film = scale.film * R::of(face.film_w_m2_k);
    let radiance = scale.exchange * emission * R::constant(STEFAN_BOLTZMANN);
    let surroundings = R::of(drive.surroundings_k);
    let square = temperature_k * temperature_k;
    let surroundings_square = surroundings * surroundings;
    let mut flux = convected * (R::constant(1.0) - hot_wall * enthalpy_j_kg);
    flux = flux + scale.heating * emission * R::of(drive.radiant_w_m2);
    flux = flux + film * (R::of(drive.gas_k) - temperature_k);
    flux = flux + radiance * (surroundings_square * surroundings_square - square * square);
    let mut slope = -(convected * hot_wall * enthalpy_slope_j_kg_k);
    slope = slope - film;
    slope = slope - R::constant(4.0) * radiance * square * temperature_k;
    FaceFlux { flux, slope }
}
