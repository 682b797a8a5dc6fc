//! Streaming statistics of an ensemble, in exact integer arithmetic.
//!
//! Floating-point sums depend on the order of their terms, hence on batch size and thread count. Here every deviation
//! from a reference is rounded once to an integer number of quanta, and all sums are integer sums. The results do not
//! depend on the order, and accumulators of two halves merge to exactly that of the whole. Compensated or pairwise
//! summation would only reduce the differences.
//!
//! With `d` the deviation of an output and `x` that of a factor, the accumulator holds `Σd, Σd², Σx, Σx², Σxd`, the
//! extremes, a histogram of `d` for percentiles, a histogram with the factors' grades for rank correlations, and `Σφφ'`
//! and `Σφd` with basis functions `φ` of one and two factors for the Sobol indices. A random sample of the members is
//! kept whole, for the errors of these functions. The memory does not depend on the number of members.

mod basis;
mod correlation_scatter;
mod histogram;
mod interval;
mod member_sample;
mod output;
mod polynomial_chaos;
mod sensitivity_indices;
mod serialisation;
mod sums;
#[cfg(test)]
mod tests;

pub use interval::{ConfidenceInterval, PairIndex};
pub use sensitivity_indices::SensitivityIndices;

use crate::ensemble::Marginal;
use basis::Basis;
use histogram::PayloadRows;
use member_sample::MemberSample;
use nalgebra::DMatrix;
use output::{FactorDeviations, OutputSums};
use rayon::prelude::*;
use sums::{Sums, centred};

/// Quanta per unit of an output: 2⁻²⁰ K, far below the resolution of a march.
const OUTPUT_QUANTA: f64 = (1u64 << 20) as f64;
/// Quanta per unit of a factor.
const FACTOR_QUANTA: f64 = (1u64 << 40) as f64;
/// Fine quanta per coarse quantum, as a power of two. Products of coarse quanta and basis functions, summed over a
/// block, are integers below 2⁵³, so a matrix product in f64 is exact in any order of summation.
const COARSE_LOG2: u32 = 9;
/// Quanta per unit of a grade, the value of the cumulative distribution function.
const GRADE_QUANTA: f64 = (1u64 << 20) as f64;
/// Largest deviation of an output that is counted, K: sums of squares stay in range for 2⁵⁴ members.
const MAX_OUTPUT_DEVIATION: f64 = (1u64 << 16) as f64;
/// Largest deviation of a factor that is counted: sums of squares stay in range for 2²⁶ members.
const MAX_FACTOR_DEVIATION: f64 = (1u64 << 10) as f64;
/// Smallest number of outputs or functions per task: with fewer, preparing a matrix product takes longer than the
/// product.
const MIN_CHUNK: usize = 32;
/// Tasks per thread, for load balance. Each task packs the functions anew for its matrix product.
const CHUNKS_PER_THREAD: usize = 2;
/// Members per matrix product.
pub const BLOCK: usize = 1024;
const _: () = assert!(GRADE_QUANTA as u64 * (BLOCK as u64) < 1 << 32, "a sum of grades over a block would overflow");
/// Members whose outputs are read together.
const ROWS: usize = 8;

/// Largest sum over a block: largest output in coarse quanta times largest function.
const MAX_BLOCK_SUM: f64 =
    MAX_OUTPUT_DEVIATION * OUTPUT_QUANTA / (1u64 << COARSE_LOG2) as f64 * basis::MAX_VALUE * BLOCK as f64;
const _: () = assert!(MAX_BLOCK_SUM <= (1u64 << f64::MANTISSA_DIGITS) as f64, "a product of matrices would round");

/// Accumulated statistics of `outputs` numbers per member, temperatures in K or times in s, and of the `factors` that
/// produced them.
///
/// Without members, mean and percentiles are NaN.
#[derive(Clone, Debug, PartialEq)]
pub struct Accumulator {
    reference: Vec<f64>,
    basis: Basis,
    members: usize,
    excluded: usize,
    outputs: Vec<OutputSums>,
    factors: Vec<Sums>,
    /// Per factor: sum of its grades, and sums of products with the grades of each factor up to it.
    grades: Vec<Vec<i128>>,
    /// Gram matrix Σφφ′ of the basis functions; row i holds the columns 0 to i.
    gram: Vec<Vec<i128>>,
    sample: MemberSample,
}

