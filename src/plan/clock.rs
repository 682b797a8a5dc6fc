//! Steps and sampling instants through time.
//!
//! A step ends on every corner that carries the shape of a schedule, where steps are stated on every corner and every instant. Every member
//! of an ensemble shares the clock, which keeps differences between members free of the noise of choosing steps.

use super::forcing::Forcing;
use super::readout::Readout;
use super::same_instant::same_instant_s;
use crate::case::{Case, Resolution};

/// Steps through time.
#[derive(Clone, Debug)]
pub struct Clock {
    /// End of each step, s, after a first entry of zero.
    pub times_s: Vec<f64>,
    /// Times at which the sensors are read, s; the first is zero.
    pub instants_s: Vec<f64>,
    /// How they are read between steps; `None` where steps end on all of them.
    pub(super) readout: Option<Readout>,
}

/// How steps follow one another, before they are cut.
#[derive(Clone, Debug, PartialEq)]
pub struct Pace {
    /// How steps grow after a corner of a schedule.
    pub growth: Growth,
    /// Where steps are to be denser or sparser than all that says, in the order of their times.
    pub slices: Vec<Slice>,
}

/// How steps grow with the time since the last corner of a schedule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Growth {
    /// A share of that time, between a first and a largest step, s; steps end on every instant too.
    Stated {
        /// The first step after a corner, s.
        first_step_s: f64,
        /// A step is at most this share of the time since the corner.
        share: f64,
        /// No step is longer, s.
        largest_step_s: f64,
    },
    /// `h = coefficient τ^(1 − 1/GRADING)`, in s^(1/GRADING): the time since the corner is a power of the number of a step. Readings are taken
    /// between steps.
    Graded {
        /// s^(1/GRADING).
        coefficient: f64,
    },
}

/// The power of its number by which the time of a step rises after a corner.
///
/// Behind a jump of a flux a temperature rises as √t, behind one of a temperature the flux falls as 1/√t; steps of one length are then of
/// order 1 or less, however short. Times that rise by the fourth power of their number keep the second order of either (Brunner, SIAM J.
/// Numer. Anal. 20, 1983, for the like of weakly singular kernels), and steps of half the lengths lie on the same curve.
pub const GRADING: f64 = 4.0;

/// Steps from a time on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slice {
    /// Time from which on it holds, s.
    pub from_s: f64,
    /// Steps for each step of the pace.
    pub density: f64,
    /// Each step is cut into so many: unlike a density, this refines every step, however few the pace takes between two corners.
    pub cuts: usize,
}

impl Pace {
    /// So many times as long steps as a case states.
    pub fn slowed(resolution: &Resolution, times: f64) -> Self {
        let growth = Growth::Stated {
            first_step_s: resolution.first_step_s * times,
            share: resolution.growth * times,
            largest_step_s: resolution.largest_step_s * times,
        };
        Self { growth, slices: Vec::new() }
    }

    fn slice(&self, time_s: f64) -> Slice {
        let slice = self.slices.iter().rfind(|slice| slice.from_s <= time_s);
        slice.copied().unwrap_or(Slice { from_s: 0.0, density: 1.0, cuts: 1 })
    }
}

impl Growth {
    /// Times after a corner, s, from one to another, and how many steps lead from the first to each; between them the number rises
    /// with the root of the time that [`warp`](Self::warp) takes.
    fn walk(self, from_s: f64, to_s: f64) -> Vec<(f64, f64)> {
        match self {
            Self::Stated { first_step_s, share, largest_step_s } => {
                let (mut walked, mut time_s, mut steps) = (vec![(from_s, 0.0)], from_s, 0.0);
                while time_s < to_s {
                    let step_s = (share * time_s).clamp(first_step_s, largest_step_s);
                    steps += ((to_s - time_s) / step_s).min(1.0);
                    time_s = if time_s + step_s < to_s { time_s + step_s } else { to_s };
                    walked.push((time_s, steps));
                }
                walked
            }
            Self::Graded { coefficient } => {
                let [from, to] = [from_s, to_s].map(|time_s| self.warp(time_s));
                let steps = GRADING * (to - from) / coefficient;
                // A part is no longer than a step, so that densities change where they should; many where there are many steps.
                let parts = steps.clamp(1.0, WALK_MOST).ceil();
                let part = |part: f64| {
                    (
                        if part < parts { (from + (to - from) * part / parts).powf(GRADING) } else { to_s },
                        steps * part / parts,
                    )
                };
                (0..=parts as usize).map(|number| part(number as f64)).collect()
            }
        }
    }

    /// What rises evenly with the number of a step, of the time since a corner.
    fn warp(self, time_s: f64) -> f64 {
        match self {
            Self::Stated { .. } => time_s,
            Self::Graded { .. } => time_s.powf(1.0 / GRADING),
        }
    }

    /// The time of a warp.
    fn unwarp(self, warp: f64) -> f64 {
        match self {
            Self::Stated { .. } => warp,
            Self::Graded { .. } => warp.powf(GRADING),
        }
    }
}

/// Parts in which steps from one landing to the next are counted, at most, where they are graded.
const WALK_MOST: f64 = 4096.0;

