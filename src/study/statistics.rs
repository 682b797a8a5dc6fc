//! Statistics of an ensemble, gathered member by member and exactly.
//!
//! Floating-point sums depend on the order of their terms, and with it on the batch and on the number of threads. Here
//! every deviation from a reference is rounded once, to a whole number of quanta, and all sums are sums of integers:
//! they come out the same in any order, and two tallies of half an ensemble merge to exactly the tally of the whole.
//! Compensated or pairwise summation would only make the differences small.
//!
//! With `d` the deviation of an output and `x` that of a factor, a tally holds `Σd, Σd², Σx, Σx², Σxd`, the extremes, for
//! the percentiles a histogram of `d`, for the ranks one that knows the factors' grades, and for the Sobol indices `Σφφ'`
//! and `Σφd` with functions `φ` of one factor and of two. Its memory has a bound that does not depend on the members.

mod basis;
mod causes;
mod expansion;
mod histogram;
mod interval;
mod numbers;
mod output;
mod sums;
#[cfg(test)]
mod tests;

pub use causes::Causes;
pub use interval::Likely;

use crate::ensemble::Marginal;
use basis::Basis;
use nalgebra::DMatrix;
use output::{Output, Shifts};
use rayon::prelude::*;
use sums::{Sums, centred};

/// Quanta of an output in one unit of it: one is 2⁻²⁰ K, far below what a march resolves.
const OUTPUT_QUANTA: f64 = (1u64 << 20) as f64;
/// Quanta of a factor in one unit of it.
const FACTOR_QUANTA: f64 = (1u64 << 40) as f64;
/// Fine quanta of an output in a coarse one, as a power of two. Products of coarse quanta and of functions, summed over a
/// block, are whole numbers below 2⁵³: a product of matrices in f64 has them exactly, in whatever order it adds.
const COARSE_LOG2: u32 = 9;
/// Quanta of a grade, which lies between zero and one.
const GRADE_QUANTA: f64 = (1u64 << 20) as f64;
/// The largest deviation of an output that is counted, K: a sum of squares then stays in range for 2⁵⁴ members.
const OUTPUT_REACH: f64 = (1u64 << 16) as f64;
/// The largest deviation of a factor that is counted: a sum of squares then stays in range for 2²⁶ members.
const FACTOR_REACH: f64 = (1u64 << 10) as f64;
/// Outputs, or functions, that a thread takes at a time, at least: fewer, and preparing a product of matrices takes longer than the product.
const STRETCH_LEAST: usize = 32;
/// Stretches a thread, so that none waits long for the last.
const STRETCHES: usize = 4;
/// Members whose products are summed at once.
pub const BLOCK: usize = 1024;

/// Coarse quanta of the furthest output, times those of the furthest function, over all members of a block.
const SUM_MOST: f64 = OUTPUT_REACH * OUTPUT_QUANTA / (1u64 << COARSE_LOG2) as f64 * basis::REACH * BLOCK as f64;
const _: () = assert!(SUM_MOST <= (1u64 << f64::MANTISSA_DIGITS) as f64, "a product of matrices would round");

/// What has been counted of an ensemble: `outputs` numbers of each member, temperatures in K or times in s, and the
/// `factors` that led to them.
///
/// Where no member has been counted, mean and percentiles are NaN.
#[derive(Clone, Debug, PartialEq)]
pub struct Tally {
    reference: Vec<f64>,
    basis: Basis,
    members: usize,
    left_out: usize,
    outputs: Vec<Output>,
    factors: Vec<Sums>,
    /// Of each factor the sum of its grades, the shares of all draws that lie below a member's value, and the sums of their
    /// products with those of each factor up to it.
    grades: Vec<Vec<i128>>,
    /// Σφφ', of each function with those up to it.
    gram: Vec<Vec<i128>>,
}

impl Tally {
    /// An empty tally. The references, one an output, and the nominal values of the factors are what deviations are
    /// counted from; members are drawn from the marginals, one a factor.
    pub fn new(reference: &[f64], marginals: &[Marginal]) -> Self {
        let basis = Basis::new(marginals);
        Self {
            reference: reference.to_vec(),
            members: 0,
            left_out: 0,
            outputs: vec![Output::new(marginals.len(), basis.len()); reference.len()],
            factors: vec![Sums::default(); marginals.len()],
            grades: (0..marginals.len()).map(|factor| vec![0; factor + 2]).collect(),
            gram: (0..basis.len()).map(|function| vec![0; function + 1]).collect(),
            basis,
        }
    }

    /// Counts one member.
    ///
    /// # Panics
    /// When there are not as many outputs and factors as references.
    pub fn add(&mut self, outputs: &[f64], factors: &[f64]) {
        self.add_block(outputs, factors, &[true]);
    }

