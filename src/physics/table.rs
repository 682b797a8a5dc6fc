//! Linear interpolation on the uniform temperature grid of a plan's tables, without a search.

use super::Real;
use crate::plan::layout::{ABREAST, TABLE_NODES, TABLE_STEP_K};

/// Position of a temperature in every table: the row below, an integer, and the fraction towards the next row.
#[derive(Clone, Copy)]
pub struct Spot<R: Real> {
    pub row: R::Still,
    pub share: R,
}

/// Position of a temperature. Above the last node the last segment is extrapolated: the fraction exceeds one.
#[inline(always)]
pub fn spot<R: Real>(temperature_k: R) -> Spot<R> {
    let position = temperature_k * R::fixed(1.0 / TABLE_STEP_K);
    let row = position.floor(TABLE_NODES as u32 - 2);
    Spot { row, share: position - row }
}

/// A table row at a table index, from one of its properties on.
#[derive(Clone, Copy)]
pub struct Segment<'a, R: Real> {
    pub row: R::Row<'a>,
    first_four: usize,
    share: R,
}

/// Segment at a table index of a table with `columns` columns that begins at `offset`.
#[inline(always)]
pub fn segment<R: Real>(table: &[R::Scalar], at: Spot<R>, columns: usize, offset: usize) -> Segment<'_, R> {
    let mut row_offset = [R::Place::default()];
    let rows = R::rows(
        &mut row_offset,
        &table[offset..],
        columns,
        #[inline(always)]
        |_| at.row,
    );
    read(rows, 0, at.share)
}

/// Segment of row `i`, with the fraction towards the next row.
#[inline(always)]
pub fn read<'a, R: Real>(rows: R::Rows<'_, 'a>, i: usize, share: R) -> Segment<'a, R> {
    Segment { row: R::row(rows, i), first_four: 0, share }
}

/// The same row from `properties` properties further on, an even number.
#[inline(always)]
pub fn beyond<R: Real>(segment: Segment<'_, R>, properties: usize) -> Segment<'_, R> {
    Segment { first_four: segment.first_four + 2 * properties / ABREAST, ..segment }
}

/// Interpolated value of a property.
#[inline(always)]
pub fn value<R: Real>(segment: Segment<'_, R>, property: usize) -> R {
    let [under, rise] = two(segment, property);
    segment.share * rise + under
}

/// Integral of a property from the table's start; its values at the nodes are the property two further on.
#[inline(always)]
pub fn integral<R: Real>(segment: Segment<'_, R>, property: usize) -> R {
    let [under, rise] = two(segment, property);
    let [risen, _] = two(segment, property + 2);
    let mean = segment.share * R::fixed(0.5) * rise + under;
    segment.share * R::fixed(TABLE_STEP_K) * mean + risen
}

/// Both columns of a property: its value at the node below, and its rise to the next node.
#[inline(always)]
fn two<R: Real>(segment: Segment<'_, R>, property: usize) -> [R::Still; 2] {
    let column = 2 * property;
    let group = R::four(segment.row, segment.first_four + column / ABREAST);
    [group[column % ABREAST], group[column % ABREAST + 1]]
}
