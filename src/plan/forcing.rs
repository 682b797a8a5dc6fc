//! Boundary schedules, reduced to the time steps of a march.
//!
//! A measured flux or temperature has thousands of rows, most of them noise that a layup averages. Adapted steps end
//! only on the corners that carry the shape of a schedule ([`major_corners`]); specified steps end on all corners, up
//! to a limit. Where a step skips rows, the schedule is replaced by its L2 projection onto continuous functions linear
//! in each step (de Boor, A Practical Guide to Splines, 2001, chapter XIV): its integral against every such function,
//! and thus the heat of a flux, is exact. Values beyond the range of the schedule are limited without a change of the
//! integral ([`limit_conservatively`]). The projected quantity is the one that the heat flux is proportional to
//! ([`Transform`]). Adaptation measures the smoothing error with all other time-step errors.

mod corners;
mod limiter;
mod transform;

use super::interpolation::share_above;
use super::time_tolerance::time_tolerance_s;
use crate::case::air::cold_wall_enthalpy_j_kg;
use crate::case::{Case, Exposure, Face, OpenFace, Schedule};
use crate::physics::layout::BoundaryForcing;
use crate::traces::Peak;
use corners::major_corners;
use limiter::limit_conservatively;
use std::ops::Range;
use std::sync::Arc;
use transform::{ConductivityIntegral, Transform};

/// The schedules of an exposure, to be evaluated on any time steps.
#[derive(Clone, Debug)]
pub(super) struct Forcing {
    signals: Vec<Signal>,
    /// Index of the signal of each quantity, hot face and back face.
    faces: [BoundaryForcing<usize>; 2],
    /// Conductivity integrals of the outermost plies, hot side and back side.
    conductivities: [Arc<ConductivityIntegral>; 2],
    duration_s: f64,
    /// Zero, and every corner of a schedule, s.
    pub corners_s: Vec<f64>,
    /// Zero, and the corners that carry the shape of a schedule ([`major_corners`]), s.
    pub major_corners_s: Vec<f64>,
    /// The major corners at which an ambient pressure, and with it the gauges, jumps, s.
    pub pressure_jumps_s: Vec<f64>,
}

/// A schedule with precomputed integrals of its blocks of rows.
#[derive(Clone, Debug)]
struct Signal {
    schedule: Schedule,
    transform: Transform,
    /// The number of a row that a value of the schedule becomes.
    row_value: fn(f64) -> f64,
    /// Smallest and largest value.
    range: (f64, f64),
    blocks: Vec<Moments>,
}

/// Rows of a schedule per precomputed integral.
const BLOCK_ROWS: usize = 256;

/// Integrals of a function from a start time: ∫ f dt, and ∫ f (t − start) dt.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    zeroth: f64,
    first: f64,
}

/// An integral over a step that is less than this share of the schedule's range times the duration is rounding.
const MISSED_PULSE: f64 = 1e-13;

/// A discontinuity smaller than this share of the schedule's range is rounding.
const JUMP_TOLERANCE: f64 = 1e-6;

impl Forcing {
    pub(super) fn new(case: &Case) -> Self {
        let pressure_pa = case.exposure.pressure_pa.after(0.0);
        let plies = [case.layup.plies.first(), case.layup.plies.last()];
        let conductivities = plies.map(|ply| {
            let ply = ply.expect("a layup has a ply");
            Arc::new(ConductivityIntegral::new(&ply.material.conductivity, pressure_pa))
        });
        Self::from_exposure(&case.exposure, conductivities)
    }

    /// The same layup under another exposure.
    pub(super) fn with_exposure(&self, exposure: &Exposure) -> Self {
        Self::from_exposure(exposure, self.conductivities.clone())
    }

