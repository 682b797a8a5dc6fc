//! Exponential, logarithm and powers of our own, for the rates of reactions.
//!
//! Shaders have none in f64 that can be trusted, and no two libraries round alike in f32; with sums and
//! products in a stated order both twins agree in both precisions.

use super::Real;
use super::compensated::keep;

const LOG2_E: f64 = std::f64::consts::LOG2_E;
/// ln 2 in two parts, the first short enough that its whole multiples are exact in f32.
const LN_2_HIGH: f64 = 0.693_145_751_953_125;
const LN_2_LOW: f64 = 1.428_606_820_309_417_2e-6;
/// Beyond this the result is taken at it: 2⁻¹¹⁵, far below any rate that moves anything, and 2¹¹⁵.
const LARGEST: f64 = 80.0;
/// 1/n! from the first up: enough for f64 on ±ln 2 / 2, as the first eight are for f32.
const SERIES: [f64; 13] = [
    1.0,
    0.5,
    1.0 / 6.0,
    1.0 / 24.0,
    1.0 / 120.0,
    1.0 / 720.0,
    1.0 / 5_040.0,
    1.0 / 40_320.0,
    1.0 / 362_880.0,
    1.0 / 3_628_800.0,
    1.0 / 39_916_800.0,
    1.0 / 479_001_600.0,
    1.0 / 6_227_020_800.0,
];

/// A power of e as `2ⁿ (1 + part)` with the part within ±0.42.
#[derive(Clone, Copy)]
pub struct Power<R> {
    pub two_to: R,
    pub part: R,
}

/// Two terms of the series from the nth on, over the nth power.
#[inline(always)]
fn two_terms<R: Real>(n: usize, rest: R) -> R {
    keep(rest * R::fixed(SERIES[n + 1])) + R::fixed(SERIES[n])
}

/// Four terms of the series from the nth on, over the nth power.
#[inline(always)]
fn four_terms<R: Real>(n: usize, rest: R, square: R) -> R {
    two_terms(n, rest) + keep(two_terms(n + 2, rest) * square)
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
    let mut sum = four_terms(0, rest, square) + keep(four_terms(4, rest, square) * fourth);
    // Of these f32 would see less than a hundredth of its last digit.
    if R::DIGITS > 23 {
        let high = four_terms(8, rest, square) + keep(fourth * R::fixed(SERIES[12]));
        sum = sum + keep(high * keep(fourth * fourth));
    }
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
