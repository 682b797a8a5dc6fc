//! Exponential, logarithm and powers for reaction rates.
//!
//! WGSL has no reliable f64 versions, and libraries round differently in f32. Sums and products in a stated order make
//! both twins agree in both precisions.

use super::Real;
use super::compensated::opaque;

pub(super) const LOG2_E: f64 = std::f64::consts::LOG2_E;
/// ln 2 in two parts (Cody and Waite); integer multiples of the first are exact in f32.
pub(super) const LN_2_HIGH: f64 = 0.693_145_751_953_125;
pub(super) const LN_2_LOW: f64 = 1.428_606_820_309_417_2e-6;
/// Arguments are clamped to ± this value: e⁻⁸⁰ = 2⁻¹¹⁵ is far below any rate that matters.
pub(super) const EXP_ARGUMENT_MAX: f64 = 80.0;
/// Coefficients of `(eˣ − 1)/x` on ±ln 2 / 2, lowest power first: minimax in the relative error (Remez exchange, 50
/// digits). Error after rounding 2.1e-17 in f64 and 2.3e-8 in f32, less than half the rounding of the sum. A Taylor
/// series needs two more terms.
pub(super) const SERIES_F64: [f64; 11] = [
    1.0,
    0.500_000_000_000_000_6,
    0.166_666_666_666_665_63,
    0.041_666_666_666_573_905,
    0.008_333_333_333_397_834,
    0.001_388_888_893_225_888_2,
    0.000_198_412_697_074_672_23,
    2.480_150_460_214_848e-5,
    2.755_741_478_996_597_4e-6,
    2.762_626_278_810_536e-7,
    2.505_209_632_569_198e-8,
];
pub(super) const SERIES_F32: [f64; 6] = [
    1.0,
    0.499_999_970_197_677_6,
    0.166_665_062_308_311_46,
    0.041_667_137_295_007_706,
    0.008_369_068_615_138_53,
    0.001_388_887_292_705_476_3,
];

/// eˣ = 2ⁿ eʳ with the reduced argument |r| ≤ ½ ln 2: the factor 2ⁿ, and eʳ − 1, below 0.42 in magnitude.
#[derive(Clone, Copy)]
pub struct ExpParts<R> {
    pub power_of_two: R,
    pub reduced_expm1: R,
}

/// Two terms of a series, divided by the power of the first.
#[inline(always)]
fn two_terms<R: Real>(terms: &[f64], rest: R) -> R {
    opaque(rest * R::constant_from_f64(terms[1])) + R::constant_from_f64(terms[0])
}

/// Four terms of a series, divided by the power of the first.
#[inline(always)]
fn four_terms<R: Real>(terms: &[f64], rest: R, square: R) -> R {
    two_terms(terms, rest) + opaque(two_terms(&terms[2..], rest) * square)
}

/// The two parts of eˣ, x clamped to ±80. Estrin's scheme: independent pairs of terms. In Horner's scheme each term
/// waits for the one before, and most of the time of a reacting cell was that wait.
#[inline(always)]
pub fn exp_parts<R: Real>(x: R) -> ExpParts<R> {
    let bounded = x.max(R::from_f64(-EXP_ARGUMENT_MAX)).min(R::from_f64(EXP_ARGUMENT_MAX));
    let exponent = (bounded * R::constant_from_f64(LOG2_E)).round_ties_even();
    let rest = opaque(bounded - exponent * R::constant_from_f64(LN_2_HIGH)) - exponent * R::constant_from_f64(LN_2_LOW);
    let square = opaque(rest * rest);
    let fourth = opaque(square * square);
    let sum = if R::MANTISSA_BITS > 23 {
        let low = four_terms(&SERIES_F64, rest, square) + opaque(four_terms(&SERIES_F64[4..], rest, square) * fourth);
        let high = two_terms(&SERIES_F64[8..], rest) + opaque(square * R::constant_from_f64(SERIES_F64[10]));
        low + opaque(high * opaque(fourth * fourth))
    } else {
        four_terms(&SERIES_F32, rest, square) + opaque(two_terms(&SERIES_F32[4..], rest) * fourth)
    };
    ExpParts { power_of_two: exponent.power_of_two(), reduced_expm1: opaque(sum * rest) }
}

/// eˣ.
#[inline(always)]
pub fn exponential<R: Real>(x: R) -> R {
    let parts = exp_parts(x);
    (parts.reduced_expm1 + R::constant_from_f64(1.0)) * parts.power_of_two
}

/// `1 − e⁻ˣ`, accurate for small x.
#[inline(always)]
pub fn decay<R: Real>(x: R) -> R {
    let parts = exp_parts(-x);
    (R::from_f64(1.0) - parts.power_of_two) - parts.power_of_two * parts.reduced_expm1
}

/// ln x for x above the smallest normal f32: a series about the nearest power of two, and one step of Halley's method
/// on eʸ = x, which triples the digits.
#[inline(always)]
pub fn logarithm<R: Real>(x: R) -> R {
    let exponent = x.exponent();
    let mantissa = x.mantissa();
    let s = (mantissa - R::from_f64(1.0)) / (mantissa + R::from_f64(1.0));
    let square = s * s;
    let mut sum = R::from_f64(1.0 / 11.0);
    for n in 1..6 {
        sum = opaque(sum * square) + R::from_f64(1.0 / f64::from(11 - 2 * n));
    }
    let near = exponent * R::from_f64(std::f64::consts::LN_2) + opaque((s + s) * sum);
    let back = exponential(near);
    near + (x - back) * R::from_f64(2.0) / (x + back)
}

/// xᵐ for x ≥ 0; x below 1e-30 counts as 1e-30.
#[inline(always)]
pub fn power<R: Real>(x: R, m: R) -> R {
    exponential(m * logarithm(x.max(R::from_f64(1e-30))))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest relative error of a function on `least`…80, in units of the last place of one.
    fn relative_error_ulp<R: Real>(least: f64, function: impl Fn(R) -> R, exact: impl Fn(f64) -> f64) -> f64 {
        let error = |step: i32| {
            let x = R::from_f64(least + (80.0 - least) * f64::from(step) / 1e5);
            let exact = exact(x.lane(0));
            (function(x).lane(0) / exact - 1.0).abs() * f64::from(R::MANTISSA_BITS).exp2()
        };
        (0..=100_000).map(error).fold(0.0, f64::max)
    }

    /// Allowed error, units of the last place: the rounding of the last sum and of its parts.
    const MAX_ERROR_ULP: f64 = 3.0;

    fn assert_accuracy<R: Real>() {
        let exponentials = relative_error_ulp::<R>(-80.0, exponential, f64::exp);
        assert!(exponentials <= MAX_ERROR_ULP, "eˣ: error {exponentials:.1} ulp");
        let decays = relative_error_ulp::<R>(1e-7, decay, |x| -(-x).exp_m1());
        assert!(decays <= MAX_ERROR_ULP, "1 − e⁻ˣ: error {decays:.1} ulp");
        let inaccurate = |x: R| exponential(x) * R::from_f64(1.0 + 8.0 * (-f64::from(R::MANTISSA_BITS)).exp2());
        assert!(relative_error_ulp::<R>(-80.0, inaccurate, f64::exp) > MAX_ERROR_ULP, "an error of eight ulp passed");
    }

    #[test]
    fn exponential_and_decay_are_accurate_to_three_ulp_in_both_precisions() {
        assert_accuracy::<f64>();
        assert_accuracy::<f32>();
    }
}
