//! What is counted of one number that every member has: a temperature at an instant, a peak, a time.

use super::classes::CLASSES;
use super::histogram::Histogram;
use super::sums::Sums;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Output {
    pub(super) sums: Sums,
    /// Σxd, one a factor.
    pub(super) crossed: Vec<i128>,
    pub(super) low: f64,
    pub(super) high: f64,
    /// Σd in each class of each factor.
    pub(super) in_class: Vec<[i128; CLASSES]>,
    pub(super) histogram: Histogram,
}

/// What a member's factor adds: its deviation in quanta, and its class.
#[derive(Clone, Copy)]
pub(super) struct Shift {
    pub(super) quanta: i64,
    pub(super) class: u8,
}

impl Output {
    /// Nothing counted yet, of a number that so many factors lead to.
    pub(super) fn new(factors: usize) -> Self {
        Self {
            sums: Sums::default(),
            crossed: vec![0; factors],
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
            in_class: vec![[0; CLASSES]; factors],
            histogram: Histogram::default(),
        }
    }

    /// Counts a value that lies so many quanta from its reference, with what the member's factors add.
    pub(super) fn add(&mut self, value: f64, quanta: i64, shifts: &[Shift]) {
        self.sums.add(quanta);
        for ((crossed, sums), shift) in self.crossed.iter_mut().zip(&mut self.in_class).zip(shifts) {
            *crossed += i128::from(shift.quanta) * i128::from(quanta);
            sums[usize::from(shift.class)] += i128::from(quanta);
        }
        self.low = self.low.min(value);
        self.high = self.high.max(value);
        self.histogram.count(quanta);
    }

    /// Counts what another has counted.
    pub(super) fn merge(&mut self, other: &Self) {
        self.sums.merge(&other.sums);
        for (mine, theirs) in self.crossed.iter_mut().zip(&other.crossed) {
            *mine += theirs;
        }
        for (mine, theirs) in self.in_class.iter_mut().flatten().zip(other.in_class.iter().flatten()) {
            *mine += theirs;
        }
        self.low = self.low.min(other.low);
        self.high = self.high.max(other.high);
        self.histogram.merge(&other.histogram);
    }
}
