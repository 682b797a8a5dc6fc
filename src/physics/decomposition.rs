//! Advancement of one reaction over a step.
//!
//! `dξ/dt = k(T) (s − ξ)^m` has a closed form at constant temperature, which neither overshoots nor depends on
//! stiffness. With the rate constant at the midpoint temperature it is second order. A linearly implicit step would be
//! second order too, but overshoots by a fifth where a hot cell burns out within a step.

use super::Real;
use super::compensated::opaque;
use super::exponential::{decay, exponential, logarithm, power};
use crate::layout::Reaction;

/// Largest logarithm of a rate constant in 1/s: 2.4e17 1/s is thousands of times the frequency at which molecules
/// vibrate, and uses up the reactant in any step. The bound keeps products of rates finite in f32.
pub(super) const LOG_RATE_MAX: f64 = 40.0;

/// Largest integral of a rate constant of an order without a closed form of its own: its products stay finite in f32.
pub(super) const EXPOSURE_MAX: f64 = 1e12;

/// Arrhenius rate constant `A exp(−E/RT)`, 1/s; zero below the onset temperature. `pre_exponential` scales A;
/// `steepness` is E/RT. A enters as ln A in the exponent: for desorption or the melting of a crystal A is 1e30 1/s or
/// more and the exponential below the range of f32, while their product is an ordinary rate.
#[inline(always)]
pub fn arrhenius_rate<R: Real>(reaction: Reaction<R::Scalar>, temperature_k: R, pre_exponential: R, steepness: R) -> R {
    let log_rate = (R::splat(reaction.log_rate_1_s) - steepness).min(R::from_f64(LOG_RATE_MAX));
    let constant = pre_exponential * exponential(log_rate);
    if reaction.onset_k == R::scalar(0.0) {
        return constant;
    }
    constant * temperature_k.ge_mask(R::splat(reaction.onset_k))
}

/// `(1 − e⁻ˣ)/x` for x ≥ 0, one at zero: the mean of an exponential decay.
#[inline(always)]
pub fn mean_decay<R: Real>(x: R) -> R {
    let one = R::from_f64(1.0);
    let near = x.min(R::from_f64(0.5));
    let mut series = one;
    for n in 0..12 {
        series = one - near * R::from_f64(1.0 / f64::from(13 - n)) * series;
    }
    // The bound keeps the quotient finite. It lies below 0.5, so that the derivative at 0.5 is that of x.
    let far = x.max(R::from_f64(0.25));
    let large = (one - exponential(-far)) / far;
    let is_large = x.ge_mask(R::from_f64(0.5));
    series + is_large * opaque(large - series)
}

/// `ln(1 + x)` for x > −1, accurate for small x.
#[inline(always)]
pub fn logarithm_1p<R: Real>(x: R) -> R {
    let one = R::from_f64(1.0);
    // The bounds keep the powers finite.
    let near = x.max(R::from_f64(-0.5)).min(R::from_f64(0.5));
    let small = near * (one - near * (R::from_f64(0.5) - near * R::from_f64(1.0 / 3.0)));
    let large = logarithm((one + x).max(R::from_f64(1e-30)));
    let is_large = (near * near).ge_mask(R::from_f64(1e-6));
    small + is_large * opaque(large - small)
}

/// Share of its reactant that a reaction consumes, at most one. `exposure` is the integral of the rate constant. Orders
/// 1, 2 and 3 have closed forms without a logarithm.
#[inline(always)]
pub fn consumed_share<R: Real>(reactant: R, exposure: R, order: R::Scalar) -> R {
    let one = R::from_f64(1.0);
    if order == R::scalar(1.0) {
        return decay(exposure);
    }
    if order == R::scalar(2.0) {
        let gone = exposure * reactant;
        return gone / (one + gone);
    }
    if order == R::scalar(3.0) {
        let gone = R::from_f64(2.0) * exposure * reactant * reactant;
        let root = (one + gone).sqrt();
        return gone / (root * (root + one));
    }
    let above = R::splat(order) - one;
    let gone = above * exposure.min(R::from_f64(EXPOSURE_MAX)) * power(reactant, above);
    let decay = logarithm_1p(gone) / above;
    decay * mean_decay(decay)
}
