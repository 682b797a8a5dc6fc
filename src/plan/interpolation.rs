//! Interpolation of readings between steps.
//!
//! Ending a step on every instant would force many short steps where little changes. A reading between steps is
//! interpolated by the cubic through the two records before it and the two after it; no stencil crosses a corner of a
//! schedule, where slopes jump. Peaks, and times above a limit, are those of this curve over all steps, so that they do
//! not depend on the instants.

use super::time_tolerance::time_tolerance_s;
use std::ops::Range;

/// Maximum number of records in an interpolation stencil.
pub(crate) const STENCIL_RECORDS: usize = 4;

/// The curve through the records of a march: its readings at the instants, and its highest point. Stencils and weights
/// at the instants are the same for all members.
#[derive(Clone, Debug)]
pub struct RecordInterpolation {
    /// Time of each record, s.
    times_s: Vec<f64>,
    /// The records at corners, the first and the last: between two of them the curve is smooth.
    breaks: Vec<usize>,
    stencils: Vec<Stencil>,
}

/// Records and weights of a value of the curve; the weights add up to one.
pub(crate) type Stencil = [(usize, f64); STENCIL_RECORDS];

/// The highest point of a curve through records.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HighestPoint {
    pub(crate) value: f64,
    pub(crate) time_s: f64,
    /// Index of the segment of the point.
    pub(crate) segment: usize,
    /// Records and weights of the point: the derivative of a maximum is the derivative at its time.
    pub(crate) stencil: Stencil,
}

impl RecordInterpolation {
    /// Interpolation from records at `times_s`, which include all `corners_s`, to `instants_s`, none later than the
    /// last record.
    pub(super) fn new(times_s: &[f64], corners_s: &[f64], instants_s: &[f64]) -> Self {
        let close_s = time_tolerance_s(times_s.last().copied().unwrap_or_default());
        let at = |time_s: f64| times_s.partition_point(|&other_s| other_s < time_s - close_s);
        let last_record = times_s.len() - 1;
        let mut breaks: Vec<usize> = corners_s.iter().map(|&corner_s| at(corner_s).min(last_record)).collect();
        breaks.extend([0, last_record]);
        breaks.sort_unstable();
        breaks.dedup();
        let records = Self { times_s: times_s.to_vec(), breaks, stencils: Vec::new() };
        Self { stencils: instants_s.iter().map(|&instant_s| records.stencil_at(instant_s)).collect(), ..records }
    }

    /// The stencil of a time, none later than the last record.
    fn stencil_at(&self, time_s: f64) -> Stencil {
        let (times_s, last_record) = (&self.times_s, self.times_s.len() - 1);
        let close_s = time_tolerance_s(times_s[last_record]);
        let after = times_s.partition_point(|&other_s| other_s < time_s - close_s).min(last_record);
        if (times_s[after] - time_s).abs() <= close_s {
            return lagrange_weights(times_s, after..after + 1, time_s);
        }
        let next = self.breaks.partition_point(|&record| record < after);
        let (begin, end) = (self.breaks[next.saturating_sub(1)], self.breaks[next]);
        lagrange_weights(times_s, stencil_records(after - 1, begin, end), time_s)
    }

    /// A curve with further records, at corners of another quantity, between which it is smooth; and the stencil of
    /// each of its records among those of this curve.
    pub(super) fn with_corners(&self, corners_s: &[f64]) -> (Self, Vec<Stencil>) {
        let end_s = self.times_s[self.times_s.len() - 1];
        let close_s = time_tolerance_s(end_s);
        let inside = corners_s.iter().copied().filter(|&corner_s| corner_s > close_s && corner_s < end_s - close_s);
        let breaks_s: Vec<f64> = self.breaks.iter().map(|&record| self.times_s[record]).chain(inside).collect();
        let mut times_s: Vec<f64> = self.times_s.iter().chain(&breaks_s).copied().collect();
        times_s.sort_by(f64::total_cmp);
        times_s.dedup_by(|later, earlier| *later - *earlier <= close_s);
        let stencils = times_s.iter().map(|&time_s| self.stencil_at(time_s)).collect();
        (Self::new(&times_s, &breaks_s, &[]), stencils)
    }

    /// The records and weights of each instant.
    pub fn stencils(&self) -> &[[(usize, f64); STENCIL_RECORDS]] {
        &self.stencils
    }

    /// Number of instants.
    pub fn instant_count(&self) -> usize {
        self.stencils.len()
    }

