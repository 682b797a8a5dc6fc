//! Look-up in tables on the uniform temperature grid of a plan: a floor and a lerp, no search.

use super::Real;
use crate::plan::layout::{TABLE_NODES, TABLE_STEP_K};

/// Where a temperature falls in every table: the row under it, and the share of the way to the next.
#[derive(Clone, Copy)]
pub struct Spot<R: Real> {
    pub row: R::Row,
    pub share: R,
}

/// Beyond the last node the end segment goes on, as the share passes one.
#[inline(always)]
pub fn spot<R: Real>(temperature_k: R) -> Spot<R> {
    let position = temperature_k * R::constant(1.0 / TABLE_STEP_K);
    let row = position.max(R::constant(0.0)).row(TABLE_NODES as u32 - 2);
    Spot { row, share: position - R::from_row(row) }
}

/// The two rows of a table around a spot: all that its columns are read from there.
#[derive(Clone, Copy)]
pub struct Segment<'a, R: Real> {
    window: R::Window<'a>,
    columns: usize,
    share: R,
}

/// The rows around a spot in a table of `columns` columns that begins at `offset`.
#[inline(always)]
pub fn segment<R: Real>(table: &[R::Scalar], spot: Spot<R>, columns: usize, offset: usize) -> Segment<'_, R> {
    Segment { window: R::window(table, spot.row, columns, offset, 2 * columns), columns, share: spot.share }
}

/// The value of one column.
#[inline(always)]
pub fn value<R: Real>(segment: Segment<'_, R>, column: usize) -> R {
    let under = R::pick(segment.window, column);
    let over = R::pick(segment.window, segment.columns + column);
    under + segment.share * (over - under)
}

/// The integral of a column from the table's start, whose value at the nodes is the column after it.
#[inline(always)]
pub fn integral<R: Real>(segment: Segment<'_, R>, column: usize) -> R {
    let under = R::pick(segment.window, column);
    let over = R::pick(segment.window, segment.columns + column);
    let mean = under + R::constant(0.5) * segment.share * (over - under);
    R::pick(segment.window, column + 1) + R::constant(TABLE_STEP_K) * segment.share * mean
}
