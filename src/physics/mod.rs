//! How one member moves: one text, generic over [`Real`], with a WGSL twin for each file in `shaders/`.
//!
//! `C(T) dT/dt = F_above − F_below` on finite volumes, heat flux positive towards the back face. The twins
//! hold the same functions in the same order and do the same operations in the same order, which is why
//! loops here run over indices: likeness to the shader is worth more than idiom.

mod carrying;
pub mod compensated;
mod conducting;
pub mod decomposition;
pub mod dual;
mod energy;
pub mod exponential;
pub mod faces;
mod flowing;
pub mod gas;
mod gauges;
pub mod holder;
pub mod lanes;
pub mod material;
pub mod member;
mod mixing;
mod reacting;
pub mod reading;
mod sensors;
mod state;
pub mod step;
mod system;
pub mod table;
pub mod tridiagonal;

use crate::plan::layout::ABREAST;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// γ of the time scheme, 1 − 1/√2: see [`step`].
const GAMMA: f64 = 0.292_893_218_813_452_4;

/// Twin files: the Rust text under `src/physics`, the WGSL text under `shaders`.
#[cfg(test)]
pub const TWINS: &[&str] = &[
    "compensated",
    "exponential",
    "table",
    "material",
    "decomposition",
    "gas",
    "faces",
    "tridiagonal",
    "reading",
    "member",
    "mixing",
    "holder",
    "reacting",
    "flowing",
    "carrying",
    "conducting",
    "system",
    "sensors",
    "gauges",
    "energy",
    "step",
];

