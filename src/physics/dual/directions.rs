//! Changes along several directions, side by side: what a dual number asks of the vectors that hold them.

use super::super::Real;
use std::ops::{Add, Mul, Neg, Sub};

/// Changes of a `V`, one a lane.
pub trait Directions<V>:
    Copy + Send + Sync + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
    /// Directions side by side.
    const LANES: usize;

    /// The same change along every direction.
    fn of(value: V) -> Self;
    fn from_lanes(lane: impl FnMut(usize) -> f64) -> Self;
    fn lane(self, lane: usize) -> f64;
    /// As [`Real::settled`].
    fn settled(self, least: Self) -> Self;
    /// As [`Real::less_times`].
    fn less_times(self, by: Self, before: Self, least: Self) -> Self;
}

impl<R: Real> Directions<R::Scalar> for R {
    const LANES: usize = R::LANES;

    #[inline(always)]
    fn of(value: R::Scalar) -> Self {
        R::of(value)
    }
    #[inline(always)]
    fn from_lanes(lane: impl FnMut(usize) -> f64) -> Self {
        R::from_lanes(lane)
    }
    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        R::lane(self, lane)
    }
    #[inline(always)]
    fn settled(self, least: Self) -> Self {
        R::settled(self, least)
    }
    #[inline(always)]
    fn less_times(self, by: Self, before: Self, least: Self) -> Self {
        R::less_times(self, by, before, least)
    }
}

/// Two vectors as one of twice the lanes, so that narrow ones too carry the directions of most layups beside one march of the
/// member. Written out, as arrays of vectors stay in memory (twice as long in f32).
#[derive(Clone, Copy)]
pub struct Twofold<D>(D, D);

impl<D: Add<Output = D>> Add for Twofold<D> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0, self.1 + other.1)
    }
}

impl<D: Sub<Output = D>> Sub for Twofold<D> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0, self.1 - other.1)
    }
}

impl<D: Mul<Output = D>> Mul for Twofold<D> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0, self.1 * other.1)
    }
}

impl<D: Neg<Output = D>> Neg for Twofold<D> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl<V: Copy, D: Directions<V>> Directions<V> for Twofold<D> {
    const LANES: usize = 2 * D::LANES;

    #[inline(always)]
    fn of(value: V) -> Self {
        Self(D::of(value), D::of(value))
    }
    #[inline(always)]
    fn from_lanes(mut lane: impl FnMut(usize) -> f64) -> Self {
        Self(D::from_lanes(&mut lane), D::from_lanes(|l| lane(D::LANES + l)))
    }
    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        if lane < D::LANES { self.0.lane(lane) } else { self.1.lane(lane - D::LANES) }
    }
    #[inline(always)]
    fn settled(self, least: Self) -> Self {
        Self(self.0.settled(least.0), self.1.settled(least.1))
    }
    #[inline(always)]
    fn less_times(self, by: Self, before: Self, least: Self) -> Self {
        Self(self.0.less_times(by.0, before.0, least.0), self.1.less_times(by.1, before.1, least.1))
    }
}
