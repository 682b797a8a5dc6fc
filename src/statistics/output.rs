//! Accumulated sums of one output: a temperature at an instant, a peak, or a time.

use super::histogram::{Histogram, PayloadRows};
use super::member_sample;
use super::sums::{Sums, sum_of_products};

/// Bins for percentiles.
const BINS: i64 = 1024;
/// Bins for ranks, each with one number per factor. Members of one bin have equal rank: with the minimum of 64 bins in
/// use, the error of a rank correlation is 1e-4 for a bell-shaped output and 1e-3 for one concentrated at one end.
const RANK_BINS: i64 = 128;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct OutputSums {
    pub(super) sums: Sums,
    /// Σxd, one per factor.
    pub(super) cross_products: Vec<i128>,
    pub(super) min: f64,
    pub(super) max: f64,
    pub(super) histogram: Histogram,
    /// Histogram with the sum of each factor's grades in every bin.
    pub(super) rank_histogram: Histogram,
    /// Σφd, one per function, in coarse quanta.
    pub(super) moments: Vec<i128>,
}

/// Bytes of the sums of one output and of its values in the sample of members, at most.
pub(super) fn max_bytes(factors: usize, functions: usize) -> f64 {
    let counts = BINS as usize + RANK_BINS as usize * (1 + factors);
    let sums = size_of::<i128>() * (factors + functions) + size_of::<i32>() * member_sample::MEMBERS_MAX;
    (size_of::<OutputSums>() + size_of::<u64>() * counts + sums) as f64
}

/// Deviations and grades of the factors of some members.
pub(super) struct FactorDeviations {
    /// Deviations in quanta, factor × member.
    pub(super) quanta: Vec<i64>,
    /// The grades of each member.
    pub(super) grades: PayloadRows,
}

impl OutputSums {
    /// Empty sums, for this many factors and basis functions.
    pub(super) fn new(factors: usize, functions: usize) -> Self {
        Self {
            sums: Sums::default(),
            cross_products: vec![0; factors],
            min: f64::INFINITY,
            max: f64::NEG_INFINITY,
            histogram: Histogram::new(BINS, 0),
            rank_histogram: Histogram::new(RANK_BINS, factors),
            moments: vec![0; functions],
        }
    }

    /// Extend the extremes to values.
    pub(super) fn extend_extremes(&mut self, values: impl Iterator<Item = f64>) {
        for value in values {
            (self.min, self.max) = (self.min.min(value), self.max.max(value));
        }
    }

    /// Add values in quanta from their reference; the moments are added separately for all outputs. Many values at
    /// once, so that the bins stay in cache.
    pub(super) fn add(&mut self, quanta: &[i64], shifts: &FactorDeviations) {
        self.sums.add(quanta);
        for (crossed, factor) in self.cross_products.iter_mut().zip(shifts.quanta.chunks(quanta.len())) {
            *crossed += sum_of_products(factor, quanta);
        }
        self.histogram.add(quanta);
        self.rank_histogram.add_with_payload(quanta, &shifts.grades);
    }

    /// Add the sums of another.
    pub(super) fn merge(&mut self, other: &Self) {
        self.sums.merge(&other.sums);
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
        self.histogram.merge(&other.histogram);
        self.rank_histogram.merge(&other.rank_histogram);
        let theirs = other.cross_products.iter().chain(&other.moments);
        for (mine, theirs) in self.cross_products.iter_mut().chain(&mut self.moments).zip(theirs) {
            *mine += theirs;
        }
    }
}