    /// Counts a block of members: `outputs` is member × output, `factors` is member × factor, and only the members
    /// that `arrived` are counted, the others passed over.
    ///
    /// A member that arrived with a number that is not finite, or further than 65,536 from its reference (a factor
    /// 1,024), is left out whole and counted in [`left_out`](Self::left_out): clamped, it would bias every figure.
    ///
    /// # Panics
    /// When the lengths do not fit the references and the number of members.
    pub fn add_block(&mut self, outputs: &[f64], factors: &[f64], arrived: &[bool]) {
        let (width, breadth) = (self.reference.len(), self.factors());
        assert_eq!(outputs.len(), arrived.len() * width, "outputs are not member × output");
        assert_eq!(factors.len(), arrived.len() * breadth, "factors are not member × factor");

        let arrivals: Vec<usize> = (0..arrived.len()).filter(|&member| arrived[member]).collect();
        let counted = |member: &usize| {
            let (outputs, factors) = (&outputs[member * width..][..width], &factors[member * breadth..][..breadth]);
            let far =
                |value: &f64, reference: f64, reach: f64| usize::from(!(-reach..=reach).contains(&(value - reference)));
            let outputs =
                outputs.iter().zip(&self.reference).map(|(value, &nominal)| far(value, nominal, OUTPUT_REACH));
            let drawn = factors.iter().zip(self.basis.marginals());
            let factors = drawn.map(|(value, marginal)| far(value, marginal.nominal, FACTOR_REACH));
            // Counted and not looked for: nearly all are near, and a loop that may end at each is slower than one that never does.
            outputs.sum::<usize>() + factors.sum::<usize>() == 0
        };
        let members: Vec<usize> = arrivals.par_iter().copied().filter(counted).collect();
        self.members += members.len();
        self.left_out += arrivals.len() - members.len();

        let each = stretch(width);
        for members in members.chunks(BLOCK) {
            let rows: Vec<&[f64]> = members.iter().map(|member| &factors[member * breadth..][..breadth]).collect();
            let shifts = self.add_factors(&rows);
            let functions = self.add_functions(&rows);
            let stretches = self.outputs.par_chunks_mut(each).zip(self.reference.par_chunks(each)).enumerate();
            stretches.for_each(|(stretch, (tallied, reference))| {
                let rows = members.iter().map(|member| &outputs[member * width + stretch * each..][..reference.len()]);
                add_outputs(tallied, reference, rows, &shifts, &functions);
            });
        }
    }

    /// Counts the factors of members, and tells what those add to an output.
    fn add_factors(&mut self, rows: &[&[f64]]) -> Shifts {
        let marginals = self.basis.marginals();
        let quanta = |factor: usize| {
            rows.iter().map(move |row| nearest((row[factor] - marginals[factor].nominal) * FACTOR_QUANTA))
        };
        let grade = |(value, marginal): (&f64, &Marginal)| nearest(marginal.share(*value) * GRADE_QUANTA) as u64;
        let grades = |row: &&[f64]| row.iter().zip(marginals).map(grade).collect();
        let shifts = Shifts {
            quanta: (0..marginals.len()).flat_map(quanta).collect(),
            grades: rows.par_iter().map(grades).collect::<Vec<Vec<u64>>>().concat(),
        };
        for (sums, quanta) in self.factors.iter_mut().zip(shifts.quanta.chunks(rows.len())) {
            sums.add(quanta);
        }
        for member in shifts.grades.chunks(marginals.len().max(1)) {
            for (sums, &grade) in self.grades.iter_mut().zip(member) {
                sums[0] += i128::from(grade);
                for (sum, &other) in sums[1..].iter_mut().zip(member) {
                    *sum += i128::from(grade) * i128::from(other);
                }
            }
        }
        shifts
    }

    /// Counts the functions of members; all of them, function × member.
    fn add_functions(&mut self, rows: &[&[f64]]) -> DMatrix<f64> {
        let mut functions = DMatrix::zeros(self.basis.len(), rows.len());
        let members = functions.as_mut_slice().par_chunks_mut(self.basis.len()).zip(rows);
        members.for_each(|(functions, row)| self.basis.evaluate(row, functions));
        let turned = functions.transpose();
        let each = stretch(self.basis.len());
        self.gram.par_chunks_mut(each).enumerate().for_each(|(stretch, sums)| {
            let first = stretch * each;
            let up_to = functions.rows(0, first + sums.len());
            let products = up_to * turned.columns(first, sums.len());
            for (sums, products) in sums.iter_mut().zip(products.column_iter()) {
                add_whole(sums, products.iter());
            }
        });
        functions
    }

    /// Counts what another tally has counted.
    ///
    /// # Panics
    /// When the two do not count from the same references.
    pub fn merge(&mut self, other: &Self) {
        assert!(
            self.reference == other.reference && self.basis == other.basis,
            "tallies count from different references"
        );
        self.members += other.members;
        self.left_out += other.left_out;
        for (mine, theirs) in self.outputs.iter_mut().zip(&other.outputs) {
            mine.merge(theirs);
        }
        for (mine, theirs) in self.factors.iter_mut().zip(&other.factors) {
            mine.merge(theirs);
        }
        let theirs = other.grades.iter().chain(&other.gram).flatten();
        for (mine, theirs) in self.grades.iter_mut().chain(&mut self.gram).flatten().zip(theirs) {
            *mine += theirs;
        }
    }

