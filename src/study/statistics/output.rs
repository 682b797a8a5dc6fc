//! Accumulated sums of one output: a temperature at an instant, a peak, or a time.

use super::histogram::Histogram;
use super::sums::{Sums, products};

/// Bins for percentiles.
const BINS: i64 = 1024;
/// Bins for ranks, each with one number per factor. Members of one bin have equal rank: with the minimum of 64 bins in
/// use, the error of a rank correlation is 1e-4 for a bell-shaped output and 1e-3 for one concentrated at one end.
const RANKS: i64 = 128;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Output {
    pub(super) sums: Sums,
    /// Σxd, one per factor.
    pub(super) crossed: Vec<i128>,
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) histogram: Histogram,
    /// Histogram with the sum of each factor's grades in every bin.
    pub(super) ranked: Histogram,
    /// Σφd, one per function, in coarse quanta.
    pub(super) moments: Vec<i128>,
}

/// Deviations and grades of the factors of some members.
pub(super) struct Shifts {
    /// Deviations in quanta, factor × member.
    pub(super) quanta: Vec<i64>,
    /// Grades, member × factor.
    pub(super) grades: Vec<u64>,
}

impl Output {
    /// Empty sums, for this many factors and basis functions.
    pub(super) fn new(factors: usize, functions: usize) -> Self {
        Self {
            sums: Sums::default(),
            crossed: vec![0; factors],
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
            histogram: Histogram::new(BINS, 0),
            ranked: Histogram::new(RANKS, factors),
            moments: vec![0; functions],
        }
    }

    /// Extend the extremes to a value.
    pub(super) fn reaches(&mut self, value: f64) {
        self.low = self.low.min(value);
        self.high = self.high.max(value);
    }

    /// Add values in quanta from their reference; the moments are added separately for all outputs. Many values at
    /// once, so that the bins stay in cache.
    pub(super) fn add(&mut self, quanta: &[i64], shifts: &Shifts) {
        self.sums.add(quanta);
        for (crossed, factor) in self.crossed.iter_mut().zip(shifts.quanta.chunks(quanta.len())) {
            *crossed += products(factor, quanta);
        }
        self.histogram.count(quanta, &[]);
        self.ranked.count(quanta, &shifts.grades);
    }

    /// Add the sums of another.
    pub(super) fn merge(&mut self, other: &Self) {
        self.sums.merge(&other.sums);
        self.low = self.low.min(other.low);
        self.high = self.high.max(other.high);
        self.histogram.merge(&other.histogram);
        self.ranked.merge(&other.ranked);
        let theirs = other.crossed.iter().chain(&other.moments);
        for (mine, theirs) in self.crossed.iter_mut().chain(&mut self.moments).zip(theirs) {
            *mine += theirs;
        }
    }
}
