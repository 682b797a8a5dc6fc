//! Table rows, one a lane: loaded in groups of four columns, then transposed so that each column is a vector.
//!
//! Loading single numbers took half of a march, and gather instructions are no faster.

use super::F64Lanes;
use crate::dual::directions::{Directions, DoubleWidth};
use crate::layout::COLUMNS_PER_LOAD;
use simdeez::engines::scalar::Scalar;
use simdeez::prelude::*;

/// Largest number of lanes of a vector.
pub const MAX_LANES: usize = 16;

/// Offset of each lane's row in a table.
pub(super) type RowOffsets<const LANES: usize> = [u32; LANES];

/// Table rows at given offsets, none of which reaches past the end of the table.
#[derive(Clone, Copy)]
pub struct TableRows<'p, 'a, T, const LANES: usize> {
    table: &'a [T],
    columns: usize,
    offsets: &'p [RowOffsets<LANES>],
}

/// One row a lane.
#[derive(Clone, Copy)]
pub struct TableRow<'a, T, const LANES: usize> {
    table: &'a [T],
    columns: usize,
    offsets: [u32; LANES],
}

impl<'p, 'a, T, const LANES: usize> TableRows<'p, 'a, T, LANES> {
    /// Stores the offsets, clamped to the last row. Checking them at each read instead takes a tenth of the read.
    #[inline(always)]
    pub(super) fn new(
        places: &'p mut [RowOffsets<LANES>],
        table: &'a [T],
        columns: usize,
        mut place: impl FnMut(usize) -> RowOffsets<LANES>,
    ) -> Self {
        let last = table.len().checked_sub(columns).and_then(|last| u32::try_from(last).ok());
        let last = last.expect("a table has at least one row and fewer than 2³² numbers");
        for (i, starts) in places.iter_mut().enumerate() {
            *starts = place(i);
            for start in starts {
                *start = (*start).min(last);
            }
        }
        Self { table, columns, offsets: places }
    }

    /// Row `i` of each lane.
    #[inline(always)]
    pub(super) fn row(self, i: usize, lanes: usize) -> TableRow<'a, T, LANES> {
        let starts = &self.offsets[i];
        // Loads each offset from memory: in a vector register they would be extracted one by one and spilled (AVX-512,
        // f32: 11.8 ns a cell-step against 8.1). The result does not depend on it. Four offsets are not put into a
        // vector, and `black_box` would cost a tenth of the march.
        let starts = if lanes > 4 { std::hint::black_box(starts) } else { starts };
        TableRow { table: self.table, columns: self.columns, offsets: *starts }
    }
}

impl<T, const LANES: usize> TableRow<'_, T, LANES> {
    /// Start of a column group in the first row of the table.
    #[inline(always)]
    fn column_start(&self, group: usize) -> usize {
        let place = COLUMNS_PER_LOAD * group;
        // A message with the numbers would have each cell store them for it.
        assert!(place + COLUMNS_PER_LOAD <= self.columns, "a column group beyond the row");
        place
    }
}

/// A SIMD engine that reads tables.
pub trait SimdTables: Simd {
    /// Tangents of a dual number in f64: at least eight directions on SIMD engines, so that most layups need one march
    /// a member (AVX2: 3.3 ms for seven directions, 4.5 ms as two marches of four).
    type Directions: Directions<f64>;

    /// Offsets of the rows with these numbers in a table of `columns` columns.
    #[inline(always)]
    fn row_offsets_f64(row: Self::Vf64, columns: usize) -> RowOffsets<8> {
        let mut rows = [0.0; 8];
        store(row, &mut rows);
        let mut offsets = [0; 8];
        for (offset, row) in offsets.iter_mut().zip(rows) {
            *offset = row as u32 * columns as u32;
        }
        offsets
    }

    /// One column group of the rows.
    #[inline(always)]
    fn column_group_f64(row: TableRow<'_, f64, 8>, group: usize) -> [Self::Vf64; COLUMNS_PER_LOAD] {
        let [a, b, c, d] = transpose::<f64, 8>(row, group, Self::Vf64::WIDTH);
        [load(&a), load(&b), load(&c), load(&d)]
    }