    /// Members counted.
    pub fn members(&self) -> usize {
        self.members
    }

    /// Factors that led to the outputs.
    pub fn factors(&self) -> usize {
        self.factors.len()
    }

    /// Members that arrived but could not be counted.
    pub fn left_out(&self) -> usize {
        self.left_out
    }

    /// Arithmetic mean of an output.
    pub fn mean(&self, output: usize) -> f64 {
        let sum = self.outputs[output].sums.first as f64;
        self.reference[output] + sum / self.members as f64 / OUTPUT_QUANTA
    }

    /// Standard deviation of an output, of a sample (divided by members less one); zero for a single member.
    pub fn deviation(&self, output: usize) -> f64 {
        let sums = &self.outputs[output].sums;
        let squares = centred(self.members, sums.squares, sums.first, sums.first);
        if self.members < 2 { 0.0 } else { (squares / (self.members - 1) as f64).sqrt() / OUTPUT_QUANTA }
    }

    /// The lowest value of an output, positive infinity where no member has been counted.
    pub fn low(&self, output: usize) -> f64 {
        self.outputs[output].low
    }

    /// The highest value of an output, negative infinity where no member has been counted.
    pub fn high(&self, output: usize) -> f64 {
        self.outputs[output].high
    }

    /// The value below which `percent` of the members lie, from up to 1,024 bins between the extremes within which
    /// members are taken as evenly spread: right to a fraction of a 512th of their range, and never beyond it.
    pub fn percentile(&self, output: usize, percent: f64) -> f64 {
        let Output { low, high, histogram, .. } = &self.outputs[output];
        match histogram.above(percent / 100.0 * self.members as f64) {
            Some(quanta) => (self.reference[output] + quanta / OUTPUT_QUANTA).max(*low).min(*high),
            None => f64::NAN,
        }
    }

    /// Pearson correlation of an output and a factor (the paper's Eq. 13); zero where either does not vary.
    pub fn correlation(&self, output: usize, factor: usize) -> f64 {
        let (y, x) = (&self.outputs[output], &self.factors[factor]);
        let output_squares = centred(self.members, y.sums.squares, y.sums.first, y.sums.first);
        let factor_squares = centred(self.members, x.squares, x.first, x.first);
        let products = centred(self.members, y.crossed[factor], x.first, y.sums.first);
        let both = (output_squares * factor_squares).sqrt();
        if both > 0.0 { (products / both).clamp(-1.0, 1.0) } else { 0.0 }
    }

    /// A factor's share of the uncertainty of an output: its squared correlation over the sum of all factors'; zero
    /// where nothing varies.
    pub fn share(&self, output: usize, factor: usize) -> f64 {
        let square = |factor| self.correlation(output, factor).powi(2);
        let all: f64 = (0..self.factors.len()).map(square).sum();
        if all > 0.0 { square(factor) / all } else { 0.0 }
    }
}

/// Counts some outputs of members, of each a row.
///
/// Rows lie far apart, so that each is fetched once, and only then gone through output by output.
fn add_outputs<'a>(
    tallied: &mut [Output],
    reference: &[f64],
    rows: impl ExactSizeIterator<Item = &'a [f64]>,
    shifts: &Shifts,
    functions: &DMatrix<f64>,
) {
    let members = rows.len();
    let mut quanta = Vec::with_capacity(members * tallied.len());
    for row in rows {
        for ((output, value), reference) in tallied.iter_mut().zip(row).zip(reference) {
            output.reaches(*value);
            quanta.push(nearest((value - reference) * OUTPUT_QUANTA));
        }
    }
    let mut coarse = DMatrix::zeros(members, tallied.len());
    let mut own = Vec::with_capacity(members);
    for (column, (output, mut coarse)) in tallied.iter_mut().zip(coarse.column_iter_mut()).enumerate() {
        own.clear();
        own.extend(quanta.iter().skip(column).step_by(reference.len()));
        output.add(&own, shifts);
        for (coarse, quanta) in coarse.iter_mut().zip(&own) {
            *coarse = ((quanta + (1 << (COARSE_LOG2 - 1))) >> COARSE_LOG2) as f64;
        }
    }
    let products = functions * coarse;
    for (output, products) in tallied.iter_mut().zip(products.column_iter()) {
        add_whole(&mut output.moments, products.iter());
    }
}

/// The whole number nearest to one that is not far from nothing; halves go away from it. `round` is a call on processors as old as
/// those that this is built for, and takes as long as all else that is done to a number here.
fn nearest(value: f64) -> i64 {
    (value + f64::copysign(0.5, value)) as i64
}

/// How many of so many a thread takes at a time.
fn stretch(all: usize) -> usize {
    all.div_ceil(STRETCHES * rayon::current_num_threads()).max(STRETCH_LEAST)
}

/// Adds products that are whole numbers, and small enough to be so exactly.
fn add_whole<'a>(sums: &mut [i128], products: impl Iterator<Item = &'a f64>) {
    for (sum, product) in sums.iter_mut().zip(products) {
        *sum += i128::from(*product as i64);
    }
}