    /// Time of each record, s.
    pub(crate) fn record_times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// The first record of each smooth part of the curve.
    pub(crate) fn segment_starts(&self) -> &[usize] {
        &self.breaks[..self.breaks.len() - 1]
    }

    /// The interpolation up to one of the instants, from the records that it needs.
    pub(super) fn until(&self, instant: usize) -> Self {
        let stencils = self.stencils[..=instant].to_vec();
        let last = stencils.iter().flatten().map(|&(record, _)| record).max().unwrap_or_default();
        Self { stencils, ..self.until_record(last) }
    }

    /// The curve up to a record, without readings.
    pub(super) fn until_record(&self, last: usize) -> Self {
        let mut breaks: Vec<usize> = self.breaks.iter().copied().filter(|&record| record < last).collect();
        breaks.push(last);
        if last == 0 {
            breaks.push(0);
        }
        Self { times_s: self.times_s[..=last].to_vec(), breaks, stencils: Vec::new() }
    }

    /// The last record that is used.
    pub(super) fn last_record(&self) -> usize {
        self.times_s.len() - 1
    }

    /// The interpolation to the same instants from only the records that it uses, and the indices of these records in
    /// ascending order.
    pub(crate) fn at_instants_only(&self) -> (Self, Vec<usize>) {
        let mut used: Vec<usize> = self.stencils.iter().flatten().map(|&(record, _)| record).collect();
        used.sort_unstable();
        used.dedup();
        let place = |record: usize| used.partition_point(|&other| other < record);
        let stencils = self.stencils.iter().map(|taps| taps.map(|(record, weight)| (place(record), weight))).collect();
        let times_s = used.iter().map(|&record| self.times_s[record]).collect();
        (Self { times_s, breaks: vec![0, used.len() - 1], stencils }, used)
    }

    /// Replace the records before `known_s` by the parabola through the three that follow in the first segment, or what
    /// there is of it; where those have one sign, by zero if the parabola has the other.
    pub(crate) fn extrapolate_start(&self, known_s: f64, records: &mut [f64]) {
        // First steps may be shorter than any tolerance of times; records are at steps.
        let known = self.times_s.partition_point(|&time_s| time_s < known_s);
        let end = self.breaks.get(1).map_or(0, |&record| record + 1);
        if known >= end {
            return;
        }
        let used = known..(known + 3).min(end);
        let one_sign = records[used.clone()].iter().all(|value| value * records[known] >= 0.0);
        for record in 0..known {
            let value = value_at(&lagrange_weights(&self.times_s, used.clone(), self.times_s[record]), records);
            records[record] = if one_sign && value * records[known] < 0.0 { 0.0 } else { value };
        }
    }

    /// The readings at all instants, from the records of one sensor, into `readings`, one value per instant.
    pub fn interpolate(&self, records: &[f64], readings: &mut [f64]) {
        for (reading, taps) in readings.iter_mut().zip(&self.stencils) {
            *reading = value_at(taps, records);
        }
    }

    /// The first highest point of the curve through the records of one sensor. At a corner the curve may jump: `starts`
    /// has its value just after the start of each [segment](Self::segment_starts), where this is not the record.
    pub(crate) fn highest(&self, records: &[f64], starts: Option<&[f64]>) -> HighestPoint {
        // Noise has many local maxima, of which few can be the highest point.
        let floor = records[..self.times_s.len()].iter().fold(f64::NEG_INFINITY, |most, &value| value.max(most));
        let mut highest = HighestPoint { value: f64::NEG_INFINITY, ..self.record(0, 0, f64::NEG_INFINITY) };
        for (segment, ends) in self.breaks.windows(2).enumerate() {
            let (begin, end) = (ends[0], ends[1]);
            let start = starts.map_or(records[begin], |starts| starts[segment]);
            let mut raise = |record: usize| self.raise(&mut highest, records, (segment, start), record, floor);
            // The highest record, and those beside the highest point between two, are not below their neighbours.
            if end == begin || start >= records[begin + 1] {
                raise(begin);
            }
            if end > begin + 1 && records[begin + 1] > start && records[begin + 1] >= records[begin + 2] {
                raise(begin + 1);
            }
            if end > begin + 2 {
                for (record, of) in (begin + 2..).zip(records[begin + 1..=end].windows(3)) {
                    if of[1] > of[0] && of[1] >= of[2] {
                        raise(record);
                    }
                }
            }
            let before = if end > begin + 1 { records[end - 1] } else { start };
            if end > begin && records[end] > before {
                raise(end);
            }
        }
        highest
    }

