//! Rows of tables, one a lane: loaded four numbers at a time as they lie, then turned so that each column is a vector.
//!
//! Half of a march was once spent on picking the numbers up one by one. Gathering loads are no way out, as processors pick
//! them up one by one too.

use super::{Doubles, Singles};
use crate::physics::dual::directions::{Directions, Twofold};
use crate::plan::layout::ABREAST;
use simdeez::engines::scalar::Scalar;
use simdeez::prelude::*;

/// Most lanes that a vector has.
pub(super) const WIDEST: usize = 16;

/// Where the row of each lane begins in a table.
#[derive(Clone, Copy)]
pub struct Places<const LANES: usize>([u32; LANES]);

/// The rows of a table of so many columns, none of which reaches past its end.
#[derive(Clone, Copy)]
pub struct Rows<'a, T, const LANES: usize> {
    table: &'a [T],
    columns: usize,
    starts: [u32; LANES],
}

impl<'a, T, const LANES: usize> Rows<'a, T, LANES> {
    #[inline(always)]
    pub(super) fn new(places: &Places<LANES>, table: &'a [T], columns: usize) -> Self {
        let last = table.len().checked_sub(columns).and_then(|last| u32::try_from(last).ok());
        let last = last.expect("a table has rows, and fewer numbers than a u32 counts");
        assert!(places.0.iter().fold(true, |all, &place| all & (place <= last)), "a row begins beyond {last}");
        // Read from where they lie, a load each: taken for a vector they are pulled out of it one by one, and for want of
        // registers written to memory again (11.8 ns a cell-step in f32, 8.1 so). What is read does not depend on it.
        Self { table, columns, starts: *std::hint::black_box(&places.0) }
    }

    /// Where four numbers stand in the first row of the table.
    #[inline(always)]
    fn place(&self, four: usize) -> usize {
        // A copy of the number, as a message that borrowed it would keep all of this in memory.
        let (place, columns) = (ABREAST * four, self.columns);
        assert!(place + ABREAST <= columns, "the columns from {place} on, of {columns}");
        place
    }
}

/// A set of vectors that reads tables.
pub trait Abreast: Simd {
    /// What holds the changes of a dual number in f64: eight directions at least where there are vectors, so that those of most
    /// layups go beside one march of their member. With AVX2 7 took 3.3 ms where two marches of four took 4.5.
    type Directions64: Directions<f64>;
    type Directions32: Directions<f32>;

    /// Where the rows of a table of so many columns begin that whole numbers count to.
    #[inline(always)]
    fn places_f64(row: Self::Vf64, columns: usize) -> Places<8> {
        let mut rows = [0.0; 8];
        row.copy_to_slice(&mut rows);
        Places(rows.map(|row| row as u32 * columns as u32))
    }

    /// One four of the columns of rows.
    #[inline(always)]
    fn four_f64(rows: Rows<'_, f64, 8>, four: usize) -> [Self::Vf64; ABREAST] {
        turned(rows, four, Self::Vf64::WIDTH).map(|column: [f64; WIDEST]| Self::Vf64::load_from_slice(&column))
    }

    /// Whether any lane is not zero.
    #[inline(always)]
    fn any_f64(lanes: Self::Vf64) -> bool {
        lanes.abs().horizontal_add() != 0.0
    }

    /// The same in f32.
    #[inline(always)]
    fn places_f32(row: Self::Vf32, columns: usize) -> Places<16> {
        let mut rows = [0.0; 16];
        row.copy_to_slice(&mut rows);
        Places(rows.map(|row| row as u32 * columns as u32))
    }

    #[inline(always)]
    fn four_f32(rows: Rows<'_, f32, 16>, four: usize) -> [Self::Vf32; ABREAST] {
        turned(rows, four, Self::Vf32::WIDTH).map(|column: [f32; WIDEST]| Self::Vf32::load_from_slice(&column))
    }

    #[inline(always)]
    fn any_f32(lanes: Self::Vf32) -> bool {
        lanes.abs().horizontal_add() != 0.0
    }
}

/// Columns of four numbers a lane, picked up one by one.
#[inline(always)]
fn turned<T: Copy + Default, const LANES: usize>(
    rows: Rows<'_, T, LANES>,
    four: usize,
    lanes: usize,
) -> [[T; WIDEST]; ABREAST] {
    let place = rows.place(four);
    let mut columns = [[T::default(); WIDEST]; ABREAST];
    for lane in 0..lanes {
        let start = rows.starts[lane] as usize + place;
        for (column, &value) in columns.iter_mut().zip(&rows.table[start..start + ABREAST]) {
            column[lane] = value;
        }
    }
    columns
}