/// Bytes of the statistics of a sweep at most: of every temperature, and of peak, its time and the largest deviation of
/// every sensor.
pub fn bytes(sensors: usize, instants: usize, factors: usize) -> f64 {
    (sensors * (instants + 3)) as f64 * output::max_bytes(factors, basis::FUNCTIONS_MAX)
}

impl Accumulator {
    /// An empty accumulator. Deviations are relative to the references, one per output, and to the nominal values of
    /// the factors; members are drawn from the marginals, one per factor.
    pub fn new(reference: &[f64], marginals: &[Marginal]) -> Self {
        let basis = Basis::new(marginals);
        Self {
            reference: reference.to_vec(),
            members: 0,
            excluded: 0,
            outputs: vec![OutputSums::new(marginals.len(), basis.len()); reference.len()],
            factors: vec![Sums::default(); marginals.len()],
            grades: (0..marginals.len()).map(|factor| vec![0; factor + 2]).collect(),
            gram: (0..basis.len()).map(|function| vec![0; function + 1]).collect(),
            sample: MemberSample::new(&basis),
            basis,
        }
    }

    /// Add one member.
    ///
    /// # Panics
    /// When the lengths differ from the number of references and factors.
    pub fn add(&mut self, outputs: &[f64], factors: &[f64]) {
        self.add_block(outputs, factors, &[true]);
    }

    /// Add a block of members: `outputs` is member × output, `factors` is member × factor, and only members with a
    /// `true` status in `is_complete` are counted.
    ///
    /// A member with a non-finite number, or with a deviation above 65,536 from a reference (1,024 for a factor), is
    /// excluded entirely and counted in [`excluded`](Self::excluded), because clamping would bias every result.
    ///
    /// # Panics
    /// When the lengths do not match the references and the number of members.
    pub fn add_block(&mut self, outputs: &[f64], factors: &[f64], is_complete: &[bool]) {
        let (width, breadth) = (self.reference.len(), self.factors());
        assert_eq!(outputs.len(), is_complete.len() * width, "outputs are not member × output");
        assert_eq!(factors.len(), is_complete.len() * breadth, "factors are not member × factor");

        let completed: Vec<usize> = (0..is_complete.len()).filter(|&member| is_complete[member]).collect();
        let counted = |member: &usize| {
            let (outputs, factors) = (&outputs[member * width..][..width], &factors[member * breadth..][..breadth]);
            let far =
                |value: &f64, reference: f64, reach: f64| usize::from(!(-reach..=reach).contains(&(value - reference)));
            let outputs =
                outputs.iter().zip(&self.reference).map(|(value, &nominal)| far(value, nominal, MAX_OUTPUT_DEVIATION));
            let drawn = factors.iter().zip(self.basis.marginals());
            let factors = drawn.map(|(value, marginal)| far(value, marginal.nominal, MAX_FACTOR_DEVIATION));
            // A sum without early exit: nearly all values are in range, and a branch per value is slower.
            outputs.sum::<usize>() + factors.sum::<usize>() == 0
        };
        let members: Vec<usize> = completed.par_iter().copied().filter(counted).collect();
        self.members += members.len();
        self.excluded += completed.len() - members.len();

        let each = chunk_len(width);
        for members in members.chunks(BLOCK) {
            let rows: Vec<&[f64]> = members.iter().map(|member| &factors[member * breadth..][..breadth]).collect();
            let shifts = self.add_factors(&rows);
            let functions = self.add_functions(&rows);
            let outputs_of = |place: usize| &outputs[members[place] * width..][..width];
            self.sample.add(&rows, |place| outputs_of(place).iter().zip(&self.reference).map(coarse_quanta).collect());
            let stretches = self.outputs.par_chunks_mut(each).zip(self.reference.par_chunks(each)).enumerate();
            stretches.for_each(|(stretch, (tallied, reference))| {
                let rows = members.iter().map(|member| &outputs[member * width + stretch * each..][..reference.len()]);
                add_outputs(tallied, reference, rows, &shifts, &functions);
            });
        }
    }