    /// Raise the highest point to a record of a segment, whose first value is `start`, and to the curve beside it,
    /// unless both are below `floor`.
    fn raise(
        &self,
        highest: &mut HighestPoint,
        records: &[f64],
        (segment, start): (usize, f64),
        record: usize,
        floor: f64,
    ) {
        let (begin, end) = (self.breaks[segment], self.breaks[segment + 1]);
        let value = |record: usize| if record == begin { start } else { records[record] };
        let here = value(record);
        let neighbours = [record.max(begin + 1) - 1, (record + 1).min(end)];
        // The curve cannot rise above the record by much more than the record differs from its neighbours.
        let reach = neighbours.map(|other| (here - value(other)).abs());
        let most = here + 2.0 * reach[0].max(reach[1]);
        if most < floor {
            return;
        }
        if here > highest.value {
            *highest = self.record(record, segment, here);
        }
        if end - begin + 1 < STENCIL_RECORDS || most <= highest.value {
            return;
        }
        for from in neighbours[0]..neighbours[1] {
            let curve = LimitedCubic::new(&self.times_s, stencil_records(from, begin, end).start, from, value);
            let Some(time_s) = curve.maximum_s() else { continue };
            let top = curve.value(time_s);
            if top > highest.value {
                *highest = HighestPoint { value: top, time_s, segment, stencil: curve.stencil(time_s) };
            }
        }
    }

    /// The first highest of the records.
    pub(crate) fn highest_record(&self, records: &[f64]) -> HighestPoint {
        let used = records.iter().copied().enumerate().take(self.times_s.len());
        let top = used.fold((0, f64::NEG_INFINITY), |top, each| if each.1 > top.1 { each } else { top });
        self.record(top.0, 0, top.1)
    }

    /// The first of the readings at the instants, `instants_s`, that is farthest from zero.
    pub(crate) fn farthest_reading(&self, records: &[f64], instants_s: &[f64]) -> HighestPoint {
        let mut farthest = self.record(0, 0, 0.0);
        for (stencil, &time_s) in self.stencils.iter().zip(instants_s) {
            let value = value_at(stencil, records);
            if value.abs() > farthest.value.abs() {
                farthest = HighestPoint { value, time_s, segment: 0, stencil: *stencil };
            }
        }
        farthest
    }

    fn record(&self, record: usize, segment: usize, value: f64) -> HighestPoint {
        let time_s = self.times_s[record];
        HighestPoint { value, time_s, segment, stencil: lagrange_weights(&self.times_s, record..record + 1, time_s) }
    }

    /// The time for which the curve through the records of one sensor is above a value, s; `starts` as for
    /// [`highest`](Self::highest).
    pub(crate) fn time_above_s(&self, records: &[f64], starts: Option<&[f64]>, limit: f64) -> f64 {
        let mut above_s = 0.0;
        for (segment, ends) in self.breaks.windows(2).enumerate() {
            let (begin, end) = (ends[0], ends[1]);
            let value = |record: usize| match starts {
                Some(starts) if record == begin => starts[segment],
                _ => records[record],
            };
            for from in begin..end {
                let [start, stop] = [from, from + 1].map(|record| value(record) - limit);
                let length_s = self.times_s[from + 1] - self.times_s[from];
                let reach = [(from.max(begin + 1) - 1, from), (from, from + 1), (from + 1, (from + 2).min(end))]
                    .map(|(one, other)| (value(one) - value(other)).abs());
                let reach = 2.0 * reach[0].max(reach[1]).max(reach[2]);
                if start.min(stop) > reach {
                    above_s += length_s;
                } else if start.max(stop) > -reach {
                    let first = stencil_records(from, begin, end).start;
                    above_s += if end - begin + 1 < STENCIL_RECORDS {
                        length_s * share_above(start, stop)
                    } else {
                        LimitedCubic::new(&self.times_s, first, from, value).time_above_s(limit)
                    };
                }
            }
        }
        above_s
    }
}

/// The value of a stencil.
pub(crate) fn value_at(taps: &Stencil, records: &[f64]) -> f64 {
    taps.iter().fold(0.0, |value, &(record, weight)| value + weight * records[record])
}

