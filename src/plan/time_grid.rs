//! Time steps and output instants.
//!
//! A step ends on every major corner of a schedule; steps that a case specifies end on every corner and every instant.
//! Sensors are recorded at the steps; readings at the instants and peaks are those of the curve through the records.
//! All members of an ensemble share the steps, so that differences between members carry no noise from step-size
//! control.

use super::forcing::Forcing;
use super::interpolation::RecordInterpolation;
use super::time_tolerance::time_tolerance_s;
use crate::case::{Case, MAX_CORNERS, Resolution};

/// End times of the steps, and the instants at which sensors are read.
#[derive(Clone, Debug)]
pub struct TimeGrid {
    /// Time at the end of each step, s; the first entry is zero.
    pub times_s: Vec<f64>,
    /// Times at which the sensors are read, s; the first is zero.
    pub instants_s: Vec<f64>,
    /// The steps at whose start the sensors are recorded, and the end of the last.
    pub(super) recorded_steps: Vec<usize>,
    /// The curve through the records.
    pub(super) interpolation: RecordInterpolation,
}

/// Rule for the step lengths, before steps are subdivided.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TimeStepControl {
    /// How steps grow after a corner of a schedule.
    pub growth: StepGrowth,
    /// Local refinement, ordered by time.
    pub segments: Vec<TimeSegment>,
}

/// Growth of the steps with the time since the last corner of a schedule.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum StepGrowth {
    /// Step = `share` × time since the corner, between a first and a largest step. Steps end on every instant.
    Geometric {
        /// The first step after a corner, s.
        first_step_s: f64,
        /// Ratio of a step to the time since the corner.
        share: f64,
        /// Largest step, s.
        max_step_s: f64,
    },
    /// `h = coefficient τ^(1 − 1/GRADING_EXPONENT)`, in s^(1/GRADING_EXPONENT): the time since the corner is a power of
    /// the step number. Instants are interpolated between steps.
    Graded {
        /// s^(1/GRADING_EXPONENT).
        coefficient: f64,
    },
}

/// Exponent of the graded time mesh: after a corner, time rises as this power of the step number.
///
/// After a jump of a flux the temperature rises as √t, after a jump of a temperature the flux falls as 1/√t; uniform
/// steps are then of order 1 or less, however short. A graded mesh of exponent 4 keeps second order for both (Brunner,
/// SIAM J. Numer. Anal. 20, 1983, for weakly singular kernels), and halved steps lie on the same curve.
pub const GRADING_EXPONENT: f64 = 4.0;

/// Refinement of the steps from one time to that of the next segment.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TimeSegment {
    /// Start of the segment, s.
    pub start_s: f64,
    /// Steps per step of the growth rule.
    pub step_density: f64,
    /// Equal parts of each step. Unlike a density, they refine every step, however few there are between two corners.
    pub subdivisions: usize,
}

impl TimeStepControl {
    /// The steps that a case specifies, `factor` times as long.
    pub fn scaled(resolution: &Resolution, times: f64) -> Self {
        let growth = StepGrowth::Geometric {
            first_step_s: resolution.first_step_s * times,
            share: resolution.step_growth * times,
            max_step_s: resolution.max_step_s * times,
        };
        Self { growth, segments: Vec::new() }
    }

    fn segment_at(&self, time_s: f64) -> TimeSegment {
        let segment = self.segments.iter().rfind(|segment| segment.start_s <= time_s);
        segment.copied().unwrap_or(TimeSegment { start_s: 0.0, step_density: 1.0, subdivisions: 1 })
    }
}

impl StepGrowth {
    /// Times after a corner, s, with the fractional number of steps that lead to each; between two of them the number
    /// is linear in [`graded_time`](Self::graded_time).
    fn count_steps(self, from_s: f64, to_s: f64) -> Vec<(f64, f64)> {
        match self {
            Self::Geometric { first_step_s, share, max_step_s } => {
                let (mut counted, mut time_s, mut steps) = (vec![(from_s, 0.0)], from_s, 0.0);
                while time_s < to_s {
                    let step_s = (share * time_s).clamp(first_step_s, max_step_s);
                    steps += ((to_s - time_s) / step_s).min(1.0);
                    time_s = if time_s + step_s < to_s { time_s + step_s } else { to_s };
                    counted.push((time_s, steps));
                }
                counted
            }
            Self::Graded { coefficient } => {
                let [from, to] = [from_s, to_s].map(|time_s| self.graded_time(time_s));
                let steps = GRADING_EXPONENT * (to - from) / coefficient;
                // Intervals no longer than a step, so that a change of density takes effect where it is stated.
                let parts = steps.clamp(1.0, MAX_COUNTING_INTERVALS).ceil();
                let part = |part: f64| {
                    (
                        if part < parts { (from + (to - from) * part / parts).powf(GRADING_EXPONENT) } else { to_s },
                        steps * part / parts,
                    )
                };
                (0..=parts as usize).map(|number| part(number as f64)).collect()
            }
        }
    }

