//! Vectors of tangents of a dual number.

use super::super::Real;
use std::ops::{Add, Mul, Neg, Sub};

/// Tangents of a `V`, one direction a lane.
pub trait Directions<V>:
    Copy + Send + Sync + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
    /// Number of directions.
    const LANES: usize;

    /// The same tangent in every direction.
    fn splat(value: V) -> Self;
    fn from_lanes(lane: impl FnMut(usize) -> f64) -> Self;
    fn lane(self, lane: usize) -> f64;
    /// As [`Real::flush_tiny`].
    fn flush_tiny(self, threshold: Self) -> Self;
    /// As [`Real::sub_mul_flushed`].
    fn sub_mul_flushed(self, factor: Self, before: Self, threshold: Self) -> Self;
}

impl<R: Real> Directions<R::Scalar> for R {
    const LANES: usize = R::LANES;

    #[inline(always)]
    fn splat(value: R::Scalar) -> Self {
        R::splat(value)
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
    fn flush_tiny(self, threshold: Self) -> Self {
        R::flush_tiny(self, threshold)
    }
    #[inline(always)]
    fn sub_mul_flushed(self, factor: Self, before: Self, threshold: Self) -> Self {
        R::sub_mul_flushed(self, factor, before, threshold)
    }
}

/// Two vectors as one of twice the lanes, so that narrow vectors also hold the directions of most layups in one march.
/// A pair and not an array: arrays of vectors stay in memory (twice the time in f32).
#[derive(Clone, Copy)]
pub struct DoubleWidth<D>(D, D);

impl<D: Add<Output = D>> Add for DoubleWidth<D> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0, self.1 + other.1)
    }
}

impl<D: Sub<Output = D>> Sub for DoubleWidth<D> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0, self.1 - other.1)
    }
}

impl<D: Mul<Output = D>> Mul for DoubleWidth<D> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0, self.1 * other.1)
    }
}

impl<D: Neg<Output = D>> Neg for DoubleWidth<D> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl<V: Copy, D: Directions<V>> Directions<V> for DoubleWidth<D> {
    const LANES: usize = 2 * D::LANES;

    #[inline(always)]
    fn splat(value: V) -> Self {
        Self(D::splat(value), D::splat(value))
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
    fn flush_tiny(self, threshold: Self) -> Self {
        Self(self.0.flush_tiny(threshold.0), self.1.flush_tiny(threshold.1))
    }
    #[inline(always)]
    fn sub_mul_flushed(self, factor: Self, before: Self, threshold: Self) -> Self {
        Self(
            self.0.sub_mul_flushed(factor.0, before.0, threshold.0),
            self.1.sub_mul_flushed(factor.1, before.1, threshold.1),
        )
    }
}