/// The records of the stencil between a record and the next, within a segment.
fn stencil_records(from: usize, begin: usize, end: usize) -> Range<usize> {
    let first = from.saturating_sub(1).max(begin);
    let last = (first + STENCIL_RECORDS - 1).min(end);
    (last + 1).saturating_sub(STENCIL_RECORDS).max(begin)..last + 1
}

/// The share of a line that is above zero.
pub(super) fn share_above(start: f64, end: f64) -> f64 {
    match (start > 0.0, end > 0.0) {
        (true, true) => 1.0,
        (false, false) => 0.0,
        (true, false) => start / (start - end),
        (false, true) => end / (end - start),
    }
}

/// Ratio of the second differences of a cubic above which it is limited. On smooth curves that the steps resolve they
/// differ by less.
const MAX_RATIO: f64 = 3.0;
/// Halvings that find where a curve crosses a value: to 1e-9 of a step.
const HALVINGS: usize = 30;

/// The curve between two records: the line between them, and its product of distances from both times a linear
/// function, which makes it the cubic through four records.
///
/// Just after a jump of a flux or a temperature a cubic overshoots: a face that is at 300 K, and then at 1,000 K at all
/// later records, would peak at 3,200 K between them. The second differences of the two triples of records are
/// therefore limited to [`MAX_RATIO`] times the smaller, and to zero where their signs differ, as slope limiters do
/// (van Leer, J. Comput. Phys. 32, 1979).
struct LimitedCubic {
    first: usize,
    from: usize,
    /// Times of the stencil, and of the two records, less the time of the first of the two, s.
    times_s: [f64; STENCIL_RECORDS],
    length_s: f64,
    origin_s: f64,
    ends: [f64; 2],
    /// Weights of both second differences in the linear factor at the first of the two records, and in its slope.
    weights: [[f64; 2]; 2],
    /// The linear factor of the cubic at the first of the two records, and its slope.
    linear_factor: [f64; 2],
}

impl LimitedCubic {
    /// Between record `from` and the next; `first` is the first of its four records.
    fn new(times_s: &[f64], first: usize, from: usize, value: impl Fn(usize) -> f64) -> Self {
        let origin_s = times_s[from];
        let times: [f64; STENCIL_RECORDS] = std::array::from_fn(|place| times_s[first + place] - origin_s);
        let values: [f64; STENCIL_RECORDS] = std::array::from_fn(|place| value(first + place));
        let slope = |place: usize| (values[place + 1] - values[place]) / (times[place + 1] - times[place]);
        let second = |place: usize| (slope(place + 1) - slope(place)) / (times[place + 2] - times[place]);
        let differences = [second(0), second(1)];
        let least = differences[0].abs().min(differences[1].abs());
        let limited = differences.map(|difference| {
            let is_bent = differences[0] * differences[1] > 0.0;
            if is_bent { (MAX_RATIO * least / difference.abs()).min(1.0) } else { 0.0 }
        });
        // The triple of records that the line belongs to, and its record that the line does not end on.
        let (triple, other) = match from - first {
            0 => (0, 2),
            1 => (0, 0),
            _ => (1, 1),
        };
        let third = [-1.0, 1.0].map(|sign| sign / (times[3] - times[0]));
        let at_start = [0, 1].map(|place| f64::from(u8::from(place == triple)) - times[other] * third[place]);
        let weights = [at_start, third].map(|of| [of[0] * limited[0], of[1] * limited[1]]);
        let linear_factor = weights.map(|of| of[0] * differences[0] + of[1] * differences[1]);
        Self {
            first,
            from,
            times_s: times,
            length_s: times_s[from + 1] - origin_s,
            origin_s,
            ends: [value(from), value(from + 1)],
            weights,
            linear_factor,
        }
    }

    fn rise(&self) -> f64 {
        self.ends[1] - self.ends[0]
    }

    /// The value at a time.
    fn value(&self, time_s: f64) -> f64 {
        self.value_after(time_s - self.origin_s)
    }

    fn value_after(&self, x: f64) -> f64 {
        let line = self.ends[0] + self.rise() * (x / self.length_s);
        line + x * (x - self.length_s) * (self.linear_factor[0] + self.linear_factor[1] * x)
    }

