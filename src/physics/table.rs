//! Linear interpolation on the uniform temperature grid of a plan's tables, without a search.

use super::Real;
use crate::layout::{COLUMNS_PER_LOAD, TABLE_NODES, TABLE_STEP_K};

/// Position of a temperature in every table: the row below, an integer, and the fraction towards the next row.
#[derive(Clone, Copy)]
pub struct TableIndex<R: Real> {
    pub row: R::Constant,
    pub fraction: R,
}

/// Position of a temperature. Above the last node the last segment is extrapolated: the fraction exceeds one.
#[inline(always)]
pub fn table_index<R: Real>(temperature_k: R) -> TableIndex<R> {
    let position = temperature_k * R::constant_from_f64(1.0 / TABLE_STEP_K);
    let row = position.floor_clamped(TABLE_NODES as u32 - 2);
    TableIndex { row, fraction: position - row }
}

/// A table row at a table index, from one of its properties on.
#[derive(Clone, Copy)]
pub struct TableSegment<'a, R: Real> {
    pub row: R::TableRow<'a>,
    first_group: usize,
    fraction: R,
}

/// Segment at a table index of a table with `columns` columns that begins at `offset`.
#[inline(always)]
pub fn table_segment<R: Real>(
    table: &[R::Scalar],
    at: TableIndex<R>,
    columns: usize,
    offset: usize,
) -> TableSegment<'_, R> {
    let mut row_offset = [R::FIRST_ROW];
    let rows = R::table_rows(
        &mut row_offset,
        &table[offset..],
        columns,
        #[inline(always)]
        |_| at.row,
    );
    row_segment(rows, 0, at.fraction)
}

/// Segment of row `i`, with the fraction towards the next row.
#[inline(always)]
pub fn row_segment<'a, R: Real>(rows: R::TableRows<'_, 'a>, i: usize, share: R) -> TableSegment<'a, R> {
    TableSegment { row: R::table_row(rows, i), first_group: 0, fraction: share }
}

/// The same row from `properties` properties further on, an even number.
#[inline(always)]
pub fn column_offset<R: Real>(segment: TableSegment<'_, R>, properties: usize) -> TableSegment<'_, R> {
    TableSegment { first_group: segment.first_group + 2 * properties / COLUMNS_PER_LOAD, ..segment }
}

/// Interpolated value of a property.
#[inline(always)]
pub fn interpolate<R: Real>(segment: TableSegment<'_, R>, property: usize) -> R {
    let [under, rise] = column_pair(segment, property);
    segment.fraction * rise + under
}

/// Integral of a property from the table's start; its values at the nodes are the property two further on.
#[inline(always)]
pub fn integral<R: Real>(segment: TableSegment<'_, R>, property: usize) -> R {
    let [under, rise] = column_pair(segment, property);
    let [risen, _] = column_pair(segment, property + 2);
    let mean = segment.fraction * R::constant_from_f64(0.5) * rise + under;
    segment.fraction * R::constant_from_f64(TABLE_STEP_K) * mean + risen
}

/// Both columns of a property: its value at the node below, and its rise to the next node.
#[inline(always)]
fn column_pair<R: Real>(segment: TableSegment<'_, R>, property: usize) -> [R::Constant; 2] {
    let column = 2 * property;
    let group = R::column_group(segment.row, segment.first_group + column / COLUMNS_PER_LOAD);
    [group[column % COLUMNS_PER_LOAD], group[column % COLUMNS_PER_LOAD + 1]]
}
