//! How the row of a temperature is found in a table whose nodes are not the table steps.

use crate::physics::layout::{COLUMNS_PER_LOAD, TABLE_STEPS};

/// How the row of a position is found; positions are in table steps.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum RowSearch {
    /// Rows are the table steps.
    Steps,
    /// Rows are equal steps from an origin, which is the first of the first group, and start at the few others of the
    /// groups that follow; the length counts both.
    List { groups: Vec<[f64; COLUMNS_PER_LOAD]>, length: u32 },
    /// For each bucket, equal parts of the table steps, the number of the row at its start, the position of that row's
    /// start, and those of at most two rows that start within the bucket; a position beyond all tables where there is
    /// none.
    Directory { entries: Vec<[f64; COLUMNS_PER_LOAD]>, buckets_per_step: u32 },
}

/// Row starts within a bucket.
const MAX_STARTS_IN_BUCKET: usize = 2;
/// Most starts in a list: comparing with so many takes as long as loading an entry of a directory for each lane.
const MAX_LISTED_STARTS: usize = 8;
/// Distance from a step below which a position is the step.
const STEP_ROUNDING: f64 = 1e-9;
/// A position that no temperature reaches.
const NEVER: f64 = 1e9;

impl RowSearch {
    /// The search for rows that start at these positions, the last of which is the end of the last row.
    pub(super) fn new(positions: &[f64]) -> Self {
        if positions.iter().enumerate().all(|(step, &position)| position == step as f64) {
            return Self::Steps;
        }
        let starts = &positions[..positions.len() - 1];
        let is_step = |start: f64| {
            let steps = start - starts[0];
            (steps - steps.round()).abs() < STEP_ROUNDING
        };
        let others: Vec<f64> = starts.iter().copied().filter(|&start| !is_step(start)).collect();
        if starts.len() == TABLE_STEPS + others.len() && others.len() <= MAX_LISTED_STARTS {
            let group = |starts: &[f64]| std::array::from_fn(|place| starts.get(place).copied().unwrap_or(NEVER));
            let groups = others.chunks(COLUMNS_PER_LOAD).map(group);
            let groups = std::iter::once(group(&starts[..1])).chain(groups).collect();
            return Self::List { groups, length: 1 + others.len() as u32 };
        }
        let mut buckets_per_step = 1;
        loop {
            let entries: Option<Vec<_>> = (0..TABLE_STEPS as u32 * buckets_per_step)
                .map(|bucket| entry(starts, bucket, buckets_per_step))
                .collect();
            if let Some(entries) = entries {
                return Self::Directory { entries, buckets_per_step };
            }
            buckets_per_step *= 2;
        }
    }
}

/// The entry of a bucket; `None` if too many rows start within it.
fn entry(starts: &[f64], bucket: u32, buckets_per_step: u32) -> Option<[f64; COLUMNS_PER_LOAD]> {
    let [from, to] = [bucket, bucket + 1].map(|edge| f64::from(edge) / f64::from(buckets_per_step));
    let row = starts.partition_point(|&start| start <= from).saturating_sub(1);
    let inside = &starts[row + 1..starts.partition_point(|&start| start < to).max(row + 1)];
    let start = |number: usize| inside.get(number).copied().unwrap_or(NEVER);
    (inside.len() <= MAX_STARTS_IN_BUCKET).then(|| [row as f64, starts[row], start(0), start(1)])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The row of a position and its start, as the processor and devices find them.
    fn found(search: &RowSearch, position: f64) -> (usize, f64) {
        match search {
            RowSearch::Steps => (position as usize, position.floor()),
            RowSearch::List { groups, .. } => {
                let step = (position - groups[0][0]).max(0.0).floor();
                let passed: Vec<f64> =
                    groups[1..].iter().flatten().copied().filter(|start| position >= *start).collect();
                (step as usize + passed.len(), passed.into_iter().fold(step + groups[0][0], f64::max))
            }
            RowSearch::Directory { entries, buckets_per_step } => {
                let [row, start, first, second] = entries[(position * f64::from(*buckets_per_step)) as usize];
                let past = [first, second].map(|other| position >= other);
                let passed = past.iter().filter(|is_past| **is_past).count();
                (
                    row as usize + passed,
                    if past[1] {
                        second
                    } else if past[0] {
                        first
                    } else {
                        start
                    },
                )
            }
        }
    }

    fn steps_from(origin: f64, others: &[f64]) -> Vec<f64> {
        let mut positions: Vec<f64> = (0..=TABLE_STEPS).map(|step| step as f64 + origin).collect();
        positions.extend(others);
        positions.sort_by(f64::total_cmp);
        positions
    }

    #[test]
    fn few_starts_besides_equal_steps_are_listed() {
        let many: Vec<f64> = (0..9).map(|number| 50.5 + f64::from(number)).collect();
        assert_eq!(RowSearch::new(&steps_from(0.0, &[])), RowSearch::Steps);
        let groups = |search| if let RowSearch::List { groups, .. } = search { groups.len() } else { 0 };
        assert_eq!(groups(RowSearch::new(&steps_from(0.6, &[]))), 1);
        assert_eq!(groups(RowSearch::new(&steps_from(0.6, &many[..5]))), 3);
        assert_eq!(groups(RowSearch::new(&steps_from(0.0, &many[..8]))), 3);
        assert_eq!(groups(RowSearch::new(&steps_from(0.0, &many))), 0);
        // A start in place of a step.
        let mut moved = steps_from(0.0, &[]);
        moved[60] = 60.0001;
        assert_eq!(groups(RowSearch::new(&moved)), 0);
    }

    #[test]
    fn every_position_leads_to_the_row_that_contains_it() {
        let close = [60.1, 60.12, 60.88, 60.9, 79.999, 80.001, 54.63, 799.5];
        for positions in [
            steps_from(0.0, &close),
            steps_from(0.63, &close),
            steps_from(0.63, &[]),
            steps_from(0.0, &[&close[..], &[61.5, 62.5]].concat()),
        ] {
            let search = RowSearch::new(&positions);
            for thousandth in 1000..(1000 * TABLE_STEPS) {
                let position = f64::from(thousandth as u32) / 1000.0 + 1e-6;
                let (row, start) = found(&search, position);
                assert!(positions[row] <= position && position < positions[row + 1], "{position}: row {row}");
                assert!((start - positions[row]).abs() < 1e-9, "{position}: {start}");
            }
        }
        let directory = RowSearch::new(&steps_from(0.0, &[&close[..], &[61.5, 62.5]].concat()));
        assert!(matches!(directory, RowSearch::Directory { buckets_per_step: 2, .. }), "two in each half of a step");
    }
}