    /// Extrema between the two records: the maximum, then the minimum.
    fn extrema(&self) -> [Option<f64>; 2] {
        // The slope is a x² + b x + c.
        let (length, [start, tilt]) = (self.length_s, self.linear_factor);
        let (a, b, c) = (3.0 * tilt, 2.0 * (start - tilt * length), self.rise() / length - start * length);
        let discriminant = b * b - 4.0 * a * c;
        if discriminant < 0.0 {
            return [None; 2];
        }
        // At a maximum the slope falls: 2 a x + b = −√(b² − 4 a c); the form without cancellation.
        let root = |sign: f64| {
            let s = sign * discriminant.sqrt();
            let x = if b * s >= 0.0 { -2.0 * c / (b + s) } else { (s - b) / (2.0 * a) };
            (x > 0.0 && x < length).then_some(x)
        };
        [root(-1.0), root(1.0)]
    }

    /// The time of a maximum between the two records, s.
    fn maximum_s(&self) -> Option<f64> {
        self.extrema()[0].map(|x| self.origin_s + x)
    }

    /// The records and weights of the value at a time.
    fn stencil(&self, time_s: f64) -> Stencil {
        let x = time_s - self.origin_s;
        let mut taps: Stencil = std::array::from_fn(|place| (self.first + place, 0.0));
        let (place, share) = (self.from - self.first, x / self.length_s);
        taps[place].1 += 1.0 - share;
        taps[place + 1].1 += share;
        for (triple, [at_start, slope]) in [0, 1].map(|triple| (triple, self.weights.map(|of| of[triple]))) {
            let bent = x * (x - self.length_s) * (at_start + slope * x);
            let t = &self.times_s[triple..triple + 3];
            for one in 0..3 {
                let [other, another] = [t[(one + 1) % 3], t[(one + 2) % 3]];
                taps[triple + one].1 += bent / ((t[one] - other) * (t[one] - another));
            }
        }
        taps
    }

    /// The time between the two records for which the curve is above a value, s.
    fn time_above_s(&self, limit: f64) -> f64 {
        let mut ends = vec![0.0];
        let [maximum, minimum] = self.extrema();
        ends.extend(maximum.into_iter().chain(minimum));
        ends.push(self.length_s);
        ends.sort_by(f64::total_cmp);
        // Between extrema the curve is monotonic.
        let piece = |pair: &[f64]| {
            let [start, end] = [pair[0], pair[1]].map(|x| self.value_after(x) > limit);
            if start == end {
                return if start { pair[1] - pair[0] } else { 0.0 };
            }
            let (mut low, mut high) = (pair[0], pair[1]);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                if (self.value_after(middle) > limit) == start { low = middle } else { high = middle }
            }
            if start { low - pair[0] } else { pair[1] - high }
        };
        ends.windows(2).map(piece).sum()
    }
}