impl Abreast for Scalar {
    type Directions64 = Doubles<Self>;
    type Directions32 = Singles<Self>;
}

#[cfg(target_arch = "aarch64")]
impl Abreast for simdeez::engines::neon::Neon {
    type Directions64 = Twofold<Twofold<Doubles<Self>>>;
    type Directions32 = Twofold<Singles<Self>>;
}

#[cfg(target_arch = "x86_64")]
#[expect(unsafe_code, reason = "argued at the blocks")]
mod x86_64 {
    use super::{Abreast, Doubles, Places, Rows, Singles, Twofold};
    use crate::plan::layout::ABREAST;
    use simdeez::engines::avx2::{Avx2, F32x8, F64x4};
    use simdeez::engines::avx512::{Avx512, F32x16, F64x8};
    use simdeez::prelude::SimdBaseIo;
    use std::arch::x86_64::*;

    // Safety, of all blocks: only a processor that has these instructions is given members in such vectors
    // (`march/cpu.rs`). `Rows::new` sees that no row reaches past the end of its table, and `Rows::place` that what is read of
    // a row is within it.

    impl Abreast for Avx512 {
        type Directions64 = Doubles<Self>;
        type Directions32 = Singles<Self>;

        #[inline(always)]
        fn places_f64(row: F64x8, columns: usize) -> Places<8> {
            let mut places = [0; 8];
            // SAFETY: see above.
            unsafe {
                let place = _mm512_mul_pd(row.underlying_value(), _mm512_set1_pd(columns as f64));
                _mm256_storeu_si256(places.as_mut_ptr().cast(), _mm512_cvttpd_epu32(place));
            }
            Places(places)
        }

        #[inline(always)]
        fn four_f64(rows: Rows<'_, f64, 8>, four: usize) -> [F64x8; ABREAST] {
            let place = rows.place(four);
            // SAFETY: see above.
            unsafe {
                let first = rows.table.as_ptr().add(place);
                let of = |lane: usize| _mm256_loadu_pd(first.add(rows.starts[lane] as usize));
                let both = |lane: usize| _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(of(lane)), of(lane + 4));
                let (a, b, c, d) = (both(0), both(1), both(2), both(3));
                let (even, odd) = (_mm512_unpacklo_pd(a, b), _mm512_unpackhi_pd(a, b));
                let (even_on, odd_on) = (_mm512_unpacklo_pd(c, d), _mm512_unpackhi_pd(c, d));
                let near = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
                let far = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
                [
                    F64x8::from_underlying_value(_mm512_permutex2var_pd(even, near, even_on)),
                    F64x8::from_underlying_value(_mm512_permutex2var_pd(odd, near, odd_on)),
                    F64x8::from_underlying_value(_mm512_permutex2var_pd(even, far, even_on)),
                    F64x8::from_underlying_value(_mm512_permutex2var_pd(odd, far, odd_on)),
                ]
            }
        }

        /// A comparison, where a sum over lanes would be three of shuffles and sums.
        #[inline(always)]
        fn any_f64(lanes: F64x8) -> bool {
            // SAFETY: see above.
            unsafe { _mm512_cmp_pd_mask::<_CMP_NEQ_UQ>(lanes.underlying_value(), _mm512_setzero_pd()) != 0 }
        }

        #[inline(always)]
        fn any_f32(lanes: F32x16) -> bool {
            // SAFETY: see above.
            unsafe { _mm512_cmp_ps_mask::<_CMP_NEQ_UQ>(lanes.underlying_value(), _mm512_setzero_ps()) != 0 }
        }

        #[inline(always)]
        fn places_f32(row: F32x16, columns: usize) -> Places<16> {
            let mut places = [0; 16];
            // SAFETY: see above.
            unsafe {
                let place = _mm512_mul_ps(row.underlying_value(), _mm512_set1_ps(columns as f32));
                _mm512_storeu_si512(places.as_mut_ptr().cast(), _mm512_cvttps_epu32(place));
            }
            Places(places)
        }