    /// Add the factors of members, and return their deviations and grades.
    fn add_factors(&mut self, rows: &[&[f64]]) -> FactorDeviations {
        let marginals = self.basis.marginals();
        let quanta = |factor: usize| {
            rows.iter().map(move |row| round_half_away((row[factor] - marginals[factor].nominal) * FACTOR_QUANTA))
        };
        let grade =
            |(value, marginal): (&f64, &Marginal)| round_half_away(marginal.cumulative(*value) * GRADE_QUANTA) as u32;
        let grades = |row: &&[f64]| row.iter().zip(marginals).map(grade).collect();
        let grades: Vec<Vec<u32>> = rows.par_iter().map(grades).collect();
        let shifts = FactorDeviations {
            quanta: (0..marginals.len()).flat_map(quanta).collect(),
            grades: PayloadRows::new(marginals.len(), grades.into_iter()),
        };
        for (sums, quanta) in self.factors.iter_mut().zip(shifts.quanta.chunks(rows.len())) {
            sums.add(quanta);
        }
        for member in shifts.grades.rows() {
            for (sums, &grade) in self.grades.iter_mut().zip(member) {
                sums[0] += i128::from(grade);
                for (sum, &other) in sums[1..].iter_mut().zip(member) {
                    *sum += i128::from(grade) * i128::from(other);
                }
            }
        }
        shifts
    }

    /// Add the basis functions of members; returns them, function × member.
    fn add_functions(&mut self, rows: &[&[f64]]) -> DMatrix<f64> {
        let mut functions = DMatrix::zeros(self.basis.len(), rows.len());
        let members = functions.as_mut_slice().par_chunks_mut(self.basis.len()).zip(rows);
        members.for_each(|(functions, row)| self.basis.evaluate(row, functions));
        let each = chunk_len(self.basis.len());
        self.gram.par_chunks_mut(each).enumerate().for_each(|(stretch, sums)| {
            let first = stretch * each;
            let up_to = functions.rows(0, first + sums.len());
            let products = up_to * functions.rows(first, sums.len()).transpose();
            for (sums, products) in sums.iter_mut().zip(products.column_iter()) {
                add_integers(sums, products.iter());
            }
        });
        functions
    }

    /// Add another accumulator.
    ///
    /// # Panics
    /// When the references differ.
    pub fn merge(&mut self, other: &Self) {
        assert!(
            self.reference == other.reference && self.basis == other.basis,
            "accumulators have different references"
        );
        self.members += other.members;
        self.excluded += other.excluded;
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
        self.sample.merge(&other.sample);
    }

    /// Number of members.
    pub fn members(&self) -> usize {
        self.members
    }

    /// Number of factors.
    pub fn factors(&self) -> usize {
        self.factors.len()
    }

    /// Completed members that were excluded as out of range.
    pub fn excluded(&self) -> usize {
        self.excluded
    }

    /// Arithmetic mean of an output.
    pub fn mean(&self, output: usize) -> f64 {
        let sum = self.outputs[output].sums.sum as f64;
        self.reference[output] + sum / self.members as f64 / OUTPUT_QUANTA
    }

    /// Sample standard deviation of an output (divisor: members minus one); zero for a single member.
    pub fn deviation(&self, output: usize) -> f64 {
        let sums = &self.outputs[output].sums;
        let squares = centred(self.members, sums.squares, sums.sum, sums.sum);
        if self.members < 2 { 0.0 } else { (squares / (self.members - 1) as f64).sqrt() / OUTPUT_QUANTA }
    }

    /// Minimum of an output; positive infinity without members.
    pub fn min(&self, output: usize) -> f64 {
        self.outputs[output].min
    }

    /// Maximum of an output; negative infinity without members.
    pub fn max(&self, output: usize) -> f64 {
        self.outputs[output].max
    }

    /// Percentile of an output, from at most 1,024 bins between the extremes with linear interpolation; the error is
    /// below a 512th of the range.
    pub fn percentile(&self, output: usize, percent: f64) -> f64 {
        let OutputSums { min: low, max: high, histogram, .. } = &self.outputs[output];
        match histogram.quantile(percent / 100.0 * self.members as f64) {
            Some(quanta) => (self.reference[output] + quanta / OUTPUT_QUANTA).max(*low).min(*high),
            None => f64::NAN,
        }
    }