    /// Whether any lane is not zero.
    #[inline(always)]
    fn any_nonzero_f64(lanes: Self::Vf64) -> bool {
        lanes.abs().horizontal_add() != 0.0
    }

    /// In f32.
    #[inline(always)]
    fn row_offsets_f32(row: Self::Vf32, columns: usize) -> RowOffsets<16> {
        let mut rows = [0.0; 16];
        store(row, &mut rows);
        let mut offsets = [0; 16];
        for (offset, row) in offsets.iter_mut().zip(rows) {
            *offset = row as u32 * columns as u32;
        }
        offsets
    }

    #[inline(always)]
    fn column_group_f32(row: TableRow<'_, f32, 16>, group: usize) -> [Self::Vf32; COLUMNS_PER_LOAD] {
        let [a, b, c, d] = transpose::<f32, 16>(row, group, Self::Vf32::WIDTH);
        [load(&a), load(&b), load(&c), load(&d)]
    }

    #[inline(always)]
    fn any_nonzero_f32(lanes: Self::Vf32) -> bool {
        lanes.abs().horizontal_add() != 0.0
    }
}

/// Columns of four numbers a lane, loaded one by one.
#[inline(always)]
fn transpose<T: Copy + Default, const LANES: usize>(
    row: TableRow<'_, T, LANES>,
    group: usize,
    lanes: usize,
) -> [[T; MAX_LANES]; COLUMNS_PER_LOAD] {
    let place = row.column_start(group);
    let mut columns = [[T::default(); MAX_LANES]; COLUMNS_PER_LOAD];
    for lane in 0..lanes {
        let start = row.offsets[lane] as usize + place;
        for (column, &value) in columns.iter_mut().zip(&row.table[start..start + COLUMNS_PER_LOAD]) {
            column[lane] = value;
        }
    }
    columns
}

/// Store a vector at the start of a slice. `SimdBaseIo::copy_to_slice` is not always inlined.
#[inline(always)]
#[expect(unsafe_code, reason = "whole vectors; see the safety comment")]
pub(super) fn store<V: SimdBaseIo>(vector: V, slice: &mut [V::Scalar]) {
    assert!(V::WIDTH <= slice.len(), "{} lanes for {} numbers", V::WIDTH, slice.len());
    // SAFETY: the slice holds at least as many numbers as the vector.
    unsafe { vector.copy_to_ptr_unaligned(slice.as_mut_ptr()) };
}

/// Load a vector from the start of a slice.
#[inline(always)]
#[expect(unsafe_code, reason = "whole vectors; see the safety comment")]
pub(super) fn load<V: SimdBaseIo>(slice: &[V::Scalar]) -> V {
    assert!(V::WIDTH <= slice.len(), "{} lanes of {} numbers", V::WIDTH, slice.len());
    // SAFETY: as in `store`.
    unsafe { V::load_from_ptr_unaligned(slice.as_ptr()) }
}

impl SimdTables for Scalar {
    type Directions = F64Lanes<Self>;
}

#[cfg(target_arch = "aarch64")]
impl SimdTables for simdeez::engines::neon::Neon {
    type Directions = DoubleWidth<DoubleWidth<F64Lanes<Self>>>;
}

#[cfg(target_arch = "x86_64")]
#[expect(unsafe_code, reason = "SIMD loads; see the safety comments")]
mod x86_64 {
    use super::{DoubleWidth, F64Lanes, RowOffsets, SimdTables, TableRow};
    use crate::layout::COLUMNS_PER_LOAD;
    use simdeez::engines::avx2::{Avx2, F32x8, F64x4};
    use simdeez::engines::avx512::{Avx512, F32x16, F64x8};
    use simdeez::prelude::SimdBaseIo;
    use std::arch::x86_64::*;

    // Safety, of all blocks: members are given such vectors only on processors with these instructions
    // (`instruction_set.rs`). `TableRows::new` keeps every row within its table, and `TableRow::column_start` every
    // column group within its row.

