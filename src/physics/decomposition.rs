//! How far a reaction goes in a step.
//!
//! An advancement moves by `dξ/dt = k(T) (s − ξ)^m`. At one temperature that has a closed form, which
//! neither overshoots nor cares how stiff it is; with the rate constant at the temperature midway
//! through a step for one, it is second order as temperature moves. A linearly implicit step would
//! be so too, but where a hot cell burns out within a step it swings by a fifth past the end.

use super::Real;
use super::compensated::keep;
use super::exponential::{decay, exponential, logarithm, power};
use crate::plan::layout::Reaction;

/// `A exp(−E/RT)` above the onset, 1/s, as a member scales A; `steepness` is E/RT.
#[inline(always)]
pub fn rate<R: Real>(reaction: Reaction<R::Scalar>, temperature_k: R, kinetics: R, steepness: R) -> R {
    let constant = kinetics * R::of(reaction.rate_1_s) * exponential(-steepness);
    if reaction.onset_k == R::scalar(0.0) {
        return constant;
    }
    constant * temperature_k.reached(R::of(reaction.onset_k))
}

/// `(1 − e⁻ˣ)/x` for x not below zero, one at zero: the mean of a decay.
#[inline(always)]
pub fn mean_decay<R: Real>(x: R) -> R {
    let one = R::constant(1.0);
    let near = x.min(R::constant(0.5));
    let mut series = one;
    for n in 0..12 {
        series = one - near * R::constant(1.0 / f64::from(13 - n)) * series;
    }
    // The lesser bound only keeps the quotient finite: at 0.5 itself the derivative is that of x.
    let far = x.max(R::constant(0.25));
    let large = (one - exponential(-far)) / far;
    let is_large = x.reached(R::constant(0.5));
    series + is_large * keep(large - series)
}

/// `ln(1 + x)` for x over minus one, as exact where x is small.
#[inline(always)]
pub fn logarithm_over_one<R: Real>(x: R) -> R {
    let one = R::constant(1.0);
    let small = x * (one - x * (R::constant(0.5) - x * R::constant(1.0 / 3.0)));
    let large = logarithm((one + x).max(R::constant(1e-30)));
    let is_large = (x * x).reached(R::constant(1e-6));
    small + is_large * keep(large - small)
}

/// The share of its reactant that a reaction uses up while the integral of its rate constant grows to `exposure`, never
/// more than one. The common orders have forms without a logarithm.
#[inline(always)]
pub fn consumed<R: Real>(reactant: R, exposure: R, order: R::Scalar) -> R {
    let one = R::constant(1.0);
    if order == R::scalar(1.0) {
        return decay(exposure);
    }
    if order == R::scalar(2.0) {
        let gone = exposure * reactant;
        return gone / (one + gone);
    }
    if order == R::scalar(3.0) {
        let gone = R::constant(2.0) * exposure * reactant * reactant;
        let root = (one + gone).sqrt();
        return gone / (root * (root + one));
    }
    let above = R::of(order) - one;
    let gone = above * exposure * power(reactant, above);
    let decay = logarithm_over_one(gone) / above;
    decay * mean_decay(decay)
}
