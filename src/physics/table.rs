//! Linear interpolation in the tables of a plan.
//!
//! Rows are table steps, found without a search; or they start at the nodes of the files too. If these are few besides
//! equal steps from an origin, a list has the origin and the others, which are counted up to a temperature. Else a
//! directory has an entry for each of many equal buckets of a step: the row at its start, and the two rows at most that
//! start within it.

use super::Real;
use crate::layout::{COLUMNS_PER_LOAD, ENTHALPY_COLUMNS, MAX_STATES, TABLE_STEP_K, TABLE_STEPS, TableLocation};

/// Position of a temperature in a table: the row, an integer, and the distance from its start in table steps.
#[derive(Clone, Copy)]
pub struct TableIndex<R: Real> {
    pub row: R::Constant,
    pub fraction: R,
}

/// The search for the row of a temperature in the table at a location.
#[derive(Clone, Copy)]
pub enum RowSearch<'a, R: Real> {
    /// Rows are the table steps, up to this one.
    Steps(u32),
    /// Rows are equal steps from an origin, and start at some further positions.
    List(R::Constant, &'a [R::Scalar]),
    /// A directory from this word on.
    Directory(&'a [R::Scalar], &'a TableLocation<u32>),
}

impl<'a, R: Real> RowSearch<'a, R> {
    /// The search of the table at a location.
    #[inline(always)]
    pub fn new(tables: &'a [R::Scalar], location: &'a TableLocation<u32>) -> Self {
        if location.directory == 0 {
            return Self::Steps(location.last_bucket);
        }
        let words = &tables[location.directory as usize..];
        if location.list_length == 0 {
            return Self::Directory(words, location);
        }
        Self::List(R::constant(words[0]), &words[COLUMNS_PER_LOAD..][..location.list_length as usize - 1])
    }
}

/// Position of a temperature in the table at a location. Above the last row that row is extrapolated.
#[inline(always)]
pub fn table_index<R: Real>(temperature_k: R, tables: &[R::Scalar], location: &TableLocation<u32>) -> TableIndex<R> {
    match RowSearch::<R>::new(tables, location) {
        RowSearch::Steps(last) => index_by_steps(temperature_k, last),
        RowSearch::List(origin, starts) => index_by_list(temperature_k, origin, starts),
        RowSearch::Directory(words, location) => index_by_directory(temperature_k, words, location),
    }
}

/// A temperature in table steps.
#[inline(always)]
fn in_steps<R: Real>(temperature_k: R) -> R {
    temperature_k * R::constant_from_f64(1.0 / TABLE_STEP_K)
}

/// [`table_index`] of a table whose rows are the table steps.
#[inline(always)]
pub fn index_by_steps<R: Real>(temperature_k: R, last: u32) -> TableIndex<R> {
    let position = in_steps(temperature_k);
    let row = position.floor_clamped(last);
    TableIndex { row, fraction: position - row }
}

/// [`table_index`] where rows are equal steps from an origin, and start at some further positions.
#[inline(always)]
pub fn index_by_list<R: Real>(temperature_k: R, origin: R::Constant, starts: &[R::Scalar]) -> TableIndex<R> {
    let position = in_steps(temperature_k);
    let step = (position - origin).floor_clamped(TABLE_STEPS as u32 - 1);
    let (mut row, mut own_start) = (step, step + origin);
    for &start in starts {
        let start = R::constant(start);
        let passed = position.reaches(start);
        row = row + passed;
        own_start = own_start.max(passed * start);
    }
    TableIndex { row, fraction: position - own_start }
}