    fn from_exposure(exposure: &Exposure, conductivities: [Arc<ConductivityIntegral>; 2]) -> Self {
        let duration_s = exposure.duration_s;
        let mut signals = Signals::new();
        let holder_k = exposure.holder.as_ref().map_or(ZERO, |holder| signals.plain(&holder.temperature_k));
        let hot_pressure_pa = signals.plain(&exposure.pressure_pa);
        let back_pressure_pa =
            exposure.back_pressure_pa.as_ref().map_or(hot_pressure_pa, |pressure_pa| signals.plain(pressure_pa));
        let sides = [
            (&exposure.hot_face, hot_pressure_pa, &conductivities[0]),
            (&exposure.back_face, back_pressure_pa, &conductivities[1]),
        ];
        let faces = sides.map(|(face, pressure_pa, conductivity)| {
            let none = BoundaryForcing {
                convection: ZERO,
                recovery: ONE,
                hot_wall: ZERO,
                blowing: ZERO,
                radiant_w_m2: ZERO,
                film_w_m2_k: ZERO,
                gas_k: ZERO,
                surroundings_k: ZERO,
                pressure_pa,
                held_k: ZERO,
                holder_k,
            };
            match face {
                Face::Held(temperature_k) => {
                    let transform = Transform::ConductivityIntegral(Arc::clone(conductivity));
                    BoundaryForcing { held_k: signals.add(temperature_k, transform, |value| value), ..none }
                }
                Face::Open(open) => signals.open_face(open, none),
            }
        });
        let signals = signals.0;
        let shapes_s: Vec<Vec<f64>> =
            signals.iter().map(|signal| major_corners(&signal.schedule, duration_s)).collect();
        let pressures = [hot_pressure_pa, back_pressure_pa].into_iter();
        let jumps_s = pressures.flat_map(|signal: usize| {
            let jumps = |time_s: &&f64| {
                signals[signal]
                    .is_jump(signals[signal].schedule.before(**time_s), signals[signal].schedule.after(**time_s))
            };
            shapes_s[signal].iter().filter(jumps).copied().collect::<Vec<f64>>()
        });
        let pressure_jumps_s = jumps_s.collect();
        let landings_s = std::iter::once(0.0).chain(shapes_s.into_iter().flatten()).collect();
        let all_s = signals.iter().flat_map(|signal| signal.schedule.times_s.iter().copied());
        let corners_s = std::iter::once(0.0).chain(all_s).collect();
        Self { signals, faces, conductivities, duration_s, corners_s, major_corners_s: landings_s, pressure_jumps_s }
    }

    /// Four rows a step: hot face at its start and end, back face at its start and end; then four rows for the end of
    /// the march.
    pub(super) fn at_step_ends(&self, times_s: &[f64]) -> Vec<BoundaryForcing<f64>> {
        let tolerance_s = time_tolerance_s(self.duration_s);
        let values: Vec<Vec<[f64; 2]>> =
            self.signals.iter().map(|signal| signal.at_steps(times_s, tolerance_s)).collect();
        let rows = (0..times_s.len() - 1).flat_map(|step| {
            let row_value = |signal: usize, end: usize| (self.signals[signal].row_value)(values[signal][step][end]);
            let of = |face: usize, end: usize| self.faces[face].map(|signal| row_value(signal, end));
            [of(0, 0), of(0, 1), of(1, 0), of(1, 1)]
        });
        let mut all: Vec<BoundaryForcing<f64>> = rows.collect();
        all.extend(final_rows(&all));
        all
    }

    /// The prescribed temperature of a face (0 hot, 1 back) at some instants, K, where the steps smooth it or it jumps
    /// within a step; `None` where the node of the face already has that temperature.
    pub(super) fn held_k(&self, face: usize, times_s: &[f64], instants_s: &[f64]) -> Option<Vec<f64>> {
        let tolerance_s = time_tolerance_s(self.duration_s);
        let signal = &self.signals[self.faces[face].held_k];
        let is_held = self.faces[face].held_k != ZERO;
        let values = &signal.schedule.values;
        let jumps = || {
            let rows = signal.schedule.times_s.windows(2).zip(values.windows(2));
            rows.filter(|(times_s, _)| times_s[1] - times_s[0] <= tolerance_s)
                .any(|(_, pair)| signal.is_jump(pair[0], pair[1]))
        };
        let is_smoothed = || times_s.windows(2).any(|step| signal.skips_rows(step, tolerance_s));
        (is_held && (jumps() || is_smoothed())).then(|| {
            let last_s = self.duration_s - tolerance_s;
            let at = |&instant_s: &f64| match instant_s < last_s {
                true => signal.schedule.after_within(instant_s, tolerance_s),
                false => signal.schedule.before_within(instant_s, tolerance_s),
            };
            instants_s.iter().map(at).collect()
        })
    }