    impl SimdTables for Avx512 {
        type Directions = F64Lanes<Self>;

        #[inline(always)]
        fn row_offsets_f64(row: F64x8, columns: usize) -> RowOffsets<8> {
            let mut places = [0; 8];
            // SAFETY: see above.
            unsafe {
                let place = _mm512_mul_pd(row.underlying_value(), _mm512_set1_pd(columns as f64));
                _mm256_storeu_si256(places.as_mut_ptr().cast(), _mm512_cvttpd_epu32(place));
            }
            places
        }

        #[inline(always)]
        fn column_group_f64(row: TableRow<'_, f64, 8>, group: usize) -> [F64x8; COLUMNS_PER_LOAD] {
            let place = row.column_start(group);
            // SAFETY: see above.
            unsafe {
                let first = row.table.as_ptr().add(place);
                let (a, b) = (two_rows_f64(first, &row.offsets, 0), two_rows_f64(first, &row.offsets, 1));
                let (c, d) = (two_rows_f64(first, &row.offsets, 2), two_rows_f64(first, &row.offsets, 3));
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

        /// One comparison; a sum over lanes takes three shuffles and sums.
        #[inline(always)]
        fn any_nonzero_f64(lanes: F64x8) -> bool {
            // SAFETY: see above.
            unsafe { _mm512_cmp_pd_mask::<_CMP_NEQ_UQ>(lanes.underlying_value(), _mm512_setzero_pd()) != 0 }
        }

        #[inline(always)]
        fn any_nonzero_f32(lanes: F32x16) -> bool {
            // SAFETY: see above.
            unsafe { _mm512_cmp_ps_mask::<_CMP_NEQ_UQ>(lanes.underlying_value(), _mm512_setzero_ps()) != 0 }
        }

        #[inline(always)]
        fn row_offsets_f32(row: F32x16, columns: usize) -> RowOffsets<16> {
            let mut places = [0; 16];
            // SAFETY: see above.
            unsafe {
                let place = _mm512_mul_ps(row.underlying_value(), _mm512_set1_ps(columns as f32));
                _mm512_storeu_si512(places.as_mut_ptr().cast(), _mm512_cvttps_epu32(place));
            }
            places
        }

        #[inline(always)]
        fn column_group_f32(row: TableRow<'_, f32, 16>, group: usize) -> [F32x16; COLUMNS_PER_LOAD] {
            let place = row.column_start(group);
            // SAFETY: see above.
            unsafe {
                let first = row.table.as_ptr().add(place);
                let (a, b) = (four_rows_f32(first, &row.offsets, 0), four_rows_f32(first, &row.offsets, 1));
                let (c, d) = (four_rows_f32(first, &row.offsets, 2), four_rows_f32(first, &row.offsets, 3));
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

    impl SimdTables for Avx2 {
        type Directions = DoubleWidth<F64Lanes<Self>>;

        #[inline(always)]
        fn row_offsets_f64(row: F64x4, columns: usize) -> RowOffsets<8> {
            let mut places = [0; 8];
            // SAFETY: see above.
            unsafe {
                let place = _mm256_mul_pd(row.underlying_value(), _mm256_set1_pd(columns as f64));
                _mm256_storeu_si256(places.as_mut_ptr().cast(), _mm256_zextsi128_si256(_mm256_cvttpd_epi32(place)));
            }
            places
        }

        #[inline(always)]
        fn column_group_f64(row: TableRow<'_, f64, 8>, group: usize) -> [F64x4; COLUMNS_PER_LOAD] {
            let place = row.column_start(group);
            // SAFETY: see above.
            unsafe {
                let first = row.table.as_ptr().add(place);
                let (a, b) = (half_rows_f64(first, &row.offsets, 0), half_rows_f64(first, &row.offsets, 1));
                let (c, d) =
                    (half_rows_f64(first.add(2), &row.offsets, 0), half_rows_f64(first.add(2), &row.offsets, 1));
                [
                    F64x4::from_underlying_value(_mm256_unpacklo_pd(a, b)),
                    F64x4::from_underlying_value(_mm256_unpackhi_pd(a, b)),
                    F64x4::from_underlying_value(_mm256_unpacklo_pd(c, d)),
                    F64x4::from_underlying_value(_mm256_unpackhi_pd(c, d)),
                ]
            }
        }

        #[inline(always)]
        fn row_offsets_f32(row: F32x8, columns: usize) -> RowOffsets<16> {
            let mut places = [0; 16];
            // SAFETY: see above.
            unsafe {
                let place = _mm256_mul_ps(row.underlying_value(), _mm256_set1_ps(columns as f32));
                _mm256_storeu_si256(places.as_mut_ptr().cast(), _mm256_cvttps_epi32(place));
            }
            places
        }

        #[inline(always)]
        fn column_group_f32(row: TableRow<'_, f32, 16>, group: usize) -> [F32x8; COLUMNS_PER_LOAD] {
            let place = row.column_start(group);
            // SAFETY: see above.
            unsafe {
                let first = row.table.as_ptr().add(place);
                let (a, b) = (two_rows_f32(first, &row.offsets, 0), two_rows_f32(first, &row.offsets, 1));
                let (c, d) = (two_rows_f32(first, &row.offsets, 2), two_rows_f32(first, &row.offsets, 3));
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

    // The loads are functions and not closures: only a function can be asked to be inlined here on stable Rust, and a
    // call that is left passes vectors through memory.

    /// Four numbers of lanes `lane` and `lane + 4`.
    #[inline(always)]
    unsafe fn two_rows_f64(first: *const f64, offsets: &RowOffsets<8>, lane: usize) -> __m512d {
        // SAFETY: see above.
        unsafe {
            let low = _mm256_loadu_pd(first.add(offsets[lane] as usize));
            let high = _mm256_loadu_pd(first.add(offsets[lane + 4] as usize));
            _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(low), high)
        }
    }

    /// Two numbers of lanes `lane` and `lane + 2`. A full load would be split again, which costs more than two half
    /// loads.
    #[inline(always)]
    unsafe fn half_rows_f64(first: *const f64, offsets: &RowOffsets<8>, lane: usize) -> __m256d {
        // SAFETY: see above.
        unsafe {
            let low = _mm_loadu_pd(first.add(offsets[lane] as usize));
            let high = _mm_loadu_pd(first.add(offsets[lane + 2] as usize));
            _mm256_set_m128d(high, low)
        }
    }

    /// Four numbers of lanes `lane`, `lane + 4`, `lane + 8` and `lane + 12`.
    #[inline(always)]
    unsafe fn four_rows_f32(first: *const f32, offsets: &RowOffsets<16>, lane: usize) -> __m512 {
        // SAFETY: see above.
        unsafe {
            let low = two_rows_f32(first, offsets, lane);
            let high = two_rows_f32(first, offsets, lane + 8);
            _mm512_insertf32x8::<1>(_mm512_castps256_ps512(low), high)
        }
    }

    /// Four numbers of lanes `lane` and `lane + 4`.
    #[inline(always)]
    unsafe fn two_rows_f32(first: *const f32, offsets: &RowOffsets<16>, lane: usize) -> __m256 {
        // SAFETY: see above.
        unsafe {
            let low = _mm_loadu_ps(first.add(offsets[lane] as usize));
            let high = _mm_loadu_ps(first.add(offsets[lane + 4] as usize));
            _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(low), high)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_past_the_end_of_a_table_are_clamped_to_the_last_row() {
        let mut places = [[0; 8]; 2];
        let rows = TableRows::new(&mut places, &[0.0; 16], 8, |i| [0, 1, 8, 8, 0, 7 + 2 * i as u32, 3, u32::MAX]);
        assert_eq!(rows.row(0, 8).offsets, [0, 1, 8, 8, 0, 7, 3, 8]);
        assert_eq!(rows.row(1, 4).offsets, [0, 1, 8, 8, 0, 8, 3, 8]);
    }
}