    /// Pearson correlation of an output and a factor (the paper's Eq. 13); zero where either is constant.
    pub fn correlation(&self, output: usize, factor: usize) -> f64 {
        let (y, x) = (&self.outputs[output], &self.factors[factor]);
        let output_squares = centred(self.members, y.sums.squares, y.sums.sum, y.sums.sum);
        let factor_squares = centred(self.members, x.squares, x.sum, x.sum);
        let products = centred(self.members, y.cross_products[factor], x.sum, y.sums.sum);
        let both = (output_squares * factor_squares).sqrt();
        if both > 0.0 { (products / both).clamp(-1.0, 1.0) } else { 0.0 }
    }

    /// Normalised squared correlation of a factor: divided by the sum over all factors; zero where nothing varies.
    pub fn squared_correlation_share(&self, output: usize, factor: usize) -> f64 {
        let square = |factor| self.correlation(output, factor).powi(2);
        let all: f64 = (0..self.factors.len()).map(square).sum();
        if all > 0.0 { square(factor) / all } else { 0.0 }
    }
}

/// Add some outputs of members, one row per member.
///
/// Rows are far apart in memory, so each is read once, several together: one output of these members is then one line
/// of the cache.
fn add_outputs<'a>(
    tallied: &mut [OutputSums],
    reference: &[f64],
    rows: impl ExactSizeIterator<Item = &'a [f64]>,
    shifts: &FactorDeviations,
    functions: &DMatrix<f64>,
) {
    let rows: Vec<&[f64]> = rows.collect();
    let members = rows.len();
    // Member × output: quanta, and then coarse quanta.
    let mut coarse = DMatrix::zeros(members, tallied.len());
    for (rows, first) in rows.chunks(ROWS).zip((0..).step_by(ROWS)) {
        for (column, (output, reference)) in tallied.iter_mut().zip(reference).enumerate() {
            output.extend_extremes(rows.iter().map(|row| row[column]));
            let quanta = &mut coarse.as_mut_slice()[column * members + first..][..rows.len()];
            for (quanta, row) in quanta.iter_mut().zip(rows) {
                *quanta = round_half_away((row[column] - reference) * OUTPUT_QUANTA) as f64;
            }
        }
    }
    let mut quanta = Vec::with_capacity(members);
    for (output, mut coarse) in tallied.iter_mut().zip(coarse.column_iter_mut()) {
        quanta.clear();
        quanta.extend(coarse.iter().map(|&quanta| quanta as i64));
        output.add(&quanta, shifts);
        for (coarse, &quanta) in coarse.iter_mut().zip(&quanta) {
            *coarse = coarsened(quanta) as f64;
        }
    }
    let products = functions * coarse;
    for (output, products) in tallied.iter_mut().zip(products.column_iter()) {
        add_integers(&mut output.moments, products.iter());
    }
}

/// Fine quanta as coarse ones.
fn coarsened(quanta: i64) -> i64 {
    (quanta + (1 << (COARSE_LOG2 - 1))) >> COARSE_LOG2
}

/// The deviation of an output from its reference, in coarse quanta: below 2²⁸ for an output that is counted.
fn coarse_quanta((output, reference): (&f64, &f64)) -> i32 {
    coarsened(round_half_away((output - reference) * OUTPUT_QUANTA)) as i32
}

/// Round a small number to the nearest integer, halves away from zero. `round` is a library call on the baseline target
/// and would dominate this loop.
fn round_half_away(value: f64) -> i64 {
    (value + f64::copysign(0.5, value)) as i64
}

/// Number of items per task.
fn chunk_len(all: usize) -> usize {
    all.div_ceil(CHUNKS_PER_THREAD * rayon::current_num_threads()).max(MIN_CHUNK)
}

/// Add products that are exact integers.
fn add_integers<'a>(sums: &mut [i128], products: impl Iterator<Item = &'a f64>) {
    for (sum, product) in sums.iter_mut().zip(products) {
        *sum += i128::from(*product as i64);
    }
}