    /// The highest prescribed temperature of a face (0 hot, 1 back), and the time at which it is first reached.
    pub(super) fn highest_held(&self, face: usize) -> Peak {
        let none = Peak { temperature_k: f64::NEG_INFINITY, time_s: 0.0 };
        self.held_points(face).into_iter().fold(none, |peak, (time_s, temperature_k)| {
            if temperature_k > peak.temperature_k { Peak { temperature_k, time_s } } else { peak }
        })
    }

    /// The time for which the prescribed temperature of a face (0 hot, 1 back) is above a temperature, s.
    pub(super) fn held_above_s(&self, face: usize, limit_k: f64) -> f64 {
        let points = self.held_points(face);
        let pieces = points.windows(2).map(|ends| {
            let [start_k, end_k] = [ends[0].1 - limit_k, ends[1].1 - limit_k];
            share_above(start_k, end_k) * (ends[1].0 - ends[0].0)
        });
        pieces.sum()
    }

    /// Times, s, and temperatures, K, between which the prescribed temperature of a face is linear.
    fn held_points(&self, face: usize) -> Vec<(f64, f64)> {
        let (schedule, end_s) = (&self.signals[self.faces[face].held_k].schedule, self.duration_s);
        let corners = schedule.times_s.iter().copied().zip(schedule.values.iter().copied());
        let inside = corners.filter(|(time_s, _)| *time_s > 0.0 && *time_s < end_s);
        std::iter::once((0.0, schedule.after(0.0))).chain(inside).chain([(end_s, schedule.before(end_s))]).collect()
    }
}

/// Signals under construction.
struct Signals(Vec<Signal>);

/// Index of the signal of quantities that a face lacks, among them the held temperature of an open face.
const ZERO: usize = 0;
/// Index of the signal of the recovery of a flux.
const ONE: usize = 1;

impl Signals {
    fn new() -> Self {
        let constant = |value| Signal::new(&Schedule::constant(value), Transform::Identity, |value| value);
        Self(vec![constant(0.0), constant(1.0)])
    }

    /// Add a schedule; `row_value` is the number of a row that a value becomes.
    fn add(&mut self, schedule: &Schedule, transform: Transform, row_value: fn(f64) -> f64) -> usize {
        self.0.push(Signal::new(schedule, transform, row_value));
        self.0.len() - 1
    }

    /// Add a schedule of values that are proportional to the heat flux and stand in a row as they are.
    fn plain(&mut self, schedule: &Schedule) -> usize {
        self.add(schedule, Transform::Identity, |value| value)
    }

    fn open_face(&mut self, open: &OpenFace, none: BoundaryForcing<usize>) -> BoundaryForcing<usize> {
        let (convection, recovery, hot_wall) = match (&open.enthalpy_film_kg_m2_s, &open.recovery_enthalpy_j_kg) {
            (Some(film), Some(enthalpy)) => {
                let above_cold_wall = |enthalpy_j_kg| enthalpy_j_kg - cold_wall_enthalpy_j_kg();
                (self.plain(film), self.add(enthalpy, Transform::Identity, above_cold_wall), ONE)
            }
            (_, Some(enthalpy)) => {
                let correction = |enthalpy_j_kg| Transform::HotWall.apply(enthalpy_j_kg);
                (self.plain(&open.flux_w_m2), ONE, self.add(enthalpy, Transform::HotWall, correction))
            }
            (_, None) => (self.plain(&open.flux_w_m2), ONE, ZERO),
        };
        BoundaryForcing {
            convection,
            recovery,
            hot_wall,
            blowing: self.add(&open.blowing, Transform::Identity, |lambda| 2.0 * lambda),
            radiant_w_m2: self.plain(&open.radiant_w_m2),
            film_w_m2_k: self.plain(&open.film_w_m2_k),
            gas_k: self.plain(&open.gas_k),
            surroundings_k: self.add(&open.surroundings_k, Transform::FourthPower, |value| value),
            ..none
        }
    }
}

