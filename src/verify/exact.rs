//! Closed forms of one-dimensional conduction; [`kinetics`] and [`darcy`] flow have modules of their own.
//!
//! Slabs are dimensionless: depth ξ = x/L below the heated face, Fourier number Fo = αt/L². Unless stated otherwise the
//! back face (ξ = 1) is insulated and the initial temperature is zero. Sources: Carslaw and Jaeger (1959), chapters 2
//! and 3; Beck, Blackwell and St. Clair (1985), chapter 1, whose case numbers are given (such as X12B10T0).

pub mod darcy;
pub mod kinetics;

use std::f64::consts::PI;
use std::ops::Range;

pub use statrs::function::erf::erfc;

/// Stefan–Boltzmann constant, W/m²/K⁴ (CODATA 2018). Not the constant of the march, which is under test.
const STEFAN_BOLTZMANN: f64 = 5.670374419e-8;
/// Gas constant, J/mol/K (CODATA 2018). Not the constant of the march either.
const GAS_CONSTANT_J_MOL_K: f64 = 8.314462618;

/// Σ term(n, λₙ) exp(−λₙ² Fo) over n = 1, 2, … until the exponential is below rounding.
fn decaying_series(fourier: f64, eigenvalue: impl Fn(f64) -> f64, term: impl Fn(f64, f64) -> f64) -> f64 {
    (1..)
        .map(|n| (f64::from(n), eigenvalue(f64::from(n))))
        .take_while(|(_, lambda)| lambda * lambda * fourier < 45.0)
        .map(|(n, lambda)| term(n, lambda) * (-lambda * lambda * fourier).exp())
        .sum()
}

/// Face temperature one (X12B10T0). Carslaw and Jaeger, §3.3.
pub fn face_temperature_step(fourier: f64, depth: f64) -> f64 {
    1.0 - decaying_series(fourier, |n| (n - 0.5) * PI, |_, lambda| 2.0 / lambda * (lambda * depth).sin())
}

/// Hot face at one, back face at zero (X11B10T0). Carslaw and Jaeger, §3.4.
pub fn both_face_temperatures(fourier: f64, depth: f64) -> f64 {
    1.0 - depth - decaying_series(fourier, |n| n * PI, |_, lambda| 2.0 / lambda * (lambda * depth).sin())
}

/// Constant flux, temperature in units of qL/k (X22B10T0). Carslaw and Jaeger, §3.8.
pub fn constant_flux(fourier: f64, depth: f64) -> f64 {
    let height = 1.0 - depth;
    let modes = decaying_series(
        fourier,
        |n| n * PI,
        |n, lambda| alternating_sign(n) / (lambda * lambda) * (lambda * height).cos(),
    );
    fourier + (3.0 * height * height - 1.0) / 6.0 - 2.0 * modes
}

/// Temperature rise under a constant flux into the hot face and out of the back face, in units of qL/k.
pub fn constant_flux_through(fourier: f64, depth: f64) -> f64 {
    constant_flux(fourier, depth) - constant_flux(fourier, 1.0 - depth)
}

/// Flux that rises as Fo: the integral of [`constant_flux`] over the Fourier number; zero for Fo ≤ 0.
///
/// The steady part of the series is summed in closed form: Σ cos(nz)/n⁴ = π⁴/90 − π²z²/12 + πz³/12 − z⁴/48, with z =
/// πξ.
pub fn ramped_flux(fourier: f64, depth: f64) -> f64 {
    if fourier <= 0.0 {
        return 0.0;
    }
    let height = 1.0 - depth;
    let modes = decaying_series(
        fourier,
        |n| n * PI,
        |n, lambda| alternating_sign(n) / lambda.powi(4) * (lambda * height).cos(),
    );
    let steady = 1.0 / 90.0 - depth * depth / 12.0 + depth.powi(3) / 12.0 - depth.powi(4) / 48.0;
    0.5 * fourier * fourier + fourier * (3.0 * height * height - 1.0) / 6.0 - 2.0 * steady + 2.0 * modes
}

