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
    let outward = ratio.reached(zero);
    // The magnitude by the sign and not by a maximum: the share is smooth where no gas flows, and its derivative there
    // is that of gas flowing out.
    let size = (ratio * (outward + outward - R::constant(1.0))).min(R::constant(60.0));
    let decay = exponential(-size);
    (decay + (R::constant(1.0) - outward) * (R::constant(1.0) - decay)) / mean_decay(size)
}

/// Heat flux into the layup at a temperature. The slope leaves out that of the emissivity, which is slight;
/// the scheme keeps its order with any slope.
#[expect(clippy::too_many_arguments, reason = "the twin in WGSL takes the same scalars")]
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::dual::Dual;
    use crate::physics::lanes::Doubles;
    use simdeez::engines::scalar::Scalar;

    /// A value and its change along one direction.
    type Along = Dual<f64, Doubles<Scalar>>;

    #[test]
    fn the_first_gas_that_leaves_a_face_takes_half_of_its_share_of_the_film() {
        // ln(1 + 2λB')/(2λB') and its inverse begin as 1 − φ/2, whichever way gas begins to flow.
        let film = 0.03;
        let gas = Along::from_lanes(|lane| lane as f64);
        let share = blown(Along::constant(film), gas);
        assert_eq!(share.lane(0), 1.0);
        assert!((share.lane(1) * film + 0.5).abs() < 1e-12, "{}", share.lane(1) * film);
        let by_differences = (blown(film, 1e-6) - blown(film, -1e-6)) / 2e-6;
        assert!((share.lane(1) / by_differences - 1.0).abs() < 1e-6, "{by_differences}");
    }

    #[test]
    fn the_mean_of_a_decay_has_its_derivative_where_its_two_forms_meet() {
        let at = |x: f64| mean_decay(Along::from_lanes(|lane| if lane == 0 { x } else { 1.0 })).lane(1);
        let exact = |x: f64| ((1.0 + x) * (-x).exp() - 1.0) / (x * x);
        for x in [0.499, 0.5, 0.501] {
            assert!((at(x) / exact(x) - 1.0).abs() < 1e-12, "at {x}: {} and {}", at(x), exact(x));
        }
    }
}