    /// The transformed time since a corner, in which steps are uniform.
    fn graded_time(self, time_s: f64) -> f64 {
        match self {
            Self::Geometric { .. } => time_s,
            Self::Graded { .. } => time_s.powf(1.0 / GRADING_EXPONENT),
        }
    }

    /// Inverse of [`graded_time`](Self::graded_time).
    fn time_since_corner(self, warp: f64) -> f64 {
        match self {
            Self::Geometric { .. } => warp,
            Self::Graded { .. } => warp.powf(GRADING_EXPONENT),
        }
    }
}

/// Most intervals in which the steps between two breakpoints are counted.
const MAX_COUNTING_INTERVALS: f64 = 4096.0;

impl TimeGrid {
    /// The steps of a growth rule, each divided into `subdivisions`, ending on corners of the schedules.
    pub(super) fn new(case: &Case, forcing: &Forcing, control: &TimeStepControl, subdivisions: usize) -> Self {
        let duration_s = case.exposure.duration_s;
        let ends_on_instants = matches!(control.growth, StepGrowth::Geometric { .. });
        let ends_on_all = ends_on_instants && forcing.corners_s.len() <= MAX_CORNERS;
        let corners_s = if ends_on_all { &forcing.corners_s } else { &forcing.major_corners_s };
        let corners_s = sort_and_deduplicate(corners_s.clone(), duration_s);
        let instants_s = instants_s(case);

        // At a jump of the pressure a record holds the gauges after the jump, so an earlier instant must not be
        // interpolated towards it: steps also end on the last instant before such a jump, and interpolation stays on
        // one side.
        let before =
            |jump_s: &f64| instants_s.iter().rfind(|&&at_s| at_s < jump_s - time_tolerance_s(duration_s)).copied();
        let jumps_s = if case.gas.is_some() { forcing.pressure_jumps_s.as_slice() } else { &[] };
        let before_jumps_s: Vec<f64> = jumps_s.iter().filter_map(before).collect();
        let breaks_s = sort_and_deduplicate([corners_s.as_slice(), &before_jumps_s].concat(), duration_s);
        let mut ends_s = if ends_on_instants { instants_s.clone() } else { vec![duration_s] };
        ends_s.extend(&breaks_s);
        let ends_s = sort_and_deduplicate(ends_s, duration_s);

        let mut times_s = vec![0.0];
        let mut corner_s = 0.0;
        for leg in ends_s.windows(2) {
            if let Some(&last) = corners_s.iter().rfind(|&&corner| corner <= leg[0] + time_tolerance_s(duration_s)) {
                corner_s = last;
            }
            append_steps(&mut times_s, leg[0], leg[1], corner_s, control, subdivisions);
        }
        let recorded_steps = if ends_on_instants {
            recorded_steps(&times_s, &breaks_s, &instants_s)
        } else {
            (0..times_s.len()).collect()
        };
        let record_times_s: Vec<f64> = recorded_steps.iter().map(|&step| times_s[step]).collect();
        let interpolation = RecordInterpolation::new(&record_times_s, &breaks_s, &instants_s);
        Self { times_s, instants_s, recorded_steps, interpolation }
    }
}

/// Records of specified steps beside those at instants and corners, which bounds the memory of a member: a case may
/// specify a million steps, and the curve through fewer records has the same peaks.
const MAX_RECORDS: usize = 2048;
/// Records between two corners at least, where there are so many steps.
const MIN_SEGMENT_RECORDS: usize = 16;

/// The steps at whose start specified steps are recorded: all instants and corners, and of the others all or every n-th
/// after a corner.
fn recorded_steps(times_s: &[f64], breaks_s: &[f64], instants_s: &[f64]) -> Vec<usize> {
    let close_s = time_tolerance_s(times_s[times_s.len() - 1]);
    let step_at = |&time_s: &f64| times_s.partition_point(|&other_s| other_s < time_s - close_s).min(times_s.len() - 1);
    let mut breaks: Vec<usize> = breaks_s.iter().map(step_at).chain([0, times_s.len() - 1]).collect();
    breaks.sort_unstable();
    let stride = times_s.len().div_ceil(MAX_RECORDS);
    let mut recorded: Vec<usize> = instants_s.iter().map(step_at).collect();
    for ends in breaks.windows(2) {
        let own = ((ends[1] - ends[0]) / MIN_SEGMENT_RECORDS).max(1);
        recorded.extend((ends[0]..ends[1]).step_by(stride.min(own)));
    }
    recorded.push(times_s.len() - 1);
    recorded.sort_unstable();
    recorded.dedup();
    recorded
}

