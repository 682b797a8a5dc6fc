//! Interpolation of readings between steps.
//!
//! Ending a step on every instant would force many short steps where little changes. A reading between steps is
//! interpolated by the cubic through the two records before it and the two after it; no stencil crosses a corner of a
//! schedule, where slopes jump.

use super::time_tolerance::time_tolerance_s;

/// Maximum number of records in an interpolation stencil.
pub(crate) const STENCIL_RECORDS: usize = 4;

/// The interpolation stencil of each instant: records and weights, the same for all members.
#[derive(Clone, Debug)]
pub struct RecordInterpolation {
    stencils: Vec<[(usize, f64); STENCIL_RECORDS]>,
}

impl RecordInterpolation {
    /// Interpolation from records at `times_s`, which include all `corners_s`, to `instants_s`, none later than the
    /// last record.
    pub(super) fn new(times_s: &[f64], corners_s: &[f64], instants_s: &[f64]) -> Self {
        let close_s = time_tolerance_s(times_s.last().copied().unwrap_or_default());
        let at = |time_s: f64| times_s.partition_point(|&other_s| other_s < time_s - close_s);
        let taps = instants_s.iter().map(|&instant_s| {
            let after = at(instant_s).min(times_s.len() - 1);
            if (times_s[after] - instant_s).abs() <= close_s {
                return lagrange_weights(times_s, after..after + 1, instant_s);
            }
            let begin = corners_s.iter().rfind(|&&corner_s| corner_s < instant_s).map_or(0, |&corner_s| at(corner_s));
            let end = corners_s
                .iter()
                .find(|&&corner_s| corner_s > instant_s)
                .map_or(times_s.len() - 1, |&corner_s| at(corner_s));
            let first = after.saturating_sub(2).max(begin);
            let last = (first + STENCIL_RECORDS - 1).min(end);
            lagrange_weights(times_s, (last + 1).saturating_sub(STENCIL_RECORDS).max(begin)..last + 1, instant_s)
        });
        Self { stencils: taps.collect() }
    }

    /// The records and weights of each instant; the weights add up to one.
    pub fn stencils(&self) -> &[[(usize, f64); STENCIL_RECORDS]] {
        &self.stencils
    }

    /// Number of instants.
    pub fn instant_count(&self) -> usize {
        self.stencils.len()
    }

    /// The interpolation up to one of the instants.
    pub(super) fn until(&self, instant: usize) -> Self {
        Self { stencils: self.stencils[..=instant].to_vec() }
    }

    /// The last record that any stencil uses.
    pub(super) fn last_record(&self) -> usize {
        self.stencils.iter().flatten().map(|&(record, _)| record).max().unwrap_or_default()
    }

    /// The readings at all instants, from the records of one sensor, into `readings`, one value per instant.
    pub fn interpolate(&self, records: &[f64], readings: &mut [f64]) {
        for (reading, taps) in readings.iter_mut().zip(&self.stencils) {
            *reading = 0.0;
            for &(record, weight) in taps {
                *reading += weight * records[record];
            }
        }
    }
}

/// Lagrange weights of some records at an instant.
fn lagrange_weights(
    times_s: &[f64],
    records: std::ops::Range<usize>,
    instant_s: f64,
) -> [(usize, f64); STENCIL_RECORDS] {
    let mut taps = [(records.start, 0.0); STENCIL_RECORDS];
    for (tap, record) in taps.iter_mut().zip(records.clone()) {
        let others = records.clone().filter(|&other| other != record);
        let factor = |other: usize| (instant_s - times_s[other]) / (times_s[record] - times_s[other]);
        *tap = (record, others.map(factor).product());
    }
    taps
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(times_s: &[f64], corners_s: &[f64], instants_s: &[f64], of: impl Fn(f64) -> f64) -> Vec<f64> {
        let records: Vec<f64> = times_s.iter().map(|&time_s| of(time_s)).collect();
        let mut readings = vec![0.0; instants_s.len()];
        RecordInterpolation::new(times_s, corners_s, instants_s).interpolate(&records, &mut readings);
        readings
    }

    #[test]
    fn a_cubic_is_interpolated_exactly_on_nonuniform_steps() {
        let cubic = |t: f64| 300.0 + 2.0 * t - 0.3 * t * t + 0.05 * t * t * t;
        let instants_s = [0.0, 0.1, 0.9, 2.0, 3.3, 6.9, 7.0];
        let readings = read(&[0.0, 0.5, 1.5, 2.0, 4.0, 7.0], &[0.0], &instants_s, cubic);
        for (reading, instant_s) in readings.iter().zip(instants_s) {
            assert!((reading - cubic(instant_s)).abs() < 1e-10, "{reading} at {instant_s} s");
        }
    }

    #[test]
    fn no_stencil_crosses_a_corner() {
        let kinked = |t: f64| if t < 2.0 { 300.0 + 10.0 * t } else { 320.0 - 5.0 * (t - 2.0) };
        let instants_s = [0.3, 1.7, 1.9, 2.0, 2.1, 3.5];
        let readings = read(&[0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0], &[0.0, 2.0], &instants_s, kinked);
        for (reading, instant_s) in readings.iter().zip(instants_s) {
            assert!((reading - kinked(instant_s)).abs() < 1e-10, "{reading} at {instant_s} s");
        }
        let blurred = read(&[0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0], &[0.0], &[1.9], kinked);
        assert!((blurred[0] - kinked(1.9)).abs() > 0.1, "a stencil across the corner is exact");
    }

    #[test]
    fn single_steps_between_corners_are_interpolated_linearly() {
        let readings = read(&[0.0, 1.0, 2.0], &[0.0, 1.0, 2.0], &[0.25, 1.5], |t| 300.0 + t);
        assert_eq!(readings, [300.25, 301.5]);
    }
}
