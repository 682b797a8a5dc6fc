//! A log of the finished work of a study, by which an interrupted study goes on: it takes the rows of the log, and
//! computes the others.

/// Rows of numbers in the order in which the study finishes them. Equal inputs give equal rows.
pub trait WorkLog {
    /// The next row that an earlier run has kept; `None` after the last one.
    fn next(&mut self) -> Option<&[f64]>;

    /// Keep a row that is not in the log.
    fn add(&mut self, row: &[f64]);
}

/// Nothing is kept.
pub struct NoLog;

impl WorkLog for NoLog {
    fn next(&mut self) -> Option<&[f64]> {
        None
    }

    fn add(&mut self, _row: &[f64]) {}
}

impl<L: WorkLog> WorkLog for Option<L> {
    fn next(&mut self) -> Option<&[f64]> {
        self.as_mut()?.next()
    }

    fn add(&mut self, row: &[f64]) {
        self.iter_mut().for_each(|log| log.add(row));
    }
}
