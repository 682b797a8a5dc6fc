//! Dual numbers for forward-mode automatic differentiation: one march gives a member and its exact derivatives.
//!
//! `(a, a′)(b, b′) = (ab, a′b + ab′)`, and so on for every operation (Clifford 1873). The value is that of one member;
//! its tangents fill the lanes of a SIMD vector, one direction a lane. Table look-ups and the sequential elimination
//! are done once, for the value. Hand-differentiated equations would repeat every formula of this folder.

pub mod directions;

use super::Real;
use crate::layout::COLUMNS_PER_LOAD;
use directions::Directions;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A value and its tangents. Lane zero is the value, the other lanes are the directions.
#[derive(Clone, Copy)]
pub struct Dual<V, D> {
    value: V,
    tangent: D,
}

impl<V: Real<Scalar = V>, D: Directions<V>> Dual<V, D> {
    /// A value with zero tangents.
    #[inline(always)]
    fn without_tangent(value: V) -> Self {
        Self { value, tangent: D::splat(V::from_f64(0.0)) }
    }

    /// Minimum or maximum of two equal values: the other value with the mean of both tangents, as a central difference
    /// has it. Either tangent alone would be a one-sided derivative, and zero if the other operand is a constant.
    #[inline(always)]
    fn with_mean_tangent(self, other: Self) -> Self {
        Self { value: other.value, tangent: (self.tangent + other.tangent) * D::splat(V::from_f64(0.5)) }
    }
}

impl<V: Real<Scalar = V>, D: Directions<V>> Add for Dual<V, D> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, tangent: self.tangent + other.tangent }
    }
}

impl<V: Real<Scalar = V>, D: Directions<V>> Sub for Dual<V, D> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { value: self.value - other.value, tangent: self.tangent - other.tangent }
    }
}

impl<V: Real<Scalar = V>, D: Directions<V>> Mul for Dual<V, D> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let change = self.tangent * D::splat(other.value) + D::splat(self.value) * other.tangent;
        Self { value: self.value * other.value, tangent: change }
    }
}

impl<V: Real<Scalar = V>, D: Directions<V>> Div for Dual<V, D> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        let inverse = V::from_f64(1.0) / other.value;
        Self { value, tangent: (self.tangent - D::splat(value) * other.tangent) * D::splat(inverse) }
    }
}

impl<V: Real<Scalar = V>, D: Directions<V>> Neg for Dual<V, D> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { value: -self.value, tangent: -self.tangent }
    }
}

impl<V: Real<Scalar = V>, D: Directions<V>> Add<V> for Dual<V, D> {
    type Output = Self;
    #[inline(always)]
    fn add(self, constant: V) -> Self {
        Self { value: self.value + constant, tangent: self.tangent }
    }
}

impl<V: Real<Scalar = V>, D: Directions<V>> Sub<V> for Dual<V, D> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, constant: V) -> Self {
        Self { value: self.value - constant, tangent: self.tangent }
    }
}

impl<V: Real<Scalar = V>, D: Directions<V>> Mul<V> for Dual<V, D> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, constant: V) -> Self {
        Self { value: self.value * constant, tangent: self.tangent * D::splat(constant) }
    }
}

impl<V: Real<Scalar = V, Constant = V> + PartialOrd, D: Directions<V>> Real for Dual<V, D> {
    type Scalar = V;
    type SecondWord<T: Copy + Send + Sync> = V::SecondWord<T>;
    type Constant = V;
    type RowOffset = V::RowOffset;
    type TableRows<'p, 'a> = V::TableRows<'p, 'a>;
    type TableRow<'a> = V::TableRow<'a>;
    const LANES: usize = 1 + D::LANES;
    const FIRST_ROW: V::RowOffset = V::FIRST_ROW;
    const MANTISSA_BITS: u32 = V::MANTISSA_BITS;

    #[inline(always)]
    fn scalar(value: f64) -> V {
        V::scalar(value)
    }
    #[inline(always)]
    fn splat(value: V) -> Self {
        Self::without_tangent(value)
    }
    #[inline(always)]
    fn from_lanes(mut lane: impl FnMut(usize) -> f64) -> Self {
        Self { value: V::from_lanes(&mut lane), tangent: D::from_lanes(|direction| lane(1 + direction)) }
    }
    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        lane.checked_sub(1).map_or_else(|| self.value.lane(0), |direction| self.tangent.lane(direction))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self.value > other.value {
            self
        } else if self.value < other.value {
            other
        } else {
            self.with_mean_tangent(other)
        }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self.value < other.value {
            self
        } else if self.value > other.value {
            other
        } else {
            self.with_mean_tangent(other)
        }
    }
    #[inline(always)]
    fn flush_tiny(self, threshold: Self) -> Self {
        Self {
            value: self.value.flush_tiny(threshold.value),
            tangent: self.tangent.flush_tiny(D::splat(threshold.value)),
        }
    }
    #[inline(always)]
    fn sub_mul_flushed(self, factor: Self, before: Self, threshold: Self) -> Self {
        // −(factor′ before + factor before′), in this order of operations.
        let product = factor.tangent * D::splat(-before.value.flush_tiny(threshold.value));
        let product = product.sub_mul_flushed(D::splat(factor.value), before.tangent, D::splat(threshold.value));
        Self {
            value: self.value.sub_mul_flushed(factor.value, before.value, threshold.value),
            tangent: self.tangent + product,
        }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        Self { value, tangent: self.tangent * D::splat(V::from_f64(0.5) / value) }
    }
    #[inline(always)]
    fn ge_mask(self, threshold: Self) -> Self {
        Self::without_tangent(self.value.ge_mask(threshold.value))
    }
    #[inline(always)]
    fn reaches(self, threshold: V) -> V {
        self.value.ge_mask(threshold)
    }
    #[inline(always)]
    fn any_nonzero(self) -> bool {
        self.value.any_nonzero()
    }
    #[inline(always)]
    fn round_ties_even(self) -> Self {
        Self::without_tangent(self.value.round_ties_even())
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        Self::without_tangent(self.value.power_of_two())
    }
    #[inline(always)]
    fn exponent(self) -> Self {
        Self::without_tangent(self.value.exponent())
    }
    #[inline(always)]
    fn mantissa(self) -> Self {
        let value = self.value.mantissa();
        Self { value, tangent: self.tangent * D::splat(value / self.value) }
    }
    #[inline(always)]
    fn floor_clamped(self, max: u32) -> V {
        self.value.floor_clamped(max)
    }
    #[inline(always)]
    fn table_rows<'p, 'a>(
        offsets: &'p mut [V::RowOffset],
        table: &'a [V],
        columns: usize,
        row_number: impl FnMut(usize) -> V,
    ) -> V::TableRows<'p, 'a> {
        V::table_rows(offsets, table, columns, row_number)
    }
    #[inline(always)]
    fn table_row<'a>(rows: V::TableRows<'_, 'a>, i: usize) -> V::TableRow<'a> {
        V::table_row(rows, i)
    }
    #[inline(always)]
    fn column_group(row: V::TableRow<'_>, group: usize) -> [V; COLUMNS_PER_LOAD] {
        V::column_group(row, group)
    }
    #[inline(always)]
    fn for_lanes_outside(self, span: f32, outside: impl FnMut(usize)) {
        self.value.for_lanes_outside(span, outside);
    }
}