/// The constants of the twins by their names in WGSL, whose text has no numbers of its own for them.
#[cfg(feature = "gpu")]
pub(crate) fn constants() -> Vec<(String, f64)> {
    let named = [
        ("LOG2_E", exponential::LOG2_E),
        ("LN_2", std::f64::consts::LN_2),
        ("LN_2_HIGH", exponential::LN_2_HIGH),
        ("LN_2_LOW", exponential::LN_2_LOW),
        ("LARGEST", exponential::LARGEST),
        ("STEFAN_BOLTZMANN", faces::STEFAN_BOLTZMANN),
        ("LEAST", tridiagonal::LEAST),
        ("EASE", reacting::EASE),
        ("LEAST_LEFT", reacting::LEAST_LEFT),
        ("PRESSURE_GAMMA", flowing::PRESSURE_GAMMA),
        ("LEAST_PASSING", flowing::LEAST_PASSING),
        ("VIRGIN_LOST", gauges::VIRGIN_LOST),
        ("CHAR_LOST", gauges::CHAR_LOST),
        ("VIRGIN_LOG_ODDS", gauges::VIRGIN_LOG_ODDS),
        ("CHAR_LOG_ODDS", gauges::CHAR_LOG_ODDS),
        ("CONVERSION_LEAST", gauges::CONVERSION_LEAST),
        ("GAMMA", GAMMA),
        ("STRAY_MARGIN_K", f64::from(step::STRAY_MARGIN_K)),
        ("STRAY_SPAN_K", f64::from(step::STRAY_SPAN_K)),
    ];
    let of_series = |name: &str, series: &[f64]| {
        let named = series.iter().enumerate().map(|(power, &term)| (format!("{name}_{power}"), term));
        named.collect::<Vec<_>>()
    };
    let mut all: Vec<_> = named.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    all.extend(of_series("SERIES", &exponential::SERIES));
    all.extend(of_series("SHORT", &exponential::SHORT_SERIES));
    all
}

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
    + Add<<Self as Real>::Still, Output = Self>
    + Sub<<Self as Real>::Still, Output = Self>
    + Mul<<Self as Real>::Still, Output = Self>
{
    /// What the rows of a plan hold.
    type Scalar: Copy + PartialEq + Send + Sync;
    /// A number that no factor changes, as those of rows and tables: what a dual number is multiplied by for half the work. Other numbers
    /// are their own.
    type Still: Real<Scalar = Self::Scalar, Still = Self::Still>;
    /// Where the row of a table begins, one a lane.
    type Place: Copy + Default + Send + Sync;
    /// The rows of a table at some places.
    type Rows<'p, 'a>: Copy;
    /// A row of a table, one a lane.
    type Row<'a>: Copy;
    /// Lanes, that is members carried at once.
    const LANES: usize;
    /// Binary digits behind the first.
    const DIGITS: u32;

    fn scalar(value: f64) -> Self::Scalar;
    /// The same value in every lane.
    fn of(value: Self::Scalar) -> Self;
    fn constant(value: f64) -> Self {
        Self::of(Self::scalar(value))
    }
    fn still(value: Self::Scalar) -> Self::Still {
        Self::Still::of(value)
    }
    fn fixed(value: f64) -> Self::Still {
        Self::Still::constant(value)
    }
    fn from_lanes(lane: impl FnMut(usize) -> f64) -> Self;
    /// The value of one lane.
    fn lane(self, lane: usize) -> f64;
    fn max(self, other: Self) -> Self;
    fn min(self, other: Self) -> Self;
    /// Zero where it is nearer zero than `least` in f32; in f64 what it is.
    fn settled(self, least: Self) -> Self;
    /// It less `by` times what [`settled`](Self::settled) makes of `before`.
    fn less_times(self, by: Self, before: Self, least: Self) -> Self;
    fn sqrt(self) -> Self;
    /// One where it is not below `mark`, else zero.
    fn reached(self, mark: Self) -> Self;
    /// Whether any lane is not zero.
    fn any(self) -> bool;
    /// The whole number nearest, of two as near the even one.
    fn nearest(self) -> Self;
    /// Two to the power of a whole number within ±126.
    fn two_to(self) -> Self;
    /// The whole power of two under a positive number, as f32 holds it.
    fn twos(self) -> Self;
    /// The number over that power of two: one to two.
    fn mantissa(self) -> Self;
    /// The whole number under it, from zero to `most`.
    fn floor(self, most: u32) -> Self::Still;
    /// The rows of a table of so many columns that whole numbers count to; where they begin is kept in as many places.
    fn rows<'p, 'a>(
        places: &'p mut [Self::Place],
        table: &'a [Self::Scalar],
        columns: usize,
        row: impl FnMut(usize) -> Self::Still,
    ) -> Self::Rows<'p, 'a>;
    /// One of them.
    fn row<'a>(rows: Self::Rows<'_, 'a>, i: usize) -> Self::Row<'a>;
    /// One four of the columns of a row.
    fn four(row: Self::Row<'_>, four: usize) -> [Self::Still; ABREAST];
    /// Whether each lane lies in zero to `span`; by its bits, which also tells what is no number.
    fn within(self, span: f32, lane: impl FnMut(usize));
}

macro_rules! scalar {
    ($real:ty, $settles:expr, $whole:expr, $bias:expr, $digits:expr) => {
        impl Real for $real {
            type Scalar = $real;
            type Still = $real;
            type Place = usize;
            type Rows<'p, 'a> = (&'p [usize], &'a [$real], usize);
            type Row<'a> = &'a [$real];
            const LANES: usize = 1;
            const DIGITS: u32 = $digits;

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
                if $settles && self.abs() < least { 0.0 } else { self }
            }
            #[inline(always)]
            fn less_times(self, by: Self, before: Self, least: Self) -> Self {
                if $settles && before.abs() < least { self } else { self - by * before }
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                <$real>::sqrt(self)
            }
            #[inline(always)]
            fn reached(self, mark: Self) -> Self {
                if self >= mark { 1.0 } else { 0.0 }
            }
            #[inline(always)]
            fn any(self) -> bool {
                self != 0.0
            }
            #[inline(always)]
            fn nearest(self) -> Self {
                (self + $whole) - $whole
            }
            #[inline(always)]
            fn two_to(self) -> Self {
                // The last bits of the sum are the exponent.
                <$real>::from_bits((self + ($whole + $bias)).to_bits() << $digits)
            }
            #[inline(always)]
            fn twos(self) -> Self {
                (((self as f32).to_bits() >> 23) as i32 - 127) as $real
            }
            #[inline(always)]
            fn mantissa(self) -> Self {
                f32::from_bits((self as f32).to_bits() & 0x007f_ffff | 0x3f80_0000).into()
            }
            #[inline(always)]
            fn floor(self, most: u32) -> Self {
                // What is no number counts as none. By way of an integer takes longer than all else that is done to a spot.
                let inside = Real::min(Real::max(self, 0.0), most as $real);
                let nearest = inside.nearest();
                if nearest > inside { nearest - 1.0 } else { nearest }
            }
            #[inline(always)]
            fn rows<'p, 'a>(
                places: &'p mut [usize],
                table: &'a [$real],
                columns: usize,
                mut row: impl FnMut(usize) -> $real,
            ) -> Self::Rows<'p, 'a> {
                for (i, place) in places.iter_mut().enumerate() {
                    // The last 22 bits of the sum are the number.
                    *place = columns * ((row(i) + $whole).to_bits() as usize & 0x003f_ffff);
                }
                (places, table, columns)
            }
            #[inline(always)]
            fn row<'a>((places, table, columns): Self::Rows<'_, 'a>, i: usize) -> &'a [$real] {
                &table[places[i]..places[i] + columns]
            }
            #[inline(always)]
            fn four(row: &[$real], four: usize) -> [Self; ABREAST] {
                row.as_chunks().0[four]
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

// So large that the next number is one more: adding it rounds to a whole number, halves to the even one.
scalar!(f32, true, 12_582_912.0, 127.0, 23);
scalar!(f64, false, 6_755_399_441_055_744.0, 1023.0, 52);