/// The last four rows: those at the end of the last step, repeated.
pub(super) fn final_rows(drives: &[BoundaryForcing<f64>]) -> [BoundaryForcing<f64>; 4] {
    let [hot, back] = [drives[drives.len() - 3], drives[drives.len() - 1]];
    [hot, hot, back, back]
}

impl Signal {
    fn new(schedule: &Schedule, transform: Transform, row_value: fn(f64) -> f64) -> Self {
        let values = schedule.values.iter();
        let range = values
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), &value| (least.min(value), most.max(value)));
        let mut signal = Self { schedule: schedule.clone(), transform, row_value, range, blocks: Vec::new() };
        let blocks = (schedule.times_s.len() - 1) / BLOCK_ROWS;
        signal.blocks = (0..blocks)
            .map(|block| {
                let first = block * BLOCK_ROWS;
                signal.between_rows(first..first + BLOCK_ROWS, schedule.times_s[first])
            })
            .collect();
        signal
    }

    /// The value at the start and at the end of each step.
    fn at_steps(&self, times_s: &[f64], tolerance_s: f64) -> Vec<[f64; 2]> {
        let read = |step: &[f64]| {
            [self.schedule.after_within(step[0], tolerance_s), self.schedule.before_within(step[1], tolerance_s)]
        };
        let mut values: Vec<[f64; 2]> = times_s.windows(2).map(read).collect();
        let (least, most) = self.range;
        let mut first = 0;
        for end in 1..=values.len() {
            if end < values.len() && !self.is_jump(values[end - 1][1], values[end][0]) {
                continue;
            }
            let mut steps = times_s[first..=end].windows(2).zip(&values[first..end]);
            if steps.any(|(step, ends)| self.skips_rows(step, tolerance_s) || self.misses_pulse(step, *ends)) {
                let mut nodes = self.l2_projection(&times_s[first..=end]);
                let lengths_s: Vec<f64> = times_s[first..=end].windows(2).map(|step| step[1] - step[0]).collect();
                let ends = [least, most].map(|value| self.transform.apply(value));
                limit_conservatively(&mut nodes, &lengths_s, (ends[0].min(ends[1]), ends[0].max(ends[1])));
                nodes.iter_mut().for_each(|node| *node = self.transform.inverse(*node));
                for (value, pair) in values[first..end].iter_mut().zip(nodes.windows(2)) {
                    // Rounding, and the inverse of a transform.
                    *value = [pair[0], pair[1]].map(|node| node.clamp(least, most));
                }
            }
            first = end;
        }
        values
    }

    /// Whether two values at one time differ by more than rounding.
    fn is_jump(&self, before: f64, after: f64) -> bool {
        let (least, most) = self.range;
        (after - before).abs() > JUMP_TOLERANCE * (most - least)
    }

    /// Rows of the schedule inside a step, farther than the tolerance from both of its ends.
    fn rows_inside(&self, step: &[f64], tolerance_s: f64) -> Range<usize> {
        let times_s = &self.schedule.times_s;
        let first = times_s.partition_point(|&time_s| time_s <= step[0] + tolerance_s);
        first..times_s.partition_point(|&time_s| time_s < step[1] - tolerance_s).max(first)
    }

    fn skips_rows(&self, step: &[f64], tolerance_s: f64) -> bool {
        !self.rows_inside(step, tolerance_s).is_empty()
    }

    /// Whether a pulse shorter than the tolerance of times lies at an end of a step, where a straight line between the
    /// values at the ends misses its integral.
    fn misses_pulse(&self, step: &[f64], ends: [f64; 2]) -> bool {
        if self.rows_inside(step, 0.0).is_empty() {
            return false;
        }
        let [start, middle, end] =
            [ends[0], 0.5 * (ends[0] + ends[1]), ends[1]].map(|value| self.transform.apply(value));
        let line = (step[1] - step[0]) * (start + 4.0 * middle + end) / 6.0;
        let range = self.transform.apply(self.range.1) - self.transform.apply(self.range.0);
        let duration_s = self.schedule.times_s.last().map_or(step[1], |end_s| end_s.max(step[1]));
        (self.moments_over(step).zeroth - line).abs() > MISSED_PULSE * range.abs() * duration_s
    }

    /// Transformed nodal values of the L2 projection onto continuous functions linear in each step: a tridiagonal
    /// system with the mass matrix of linear finite elements.
    fn l2_projection(&self, times_s: &[f64]) -> Vec<f64> {
        let nodes = times_s.len();
        let (mut diagonal, mut right) = (vec![0.0; nodes], vec![0.0; nodes]);
        let lengths_s: Vec<f64> = times_s.windows(2).map(|step| step[1] - step[0]).collect();
        for (step, (pair, &length_s)) in times_s.windows(2).zip(&lengths_s).enumerate() {
            let moments = self.moments_over(pair);
            let rising = moments.first / length_s;
            right[step] += moments.zeroth - rising;
            right[step + 1] += rising;
            diagonal[step] += length_s / 3.0;
            diagonal[step + 1] += length_s / 3.0;
        }
        for node in 1..nodes {
            let neighbour = lengths_s[node - 1] / 6.0;
            let ratio = neighbour / diagonal[node - 1];
            diagonal[node] -= ratio * neighbour;
            right[node] -= ratio * right[node - 1];
        }
        right[nodes - 1] /= diagonal[nodes - 1];
        for node in (0..nodes - 1).rev() {
            right[node] = (right[node] - lengths_s[node] / 6.0 * right[node + 1]) / diagonal[node];
        }
        right
    }

    /// The moments over a step from its start: row by row to the next block, then whole blocks.
    fn moments_over(&self, step: &[f64]) -> Moments {
        let rows = self.rows_inside(step, 0.0);
        let (start, end) = (self.schedule.after(step[0]), self.schedule.before(step[1]));
        if rows.is_empty() {
            return self.segment([step[0], step[1]], [start, end], step[0]);
        }
        let (times_s, values) = (&self.schedule.times_s, &self.schedule.values);
        let (first, last) = (rows.start, rows.end - 1);
        let head = self.segment([step[0], times_s[first]], [start, values[first]], step[0]);
        let tail = self.segment([times_s[last], step[1]], [values[last], end], step[0]);
        let sum = head.plus(tail);
        let blocks = first.div_ceil(BLOCK_ROWS)..last / BLOCK_ROWS;
        if blocks.is_empty() {
            return sum.plus(self.between_rows(first..last, step[0]));
        }
        let sum = sum.plus(self.between_rows(first..blocks.start * BLOCK_ROWS, step[0]));
        let sum = sum.plus(self.between_rows(blocks.end * BLOCK_ROWS..last, step[0]));
        blocks.fold(sum, |sum, block| {
            let Moments { zeroth, first } = self.blocks[block];
            sum.plus(Moments { zeroth, first: first + (times_s[block * BLOCK_ROWS] - step[0]) * zeroth })
        })
    }

    /// The moments over the segments between rows.
    fn between_rows(&self, rows: Range<usize>, from_s: f64) -> Moments {
        let (times_s, values) = (&self.schedule.times_s, &self.schedule.values);
        rows.fold(Moments::default(), |sum, row| {
            sum.plus(self.segment([times_s[row], times_s[row + 1]], [values[row], values[row + 1]], from_s))
        })
    }

    /// The moments of the transform of a straight line by Simpson's rule: exact for a straight line, and for the
    /// integral of a conductivity linear in temperature.
    fn segment(&self, times_s: [f64; 2], values: [f64; 2], from_s: f64) -> Moments {
        let [start, middle, end] =
            [values[0], 0.5 * (values[0] + values[1]), values[1]].map(|value| self.transform.apply(value));
        let length_s = times_s[1] - times_s[0];
        let zeroth = length_s * (start + 4.0 * middle + end) / 6.0;
        let first = (times_s[0] - from_s) * zeroth + length_s * length_s * (2.0 * middle + end) / 6.0;
        Moments { zeroth, first }
    }
}