/// A case that states its steps has one end on every corner of its schedules, while they have no more than this.
const CORNERS_MOST: usize = 10_000;

impl Clock {
    /// How instants are read between steps; `None` where steps end on them.
    #[cfg(feature = "internals")]
    pub fn readout(&self) -> Option<&Readout> {
        self.readout.as_ref()
    }

    /// The steps of a pace, each cut into so many, which end on the corners of schedules that are to be landed on.
    pub(super) fn new(case: &Case, forcing: &Forcing, pace: &Pace, cuts: usize) -> Self {
        let duration_s = case.exposure.duration_s;
        let lands = matches!(pace.growth, Growth::Stated { .. });
        let lands_on_all = lands && forcing.corners_s.len() <= CORNERS_MOST;
        let corners_s = if lands_on_all { &forcing.corners_s } else { &forcing.landings_s };
        let corners_s = settle(corners_s.clone(), duration_s);
        let mut instants_s: Vec<f64> =
            (0..).map(|i| f64::from(i) * case.resolution.every_s).take_while(|&t| t < duration_s).collect();
        instants_s.extend(case.observations.iter().flat_map(|seen| seen.times_s.iter().copied()));
        instants_s.push(duration_s);
        let instants_s = settle(instants_s, duration_s);

        // A record at a jump has what gauges read after it: an instant before is not to be interpolated towards that. So steps end on
        // the last instant before such a jump, and readings do not look beyond it.
        let before =
            |jump_s: &f64| instants_s.iter().rfind(|&&at_s| at_s < jump_s - same_instant_s(duration_s)).copied();
        let jumps_s = if case.gas.is_some() { forcing.pressure_jumps_s.as_slice() } else { &[] };
        let before_jumps_s: Vec<f64> = jumps_s.iter().filter_map(before).collect();
        let breaks_s = settle([corners_s.as_slice(), &before_jumps_s].concat(), duration_s);
        let mut landings_s = if lands { instants_s.clone() } else { vec![duration_s] };
        landings_s.extend(&breaks_s);
        let landings_s = settle(landings_s, duration_s);

        let mut times_s = vec![0.0];
        let mut corner_s = 0.0;
        for leg in landings_s.windows(2) {
            if let Some(&last) = corners_s.iter().rfind(|&&corner| corner <= leg[0] + same_instant_s(duration_s)) {
                corner_s = last;
            }
            fill(&mut times_s, leg[0], leg[1], corner_s, pace, cuts);
        }
        let readout = (!lands).then(|| Readout::new(&times_s, &breaks_s, &instants_s));
        Self { times_s, instants_s, readout }
    }
}

/// Times in order, within the march, once each.
fn settle(mut times_s: Vec<f64>, duration_s: f64) -> Vec<f64> {
    times_s.retain(|&t| (0.0..=duration_s).contains(&t));
    times_s.sort_by(f64::total_cmp);
    times_s.dedup_by(|later, earlier| *later - *earlier <= same_instant_s(duration_s));
    times_s
}

/// Append the steps from one landing to the next, each cut into so many.
///
/// The number of steps that the pace takes, its densities counted in, is summed up over the leg, and steps end where it has
/// risen by equal parts, which are such that the leg has whole steps: none is longer than the pace's where its density is one. Cuts are equal parts of
/// a step on the pace's own curve, whatever densities meet within it: each step is really refined, also one over a slice that is nearly empty.
fn fill(times_s: &mut Vec<f64>, start_s: f64, end_s: f64, corner_s: f64, pace: &Pace, cuts: usize) {
    // Rounding of a leg that is a multiple of the step is not to cost a step.
    const ROUNDING: f64 = 1e-6;
    let growth = pace.growth;
    let walked = growth.walk(start_s - corner_s, end_s - corner_s);
    let mut dense = vec![0.0];
    for pair in walked.windows(2) {
        let slice = pace.slice(corner_s + 0.5 * (pair[0].0 + pair[1].0));
        dense.push(dense[dense.len() - 1] + slice.density * (pair[1].1 - pair[0].1));
    }
    let (plain, all) = (walked[walked.len() - 1].1, dense[dense.len() - 1]);
    let whole = (plain - ROUNDING).ceil().max(1.0);
    let steps = (whole * all / plain).round().max(1.0) as usize;
    let mut next = 1;
    let mut time_s = |step: f64| {
        let reached = all * step / steps as f64;
        while next + 1 < walked.len() && dense[next] < reached {
            next += 1;
        }
        let share = (reached - dense[next - 1]) / (dense[next] - dense[next - 1]);
        let [from, to] = [walked[next - 1].0, walked[next].0].map(|time_s| growth.warp(time_s));
        corner_s + growth.unwarp(from + (to - from) * share)
    };
    for step in 1..=steps {
        let from_s = times_s[times_s.len() - 1];
        let to_s = if step < steps { time_s(step as f64) } else { end_s };
        let [from, to] = [from_s, to_s].map(|time_s| growth.warp(time_s - corner_s));
        let parts = cuts * pace.slice(from_s).cuts;
        let inner = (1..parts).map(|part| from + (to - from) * part as f64 / parts as f64);
        times_s.extend(inner.map(|warp| corner_s + growth.unwarp(warp)).chain([to_s]));
    }
}
