//! A real number that counts its operations: the march, run on it, gives the work of a cell-step.

use bondline::ensemble::Ensemble;
use bondline::plan::Plan;
use bondline_physics::Real;
use bondline_physics::double_word::Omitted;
use bondline_physics::layout::COLUMNS_PER_LOAD;
use bondline_physics::member::Member;
use std::fmt::{self, Display, Formatter};
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::sync::atomic::{AtomicU64, Ordering};

#[derive(Clone, Copy)]
struct CountingReal(f64);

static SUMS: AtomicU64 = AtomicU64::new(0);
static PRODUCTS: AtomicU64 = AtomicU64::new(0);
static QUOTIENTS: AtomicU64 = AtomicU64::new(0);
static CHOICES: AtomicU64 = AtomicU64::new(0);
static LOADS: AtomicU64 = AtomicU64::new(0);

/// Operations of one cell-step.
pub(crate) struct OperationCounts {
    pub sums: f64,
    pub products: f64,
    pub quotients: f64,
    /// Minima, maxima and the like, not counted as arithmetic.
    pub choices: f64,
    /// Properties read from tables, each as value and increment to the next node.
    pub loads: f64,
}

impl OperationCounts {
    /// Additions, subtractions, multiplications and divisions, counted equally.
    pub(crate) fn flops(&self) -> f64 {
        self.sums + self.products + self.quotients
    }

    /// Count the operations of one march of the nominal member; work per step or per march is averaged over the cells.
    pub(crate) fn of(plan: &Plan, nominal: &Ensemble) -> Self {
        let counters = [&SUMS, &PRODUCTS, &QUOTIENTS, &CHOICES, &LOADS];
        counters.iter().for_each(|counter| counter.store(0, Ordering::Relaxed));
        let factors = nominal.member(0);
        let column = |column: u32| CountingReal(if column == 0 { 1.0 } else { factors[column as usize - 1] });
        if plan.rows().gas.is_some() {
            march::<true>(plan, column);
        } else {
            march::<false>(plan, column);
        }
        let cell_steps = (plan.cells() * plan.steps()) as f64;
        let [sums, products, quotients, choices, loads] =
            counters.map(|counter| counter.load(Ordering::Relaxed) as f64 / cell_steps);
        Self { sums, products, quotients, choices, loads }
    }
}

impl Display for OperationCounts {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { sums, products, quotients, choices, loads } = self;
        write!(
            f,
            "{:.0} flops: {sums:.0} additions, {products:.0} multiplications, {quotients:.1} divisions; ",
            self.flops()
        )?;
        write!(f, "besides {choices:.0} choices and {loads:.0} properties read from tables")
    }
}

fn march<const GAS: bool>(plan: &Plan, column: impl Fn(u32) -> CountingReal + Copy) {
    let mut member = Member::<CountingReal, GAS>::start(plan.rows(), &plan.rows().data, column);
    for turn in 0..=plan.steps() {
        member.advance(turn, |_| ());
    }
}

fn count(counter: &AtomicU64) {
    counter.fetch_add(1, Ordering::Relaxed);
}

macro_rules! operator {
    ($trait:ident, $method:ident, $counter:ident) => {
        impl $trait for CountingReal {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                count(&$counter);
                Self($trait::$method(self.0, other.0))
            }
        }
    };
}

operator!(Add, add, SUMS);
operator!(Sub, sub, SUMS);
operator!(Mul, mul, PRODUCTS);
operator!(Div, div, QUOTIENTS);

impl Neg for CountingReal {
    type Output = Self;
    // A negation is fused into the next operation.
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Real for CountingReal {
    type Scalar = f64;
    type Constant = Self;
    type SecondWord<T: Copy + Send + Sync> = Omitted;
    type RowOffset = usize;
    type TableRows<'p, 'a> = <f64 as Real>::TableRows<'p, 'a>;
    type TableRow<'a> = &'a [f64];
    const LANES: usize = 1;
    const FIRST_ROW: Self::RowOffset = 0;
    const MANTISSA_BITS: u32 = 52;

    fn scalar(value: f64) -> f64 {
        value
    }
    fn splat(value: f64) -> Self {
        Self(value)
    }
    fn from_lanes(mut lane: impl FnMut(usize) -> f64) -> Self {
        Self(lane(0))
    }
    fn lane(self, _lane: usize) -> f64 {
        self.0
    }
    fn max(self, other: Self) -> Self {
        count(&CHOICES);
        Self(Real::max(self.0, other.0))
    }
    fn min(self, other: Self) -> Self {
        count(&CHOICES);
        Self(Real::min(self.0, other.0))
    }
    fn flush_tiny(self, least: Self) -> Self {
        count(&CHOICES);
        Self(Real::flush_tiny(self.0, least.0))
    }
    fn sub_mul_flushed(self, by: Self, before: Self, least: Self) -> Self {
        self - by * Real::flush_tiny(before, least)
    }
    fn sqrt(self) -> Self {
        count(&QUOTIENTS);
        Self(self.0.sqrt())
    }
    fn ge_mask(self, mark: Self) -> Self {
        count(&CHOICES);
        Self(Real::ge_mask(self.0, mark.0))
    }
    fn reaches(self, mark: Self) -> Self {
        Real::ge_mask(self, mark)
    }
    fn any_nonzero(self) -> bool {
        count(&CHOICES);
        Real::any_nonzero(self.0)
    }
    fn round_ties_even(self) -> Self {
        Self(Real::round_ties_even(self.0))
    }
    fn power_of_two(self) -> Self {
        Self(Real::power_of_two(self.0))
    }
    fn exponent(self) -> Self {
        Self(Real::exponent(self.0))
    }
    fn mantissa(self) -> Self {
        Self(Real::mantissa(self.0))
    }
    fn floor_clamped(self, most: u32) -> Self {
        Self(Real::floor_clamped(self.0, most))
    }
    fn table_rows<'p, 'a>(
        places: &'p mut [usize],
        table: &'a [f64],
        columns: usize,
        mut row: impl FnMut(usize) -> Self,
    ) -> Self::TableRows<'p, 'a> {
        <f64 as Real>::table_rows(places, table, columns, |i| row(i).0)
    }
    fn table_row<'a>(rows: Self::TableRows<'_, 'a>, i: usize) -> &'a [f64] {
        <f64 as Real>::table_row(rows, i)
    }
    fn column_group(row: &[f64], four: usize) -> [Self; COLUMNS_PER_LOAD] {
        count(&LOADS);
        <f64 as Real>::column_group(row, four).map(Self)
    }
    fn for_lanes_outside(self, span: f32, lane: impl FnMut(usize)) {
        count(&CHOICES);
        Real::for_lanes_outside(self.0, span, lane);
    }
}