/// Convection to a gas at one, Biot number Bi = hL/k (X32B10T0). Carslaw and Jaeger, §3.10.
pub fn convection(biot: f64, fourier: f64, depth: f64) -> f64 {
    let term = |_, b: f64| 4.0 * b.sin() / (2.0 * b + (2.0 * b).sin()) * (b * (1.0 - depth)).cos();
    1.0 - decaying_series(fourier, |n| convection_eigenvalue(biot, n), term)
}

/// The n-th root of b tan b = Bi, between (n − 1)π and (n − 1/2)π, by bisection.
fn convection_eigenvalue(biot: f64, n: f64) -> f64 {
    let (mut low, mut high) = ((n - 1.0) * PI, (n - 0.5) * PI);
    let below = |b: f64| alternating_sign(n) * (b * b.sin() - biot * b.cos()) > 0.0;
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if below(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// (−1)ⁿ.
fn alternating_sign(n: f64) -> f64 {
    if n % 2.0 == 0.0 { 1.0 } else { -1.0 }
}

/// Half space under a constant flux, K: flux over conductivity (K/m), x and √(αt) in m. Carslaw and Jaeger, §2.9.
pub fn half_space_flux(gradient_k_m: f64, depth_m: f64, reach_m: f64) -> f64 {
    let eta = depth_m / (2.0 * reach_m);
    gradient_k_m * (2.0 * reach_m / PI.sqrt() * (-eta * eta).exp() - depth_m * erfc(eta))
}

/// Half space with convection to a gas at one; film coefficient over conductivity in 1/m. Carslaw and Jaeger, §2.7.
pub fn half_space_convection(film_1_m: f64, depth_m: f64, reach_m: f64) -> f64 {
    let eta = depth_m / (2.0 * reach_m);
    let lift = film_1_m * reach_m;
    erfc(eta) - (film_1_m * depth_m + lift * lift).exp() * erfc(eta + lift)
}

/// Face ξ = 0 held at sin(ω Fo), face ξ = 1 at zero; by Duhamel's integral on the sine series of 1 − ξ.
pub fn sinusoidal_face_temperature(omega: f64, fourier: f64, depth: f64) -> f64 {
    let modes: f64 = (1..4000)
        .map(|n| {
            let lambda = f64::from(n) * PI;
            let rate = lambda * lambda;
            let (sin, cos) = (omega * fourier).sin_cos();
            let swing = rate * cos + omega * sin - rate * (-rate * fourier).exp();
            2.0 / lambda * omega * swing / (rate * rate + omega * omega) * (lambda * depth).sin()
        })
        .sum();
    (1.0 - depth) * (omega * fourier).sin() - modes
}

/// Temperature rise of a Kirchhoff-transformed rise θ for k/k₀ = 1 + b ΔT: the root of θ = ΔT + b ΔT²/2. With ρc ∝ k
/// the transformed equation is linear. Carslaw and Jaeger, §1.6.
pub fn inverse_kirchhoff_k(theta_k: f64, slope_1_k: f64) -> f64 {
    ((1.0 + 2.0 * slope_1_k * theta_k).sqrt() - 1.0) / slope_1_k
}

/// Time in which a plate of a heat capacity (J/m²/K) cools by radiation to its surroundings (K): the integral of
/// C dT/(εσ(T⁴ − T_s⁴)) by partial fractions.
pub fn cooling_time_s(capacity_j_m2_k: f64, emissivity: f64, surroundings_k: f64, from_k: f64, to_k: f64) -> f64 {
    let primitive =
        |t: f64| ((t + surroundings_k) / (t - surroundings_k).abs()).ln() + 2.0 * (t / surroundings_k).atan();
    let scale = 4.0 * emissivity * STEFAN_BOLTZMANN * surroundings_k.powi(3);
    capacity_j_m2_k / scale * (primitive(to_k) - primitive(from_k))
}

/// Time in which a plate heats under an absorbed flux (W/m²) and radiates to surroundings at 0 K.
pub fn heating_time_s(capacity_j_m2_k: f64, emissivity: f64, flux_w_m2: f64, from_k: f64, to_k: f64) -> f64 {
    let end_k = (flux_w_m2 / (emissivity * STEFAN_BOLTZMANN)).powf(0.25);
    let primitive = |t: f64| 0.5 * ((end_k + t) / (end_k - t)).ln() + (t / end_k).atan();
    let scale = 2.0 * emissivity * STEFAN_BOLTZMANN * end_k.powi(3);
    capacity_j_m2_k / scale * (primitive(to_k) - primitive(from_k))
}

/// Steady temperature (K) of a radiating face behind a conductance from a held face, by Newton's method. It converges
/// from the hot side because the balance is convex.
pub fn steady_radiating_face_k(conductance_w_m2_k: f64, held_k: f64, emissivity: f64, surroundings_k: f64) -> f64 {
    let radiance = emissivity * STEFAN_BOLTZMANN;
    (0..50).fold(held_k, |t, _| {
        let excess = radiance * (t.powi(4) - surroundings_k.powi(4)) - conductance_w_m2_k * (held_k - t);
        t - excess / (4.0 * radiance * t.powi(3) + conductance_w_m2_k)
    })
}

/// Radiation of a black body, W/m².
pub fn blackbody_w_m2(temperature_k: f64) -> f64 {
    STEFAN_BOLTZMANN * temperature_k.powi(4)
}

/// Temperature of a lumped plate, K: dT/dt = `rate_k_s(t, T)`, Runge–Kutta in steps of at most 1 s.
pub fn lumped_k(start_k: f64, time_s: f64, rate_k_s: impl Fn(f64, f64) -> f64) -> f64 {
    runge_kutta([start_k], 0.0..time_s, 1.0, |t, [temperature_k]| [rate_k_s(t, temperature_k)])[0]
}

/// The final state of y' = `rate(t, y)` over a time span, by the classical fourth-order Runge–Kutta scheme in equal
/// steps of at most `step_s`.
pub fn runge_kutta<const N: usize>(
    start: [f64; N],
    span_s: Range<f64>,
    step_s: f64,
    rate: impl Fn(f64, [f64; N]) -> [f64; N],
) -> [f64; N] {
    let steps = ((span_s.end - span_s.start) / step_s).ceil() as u32;
    let h = (span_s.end - span_s.start) / f64::from(steps);
    let ahead = |y: [f64; N], reach: f64, slope: [f64; N]| std::array::from_fn(|i| y[i] + reach * slope[i]);
    (0..steps).fold(start, |y, step| {
        let t = span_s.start + f64::from(step) * h;
        let k1 = rate(t, y);
        let k2 = rate(t + 0.5 * h, ahead(y, 0.5 * h, k1));
        let k3 = rate(t + 0.5 * h, ahead(y, 0.5 * h, k2));
        let k4 = rate(t + h, ahead(y, h, k3));
        ahead(y, h / 6.0, std::array::from_fn(|i| k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]))
    })
}

#[cfg(test)]
#[expect(clippy::excessive_precision, reason = "figures are quoted whole, as published")]
mod tests {
    use super::*;

    #[track_caller]
    fn meets(found: f64, expected: f64, tolerance: f64) {
        assert!((found - expected).abs() <= tolerance, "{found} is not {expected}: off by {:e}", found - expected);
    }

    // 18-digit evaluations at 60 s of a slab of 1e-6 m²/s, 0.5 W/m/K, 20 mm from 300 K.
    const FOURIER: f64 = 1e-6 * 60.0 / (0.02 * 0.02);

    #[test]
    fn slab_series_meet_their_tables_of_eighteen_digits() {
        meets(300.0 + 1200.0 * face_temperature_step(FOURIER, 0.1), 1_326.634_403_434_445_25, 1e-10);
        meets(300.0 + 1200.0 * face_temperature_step(FOURIER, 1.0), 462.933_867_977_276_269, 1e-10);
        meets(300.0 + 2000.0 * constant_flux(FOURIER, 0.0), 1_174.177_569_910_697_85, 1e-10);
        meets(300.0 + 2000.0 * constant_flux(FOURIER, 0.5), 516.938_255_190_481_705, 1e-10);
        meets(300.0 + 1200.0 * convection(4.0, FOURIER, 0.0), 1_123.684_317_925_954_44, 1e-10);
        meets(300.0 + 1200.0 * convection(4.0, FOURIER, 1.0), 377.661_045_009_777_979, 1e-10);
        meets(300.0 + 1200.0 * both_face_temperatures(FOURIER, 0.5), 726.174_647_246_172, 1e-9);
        meets(300.0 + 2000.0 * constant_flux_through(FOURIER, 0.2), 750.789_101_944_985, 1e-9);
        meets(20.0 + 100.0 * convection(100.0, 0.1, 0.2), 83.879_649_178_429_5, 1e-10);
        meets(20.0 + 100.0 * convection(0.1, 0.1, 1.0), 20.077_740_933_712_7, 1e-10);
    }

    // The library's erfc has ten digits, four more than the march must reach.
    #[test]
    fn half_space_forms_meet_their_tables_of_eighteen_digits() {
        let reach_m = (1e-6_f64 * 60.0).sqrt();
        meets(300.0 + 1200.0 * erfc(0.005 / (2.0 * reach_m)), 1_077.692_241_766_975_36, 1e-7);
        meets(300.0 + half_space_flux(1e5, 0.0, reach_m), 1_174.038_744_473_663_26, 1e-7);
        meets(300.0 + half_space_flux(1e5, 0.01, reach_m), 514.891_424_200_243_563, 1e-7);
        meets(300.0 + 1200.0 * half_space_convection(200.0, 0.002, reach_m), 978.411_695_209_366_434, 1e-7);
    }

    #[test]
    fn the_triangular_flux_meets_its_table_of_eighteen_digits() {
        let triangle =
            |t: f64, depth| ramped_flux(t, depth) - 2.0 * ramped_flux(t - 0.6, depth) + ramped_flux(t - 1.2, depth);
        meets(triangle(0.6, 0.0), 0.357_832_813_119_502_234, 1e-14);
        meets(triangle(0.9, 0.5), 0.301_284_740_662_303_966, 1e-14);
        meets(triangle(1.8, 1.0), 0.359_945_259_304_291_068, 1e-14);
        meets(triangle(0.05, 0.0), 0.008_410_441_740_119_261_12, 1e-14);
    }

    #[test]
    fn the_kirchhoff_transform_meets_its_table_of_eighteen_digits() {
        meets(
            300.0 + inverse_kirchhoff_k(2000.0 * face_temperature_step(FOURIER, 0.5), 0.002),
            792.446_791_872_476_866,
            1e-10,
        );
        meets(300.0 + inverse_kirchhoff_k(1200.0 * constant_flux(FOURIER, 0.0), 0.002), 680.060_533_114_864_042, 1e-10);
    }

    #[test]
    fn radiating_plates_meet_their_tables_of_eighteen_digits() {
        meets(cooling_time_s(4860.0, 0.9, 300.0, 1200.0, 500.0), 250.942_038_424_200_161, 1e-10);
        meets(cooling_time_s(4860.0, 0.9, 300.0, 1200.0, 1199.0), 0.046_183_186_483_991_650_2, 1e-11);
        meets(heating_time_s(4860.0, 0.9, 50e3, 300.0, 900.0), 78.733_394_712_040_634_3, 1e-11);
        meets(steady_radiating_face_k(556.0, 1000.0, 0.98, 300.0), 927.003_950_452_06, 1e-9);
    }

    // Four thousand modes leave 1e-8.
    #[test]
    fn the_sinusoidal_bar_meets_its_table() {
        let diffusivity = 35.0 / (7200.0 * 440.5);
        let (omega, fourier) = (PI / 40.0 * 0.01 / diffusivity, diffusivity * 32.0 / 0.01);
        meets(100.0 * sinusoidal_face_temperature(omega, fourier, 0.2), 36.603_115_959_085, 1e-7);
        meets(100.0 * sinusoidal_face_temperature(omega, fourier, 0.5), 3.374_239_333_583_9, 1e-7);
    }

    #[test]
    fn the_lumped_integration_meets_the_closed_form() {
        let rate = |_, t: f64| (50e3 - 0.9 * blackbody_w_m2(t)) / 4860.0;
        meets(lumped_k(300.0, heating_time_s(4860.0, 0.9, 50e3, 300.0, 900.0), rate), 900.0, 1e-6);
    }
}
