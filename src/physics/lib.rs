//! The physics of one member, written once and generic over [`Real`]; each file has a WGSL twin in `shaders/`.
//!
//! `C(T) dT/dt = F_above − F_below` on finite volumes, heat flux positive towards the back face. Both twins hold the
//! same functions in the same order and do the same operations in the same order. Loops therefore run over indices, as
//! in the shader.
//!
//! A package of its own, internal to `bondline`: its kernels are a third of the optimisation. They compile beside the
//! rest, and once for the library and its tests.
#![expect(missing_docs, reason = "not part of the public interface")]

pub mod cell_state;
pub mod compensated;
mod conduction;
mod darcy_flow;
pub mod decomposition;
pub mod double_word;
pub mod dual;
mod energy;
pub mod exponential;
pub mod gas;
mod gas_advection;
mod gauges;
pub mod holder;
pub mod instruction_set;
pub mod kernel;
pub mod lanes;
pub mod layout;
pub mod material;
pub mod member;
mod mixture;
mod pyrolysis;
mod sensors;
mod state;
pub mod step;
pub mod surface_flux;
mod system;
pub mod table;
pub mod thermocouple;
pub mod tridiagonal;

use double_word::{Omitted, SecondWord, Stored};
use layout::COLUMNS_PER_LOAD;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// γ of the time scheme, 1 − 1/√2: see [`step`].
const GAMMA: f64 = 0.292_893_218_813_452_4;

/// Twin files: the Rust text under `src/physics`, the WGSL text under `shaders`.
pub const TWINS: &[&str] = &[
    "compensated",
    "exponential",
    "table",
    "material",
    "decomposition",
    "gas",
    "surface_flux",
    "tridiagonal",
    "thermocouple",
    "member",
    "mixture",
    "holder",
    "pyrolysis",
    "darcy_flow",
    "gas_advection",
    "conduction",
    "system",
    "sensors",
    "gauges",
    "energy",
    "step",
];

/// The constants of the twins by their names in WGSL, whose text has no numbers of its own for them.
pub fn constants() -> Vec<(String, f64)> {
    let named = [
        ("LOG2_E", exponential::LOG2_E),
        ("LN_2", std::f64::consts::LN_2),
        ("LN_2_HIGH", exponential::LN_2_HIGH),
        ("LN_2_LOW", exponential::LN_2_LOW),
        ("EXP_ARGUMENT_MAX", exponential::EXP_ARGUMENT_MAX),
        ("STEFAN_BOLTZMANN", surface_flux::STEFAN_BOLTZMANN),
        ("FLUSH_THRESHOLD", tridiagonal::FLUSH_THRESHOLD),
        ("LOG_RATE_MAX", decomposition::LOG_RATE_MAX),
        ("EXPOSURE_MAX", decomposition::EXPOSURE_MAX),
        ("DAMPING_SHARE", pyrolysis::DAMPING_SHARE),
        ("REACTANT_MIN", pyrolysis::REACTANT_MIN),
        ("PRESSURE_GAMMA", darcy_flow::PRESSURE_GAMMA),
        ("CONDUCTANCE_MIN", darcy_flow::CONDUCTANCE_MIN),
        ("STORAGE_MIN", darcy_flow::STORAGE_MIN),
        ("VIRGIN_CONVERSION", gauges::VIRGIN_CONVERSION),
        ("CHAR_CONVERSION", gauges::CHAR_CONVERSION),
        ("VIRGIN_LOG_ODDS", gauges::VIRGIN_LOG_ODDS),
        ("CHAR_LOG_ODDS", gauges::CHAR_LOG_ODDS),
        ("CONVERSION_MIN", gauges::CONVERSION_MIN),
        ("BEND_MIN_K_M", thermocouple::BEND_MIN_K_M),
        ("GAMMA", GAMMA),
        ("EXCESS_ALLOWED", step::EXCESS_ALLOWED),
        ("DIVERGENCE_MARGIN_K", f64::from(step::DIVERGENCE_MARGIN_K)),
        ("DIVERGENCE_SPAN_K", f64::from(step::DIVERGENCE_SPAN_K)),
    ];
    let coefficients = |name: &str, series: &[f64]| {
        let named = series.iter().enumerate().map(|(power, &term)| (format!("{name}_{power}"), term));
        named.collect::<Vec<_>>()
    };
    let mut all: Vec<_> = named.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    all.extend(coefficients("SERIES_F64", &exponential::SERIES_F64));
    all.extend(coefficients("SERIES_F32", &exponential::SERIES_F32));
    all
}

