//! Exponential, logarithm and powers of our own, for the rates of reactions.
//!
//! Shaders have none in f64 that can be trusted, and no two libraries round alike in f32; with sums and
//! products in a stated order both twins agree in both precisions.

use super::Real;
use super::compensated::keep;

pub(super) const LOG2_E: f64 = std::f64::consts::LOG2_E;
/// ln 2 in two parts, the first short enough that its whole multiples are exact in f32.
pub(super) const LN_2_HIGH: f64 = 0.693_145_751_953_125;
pub(super) const LN_2_LOW: f64 = 1.428_606_820_309_417_2e-6;
/// Beyond this the result is taken at it: 2⁻¹¹⁵, far below any rate that moves anything, and 2¹¹⁵.
pub(super) const LARGEST: f64 = 80.0;
/// `(eˣ − 1)/x` on ±ln 2 / 2 as powers of x, from the noughth up, for f64 and for f32: least in their largest relative error (Remez'
/// exchange in 50 digits), which once they are rounded is 2.1e-17 and 2.3e-8, under half of what rounding takes from the sum. Taylor's series
/// wants two terms more of either.
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

/// A power of e as `2ⁿ (1 + part)` with the part within ±0.42.
#[derive(Clone, Copy)]
pub struct Power<R> {
    pub two_to: R,
    pub part: R,
}

/// Two terms of a series over the power of the first.
#[inline(always)]
fn two_terms<R: Real>(terms: &[f64], rest: R) -> R {
    keep(rest * R::fixed(terms[1])) + R::fixed(terms[0])
}

/// Four terms of a series over the power of the first.
#[inline(always)]
fn four_terms<R: Real>(terms: &[f64], rest: R, square: R) -> R {
    two_terms(terms, rest) + keep(two_terms(&terms[2..], rest) * square)
}

/// eˣ for x within ±80, and at the nearer end beyond, in its two parts. The series is summed in pairs of pairs of pairs
/// (Estrin): one term after the other, each waits for the one before, and a cell-step with reactions waited for little else.
#[inline(always)]
pub fn power_of_e<R: Real>(x: R) -> Power<R> {
    let bounded = x.max(R::constant(-LARGEST)).min(R::constant(LARGEST));
    let twos = (bounded * R::fixed(LOG2_E)).nearest();
    let rest = keep(bounded - twos * R::fixed(LN_2_HIGH)) - twos * R::fixed(LN_2_LOW);
    let square = keep(rest * rest);
    let fourth = keep(square * square);
    let sum = if R::DIGITS > 23 {
        let low = four_terms(&SERIES, rest, square) + keep(four_terms(&SERIES[4..], rest, square) * fourth);
        let high = two_terms(&SERIES[8..], rest) + keep(square * R::fixed(SERIES[10]));
        low + keep(high * keep(fourth * fourth))
    } else {
        four_terms(&SHORT_SERIES, rest, square) + keep(two_terms(&SHORT_SERIES[4..], rest) * fourth)
    };
    Power { two_to: twos.two_to(), part: keep(sum * rest) }
}

/// eˣ.
#[inline(always)]
pub fn exponential<R: Real>(x: R) -> R {
    let power = power_of_e(x);
    (power.part + R::fixed(1.0)) * power.two_to
}

/// `1 − e⁻ˣ`, as exact where x is small.
#[inline(always)]
pub fn decay<R: Real>(x: R) -> R {
    let power = power_of_e(-x);
    (R::constant(1.0) - power.two_to) - power.two_to * power.part
}

/// ln x for x over the least normal f32: a series about the nearest power of two, and one step of Halley's on
/// eʸ = x, which triples the digits.
#[inline(always)]
pub fn logarithm<R: Real>(x: R) -> R {
    let twos = x.twos();
    let mantissa = x.mantissa();
    let s = (mantissa - R::constant(1.0)) / (mantissa + R::constant(1.0));
    let square = s * s;
    let mut sum = R::constant(1.0 / 11.0);
    for n in 1..6 {
        sum = keep(sum * square) + R::constant(1.0 / f64::from(11 - 2 * n));
    }
    let near = twos * R::constant(std::f64::consts::LN_2) + keep((s + s) * sum);
    let back = exponential(near);
    near + (x - back) * R::constant(2.0) / (x + back)
}

/// xᵐ for x not below zero; what is nearer zero than 1e-30 counts as that.
#[inline(always)]
pub fn power<R: Real>(x: R, m: R) -> R {
    exponential(m * logarithm(x.max(R::constant(1e-30))))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By how many spacings of numbers about one a function of numbers up to 80 is off the truth, relative to that, at most.
    fn spacings_off<R: Real>(least: f64, own: impl Fn(R) -> R, truth: impl Fn(f64) -> f64) -> f64 {
        let spacings = |step: i32| {
            let x = R::constant(least + (80.0 - least) * f64::from(step) / 1e5);
            let truth = truth(x.lane(0));
            (own(x).lane(0) / truth - 1.0).abs() * f64::from(R::DIGITS).exp2()
        };
        (0..=100_000).map(spacings).fold(0.0, f64::max)
    }

    /// The last sum, and what its parts were rounded before.
    const MOST: f64 = 3.0;

    fn holds_to_the_last_digits<R: Real>() {
        let exponentials = spacings_off::<R>(-80.0, exponential, f64::exp);
        assert!(exponentials <= MOST, "eˣ is {exponentials:.1} spacings off");
        let decays = spacings_off::<R>(1e-7, decay, |x| -(-x).exp_m1());
        assert!(decays <= MOST, "1 − e⁻ˣ is {decays:.1} spacings off");
        let spoilt = |x: R| exponential(x) * R::constant(1.0 + 8.0 * (-f64::from(R::DIGITS)).exp2());
        assert!(spacings_off::<R>(-80.0, spoilt, f64::exp) > MOST, "eight spacings more passed");
    }

    #[test]
    fn powers_of_e_and_decays_hold_to_the_last_digits_in_both_precisions() {
        holds_to_the_last_digits::<f64>();
        holds_to_the_last_digits::<f32>();
    }
}