/// [`table_index`] by a directory.
#[inline(always)]
pub fn index_by_directory<R: Real>(
    temperature_k: R,
    words: &[R::Scalar],
    location: &TableLocation<u32>,
) -> TableIndex<R> {
    let position = in_steps(temperature_k);
    let scaled = position * R::constant_from_f64(f64::from(location.buckets_per_step));
    let bucket = scaled.floor_clamped(location.last_bucket);
    let mut row_offset = [R::FIRST_ROW];
    let directory = R::table_rows(
        &mut row_offset,
        words,
        COLUMNS_PER_LOAD,
        #[inline(always)]
        |_| bucket,
    );
    let [row, start, first, second] = R::column_group(R::table_row(directory, 0), 0);
    let (past_first, past_second) = (position.reaches(first), position.reaches(second));
    let own_start =
        (R::constant_from_f64(1.0) - past_first) * start + (past_first - past_second) * first + past_second * second;
    TableIndex { row: row + past_first + past_second, fraction: position - own_start }
}

/// A table row at a table index, from one of its properties on.
#[derive(Clone, Copy)]
pub struct TableSegment<'a, R: Real> {
    pub row: R::TableRow<'a>,
    first_group: usize,
    fraction: R,
}

/// Segment at a table index of the table at a location.
#[inline(always)]
pub fn table_segment<'a, R: Real>(
    tables: &'a [R::Scalar],
    at: TableIndex<R>,
    location: &TableLocation<u32>,
) -> TableSegment<'a, R> {
    let mut row_offset = [R::FIRST_ROW];
    let rows = R::table_rows(
        &mut row_offset,
        &tables[location.offset as usize..],
        location.columns as usize,
        #[inline(always)]
        |_| at.row,
    );
    row_segment(rows, 0, at.fraction)
}

/// Segment of row `i`, with the distance from its start in table steps.
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

/// The first property of a segment, its integral from the start of the table, and its upper bound. The first property
/// of `steep` has the integral at the nodes, the second the upper bound.
#[inline(always)]
pub fn first_integral<R: Real>(segment: TableSegment<'_, R>, steep: TableSegment<'_, R>) -> [R; 3] {
    let ([under, rise], [risen, _]) = (column_pair(segment, 0), column_pair(steep, 0));
    let mean = segment.fraction * R::constant_from_f64(0.5) * rise + under;
    let integral = segment.fraction * R::constant_from_f64(TABLE_STEP_K) * mean + risen;
    [interpolate(segment, 0), integral, interpolate(steep, 1)]
}

/// The tabulated states of a cell: their number, the properties of each in a row, and the weights of their heat
/// capacities in that of the cell.
#[derive(Clone, Copy)]
pub struct TabulatedStates<R> {
    pub count: usize,
    pub properties: usize,
    pub weights: [R; MAX_STATES],
}

/// Weighted sum over the states of a property at the start of a row, and of its rise per table step. The property of
/// the next state is `stride` properties further on.
#[inline(always)]
fn state_sum<R: Real>(
    segment: TableSegment<'_, R>,
    property: usize,
    stride: usize,
    states: &TabulatedStates<R>,
) -> [R; 2] {
    let [start, rise] = column_pair(segment, property);
    let mut sum = [states.weights[0] * start, states.weights[0] * rise];
    for state in 1..MAX_STATES {
        if state < states.count {
            let [start, rise] = column_pair(segment, property + state * stride);
            sum = [sum[0] + states.weights[state] * start, sum[1] + states.weights[state] * rise];
        }
    }
    sum
}

/// Weighted sum of the heat capacities of the states at a temperature.
#[inline(always)]
pub fn heat_capacity_sum<R: Real>(segment: TableSegment<'_, R>, states: &TabulatedStates<R>) -> R {
    let [start, rise] = state_sum(segment, 1, states.properties, states);
    segment.fraction * rise + start
}

