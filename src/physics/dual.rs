//! Dual numbers for forward-mode automatic differentiation: one march gives a member and its exact derivatives.
//!
//! `(a, a′)(b, b′) = (ab, a′b + ab′)`, and so on for every operation (Clifford 1873). The value is that of one member;
//! its tangents fill the lanes of a SIMD vector, one direction a lane. Table look-ups and the sequential elimination
//! are done once, for the value. Hand-differentiated equations would repeat every formula of this folder.

pub mod directions;

use super::Real;
use crate::plan::layout::ABREAST;
use directions::Directions;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A value and its tangents. Lane zero is the value, the other lanes are the directions.
#[derive(Clone, Copy)]
pub struct Dual<V, D> {
    value: V,
    change: D,
}

impl<V: Real<Scalar = V>, D: Directions<V>> Dual<V, D> {
    /// A value with zero tangents.
    #[inline(always)]
    fn unchanging(value: V) -> Self {
        Self { value, change: D::of(V::constant(0.0)) }
    }

    /// Minimum or maximum of two equal values: the other value with the mean of both tangents, as a central difference
    /// has it. Either tangent alone would be a one-sided derivative, and zero if the other operand is a constant.
    #[inline(always)]
    fn halfway(self, other: Self) -> Self {
        Self { value: other.value, change: (self.change + other.change) * D::of(V::constant(0.5)) }
    }
}

impl<V: Real<Scalar = V>, D: Directions<V>> Add for Dual<V, D> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, change: self.change + other.change }
    }
}

impl<V: Real<Scalar = V>, D: Directions<V>> Sub for Dual<V, D> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { value: self.value - other.value, change: self.change - other.change }
    }
}

impl<V: Real<Scalar = V>, D: Directions<V>> Mul for Dual<V, D> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let change = self.change * D::of(other.value) + D::of(self.value) * other.change;
        Self { value: self.value * other.value, change }
    }
}

impl<V: Real<Scalar = V>, D: Directions<V>> Div for Dual<V, D> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        let inverse = V::constant(1.0) / other.value;
        Self { value, change: (self.change - D::of(value) * other.change) * D::of(inverse) }
    }
}

impl<V: Real<Scalar = V>, D: Directions<V>> Neg for Dual<V, D> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { value: -self.value, change: -self.change }
    }
}

impl<V: Real<Scalar = V>, D: Directions<V>> Add<V> for Dual<V, D> {
    type Output = Self;
    #[inline(always)]
    fn add(self, constant: V) -> Self {
        Self { value: self.value + constant, change: self.change }
    }
}

impl<V: Real<Scalar = V>, D: Directions<V>> Sub<V> for Dual<V, D> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, constant: V) -> Self {
        Self { value: self.value - constant, change: self.change }
    }
}

impl<V: Real<Scalar = V>, D: Directions<V>> Mul<V> for Dual<V, D> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, constant: V) -> Self {
        Self { value: self.value * constant, change: self.change * D::of(constant) }
    }
}

impl<V: Real<Scalar = V, Still = V> + PartialOrd, D: Directions<V>> Real for Dual<V, D> {
    type Scalar = V;
    type Still = V;
    type Place = V::Place;
    type Rows<'p, 'a> = V::Rows<'p, 'a>;
    type Row<'a> = V::Row<'a>;
    const LANES: usize = 1 + D::LANES;
    const DIGITS: u32 = V::DIGITS;

    #[inline(always)]
    fn scalar(value: f64) -> V {
        V::scalar(value)
    }
    #[inline(always)]
    fn of(value: V) -> Self {
        Self::unchanging(value)
    }
    #[inline(always)]
    fn from_lanes(mut lane: impl FnMut(usize) -> f64) -> Self {
        Self { value: V::from_lanes(&mut lane), change: D::from_lanes(|direction| lane(1 + direction)) }
    }
    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        lane.checked_sub(1).map_or_else(|| self.value.lane(0), |direction| self.change.lane(direction))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self.value > other.value {
            self
        } else if self.value < other.value {
            other
        } else {
            self.halfway(other)
        }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self.value < other.value {
            self
        } else if self.value > other.value {
            other
        } else {
            self.halfway(other)
        }
    }
    #[inline(always)]
    fn settled(self, threshold: Self) -> Self {
        Self { value: self.value.settled(threshold.value), change: self.change.settled(D::of(threshold.value)) }
    }
    #[inline(always)]
    fn less_times(self, factor: Self, before: Self, threshold: Self) -> Self {
        // −(factor′ before + factor before′), in this order of operations.
        let product = factor.change * D::of(-before.value.settled(threshold.value));
        let product = product.less_times(D::of(factor.value), before.change, D::of(threshold.value));
        Self {
            value: self.value.less_times(factor.value, before.value, threshold.value),
            change: self.change + product,
        }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        Self { value, change: self.change * D::of(V::constant(0.5) / value) }
    }
    #[inline(always)]
    fn reached(self, threshold: Self) -> Self {
        Self::unchanging(self.value.reached(threshold.value))
    }
    #[inline(always)]
    fn any(self) -> bool {
        self.value.any()
    }
    #[inline(always)]
    fn nearest(self) -> Self {
        Self::unchanging(self.value.nearest())
    }
    #[inline(always)]
    fn two_to(self) -> Self {
        Self::unchanging(self.value.two_to())
    }
    #[inline(always)]
    fn twos(self) -> Self {
        Self::unchanging(self.value.twos())
    }
    #[inline(always)]
    fn mantissa(self) -> Self {
        let value = self.value.mantissa();
        Self { value, change: self.change * D::of(value / self.value) }
    }
    #[inline(always)]
    fn floor(self, max: u32) -> V {
        self.value.floor(max)
    }
    #[inline(always)]
    fn rows<'p, 'a>(
        offsets: &'p mut [V::Place],
        table: &'a [V],
        columns: usize,
        row_number: impl FnMut(usize) -> V,
    ) -> V::Rows<'p, 'a> {
        V::rows(offsets, table, columns, row_number)
    }
    #[inline(always)]
    fn row<'a>(rows: V::Rows<'_, 'a>, i: usize) -> V::Row<'a> {
        V::row(rows, i)
    }
    #[inline(always)]
    fn four(row: V::Row<'_>, group: usize) -> [V; ABREAST] {
        V::four(row, group)
    }
    #[inline(always)]
    fn within(self, span: f32, outside: impl FnMut(usize)) {
        self.value.within(span, outside);
    }
}