/// The number type of a march: `f64`, `f32` (bit for bit the shader's arithmetic), or SIMD lanes of either.
pub trait Real:
    Copy
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<<Self as Real>::Constant, Output = Self>
    + Sub<<Self as Real>::Constant, Output = Self>
    + Mul<<Self as Real>::Constant, Output = Self>
{
    /// The scalar of a plan's rows.
    type Scalar: Copy + PartialEq + Send + Sync;
    /// A number that no factor changes, such as those of rows and tables. Multiplying a dual number by one costs half a
    /// product of two dual numbers. Other number types are their own `Constant`.
    type Constant: Real<Scalar = Self::Scalar, Constant = Self::Constant>;
    /// Second word of a [`DoubleWord`](double_word::DoubleWord) of numbers `T`: stored in f32, omitted in f64.
    type SecondWord<T: Copy + Send + Sync>: SecondWord<T>;
    /// Offset of the table row of each lane.
    type RowOffset: Copy + Send + Sync;
    /// Table rows at given offsets.
    type TableRows<'p, 'a>: Copy;
    /// One table row a lane.
    type TableRow<'a>: Copy;
    /// Members marched at once.
    const LANES: usize;
    /// The first row of a table in every lane.
    const FIRST_ROW: Self::RowOffset;
    /// Mantissa bits, without the leading one.
    const MANTISSA_BITS: u32;

    fn scalar(value: f64) -> Self::Scalar;
    /// The same value in every lane.
    fn splat(value: Self::Scalar) -> Self;
    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        Self::splat(Self::scalar(value))
    }
    #[inline(always)]
    fn constant(value: Self::Scalar) -> Self::Constant {
        Self::Constant::splat(value)
    }
    #[inline(always)]
    fn constant_from_f64(value: f64) -> Self::Constant {
        Self::Constant::from_f64(value)
    }
    fn from_lanes(lane: impl FnMut(usize) -> f64) -> Self;
    /// The value of one lane.
    fn lane(self, lane: usize) -> f64;
    fn max(self, other: Self) -> Self;
    fn min(self, other: Self) -> Self;
    /// Zero if |self| < `threshold` in f32; the value itself in f64.
    fn flush_tiny(self, threshold: Self) -> Self;
    /// `self − factor × before`, with `before` flushed as by [`flush_tiny`](Self::flush_tiny).
    fn sub_mul_flushed(self, factor: Self, before: Self, threshold: Self) -> Self;
    fn sqrt(self) -> Self;
    /// One if self ≥ `threshold`, else zero.
    fn ge_mask(self, threshold: Self) -> Self;
    /// One if the value ≥ `threshold`, else zero, without derivatives.
    fn reaches(self, threshold: Self::Constant) -> Self::Constant;
    /// Whether any lane is not zero.
    fn any_nonzero(self) -> bool;
    /// Rounds to the nearest integer, ties to even.
    fn round_ties_even(self) -> Self;
    /// 2ⁿ of an integer n within ±126.
    fn power_of_two(self) -> Self;
    /// Binary exponent of a positive number, in f32.
    fn exponent(self) -> Self;
    /// Mantissa of a positive number, in f32: from one to two.
    fn mantissa(self) -> Self;
    /// Largest integer not above the value, clamped to 0…`max`.
    fn floor_clamped(self, max: u32) -> Self::Constant;
    /// Rows of a table with `columns` columns, by the row number of each; stores their offsets in `offsets`.
    fn table_rows<'p, 'a>(
        offsets: &'p mut [Self::RowOffset],
        table: &'a [Self::Scalar],
        columns: usize,
        row_number: impl FnMut(usize) -> Self::Constant,
    ) -> Self::TableRows<'p, 'a>;
    /// Row `i`.
    fn table_row<'a>(rows: Self::TableRows<'_, 'a>, i: usize) -> Self::TableRow<'a>;
    /// One group of `COLUMNS_PER_LOAD` columns of a row.
    fn column_group(row: Self::TableRow<'_>, group: usize) -> [Self::Constant; COLUMNS_PER_LOAD];
    /// Calls `outside` for each lane outside 0…`span`. Compares bits, so that NaN is outside.
    fn for_lanes_outside(self, span: f32, outside: impl FnMut(usize));
}

