//! How one member moves: one text, generic over [`Real`], with a WGSL twin for each file in `shaders/`.
//!
//! `C(T) dT/dt = F_above − F_below` on finite volumes, heat flux positive towards the back face. The twins
//! hold the same functions in the same order and do the same operations in the same order, which is why
//! loops here run over indices: likeness to the shader is worth more than idiom.

pub mod compensated;
pub mod faces;
pub mod holder;
pub mod lanes;
pub mod material;
pub mod member;
pub mod reading;
pub mod step;
pub mod table;
pub mod tridiagonal;

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Twin files: the Rust text under `src/physics`, the WGSL text under `shaders`.
pub const TWINS: &[&str] =
    &["compensated", "table", "material", "faces", "tridiagonal", "reading", "member", "holder", "step"];

/// A number a march is made of: `f64` the truth, `f32` the shader's twin, or lanes of members of either.
pub trait Real:
    Copy
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// What the rows of a plan hold.
    type Scalar: Copy + Send + Sync;
    /// A row of a table, one a lane.
    type Row: Copy;
    /// Lanes, that is members carried at once.
    const LANES: usize;

    fn scalar(value: f64) -> Self::Scalar;
    /// The same value in every lane.
    fn of(value: Self::Scalar) -> Self;
    fn constant(value: f64) -> Self {
        Self::of(Self::scalar(value))
    }
    fn from_lanes(lane: impl FnMut(usize) -> f64) -> Self;
    /// The value of one lane.
    fn lane(self, lane: usize) -> f64;
    fn max(self, other: Self) -> Self;
    fn min(self, other: Self) -> Self;
    /// Zero where it is nearer zero than `least`.
    fn settled(self, least: Self) -> Self;
    /// The row of a table that a non-negative position falls in, at most `last`.
    fn row(self, last: u32) -> Self::Row;
    fn from_row(row: Self::Row) -> Self;
    /// `table[offset + stride row]`, a lane.
    fn gather(table: &[Self::Scalar], row: Self::Row, stride: usize, offset: usize) -> Self;
    /// Whether each lane lies in zero to `span`; by its bits, which also tells what is no number.
    fn within(self, span: f32, lane: impl FnMut(usize));
}

macro_rules! scalar {
    ($real:ty) => {
        impl Real for $real {
            type Scalar = $real;
            type Row = u32;
            const LANES: usize = 1;

            #[inline(always)]
            fn scalar(value: f64) -> $real {
                value as $real
            }
            #[inline(always)]
            fn of(value: $real) -> Self {
                value
            }
            #[inline(always)]
            fn from_lanes(mut lane: impl FnMut(usize) -> f64) -> Self {
                lane(0) as $real
            }
            #[inline(always)]
            fn lane(self, _lane: usize) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                if self > other { self } else { other }
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                if self < other { self } else { other }
            }
            #[inline(always)]
            fn settled(self, least: Self) -> Self {
                if self.abs() < least { 0.0 } else { self }
            }
            #[inline(always)]
            fn row(self, last: u32) -> u32 {
                (self as u32).min(last)
            }
            #[inline(always)]
            fn from_row(row: u32) -> Self {
                row as $real
            }
            #[inline(always)]
            fn gather(table: &[$real], row: u32, stride: usize, offset: usize) -> Self {
                table[offset + stride * row as usize]
            }
            #[inline(always)]
            fn within(self, span: f32, mut stray: impl FnMut(usize)) {
                if (self as f32).to_bits() > span.to_bits() {
                    stray(0);
                }
            }
        }
    };
}

scalar!(f32);
scalar!(f64);