/// Lagrange weights of some records at an instant.
fn lagrange_weights(times_s: &[f64], records: Range<usize>, instant_s: f64) -> Stencil {
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
    fn the_first_records_are_those_of_a_parabola_within_the_first_segment_and_keep_their_sign() {
        let curve = RecordInterpolation::new(&[0.0, 1.0, 3.0, 4.0, 6.0, 7.0], &[6.0], &[]);
        let extrapolated = |of: fn(f64) -> f64| {
            let mut records = [9.0, 9.0, of(3.0), of(4.0), of(6.0), 50.0];
            curve.extrapolate_start(3.0, &mut records);
            records
        };
        let parabola = |t: f64| 2.0 - t + 3.0 * t * t;
        let found = extrapolated(parabola);
        let close = |one: f64, other: f64| (one - other).abs() < 1e-12;
        assert!(close(found[0], parabola(0.0)) && close(found[1], parabola(1.0)), "{found:?}");
        assert_eq!(extrapolated(|t| t - 2.0)[..2], [0.0, 0.0]);

        let mut records = [0.0, 9.0, 5.0, 5.0, 5.0, 5.0];
        RecordInterpolation::new(&[0.0, 1e-9, 2e-7, 1e-6, 4e-6, 2e4], &[], &[]).extrapolate_start(2e-7, &mut records);
        assert!(records.iter().all(|record| close(*record, 5.0)), "of steps below the tolerance of times: {records:?}");
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

    fn curve(times_s: &[f64], corners_s: &[f64]) -> RecordInterpolation {
        RecordInterpolation::new(times_s, corners_s, &[0.0])
    }

    fn records(times_s: &[f64], of: impl Fn(f64) -> f64) -> Vec<f64> {
        times_s.iter().map(|&time_s| of(time_s)).collect()
    }

    #[test]
    fn the_maximum_of_a_cubic_between_records_is_found_exactly() {
        let (times_s, top_s) = ([0.0, 0.5, 1.5, 2.0, 4.0, 7.0], 2.6);
        let cubic = |t: f64| 300.0 - (t - top_s).powi(2) * (1.0 - 0.05 * (t - top_s));
        let values = records(&times_s, cubic);
        let found = curve(&times_s, &[0.0]).highest(&values, None);
        assert!((found.value - 300.0).abs() < 1e-9 && (found.time_s - top_s).abs() < 1e-6, "{found:?}");
        // Negative control: no record is as high.
        assert!(values.iter().all(|&value| value < 300.0 - 0.3));
        // The stencil of the derivative is that of the value.
        assert!((value_at(&found.stencil, &values) - found.value).abs() < 1e-9);
        let slope_k_s = records(&times_s, |t| 7.0 + 0.1 * t);
        assert!((value_at(&found.stencil, &slope_k_s) - 7.26).abs() < 1e-9);
    }

    /// The cubic through a jump and three equal records is 2,000 K above them.
    #[test]
    fn the_curve_does_not_overshoot_after_a_jump() {
        let (times_s, values) = ([0.0, 1.0, 16.0, 81.0, 256.0], [300.0, 1000.0, 1000.0, 999.0, 990.0]);
        let found = curve(&times_s, &[0.0]).highest(&values, None);
        assert!((1000.0..1000.1).contains(&found.value) && found.time_s < 16.0, "{found:?}");
        let cubic = lagrange_weights(&times_s, 0..4, 8.0);
        assert!(value_at(&cubic, &values) > 3000.0);
    }

    #[test]
    fn a_peak_at_a_corner_is_its_record() {
        let times_s = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0];
        let values = records(&times_s, |t| if t < 2.0 { 300.0 + 10.0 * t } else { 320.0 - 2.0 * (t - 2.0) });
        let found = curve(&times_s, &[0.0, 2.0]).highest(&values, None);
        assert_eq!((found.value, found.time_s), (320.0, 2.0));
        // Just after the corner the curve may jump.
        let jumps = curve(&times_s, &[0.0, 2.0]).highest(&values, Some(&[300.0, 350.0]));
        assert_eq!((jumps.value, jumps.time_s, jumps.segment), (350.0, 2.0, 1));
    }

    #[test]
    fn of_equal_maxima_the_first_is_found_and_of_two_the_higher() {
        let times_s: Vec<f64> = (0..=80).map(|n| 0.25 * f64::from(n)).collect();
        // Maxima every 5 s, or 20 records, from 2.6 s on.
        let wave = |n: usize| (std::f64::consts::PI * (0.05 * (n % 20) as f64 - 0.02)).sin().powi(2);
        let waves =
            |second: f64| -> Vec<f64> { (0..=80).map(|n| if n < 40 { 1.0 } else { second } * wave(n)).collect() };
        let of = |values: &[f64]| curve(&times_s, &[0.0]).highest(values, None);
        assert!((of(&waves(0.999)).time_s - 2.6).abs() < 0.01);
        assert!((of(&waves(1.001)).time_s - 12.6).abs() < 0.01);
        assert_eq!(of(&[300.0; 81]).time_s, 0.0);
    }

    #[test]
    fn the_time_above_a_value_is_that_between_the_crossings() {
        let times_s = [0.0, 1.0, 2.5, 3.0, 5.0, 6.0, 8.0];
        let parabola = records(&times_s, |t| 310.0 - (t - 4.1).powi(2));
        let above_s = |limit: f64| curve(&times_s, &[0.0]).time_above_s(&parabola, None, limit);
        for drop_k in [0.2, 1.0, 5.0] {
            assert!((above_s(310.0 - drop_k) - 2.0 * f64::sqrt(drop_k)).abs() < 1e-6, "{drop_k} K");
        }
        assert_eq!((above_s(310.0), above_s(200.0)), (0.0, 8.0));
        // Lines between a few records, and negative control: the records alone are never above 309.8 K.
        let line =
            curve(&[0.0, 2.0, 5.0, 6.0], &[0.0, 2.0, 5.0]).time_above_s(&[300.0, 500.0, 500.0, 300.0], None, 400.0);
        assert!((line - 4.5).abs() < 1e-12 && parabola.iter().all(|&value| value < 309.8));
    }
}
