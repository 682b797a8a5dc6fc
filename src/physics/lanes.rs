//! Several members side by side in one number, for the processor's vector units.
//!
//! Every lane rounds exactly as the scalar does: no fused multiplications, the same choices. What a vector unit
//! has no instruction for goes through an array, a lane at a time.

use super::Real;
use simdeez::prelude::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Most lanes that a vector has.
const WIDEST: usize = 16;
/// Rows of a table are below two to the 22nd, which f32 counts exactly.
const MOST_ROWS: u32 = (1 << 22) - 1;

macro_rules! lanes {
    ($(#[$about:meta])* $lanes:ident, $real:ty, $vector:ident, $whole:expr, $bias:expr, $digits:expr, $bits:ident, $unbits:ident) => {
        $(#[$about])*
        pub struct $lanes<S: Simd>(S::$vector);

        impl<S: Simd> Clone for $lanes<S> {
            #[inline(always)]
            fn clone(&self) -> Self {
                *self
            }
        }

        impl<S: Simd> Copy for $lanes<S> {}

        impl<S: Simd> $lanes<S> {
            #[inline(always)]
            fn array(self) -> [$real; WIDEST] {
                let mut array = [0.0; WIDEST];
                self.0.copy_to_slice(&mut array);
                array
            }

            #[inline(always)]
            fn gathered(lane: impl FnMut(usize) -> $real) -> Self {
                let mut lane = lane;
                let mut array = [0.0; WIDEST];
                for l in 0..S::$vector::WIDTH {
                    array[l] = lane(l);
                }
                Self(S::$vector::load_from_slice(&array))
            }
        }

        lanes!(operator $lanes, Add, add);
        lanes!(operator $lanes, Sub, sub);
        lanes!(operator $lanes, Mul, mul);
        lanes!(operator $lanes, Div, div);

        impl<S: Simd> Neg for $lanes<S> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self(self.0 ^ S::$vector::set1(-0.0))
            }
        }

        impl<S: Simd> Real for $lanes<S> {
            type Scalar = $real;
            type Row = ($lanes<S>, [u32; WIDEST]);
            type Window<'a> = [&'a [$real]; WIDEST];
            const LANES: usize = S::$vector::WIDTH;

            #[inline(always)]
            fn scalar(value: f64) -> $real {
                value as $real
            }
            #[inline(always)]
            fn of(value: $real) -> Self {
                Self(S::$vector::set1(value))
            }
            #[inline(always)]
            fn from_lanes(mut lane: impl FnMut(usize) -> f64) -> Self {
                Self::gathered(|l| lane(l) as $real)
            }
            #[inline(always)]
            fn lane(self, lane: usize) -> f64 {
                f64::from(self.array()[lane])
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                Self(self.0.max(other.0))
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                Self(self.0.min(other.0))
            }
            #[inline(always)]
            fn settled(self, least: Self) -> Self {
                Self(self.0.abs().cmp_gte(least.0) & self.0)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                Self(self.0.sqrt())
            }
            #[inline(always)]
            fn reached(self, mark: Self) -> Self {
                Self(self.0.cmp_gte(mark.0) & S::$vector::set1(1.0))
            }
            #[inline(always)]
            fn nearest(self) -> Self {
                Self((self.0 + S::$vector::set1($whole)) - S::$vector::set1($whole))
            }
            #[inline(always)]
            fn two_to(self) -> Self {
                Self(((self.0 + S::$vector::set1($whole + $bias)).$bits() << $digits).$unbits())
            }
            #[inline(always)]
            fn twos(self) -> Self {
                let array = self.array();
                Self::gathered(|lane| Real::twos(array[lane]))
            }
            #[inline(always)]
            fn mantissa(self) -> Self {
                let array = self.array();
                Self::gathered(|lane| Real::mantissa(array[lane]))
            }
            #[inline(always)]
            fn row(self, last: u32) -> ($lanes<S>, [u32; WIDEST]) {
                let whole = self.0.max(S::$vector::zeroes()).min(S::$vector::set1(last as $real)).floor();
                // As above, the last bits of the sum are the number.
                let shifted = Self(whole + S::$vector::set1($whole)).array();
                let mut row = [0; WIDEST];
                for lane in 0..Self::LANES {
                    row[lane] = shifted[lane].to_bits() as u32 & MOST_ROWS;
                }
                (Self(whole), row)
            }
            #[inline(always)]
            fn from_row(row: ($lanes<S>, [u32; WIDEST])) -> Self {
                row.0
            }
            #[inline(always)]
            fn window(
                table: &[$real],
                row: ($lanes<S>, [u32; WIDEST]),
                stride: usize,
                offset: usize,
                length: usize,
            ) -> [&[$real]; WIDEST] {
                let mut windows = [&table[..length]; WIDEST];
                for lane in 0..Self::LANES {
                    let start = offset + stride * row.1[lane] as usize;
                    windows[lane] = &table[start..start + length];
                }
                windows
            }
            #[inline(always)]
            fn pick(window: [&[$real]; WIDEST], place: usize) -> Self {
                Self::gathered(|lane| window[lane][place])
            }
            #[inline(always)]
            fn within(self, span: f32, mut stray: impl FnMut(usize)) {
                let inside = self.0.cmp_gte(S::$vector::zeroes()) & self.0.cmp_lte(S::$vector::set1(span.into()));
                if (inside & S::$vector::set1(1.0)).horizontal_add() != Self::LANES as $real {
                    let array = self.array();
                    (0..Self::LANES).for_each(|lane| Real::within(array[lane], span, |_| stray(lane)));
                }
            }
        }
    };
    (operator $lanes:ident, $trait:ident, $method:ident) => {
        impl<S: Simd> $trait for $lanes<S> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self($trait::$method(self.0, other.0))
            }
        }
    };
}

lanes!(
    /// Members in f64.
    Doubles, f64, Vf64, 6_755_399_441_055_744.0, 1023.0, 52, bitcast_i64, bitcast_f64
);
lanes!(
    /// Members in f32.
    Singles, f32, Vf32, 12_582_912.0, 127.0, 23, bitcast_i32, bitcast_f32
);