impl Moments {
    fn plus(self, other: Self) -> Self {
        Self { zeroth: self.zeroth + other.zeroth, first: self.first + other.first }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::RandomStream;

    /// A square pulse sampled at 100 Hz, with relative noise.
    fn pulse(rows: usize, noise: f64) -> Schedule {
        let mut numbers = RandomStream::new(1, 27);
        let times_s: Vec<f64> = (0..rows).map(|row| 0.01 * row as f64).collect();
        let end_s = 0.01 * (rows - 1) as f64;
        let value = |time_s: f64| if (0.2 * end_s..0.5 * end_s).contains(&time_s) { 2e5 } else { 0.0 };
        let values = times_s.iter().map(|&time_s| value(time_s) + 2e5 * noise * numbers.normal()).collect();
        Schedule { times_s, values }
    }

    fn steps_s(steps: usize, end_s: f64) -> Vec<f64> {
        // Nonuniform steps that coincide with no row.
        let time = |step: usize| end_s * (step as f64 / steps as f64).powf(1.3);
        (0..=steps).map(time).collect()
    }

    /// The exact integral of the product of two piecewise linear functions.
    fn product(schedule: &Schedule, hat: impl Fn(f64) -> f64, points_s: &[f64]) -> f64 {
        let mut all_s: Vec<f64> = schedule.times_s.iter().chain(points_s).copied().collect();
        all_s.sort_by(f64::total_cmp);
        let (least_s, most_s) = (points_s[0], points_s[points_s.len() - 1]);
        let pairs = all_s.windows(2).filter(|pair| pair[0] >= least_s && pair[1] <= most_s && pair[0] < pair[1]);
        pairs
            .map(|pair| {
                let [f0, f1] = [schedule.after(pair[0]), schedule.before(pair[1])];
                let [g0, g1] = [hat(pair[0]), hat(pair[1])];
                (pair[1] - pair[0]) * (2.0 * (f0 * g0 + f1 * g1) + f0 * g1 + f1 * g0) / 6.0
            })
            .sum()
    }

    #[test]
    fn projection_conserves_the_heat_of_a_noisy_flux_and_its_integral_against_every_hat_function() {
        let schedule = pulse(3001, 0.01);
        let times_s = steps_s(40, 30.0);
        let signal = Signal::new(&schedule, Transform::Identity, |value| value);
        let nodes = signal.l2_projection(&times_s);
        for node in 0..times_s.len() {
            let support = &times_s[node.saturating_sub(1)..=(node + 1).min(times_s.len() - 1)];
            let hat = |time_s: f64| {
                let neighbour = if time_s < times_s[node] { times_s[node - 1] } else { support[support.len() - 1] };
                if time_s == times_s[node] { 1.0 } else { (time_s - neighbour) / (times_s[node] - neighbour) }
            };
            let exact = product(&schedule, hat, support);
            let linear = Schedule { times_s: times_s.clone(), values: nodes.clone() };
            let found = product(&linear, hat, support);
            assert!((found - exact).abs() < 1e-9 * 2e5 * 30.0, "{found}, not {exact}, about {} s", times_s[node]);
        }
        let heat = |schedule: &Schedule| product(schedule, |_| 1.0, &[0.0, 30.0]);
        let found = heat(&Schedule { times_s: times_s.clone(), values: nodes });
        assert!((found / heat(&schedule) - 1.0).abs() < 1e-12);
        let read = Schedule { values: times_s.iter().map(|&time_s| schedule.after(time_s)).collect(), times_s };
        assert!((heat(&read) / heat(&schedule) - 1.0).abs() > 1e-3, "point sampling at the ends of steps loses heat");
    }

    #[test]
    fn block_integrals_equal_the_sums_over_their_rows() {
        let signal = Signal::new(&pulse(3001, 0.01), Transform::FourthPower, |value| value);
        for step in [[0.0, 30.0], [0.005, 29.0], [2.56, 5.12], [2.551, 7.689]] {
            let Moments { zeroth, first } = signal.moments_over(&step);
            let one_by_one = Signal { blocks: Vec::new(), ..signal.clone() };
            let rows = one_by_one.rows_inside(&step, 0.0);
            let ends = [signal.schedule.after(step[0]), signal.schedule.before(step[1])];
            let times = &signal.schedule.times_s;
            let values = &signal.schedule.values;
            let head = signal.segment([step[0], times[rows.start]], [ends[0], values[rows.start]], step[0]);
            let tail = signal.segment([times[rows.end - 1], step[1]], [values[rows.end - 1], ends[1]], step[0]);
            let exact = head.plus(one_by_one.between_rows(rows.start..rows.end - 1, step[0])).plus(tail);
            assert!((zeroth / exact.zeroth - 1.0).abs() < 1e-12, "{step:?}");
            assert!((first / exact.first - 1.0).abs() < 1e-12, "{step:?}");
        }
    }

    #[test]
    fn a_schedule_with_steps_on_all_corners_is_sampled_exactly() {
        let schedule = Schedule { times_s: vec![0.0, 0.5, 41.0, 41.0], values: vec![0.0, 26.7, 26.7, 1.0] };
        let values =
            Signal::new(&schedule, Transform::Identity, |value| value).at_steps(&[0.0, 0.25, 0.5, 41.0, 60.0], 1e-9);
        assert_eq!(values, [[0.0, 13.35], [13.35, 26.7], [26.7, 26.7], [1.0, 1.0]]);
    }

    /// The projection overshoots on both sides of such a pulse; clamping it gave up to half as much heat again.
    #[test]
    fn a_pulse_shorter_than_a_step_gives_its_heat_within_its_range() {
        // The shortest is within the tolerance of times.
        for width_s in [1e-5, 1e-3, 0.5, 10.0, 60.0] {
            let (start_s, end_s) = (3600.0, 3600.0 + width_s);
            let times_s = vec![0.0, start_s, start_s, end_s, end_s, 86_400.0];
            let pulse = Schedule { times_s, values: vec![0.0, 0.0, 1e5, 1e5, 0.0, 0.0] };
            let steps_s = steps_s(40, 86_400.0);
            let signal = Signal::new(&pulse, Transform::Identity, |value| value);
            let values = signal.at_steps(&steps_s, time_tolerance_s(86_400.0));
            assert!(values.iter().flatten().all(|value| (0.0..=1e5).contains(value)), "{values:?}");
            let heats =
                steps_s.windows(2).zip(&values).map(|(step, ends)| 0.5 * (step[1] - step[0]) * (ends[0] + ends[1]));
            let heat = heats.sum::<f64>();
            assert!((heat / (1e5 * width_s) - 1.0).abs() < 1e-6, "{heat} J/m² of {width_s} s");
            // The same with a step that ends where the pulse begins.
            let mut ending_s = steps_s;
            ending_s.push(start_s);
            ending_s.sort_by(f64::total_cmp);
            let values = signal.at_steps(&ending_s, time_tolerance_s(86_400.0));
            let heats =
                ending_s.windows(2).zip(&values).map(|(step, ends)| 0.5 * (step[1] - step[0]) * (ends[0] + ends[1]));
            let heat = heats.sum::<f64>();
            assert!((heat / (1e5 * width_s) - 1.0).abs() < 1e-6, "{heat} J/m² of {width_s} s after the end of a step");
        }
    }

    #[test]
    fn a_projected_schedule_stays_within_its_range() {
        let times_s: Vec<f64> = (0..2000).map(|row| 0.1 * row as f64).collect();
        let values = (0..2000).map(|row| if row / 7 % 3 == 0 { 1e5 } else { 0.0 }).collect();
        let signal = Signal::new(&Schedule { times_s, values }, Transform::Identity, |value| value);
        let found = signal.at_steps(&steps_s(30, 199.9), 1e-9);
        assert!(found.iter().flatten().all(|value| (0.0..=1e5).contains(value)), "{found:?}");
        assert!(found.iter().flatten().any(|&value| value > 2e4), "the projection is zero");
    }
}
