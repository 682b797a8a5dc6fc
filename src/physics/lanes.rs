//! Several members in the lanes of one SIMD vector.
//!
//! Every lane rounds exactly as the scalar does: no fused multiply-add, the same branches. Operations without a vector
//! instruction go through an array, lane by lane.

mod simd_tables;

use super::Real;
use super::double_word::{Omitted, Stored};
use crate::layout::COLUMNS_PER_LOAD;
pub use simd_tables::{MAX_LANES, SimdTables};
use simd_tables::{RowOffsets, TableRow, TableRows, load, store};
use simdeez::prelude::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

macro_rules! lanes {
    (
        $(#[$doc:meta])* $lanes:ident, $real:ty, $vector:ident, $max_lanes:literal,
        $row_offsets:ident, $column_group:ident, $any_nonzero:ident,
        $second_word:ty, $flushes:expr, $rounding_magic:expr, $bias:expr, $mantissa_bits:expr,
        $bits:ident, $unbits:ident
    ) => {
        $(#[$doc])*
        pub struct $lanes<S: SimdTables>(S::$vector);

        impl<S: SimdTables> Clone for $lanes<S> {
            #[inline(always)]
            fn clone(&self) -> Self {
                *self
            }
        }

        impl<S: SimdTables> Copy for $lanes<S> {}

        impl<S: SimdTables> $lanes<S> {
            #[inline(always)]
            fn array(self) -> [$real; MAX_LANES] {
                let mut array = [0.0; MAX_LANES];
                store(self.0, &mut array);
                array
            }

            #[inline(always)]
            fn gathered(lane: impl FnMut(usize) -> $real) -> Self {
                let mut lane = lane;
                let mut array = [0.0; MAX_LANES];
                for l in 0..S::$vector::WIDTH {
                    array[l] = lane(l);
                }
                Self(load(&array))
            }
        }

        lanes!(operator $lanes, Add, add);
        lanes!(operator $lanes, Sub, sub);
        lanes!(operator $lanes, Mul, mul);
        lanes!(operator $lanes, Div, div);

        impl<S: SimdTables> Neg for $lanes<S> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self(self.0 ^ S::$vector::set1(-0.0))
            }
        }

        impl<S: SimdTables> Real for $lanes<S> {
            type Scalar = $real;
            type SecondWord<T: Copy + Send + Sync> = $second_word;
            type Constant = Self;
            type RowOffset = RowOffsets<$max_lanes>;
            type TableRows<'p, 'a> = TableRows<'p, 'a, $real, $max_lanes>;
            type TableRow<'a> = TableRow<'a, $real, $max_lanes>;
            const LANES: usize = S::$vector::WIDTH;
            const FIRST_ROW: RowOffsets<$max_lanes> = [0; $max_lanes];
            const MANTISSA_BITS: u32 = $mantissa_bits;

            #[inline(always)]
            fn scalar(value: f64) -> $real {
                value as $real
            }
            #[inline(always)]
            fn splat(value: $real) -> Self {
                Self(S::$vector::set1(value))
            }
            #[inline(always)]
            fn from_lanes(mut lane: impl FnMut(usize) -> f64) -> Self {
                Self::gathered(|l| lane(l) as $real)
            }
            #[inline(always)]
            fn lane(self, lane: usize) -> f64 {
                f64::from(self.0[lane])
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
            fn flush_tiny(self, threshold: Self) -> Self {
                // NaN compares false and stays.
                if $flushes {
                    Self(self.0.abs().cmp_lt(threshold.0).blendv(self.0, S::$vector::zeroes()))
                } else {
                    self
                }
            }
            #[inline(always)]
            fn sub_mul_flushed(self, factor: Self, before: Self, threshold: Self) -> Self {
                let difference = self - factor * before;
                if $flushes {
                    Self(before.0.abs().cmp_lt(threshold.0).blendv(difference.0, self.0))
                } else {
                    difference
                }
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                Self(self.0.sqrt())
            }
            #[inline(always)]
            fn ge_mask(self, threshold: Self) -> Self {
                Self(self.0.cmp_gte(threshold.0) & S::$vector::set1(1.0))
            }
            #[inline(always)]
            fn reaches(self, threshold: Self) -> Self {
                self.ge_mask(threshold)
            }
            #[inline(always)]
            fn any_nonzero(self) -> bool {
                S::$any_nonzero(self.0)
            }
            #[inline(always)]
            fn round_ties_even(self) -> Self {
                Self((self.0 + S::$vector::set1($rounding_magic)) - S::$vector::set1($rounding_magic))
            }
            #[inline(always)]
            fn power_of_two(self) -> Self {
                Self(((self.0 + S::$vector::set1($rounding_magic + $bias)).$bits() << $mantissa_bits).$unbits())
            }
            #[inline(always)]
            fn exponent(self) -> Self {
                let array = self.array();
                Self::gathered(|lane| Real::exponent(array[lane]))
            }
            #[inline(always)]
            fn mantissa(self) -> Self {
                let array = self.array();
                Self::gathered(|lane| Real::mantissa(array[lane]))
            }
            #[inline(always)]
            fn floor_clamped(self, max: u32) -> Self {
                Self(self.0.max(S::$vector::zeroes()).min(S::$vector::set1(max as $real)).floor())
            }
            #[inline(always)]
            fn table_rows<'p, 'a>(
                offsets: &'p mut [RowOffsets<$max_lanes>],
                table: &'a [$real],
                columns: usize,
                mut row_number: impl FnMut(usize) -> Self,
            ) -> Self::TableRows<'p, 'a> {
                TableRows::new(
                    offsets,
                    table,
                    columns,
                    #[inline(always)]
                    |i| S::$row_offsets(row_number(i).0, columns),
                )
            }
            #[inline(always)]
            fn table_row<'a>(rows: Self::TableRows<'_, 'a>, i: usize) -> Self::TableRow<'a> {
                rows.row(i, Self::LANES)
            }
            #[inline(always)]
            fn column_group(row: Self::TableRow<'_>, group: usize) -> [Self; COLUMNS_PER_LOAD] {
                let [a, b, c, d] = S::$column_group(row, group);
                [Self(a), Self(b), Self(c), Self(d)]
            }
            #[inline(always)]
            fn for_lanes_outside(self, span: f32, mut outside: impl FnMut(usize)) {
                let inside = self.0.cmp_gte(S::$vector::zeroes()) & self.0.cmp_lte(S::$vector::set1(span.into()));
                if (inside & S::$vector::set1(1.0)).horizontal_add() != Self::LANES as $real {
                    let array = self.array();
                    (0..Self::LANES).for_each(|lane| Real::for_lanes_outside(array[lane], span, |_| outside(lane)));
                }
            }
        }
    };
    (operator $lanes:ident, $trait:ident, $method:ident) => {
        impl<S: SimdTables> $trait for $lanes<S> {
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
    F64Lanes, f64, Vf64, 8, row_offsets_f64, column_group_f64, any_nonzero_f64,
    Omitted, false, 6_755_399_441_055_744.0, 1023.0, 52, bitcast_i64, bitcast_f64
);
lanes!(
    /// Members in f32.
    F32Lanes, f32, Vf32, 16, row_offsets_f32, column_group_f32, any_nonzero_f32,
    Stored<T>, true, 12_582_912.0, 127.0, 23, bitcast_i32, bitcast_f32
);
