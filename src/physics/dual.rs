//! A number with how it changes along some directions: marched, it gives a member and its exact derivatives at once.
//!
//! `(a, a′)(b, b′) = (ab, a′b + ab′)`, and so on through every operation (Clifford 1873). The number is one member's, its
//! changes lie side by side in a vector, one direction a lane: all that costs most in a member alone, to find rows of tables, to
//! wait for a pivot, is done once, and most of the rest in vectors that would else be empty. The road not taken, the scheme
//! differentiated by hand, is every formula of this folder a second time, to be kept true by hand.

pub mod directions;

use super::Real;
use crate::plan::layout::ABREAST;
use directions::Directions;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A value, and how it changes by one unit of each direction. Lane zero is the value, the others are the directions.
#[derive(Clone, Copy)]
pub struct Dual<V, D> {
    value: V,
    change: D,
}

impl<V: Real<Scalar = V>, D: Directions<V>> Dual<V, D> {
    /// A value that changes along no direction.
    #[inline(always)]
    fn unchanging(value: V) -> Self {
        Self { value, change: D::of(V::constant(0.0)) }
    }

    /// The minimum or maximum of two equal values: the other one, with the mean of both changes, as a central
    /// difference has it. Either change alone would be the derivative on one side only, and zero where the other
    /// operand is a constant.
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
    fn add(self, still: V) -> Self {
        Self { value: self.value + still, change: self.change }
    }
}

impl<V: Real<Scalar = V>, D: Directions<V>> Sub<V> for Dual<V, D> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, still: V) -> Self {
        Self { value: self.value - still, change: self.change }
    }
}

impl<V: Real<Scalar = V>, D: Directions<V>> Mul<V> for Dual<V, D> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, still: V) -> Self {
        Self { value: self.value * still, change: self.change * D::of(still) }
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
    fn settled(self, least: Self) -> Self {
        Self { value: self.value.settled(least.value), change: self.change.settled(D::of(least.value)) }
    }
    #[inline(always)]
    fn less_times(self, by: Self, before: Self, least: Self) -> Self {
        // −(by′ before + by before′), operation for operation.
        let less = by.change * D::of(-before.value.settled(least.value));
        let less = less.less_times(D::of(by.value), before.change, D::of(least.value));
        Self { value: self.value.less_times(by.value, before.value, least.value), change: self.change + less }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        Self { value, change: self.change * D::of(V::constant(0.5) / value) }
    }
    #[inline(always)]
    fn reached(self, mark: Self) -> Self {
        Self::unchanging(self.value.reached(mark.value))
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
    fn floor(self, most: u32) -> V {
        self.value.floor(most)
    }
    #[inline(always)]
    fn rows<'p, 'a>(
        places: &'p mut [V::Place],
        table: &'a [V],
        columns: usize,
        row: impl FnMut(usize) -> V,
    ) -> V::Rows<'p, 'a> {
        V::rows(places, table, columns, row)
    }
    #[inline(always)]
    fn row<'a>(rows: V::Rows<'_, 'a>, i: usize) -> V::Row<'a> {
        V::row(rows, i)
    }
    #[inline(always)]
    fn four(row: V::Row<'_>, four: usize) -> [V; ABREAST] {
        V::four(row, four)
    }
    #[inline(always)]
    fn within(self, span: f32, lane: impl FnMut(usize)) {
        self.value.within(span, lane);
    }
}
