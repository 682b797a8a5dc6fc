//! A real number that counts its operations: the march, run on it, gives the work of a cell-step.

use bondline::ensemble::Ensemble;
use bondline::physics::Real;
use bondline::physics::member::Member;
use bondline::plan::Plan;
use bondline::plan::layout::ABREAST;
use std::fmt::{self, Display, Formatter};
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::sync::atomic::{AtomicU64, Ordering};

#[derive(Clone, Copy)]
struct Counted(f64);

static SUMS: AtomicU64 = AtomicU64::new(0);
static PRODUCTS: AtomicU64 = AtomicU64::new(0);
static QUOTIENTS: AtomicU64 = AtomicU64::new(0);
static CHOICES: AtomicU64 = AtomicU64::new(0);
static LOADS: AtomicU64 = AtomicU64::new(0);

/// Operations of one cell-step.
pub(crate) struct Work {
    pub sums: f64,
    pub products: f64,
    pub quotients: f64,
    /// Minima, maxima and the like, not counted as arithmetic.
    pub choices: f64,
    /// Properties read from tables, each as value and increment to the next node.
    pub loads: f64,
}

impl Work {
    /// Additions, subtractions, multiplications and divisions, counted equally.
    pub(crate) fn flops(&self) -> f64 {
        self.sums + self.products + self.quotients
    }

    /// Count the operations of one march of the nominal member; work per step or per march is averaged over the cells.
    pub(crate) fn of(plan: &Plan, nominal: &Ensemble) -> Self {
        let counters = [&SUMS, &PRODUCTS, &QUOTIENTS, &CHOICES, &LOADS];
        counters.iter().for_each(|counter| counter.store(0, Ordering::Relaxed));
        let factors = nominal.member(0);
        let column = |column: u32| Counted(if column == 0 { 1.0 } else { factors[column as usize - 1] });
        if plan.gas().is_some() {
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

impl Display for Work {
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

fn march<const GAS: bool>(plan: &Plan, column: impl Fn(u32) -> Counted + Copy) {
    let mut member = Member::<Counted, GAS>::start(plan, plan.rows(), column);
    for turn in 0..=plan.steps() {
        member.advance(turn, |_| ());
    }
}

fn count(counter: &AtomicU64) {
    counter.fetch_add(1, Ordering::Relaxed);
}

macro_rules! operator {
    ($trait:ident, $method:ident, $counter:ident) => {
        impl $trait for Counted {
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

impl Neg for Counted {
    type Output = Self;
    // A negation is fused into the next operation.
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Real for Counted {
    type Scalar = f64;
    type Still = Self;
    type Place = usize;
    type Rows<'p, 'a> = <f64 as Real>::Rows<'p, 'a>;
    type Row<'a> = &'a [f64];
    const LANES: usize = 1;
    const DIGITS: u32 = 52;

    fn scalar(value: f64) -> f64 {
        value
    }
    fn of(value: f64) -> Self {
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
    fn settled(self, least: Self) -> Self {
        count(&CHOICES);
        Self(Real::settled(self.0, least.0))
    }
    fn less_times(self, by: Self, before: Self, least: Self) -> Self {
        self - by * Real::settled(before, least)
    }
    fn sqrt(self) -> Self {
        count(&QUOTIENTS);
        Self(self.0.sqrt())
    }
    fn reached(self, mark: Self) -> Self {
        count(&CHOICES);
        Self(Real::reached(self.0, mark.0))
    }
    fn any(self) -> bool {
        count(&CHOICES);
        Real::any(self.0)
    }
    fn nearest(self) -> Self {
        Self(Real::nearest(self.0))
    }
    fn two_to(self) -> Self {
        Self(Real::two_to(self.0))
    }
    fn twos(self) -> Self {
        Self(Real::twos(self.0))
    }
    fn mantissa(self) -> Self {
        Self(Real::mantissa(self.0))
    }
    fn floor(self, most: u32) -> Self {
        Self(Real::floor(self.0, most))
    }
    fn rows<'p, 'a>(
        places: &'p mut [usize],
        table: &'a [f64],
        columns: usize,
        mut row: impl FnMut(usize) -> Self,
    ) -> Self::Rows<'p, 'a> {
        <f64 as Real>::rows(places, table, columns, |i| row(i).0)
    }
    fn row<'a>(rows: Self::Rows<'_, 'a>, i: usize) -> &'a [f64] {
        <f64 as Real>::row(rows, i)
    }
    fn four(row: &[f64], four: usize) -> [Self; ABREAST] {
        count(&LOADS);
        <f64 as Real>::four(row, four).map(Self)
    }
    fn within(self, span: f32, lane: impl FnMut(usize)) {
        count(&CHOICES);
        Real::within(self.0, span, lane);
    }
}
