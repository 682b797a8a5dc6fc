//! Look-up in tables on the uniform temperature grid of a plan: a floor and a lerp, no search.

use super::Real;
use crate::plan::layout::{ABREAST, TABLE_NODES, TABLE_STEP_K};

/// Where a temperature falls in every table: the row under it, a whole number, and the share of the way to the next.
#[derive(Clone, Copy)]
pub struct Spot<R: Real> {
    pub row: R::Still,
    pub share: R,
}

/// Beyond the last node the end segment goes on, as the share passes one.
#[inline(always)]
pub fn spot<R: Real>(temperature_k: R) -> Spot<R> {
    let position = temperature_k * R::fixed(1.0 / TABLE_STEP_K);
    let row = position.floor(TABLE_NODES as u32 - 2);
    Spot { row, share: position - row }
}

/// The row of a table under a spot, from one of its properties on: all that they are read from.
#[derive(Clone, Copy)]
pub struct Segment<'a, R: Real> {
    pub row: R::Row<'a>,
    first_four: usize,
    share: R,
}

/// The row under a spot in a table of `columns` columns that begins at `offset`.
#[inline(always)]
pub fn segment<R: Real>(table: &[R::Scalar], spot: Spot<R>, columns: usize, offset: usize) -> Segment<'_, R> {
    let mut place = [R::Place::default()];
    let rows = R::rows(
        &mut place,
        &table[offset..],
        columns,
        #[inline(always)]
        |_| spot.row,
    );
    read(rows, 0, spot.share)
}

/// One of the rows of a table, and the share of the way to the next.
#[inline(always)]
pub fn read<'a, R: Real>(rows: R::Rows<'_, 'a>, i: usize, share: R) -> Segment<'a, R> {
    Segment { row: R::row(rows, i), first_four: 0, share }
}

/// The same row from as many properties further on, an even number.
#[inline(always)]
pub fn beyond<R: Real>(segment: Segment<'_, R>, properties: usize) -> Segment<'_, R> {
    Segment { first_four: segment.first_four + 2 * properties / ABREAST, ..segment }
}

/// The value of one property.
#[inline(always)]
pub fn value<R: Real>(segment: Segment<'_, R>, property: usize) -> R {
    let [under, rise] = two(segment, property);
    segment.share * rise + under
}

/// The integral of a property from the table's start, whose value at the nodes is the property two on.
#[inline(always)]
pub fn integral<R: Real>(segment: Segment<'_, R>, property: usize) -> R {
    let [under, rise] = two(segment, property);
    let [risen, _] = two(segment, property + 2);
    let mean = segment.share * R::fixed(0.5) * rise + under;
    segment.share * R::fixed(TABLE_STEP_K) * mean + risen
}

/// The two columns of a property: its value at the node under the spot, and by how much it rises to the next.
#[inline(always)]
fn two<R: Real>(segment: Segment<'_, R>, property: usize) -> [R::Still; 2] {
    let column = 2 * property;
    let four = R::four(segment.row, segment.first_four + column / ABREAST);
    [four[column % ABREAST], four[column % ABREAST + 1]]
}