/// Times at which the sensors are read, s: the output instants and the times of the observations.
pub(crate) fn instants_s(case: &Case) -> Vec<f64> {
    let duration_s = case.exposure.duration_s;
    let mut instants_s: Vec<f64> =
        (0..).map(|i| f64::from(i) * case.resolution.output_interval_s).take_while(|&t| t < duration_s).collect();
    instants_s.extend(case.observations.iter().flat_map(|seen| seen.times_s.iter().copied()));
    instants_s.push(duration_s);
    sort_and_deduplicate(instants_s, duration_s)
}

/// Times within the march, sorted and without duplicates.
fn sort_and_deduplicate(mut times_s: Vec<f64>, duration_s: f64) -> Vec<f64> {
    times_s.retain(|&t| (0.0..=duration_s).contains(&t));
    times_s.sort_by(f64::total_cmp);
    times_s.dedup_by(|later, earlier| *later - *earlier <= time_tolerance_s(duration_s));
    times_s
}

/// Append the steps from one breakpoint to the next.
///
/// The number of steps, weighted by the local density, is accumulated over the leg and divided into equal parts, so
/// that the leg has whole steps; where the density is one, no step is longer than the growth rule's. Subdivisions are
/// equal in the transformed time and cross density changes: every step is refined, even in a segment with almost none.
fn append_steps(
    times_s: &mut Vec<f64>,
    start_s: f64,
    end_s: f64,
    corner_s: f64,
    control: &TimeStepControl,
    subdivisions: usize,
) {
    // A leg that is a whole number of steps must not get one more by rounding.
    const ROUNDING: f64 = 1e-6;
    let growth = control.growth;
    let counted = growth.count_steps(start_s - corner_s, end_s - corner_s);
    let mut weighted = vec![0.0];
    for pair in counted.windows(2) {
        let segment = control.segment_at(corner_s + 0.5 * (pair[0].0 + pair[1].0));
        weighted.push(weighted[weighted.len() - 1] + segment.step_density * (pair[1].1 - pair[0].1));
    }
    let (unweighted, all) = (counted[counted.len() - 1].1, weighted[weighted.len() - 1]);
    let whole = (unweighted - ROUNDING).ceil().max(1.0);
    let steps = (whole * all / unweighted).round().max(1.0) as usize;
    let mut next = 1;
    let mut time_s = |step: f64| {
        let target = all * step / steps as f64;
        while next + 1 < counted.len() && weighted[next] < target {
            next += 1;
        }
        let share = (target - weighted[next - 1]) / (weighted[next] - weighted[next - 1]);
        let [from, to] = [counted[next - 1].0, counted[next].0].map(|time_s| growth.graded_time(time_s));
        corner_s + growth.time_since_corner(from + (to - from) * share)
    };
    for step in 1..=steps {
        let from_s = times_s[times_s.len() - 1];
        let to_s = if step < steps { time_s(step as f64) } else { end_s };
        let [from, to] = [from_s, to_s].map(|time_s| growth.graded_time(time_s - corner_s));
        let parts = subdivisions * control.segment_at(from_s).subdivisions;
        let inner = (1..parts).map(|part| from + (to - from) * part as f64 / parts as f64);
        times_s.extend(inner.map(|warp| corner_s + growth.time_since_corner(warp)).chain([to_s]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Plan;

    #[test]
    fn a_case_bounds_its_number_of_steps_closely_from_above() {
        for id in ["slab", "lcat-2259", "lcat-2259-tc3", "permeation", "stack-saffil-sic"] {
            let case = Case::load(format!("cases/{id}").as_ref()).expect("a shipped case");
            for (first_step_s, growth, max_step_s) in
                [(0.005, 0.05, 0.5), (0.1, 1.0, 10.0), (0.01, 0.01, 0.01), (1e-5, 0.5, 100.0), (0.02, 0.01, 5.0)]
            {
                let mut builder = case.to_builder();
                let resolution = &mut builder.resolution;
                (resolution.first_step_s, resolution.step_growth, resolution.max_step_s) =
                    (first_step_s, growth, max_step_s);
                let case = builder.build().expect("a valid case");
                let corners_s = case.exposure.schedules().flat_map(|schedule| schedule.times_s.iter().copied());
                let (instants, duration_s) = (instants_s(&case).len(), case.exposure.duration_s);
                let bound = case.resolution.max_steps(corners_s.collect(), instants, duration_s);
                let steps = Plan::new(&case).steps() as f64;
                assert!(steps <= bound && bound < 3.0 * steps, "{id}: {steps} steps, bound {bound}");
            }
        }
    }
}
