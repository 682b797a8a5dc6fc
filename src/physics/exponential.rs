//! Exponential, logarithm and powers for reaction rates.
//!
//! WGSL has no reliable f64 versions, and libraries round differently in f32. Sums and products in a stated order make
//! both twins agree in both precisions.

use super::Real;
use super::compensated::keep;

pub(super) const LOG2_E: f64 = std::f64::consts::LOG2_E;
/// ln 2 in two parts (Cody and Waite); integer multiples of the first are exact in f32.
pub(super) const LN_2_HIGH: f64 = 0.693_145_751_953_125;
pub(super) const LN_2_LOW: f64 = 1.428_606_820_309_417_2e-6;
/// Arguments are clamped to ± this value: e⁻⁸⁰ = 2⁻¹¹⁵ is far below any rate that matters.
pub(super) const LARGEST: f64 = 80.0;
/// Coefficients of `(eˣ − 1)/x` on ±ln 2 / 2, lowest power first: minimax in the relative error (Remez exchange, 50
/// digits). Error after rounding 2.1e-17 in f64 and 2.3e-8 in f32, less than half the rounding of the sum. A Taylor
/// series needs two more terms.
pub(super) const SERIES: [f64; 11] = [
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
pub(super) const SHORT_SERIES: [f64; 6] = [
    1.0,
    0.499_999_970_197_677_6,
    0.166_665_062_308_311_46,
    0.041_667_137_295_007_706,
    0.008_369_068_615_138_53,
    0.001_388_887_292_705_476_3,
];

/// eˣ = `2ⁿ (1 + part)`, |part| < 0.42.
#[derive(Clone, Copy)]
pub struct Power<R> {
    pub two_to: R,
    pub part: R,
}

/// Two terms of a series, divided by the power of the first.
#[inline(always)]
fn two_terms<R: Real>(terms: &[f64], rest: R) -> R {
    keep(rest * R::fixed(terms[1])) + R::fixed(terms[0])
}

/// Four terms of a series, divided by the power of the first.
#[inline(always)]
fn four_terms<R: Real>(terms: &[f64], rest: R, square: R) -> R {
    two_terms(terms, rest) + keep(two_terms(&terms[2..], rest) * square)
}

/// The two parts of eˣ, x clamped to ±80. Estrin's scheme: independent pairs of terms. In Horner's scheme each term
/// waits for the one before, and most of the time of a reacting cell was that wait.
#[inline(always)]
pub fn power_of_e<R: Real>(x: R) -> Power<R> {
    let bounded = x.max(R::constant(-LARGEST)).min(R::constant(LARGEST));
    let exponent = (bounded * R::fixed(LOG2_E)).nearest();
    let rest = keep(bounded - exponent * R::fixed(LN_2_HIGH)) - exponent * R::fixed(LN_2_LOW);
    let square = keep(rest * rest);
    let fourth = keep(square * square);
    let sum = if R::DIGITS > 23 {
        let low = four_terms(&SERIES, rest, square) + keep(four_terms(&SERIES[4..], rest, square) * fourth);
        let high = two_terms(&SERIES[8..], rest) + keep(square * R::fixed(SERIES[10]));
        low + keep(high * keep(fourth * fourth))
    } else {
        four_terms(&SHORT_SERIES, rest, square) + keep(two_terms(&SHORT_SERIES[4..], rest) * fourth)
    };
    Power { two_to: exponent.two_to(), part: keep(sum * rest) }
}

/// eˣ.
#[inline(always)]
pub fn exponential<R: Real>(x: R) -> R {
    let power = power_of_e(x);
    (power.part + R::fixed(1.0)) * power.two_to
}

/// `1 − e⁻ˣ`, accurate for small x.
#[inline(always)]
pub fn decay<R: Real>(x: R) -> R {
    let power = power_of_e(-x);
    (R::constant(1.0) - power.two_to) - power.two_to * power.part
}

/// ln x for x above the smallest normal f32: a series about the nearest power of two, and one step of Halley's method
/// on eʸ = x, which triples the digits.
#[inline(always)]
pub fn logarithm<R: Real>(x: R) -> R {
    let exponent = x.twos();
    let mantissa = x.mantissa();
    let s = (mantissa - R::constant(1.0)) / (mantissa + R::constant(1.0));
    let square = s * s;
    let mut sum = R::constant(1.0 / 11.0);
    for n in 1..6 {
        sum = keep(sum * square) + R::constant(1.0 / f64::from(11 - 2 * n));
    }
    let near = exponent * R::constant(std::f64::consts::LN_2) + keep((s + s) * sum);
    let back = exponential(near);
    near + (x - back) * R::constant(2.0) / (x + back)
}

/// xᵐ for x ≥ 0; x below 1e-30 counts as 1e-30.
#[inline(always)]
pub fn power<R: Real>(x: R, m: R) -> R {
    exponential(m * logarithm(x.max(R::constant(1e-30))))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest relative error of a function on `least`…80, in units of the last place of one.
    fn relative_error_ulp<R: Real>(least: f64, function: impl Fn(R) -> R, exact: impl Fn(f64) -> f64) -> f64 {
        let error = |step: i32| {
            let x = R::constant(least + (80.0 - least) * f64::from(step) / 1e5);
            let exact = exact(x.lane(0));
            (function(x).lane(0) / exact - 1.0).abs() * f64::from(R::DIGITS).exp2()
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
        let inaccurate = |x: R| exponential(x) * R::constant(1.0 + 8.0 * (-f64::from(R::DIGITS)).exp2());
        assert!(relative_error_ulp::<R>(-80.0, inaccurate, f64::exp) > MAX_ERROR_ULP, "an error of eight ulp passed");
    }

    #[test]
    fn exponential_and_decay_are_accurate_to_three_ulp_in_both_precisions() {
        assert_accuracy::<f64>();
        assert_accuracy::<f32>();
    }
}
