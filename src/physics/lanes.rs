//! Several members side by side in one number, for the processor's vector units.
//!
//! Plain arrays and loops: the compiler turns them into vector instructions of whatever width it is told
//! of, and every lane rounds exactly as the scalar does.

use super::Real;
use std::array::from_fn;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// `N` members' values of one quantity.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub struct Lanes<T, const N: usize>([T; N]);

macro_rules! lanes {
    ($real:ty) => {
        lanes!(operator $real, Add, add);
        lanes!(operator $real, Sub, sub);
        lanes!(operator $real, Mul, mul);
        lanes!(operator $real, Div, div);

        impl<const N: usize> Neg for Lanes<$real, N> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self(from_fn(|lane| -self.0[lane]))
            }
        }

        impl<const N: usize> Real for Lanes<$real, N> {
            type Scalar = $real;
            type Row = [u32; N];
            const LANES: usize = N;

            #[inline(always)]
            fn scalar(value: f64) -> $real {
                value as $real
            }
            #[inline(always)]
            fn of(value: $real) -> Self {
                Self([value; N])
            }
            #[inline(always)]
            fn from_lanes(mut lane: impl FnMut(usize) -> f64) -> Self {
                Self(from_fn(|l| lane(l) as $real))
            }
            #[inline(always)]
            fn lane(self, lane: usize) -> f64 {
                f64::from(self.0[lane])
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                Self(from_fn(|lane| Real::max(self.0[lane], other.0[lane])))
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                Self(from_fn(|lane| Real::min(self.0[lane], other.0[lane])))
            }
            #[inline(always)]
            fn settled(self, least: Self) -> Self {
                Self(from_fn(|lane| Real::settled(self.0[lane], least.0[lane])))
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                Self(from_fn(|lane| self.0[lane].sqrt()))
            }
            #[inline(always)]
            fn reached(self, mark: Self) -> Self {
                Self(from_fn(|lane| Real::reached(self.0[lane], mark.0[lane])))
            }
            #[inline(always)]
            fn nearest(self) -> Self {
                Self(from_fn(|lane| Real::nearest(self.0[lane])))
            }
            #[inline(always)]
            fn two_to(self) -> Self {
                Self(from_fn(|lane| Real::two_to(self.0[lane])))
            }
            #[inline(always)]
            fn twos(self) -> Self {
                Self(from_fn(|lane| Real::twos(self.0[lane])))
            }
            #[inline(always)]
            fn mantissa(self) -> Self {
                Self(from_fn(|lane| Real::mantissa(self.0[lane])))
            }
            #[inline(always)]
            fn row(self, last: u32) -> [u32; N] {
                from_fn(|lane| Real::row(self.0[lane], last))
            }
            #[inline(always)]
            fn from_row(row: [u32; N]) -> Self {
                Self(from_fn(|lane| row[lane] as $real))
            }
            #[inline(always)]
            fn gather(table: &[$real], row: [u32; N], stride: usize, offset: usize) -> Self {
                Self(from_fn(|lane| table[offset + stride * row[lane] as usize]))
            }
            #[inline(always)]
            fn within(self, span: f32, mut stray: impl FnMut(usize)) {
                let outside: [bool; N] = from_fn(|lane| (self.0[lane] as f32).to_bits() > span.to_bits());
                if outside.contains(&true) {
                    outside.iter().enumerate().filter(|(_, is)| **is).for_each(|(lane, _)| stray(lane));
                }
            }
        }
    };
    (operator $real:ty, $trait:ident, $method:ident) => {
        impl<const N: usize> $trait for Lanes<$real, N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(from_fn(|lane| $trait::$method(self.0[lane], other.0[lane])))
            }
        }
    };
}

lanes!(f32);
lanes!(f64);
