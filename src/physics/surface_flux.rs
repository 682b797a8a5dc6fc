//! Heat flux through an open face, positive into the layup.
//!
//! `q = f_h (c (r − w Δh_w) + ε q_rad) + f_f h (T_g − T) + f_x ε σ (T_s⁴ − T⁴)`, where Δh_w is the enthalpy of air at
//! the wall above that at the cold wall. Of a cold-wall flux c, r is 1 and `w = 1/(h_r − h_w(T_cw))` is the hot-wall
//! correction, so that c w is a film coefficient of an enthalpy difference (kg/m²/s). Where c is such a coefficient
//! itself, r is `h_r − h_w(T_cw)` and w is 1. Fourth powers are squares of squares in both twins.

use super::Real;
use super::decomposition::mean_decay;
use super::exponential::exponential;
use crate::layout::{BoundaryForcing, FaceColumns};

/// Stefan–Boltzmann constant, W/m²/K⁴ (CODATA 2018).
pub const STEFAN_BOLTZMANN: f64 = 5.670374419e-8;

/// Factors of one member on a face.
#[derive(Clone, Copy)]
pub struct FaceScale<R> {
    pub heating: R,
    pub film: R,
    pub exchange: R,
    pub emissivity: R,
}

/// Heat flux (W/m²) and its derivative by the surface temperature (W/m²/K).
#[derive(Clone, Copy)]
pub struct SurfaceFlux<R> {
    pub flux: R,
    pub slope: R,
}

/// The factors of a face from a member's columns.
#[inline(always)]
pub fn face_scale<R: Real>(scaling: &FaceColumns<u32>, column: impl Fn(u32) -> R) -> FaceScale<R> {
    FaceScale {
        heating: column(scaling.heating),
        film: column(scaling.film),
        exchange: column(scaling.exchange),
        emissivity: column(scaling.emissivity),
    }
}

/// Blowing correction: share of a film coefficient C (kg/m²/s) that remains at a gas mass flux out, `φ/(eᶲ − 1)` with φ
/// = 2λ × mass flux / C. Equal to `ln(1 + 2λB')/(2λB')` with B' by the reduced coefficient.
#[inline(always)]
pub fn blowing_share<R: Real>(film_kg_m2_s: R, twice_blowing_kg_m2_s: R) -> R {
    let zero = R::from_f64(0.0);
    let ratio = twice_blowing_kg_m2_s / film_kg_m2_s.max(R::from_f64(1e-12));
    let outward = ratio.ge_mask(zero);
    // |ratio| by its sign, not by a maximum: the share is smooth at zero mass flux, and its derivative there is that of
    // outflow.
    let size = (ratio * (outward + outward - R::from_f64(1.0))).min(R::from_f64(60.0));
    let decay = exponential(-size);
    (decay + (R::from_f64(1.0) - outward) * (R::from_f64(1.0) - decay)) / mean_decay(size)
}

/// Heat flux into the layup at a surface temperature. The slope leaves out the small one of the emissivity; the scheme
/// keeps its order with any slope.
#[inline(always)]
pub fn surface_flux<R: Real>(
    forcing: BoundaryForcing<R::Scalar>,
    scale: FaceScale<R>,
    temperature_k: R,
    emissivity: R,
    enthalpy_j_kg: R,
    enthalpy_slope_j_kg_k: R,
    blown_kg_m2_s: R,
) -> SurfaceFlux<R> {
    // No surface emits more than a black one, whatever a factor or an extrapolated table says.
    let capped_emissivity = (scale.emissivity * emissivity).min(R::from_f64(1.0));
    let hot_wall = R::splat(forcing.hot_wall);
    let mut convected = scale.heating * R::splat(forcing.convection);
    if forcing.blowing != R::scalar(0.0) {
        convected = convected * blowing_share(convected * hot_wall, R::splat(forcing.blowing) * blown_kg_m2_s);
    }
    let film = scale.film * R::splat(forcing.film_w_m2_k);
    let radiance = scale.exchange * capped_emissivity * R::from_f64(STEFAN_BOLTZMANN);
    let surroundings = R::splat(forcing.surroundings_k);
    let square = temperature_k * temperature_k;
    let surroundings_square = surroundings * surroundings;
    let mut flux = convected * (R::splat(forcing.recovery) - hot_wall * enthalpy_j_kg);
    flux = flux + scale.heating * capped_emissivity * R::splat(forcing.radiant_w_m2);
    flux = flux + film * (R::splat(forcing.gas_k) - temperature_k);
    flux = flux + radiance * (surroundings_square * surroundings_square - square * square);
    let mut slope = -(convected * hot_wall * enthalpy_slope_j_kg_k);
    slope = slope - film;
    slope = slope - R::from_f64(4.0) * radiance * square * temperature_k;
    SurfaceFlux { flux, slope }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Dual;
    use crate::lanes::F64Lanes;
    use simdeez::engines::scalar::Scalar;

    /// A value and its tangent in one direction.
    type OneDirection = Dual<f64, F64Lanes<Scalar>>;

    #[test]
    fn weak_blowing_reduces_the_film_coefficient_by_half_of_phi() {
        // ln(1 + 2λB')/(2λB') and its inverse begin as 1 − φ/2, for outflow and inflow.
        let film = 0.03;
        let gas = OneDirection::from_lanes(|lane| lane as f64);
        let share = blowing_share(OneDirection::from_f64(film), gas);
        assert_eq!(share.lane(0), 1.0);
        assert!((share.lane(1) * film + 0.5).abs() < 1e-12, "{}", share.lane(1) * film);
        let central_difference = (blowing_share(film, 1e-6) - blowing_share(film, -1e-6)) / 2e-6;
        assert!((share.lane(1) / central_difference - 1.0).abs() < 1e-6, "{central_difference}");
    }

    #[test]
    fn mean_decay_has_the_exact_derivative_where_its_two_forms_meet() {
        let at = |x: f64| mean_decay(OneDirection::from_lanes(|lane| if lane == 0 { x } else { 1.0 })).lane(1);
        let exact = |x: f64| ((1.0 + x) * (-x).exp() - 1.0) / (x * x);
        for x in [0.499, 0.5, 0.501] {
            assert!((at(x) / exact(x) - 1.0).abs() < 1e-12, "at {x}: {} and {}", at(x), exact(x));
        }
    }
}
