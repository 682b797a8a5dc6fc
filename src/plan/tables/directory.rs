//! The rows of a table whose nodes are not the table steps.

use crate::physics::layout::{COLUMNS_PER_LOAD, TABLE_STEPS};

/// For each bucket, equal parts of the table steps, the number of the row at its start, the position of that row's
/// start, and those of at most two rows that start within the bucket; a position beyond all tables where there is none.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Directory {
    pub(super) entries: Vec<[f64; COLUMNS_PER_LOAD]>,
    pub(super) buckets_per_step: u32,
}

/// Row starts within a bucket.
const MAX_STARTS_IN_BUCKET: usize = 2;
/// A position that no temperature reaches.
const NEVER: f64 = 1e9;

impl Directory {
    /// The directory of rows that start at these positions, in table steps, the last of which is the end of the last
    /// row; `None` if the rows are the table steps.
    pub(super) fn new(positions: &[f64]) -> Option<Self> {
        if positions.iter().enumerate().all(|(step, &position)| position == step as f64) {
            return None;
        }
        let starts = &positions[..positions.len() - 1];
        let mut buckets_per_step = 1;
        loop {
            let entries: Option<Vec<_>> = (0..TABLE_STEPS as u32 * buckets_per_step)
                .map(|bucket| entry(starts, bucket, buckets_per_step))
                .collect();
            if let Some(entries) = entries {
                return Some(Self { entries, buckets_per_step });
            }
            buckets_per_step *= 2;
        }
    }
}

/// The entry of a bucket; `None` if too many rows start within it.
fn entry(starts: &[f64], bucket: u32, buckets_per_step: u32) -> Option<[f64; COLUMNS_PER_LOAD]> {
    let [from, to] = [bucket, bucket + 1].map(|edge| f64::from(edge) / f64::from(buckets_per_step));
    let row = starts.partition_point(|&start| start <= from) - 1;
    let inside = &starts[row + 1..starts.partition_point(|&start| start < to)];
    let start = |number: usize| inside.get(number).copied().unwrap_or(NEVER);
    (inside.len() <= MAX_STARTS_IN_BUCKET).then(|| [row as f64, starts[row], start(0), start(1)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_are_the_table_steps_need_no_directory() {
        let steps: Vec<f64> = (0..=TABLE_STEPS).map(|step| step as f64).collect();
        assert_eq!(Directory::new(&steps), None);
    }

    #[test]
    fn every_position_leads_to_the_row_that_contains_it() {
        let mut positions: Vec<f64> = (0..=TABLE_STEPS).map(|step| step as f64).collect();
        positions.extend([60.1, 60.12, 60.88, 60.9, 79.999, 80.001, 54.63, 799.5]);
        positions.sort_by(f64::total_cmp);
        let directory = Directory::new(&positions).expect("rows between the steps");
        assert_eq!(directory.buckets_per_step, 2, "four starts within a step, two in each half");
        for tenth_of_percent in 0..(1000 * TABLE_STEPS) {
            let position = tenth_of_percent as f64 / 1000.0;
            let [row, start, first, second] =
                directory.entries[(position * f64::from(directory.buckets_per_step)) as usize];
            let past = [first, second].map(|other| usize::from(position >= other));
            let found = row as usize + past[0] + past[1];
            assert!(positions[found] <= position && position < positions[found + 1], "{position}: row {found}");
            let from = if past[1] == 1 {
                second
            } else if past[0] == 1 {
                first
            } else {
                start
            };
            assert_eq!(from, positions[found]);
        }
    }
}