        #[inline(always)]
        fn four_f32(rows: Rows<'_, f32, 16>, four: usize) -> [F32x16; ABREAST] {
            let place = rows.place(four);
            // SAFETY: see above.
            unsafe {
                let first = rows.table.as_ptr().add(place);
                let of = |lane: usize| _mm_loadu_ps(first.add(rows.starts[lane] as usize));
                let all = |lane: usize| {
                    let half = _mm512_insertf32x4::<1>(_mm512_castps128_ps512(of(lane)), of(lane + 4));
                    _mm512_insertf32x4::<3>(_mm512_insertf32x4::<2>(half, of(lane + 8)), of(lane + 12))
                };
                let (a, b, c, d) = (all(0), all(1), all(2), all(3));
                let low = _mm512_castps_pd(_mm512_unpacklo_ps(a, b));
                let high = _mm512_castps_pd(_mm512_unpackhi_ps(a, b));
                let low_on = _mm512_castps_pd(_mm512_unpacklo_ps(c, d));
                let high_on = _mm512_castps_pd(_mm512_unpackhi_ps(c, d));
                [
                    F32x16::from_underlying_value(_mm512_castpd_ps(_mm512_unpacklo_pd(low, low_on))),
                    F32x16::from_underlying_value(_mm512_castpd_ps(_mm512_unpackhi_pd(low, low_on))),
                    F32x16::from_underlying_value(_mm512_castpd_ps(_mm512_unpacklo_pd(high, high_on))),
                    F32x16::from_underlying_value(_mm512_castpd_ps(_mm512_unpackhi_pd(high, high_on))),
                ]
            }
        }
    }

    impl Abreast for Avx2 {
        type Directions64 = Twofold<Doubles<Self>>;
        type Directions32 = Singles<Self>;

        #[inline(always)]
        fn places_f64(row: F64x4, columns: usize) -> Places<8> {
            let mut places = [0; 8];
            // SAFETY: see above.
            unsafe {
                let place = _mm256_mul_pd(row.underlying_value(), _mm256_set1_pd(columns as f64));
                _mm_storeu_si128(places.as_mut_ptr().cast(), _mm256_cvttpd_epi32(place));
            }
            Places(places)
        }

        #[inline(always)]
        fn four_f64(rows: Rows<'_, f64, 8>, four: usize) -> [F64x4; ABREAST] {
            let place = rows.place(four);
            // SAFETY: see above.
            unsafe {
                let first = rows.table.as_ptr().add(place);
                let of = |lane: usize| _mm256_loadu_pd(first.add(rows.starts[lane] as usize));
                let (a, b, c, d) = (of(0), of(1), of(2), of(3));
                let (even, odd) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
                let (even_on, odd_on) = (_mm256_unpacklo_pd(c, d), _mm256_unpackhi_pd(c, d));
                [
                    F64x4::from_underlying_value(_mm256_permute2f128_pd::<0x20>(even, even_on)),
                    F64x4::from_underlying_value(_mm256_permute2f128_pd::<0x20>(odd, odd_on)),
                    F64x4::from_underlying_value(_mm256_permute2f128_pd::<0x31>(even, even_on)),
                    F64x4::from_underlying_value(_mm256_permute2f128_pd::<0x31>(odd, odd_on)),
                ]
            }
        }

        #[inline(always)]
        fn places_f32(row: F32x8, columns: usize) -> Places<16> {
            let mut places = [0; 16];
            // SAFETY: see above.
            unsafe {
                let place = _mm256_mul_ps(row.underlying_value(), _mm256_set1_ps(columns as f32));
                _mm256_storeu_si256(places.as_mut_ptr().cast(), _mm256_cvttps_epi32(place));
            }
            Places(places)
        }

        #[inline(always)]
        fn four_f32(rows: Rows<'_, f32, 16>, four: usize) -> [F32x8; ABREAST] {
            let place = rows.place(four);
            // SAFETY: see above.
            unsafe {
                let first = rows.table.as_ptr().add(place);
                let of = |lane: usize| _mm_loadu_ps(first.add(rows.starts[lane] as usize));
                let both = |lane: usize| _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(of(lane)), of(lane + 4));
                let (a, b, c, d) = (both(0), both(1), both(2), both(3));
                let low = _mm256_castps_pd(_mm256_unpacklo_ps(a, b));
                let high = _mm256_castps_pd(_mm256_unpackhi_ps(a, b));
                let low_on = _mm256_castps_pd(_mm256_unpacklo_ps(c, d));
                let high_on = _mm256_castps_pd(_mm256_unpackhi_ps(c, d));
                [
                    F32x8::from_underlying_value(_mm256_castpd_ps(_mm256_unpacklo_pd(low, low_on))),
                    F32x8::from_underlying_value(_mm256_castpd_ps(_mm256_unpackhi_pd(low, low_on))),
                    F32x8::from_underlying_value(_mm256_castpd_ps(_mm256_unpacklo_pd(high, high_on))),
                    F32x8::from_underlying_value(_mm256_castpd_ps(_mm256_unpackhi_pd(high, high_on))),
                ]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_that_would_reach_past_the_end_of_its_table_is_not_read() {
        let is_read = |place| {
            let places = Places([0, 1, 8, 8, 0, place, 3, 0]);
            std::panic::catch_unwind(|| Rows::new(&places, &[0.0; 16], 8).columns).is_ok()
        };
        assert!(is_read(8), "the last row there is room for");
        assert!(!is_read(9));
    }
}
