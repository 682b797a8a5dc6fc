//! What is counted of one number that every member has: a temperature at an instant, a peak, a time.

use super::histogram::Histogram;
use super::sums::{Sums, products};

/// Bins for the percentiles.
const BINS: i64 = 1024;
/// Bins for the ranks, of which each holds a number a factor. Members of one bin rank alike: with the least of
/// 64 bins in use that moves the rank correlations of a bell by 1e-4, of an output that piles up at one end by 1e-3.
const RANKS: i64 = 128;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Output {
    pub(super) sums: Sums,
    /// Σxd, one a factor.
    pub(super) crossed: Vec<i128>,
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) histogram: Histogram,
    /// With the sum of each factor's grades in every bin.
    pub(super) ranked: Histogram,
    /// Σφd, one a function, in coarse quanta.
    pub(super) moments: Vec<i128>,
}

/// What the factors of some members add to an output.
pub(super) struct Shifts {
    /// Deviations in quanta, factor × member.
    pub(super) quanta: Vec<i64>,
    /// Grades, member × factor.
    pub(super) grades: Vec<u64>,
}

impl Output {
    /// Nothing counted yet, of a number that so many factors lead to and that is written in so many functions.
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

    /// Takes a value in between the lowest and the highest.
    pub(super) fn reaches(&mut self, value: f64) {
        self.low = self.low.min(value);
        self.high = self.high.max(value);
    }

    /// Counts values that lie so many quanta from their reference, with what the factors of their members add; their moments
    /// are added with those of all outputs. Many at once, so that its bins are fetched once.
    pub(super) fn add(&mut self, quanta: &[i64], shifts: &Shifts) {
        self.sums.add(quanta);
        for (crossed, factor) in self.crossed.iter_mut().zip(shifts.quanta.chunks(quanta.len())) {
            *crossed += products(factor, quanta);
        }
        self.histogram.count(quanta, &[]);
        self.ranked.count(quanta, &shifts.grades);
    }

    /// Counts what another has counted.
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