macro_rules! scalar {
    ($real:ty, $second_word:ty, $flushes:expr, $rounding_magic:expr, $bias:expr, $mantissa_bits:expr) => {
        impl Real for $real {
            type Scalar = $real;
            type SecondWord<T: Copy + Send + Sync> = $second_word;
            type Constant = $real;
            type RowOffset = usize;
            type TableRows<'p, 'a> = (&'p [usize], &'a [$real], usize);
            type TableRow<'a> = &'a [$real];
            const LANES: usize = 1;
            const FIRST_ROW: usize = 0;
            const MANTISSA_BITS: u32 = $mantissa_bits;

            #[inline(always)]
            fn scalar(value: f64) -> $real {
                value as $real
            }
            #[inline(always)]
            fn splat(value: $real) -> Self {
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
            fn flush_tiny(self, threshold: Self) -> Self {
                if $flushes && self.abs() < threshold { 0.0 } else { self }
            }
            #[inline(always)]
            fn sub_mul_flushed(self, factor: Self, before: Self, threshold: Self) -> Self {
                if $flushes && before.abs() < threshold { self } else { self - factor * before }
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                <$real>::sqrt(self)
            }
            #[inline(always)]
            fn ge_mask(self, threshold: Self) -> Self {
                if self >= threshold { 1.0 } else { 0.0 }
            }
            #[inline(always)]
            fn reaches(self, threshold: Self) -> Self {
                Real::ge_mask(self, threshold)
            }
            #[inline(always)]
            fn any_nonzero(self) -> bool {
                self != 0.0
            }
            #[inline(always)]
            fn round_ties_even(self) -> Self {
                (self + $rounding_magic) - $rounding_magic
            }
            #[inline(always)]
            fn power_of_two(self) -> Self {
                // The low bits of the sum are the biased exponent.
                <$real>::from_bits((self + ($rounding_magic + $bias)).to_bits() << $mantissa_bits)
            }
            #[inline(always)]
            fn exponent(self) -> Self {
                (((self as f32).to_bits() >> 23) as i32 - 127) as $real
            }
            #[inline(always)]
            fn mantissa(self) -> Self {
                f32::from_bits((self as f32).to_bits() & 0x007f_ffff | 0x3f80_0000).into()
            }
            #[inline(always)]
            fn floor_clamped(self, max: u32) -> Self {
                // NaN becomes zero. A conversion to an integer and back would take longer than the rest of the table
                // look-up.
                let inside = Real::min(Real::max(self, 0.0), max as $real);
                // The method of `$real` itself is a call of the C library.
                let nearest = Real::round_ties_even(inside);
                if nearest > inside { nearest - 1.0 } else { nearest }
            }
            #[inline(always)]
            fn table_rows<'p, 'a>(
                offsets: &'p mut [usize],
                table: &'a [$real],
                columns: usize,
                mut row_number: impl FnMut(usize) -> $real,
            ) -> Self::TableRows<'p, 'a> {
                for (i, offset) in offsets.iter_mut().enumerate() {
                    // The low 22 bits of the sum are the integer.
                    *offset = columns * ((row_number(i) + $rounding_magic).to_bits() as usize & 0x003f_ffff);
                }
                (offsets, table, columns)
            }
            #[inline(always)]
            fn table_row<'a>((offsets, table, columns): Self::TableRows<'_, 'a>, i: usize) -> &'a [$real] {
                &table[offsets[i]..offsets[i] + columns]
            }
            #[inline(always)]
            fn column_group(row: &[$real], group: usize) -> [Self; COLUMNS_PER_LOAD] {
                row.as_chunks().0[group]
            }
            #[inline(always)]
            fn for_lanes_outside(self, span: f32, mut outside: impl FnMut(usize)) {
                if (self as f32).to_bits() > span.to_bits() {
                    outside(0);
                }
            }
        }
    };
}

// 1.5 × 2^(mantissa bits): the spacing there is one, so adding it rounds to an integer, ties to even.
scalar!(f32, Stored<T>, true, 12_582_912.0, 127.0, 23);
scalar!(f64, Omitted, false, 6_755_399_441_055_744.0, 1023.0, 52);