/// Rise of the temperature of a cell, K, for the enthalpy of a rise by `predicted_k` at its heat capacity, or, where
/// `reduced` is one and not zero, at the lower bound of it; and the lower bound over the heat capacity.
///
/// Within the row the rise is a root of the quadratic integral of the heat capacity, without a difference of
/// temperatures. Beyond, the row is found by bisection of the integrals at the starts of the rows.
#[inline(always)]
pub fn rise_by_enthalpy<R: Real>(
    temperature_k: R,
    predicted_k: R,
    reduced: R,
    tables: &[R::Scalar],
    location: &TableLocation<u32>,
    states: &TabulatedStates<R>,
) -> [R; 2] {
    let enthalpy_columns = (location.columns as usize - states.count * ENTHALPY_COLUMNS) / 2;
    let at = table_index(temperature_k, tables, location);
    let here = table_segment(tables, at, location);
    let start_at = |row: R::Constant| -> R {
        state_sum(table_segment(tables, row_start::<R>(row), location), 3, states.properties, states)[0]
    };
    let [capacity_start, slope] = state_sum(here, 1, states.properties, states);
    let heat_capacity = here.fraction * slope + capacity_start;
    let [least_start, least_rise] = state_sum(here, enthalpy_columns, ENTHALPY_COLUMNS / 2, states);
    let least = here.fraction * least_rise + least_start;
    let gained_j_kg = predicted_k * (reduced * least + (R::from_f64(1.0) - reduced) * heat_capacity);
    let own = rise_within_row(heat_capacity, slope, gained_j_kg);
    let own_start_j_kg = state_sum(here, 3, states.properties, states)[0];
    let mean = here.fraction * R::constant_from_f64(0.5) * slope + capacity_start;
    let sought_j_kg = here.fraction * R::constant_from_f64(TABLE_STEP_K) * mean + own_start_j_kg + gained_j_kg;
    let (zero, one) = (R::constant_from_f64(0.0), R::constant_from_f64(1.0));
    let last = R::constant_from_f64(f64::from(location.rows - 1));
    let next_start_j_kg = start_at((at.row + one).min(last));
    let passes_end = (sought_j_kg - next_start_j_kg).reaches(zero) * (one - at.row.reaches(last));
    let stays = (sought_j_kg - own_start_j_kg).reaches(zero) * (one - passes_end);
    // Most cells stay in their row: the search is for the others.
    if !(one - stays).any_nonzero() {
        return [own, least / heat_capacity];
    }
    let mut row = R::constant_from_f64(0.0);
    let mut span = location.enthalpy_search_span;
    while span > 0 {
        let step = R::constant_from_f64(f64::from(span));
        let next = (row + step).min(last);
        row = (row + (sought_j_kg - start_at(next)).reaches(zero) * step).min(last);
        span /= 2;
    }
    let found = table_segment(tables, row_start::<R>(row), location);
    let [capacity, slope] = state_sum(found, 1, states.properties, states);
    let [position, _] = column_pair(found, enthalpy_columns + 1);
    let from_start_k = rise_within_row(capacity, slope, sought_j_kg - start_at(row));
    let beyond_k = (from_start_k + position * R::constant_from_f64(TABLE_STEP_K)) - temperature_k;
    [own * stays + beyond_k * (one - stays), least / heat_capacity]
}

/// The start of a row.
#[inline(always)]
fn row_start<R: Real>(row: R::Constant) -> TableIndex<R> {
    TableIndex { row, fraction: R::from_f64(0.0) }
}

/// Temperature rise of an enthalpy rise, K, from a heat capacity with a slope per table step.
#[inline(always)]
fn rise_within_row<R: Real>(heat_capacity: R, slope: R, gained_j_kg: R) -> R {
    let zero = R::from_f64(0.0);
    let slope_j_kg_k2 = slope * R::constant_from_f64(1.0 / TABLE_STEP_K);
    let discriminant = heat_capacity * heat_capacity + (gained_j_kg + gained_j_kg) * slope_j_kg_k2;
    (gained_j_kg + gained_j_kg) / (heat_capacity + discriminant.max(zero).sqrt())
}

/// Both columns of a property: its value at the start of the row, and its rise per table step.
#[inline(always)]
fn column_pair<R: Real>(segment: TableSegment<'_, R>, property: usize) -> [R::Constant; 2] {
    let column = 2 * property;
    let group = R::column_group(segment.row, segment.first_group + column / COLUMNS_PER_LOAD);
    [group[column % COLUMNS_PER_LOAD], group[column % COLUMNS_PER_LOAD + 1]]
}
