//! Knots of the unknown heating, and the roughness operator of the regularisation.

use crate::case::Schedule;
use nalgebra::DMatrix;

/// A segment of a schedule is a jump where it changes by at least this fraction of the largest value in less than the
/// knot spacing, as at injection or retraction. Smoothing across it would smear it.
const JUMP_FRACTION: f64 = 0.1;

/// Knot times, and which segments between them are jumps.
#[derive(Clone, Debug)]
pub(super) struct Knots {
    pub times_s: Vec<f64>,
    /// Value of the case's own schedule at each knot.
    pub case_values: Vec<f64>,
    /// One entry per segment between neighbouring knots.
    is_jump: Vec<bool>,
    /// The time over which the knots are spread, s.
    pub heated_duration_s: f64,
}

/// The second difference at a knot between two segments that are not jumps; the lengths of the segments `before` and
/// `after` the knot are relative to H.
struct SecondDifference {
    knot: usize,
    before: f64,
    after: f64,
    /// Factor on the change of slope, such that the sum of squares is the roughness.
    weight: f64,
}

impl Knots {
    /// Every corner of a schedule up to `end_s`, and `more` knots spread evenly over the time in which the schedule
    /// differs from `rest`, its value without heating. The corners remain variables, so data can still show heating
    /// elsewhere. A schedule that is always or never at rest, such as a gas temperature, gets knots over its whole
    /// duration.
    pub(super) fn new(schedule: &Schedule, rest: Option<f64>, end_s: f64, more: usize) -> Self {
        let corners = schedule.times_s.iter().zip(&schedule.values).map(|(&time_s, &value)| (time_s, value));
        let mut kept: Vec<(f64, f64)> = corners.filter(|(time_s, _)| (0.0..end_s).contains(time_s)).collect();
        if kept.first().is_none_or(|first| first.0 > 0.0) {
            kept.insert(0, (0.0, schedule.after(0.0)));
        }
        kept.push((end_s, schedule.before(end_s)));
        let rests = |value: f64| Some(value) == rest;
        let never_heats = kept.iter().all(|(_, value)| rests(*value));
        let heats = |leg: &[(f64, f64)]| never_heats || !rests(leg[0].1) || !rests(leg[1].1);
        let spread_s: f64 = kept.windows(2).filter(|leg| heats(leg)).map(|leg| leg[1].0 - leg[0].0).sum();
        let least = kept.iter().map(|(_, value)| *value).fold(f64::INFINITY, f64::min);
        let level = rest.unwrap_or(least);
        let largest = kept.iter().map(|(_, value)| (value - level).abs()).fold(0.0, f64::max);
        let spacing_s = spread_s / (more + 1) as f64;

        let (mut points, mut is_sharp) = (vec![kept[0]], Vec::new());
        for leg in kept.windows(2) {
            let [(from_s, from), (to_s, to)] = [leg[0], leg[1]];
            let length_s = to_s - from_s;
            let within = if heats(leg) { (length_s / spread_s * more as f64).round() as usize } else { 0 };
            for place in 1..=within {
                let share = place as f64 / (within + 1) as f64;
                points.push((from_s + share * length_s, from + share * (to - from)));
            }
            points.push(leg[1]);
            let sharp =
                length_s <= 0.0 || (length_s < spacing_s && to != from && (to - from).abs() >= JUMP_FRACTION * largest);
            is_sharp.extend(std::iter::repeat_n(sharp, within + 1));
        }
        let (times_s, own) = points.into_iter().unzip();
        Self { times_s, case_values: own, is_jump: is_sharp, heated_duration_s: spread_s }
    }

    /// Second derivatives at the knots between two segments that are not jumps, one row each. Their sum of squares is
    /// `H³ ∫ q″² dt` with H the time over which knots are spread: zero for straight lines and independent of the number
    /// of knots.
    pub(super) fn roughness(&self) -> DMatrix<f64> {
        let second_differences = self.second_differences();
        let mut rows = DMatrix::zeros(second_differences.len(), self.times_s.len());
        for (row, SecondDifference { knot, before, after, weight }) in second_differences.into_iter().enumerate() {
            rows[(row, knot - 1)] = weight / before;
            rows[(row, knot)] = -weight * (1.0 / before + 1.0 / after);
            rows[(row, knot + 1)] = weight / after;
        }
        rows
    }

    /// Roughness of the independent increments of a random walk that has the variance one after H, one column per
    /// segment.
    pub(super) fn walk_roughness(&self) -> DMatrix<f64> {
        let second_differences = self.second_differences();
        let mut rows = DMatrix::zeros(second_differences.len(), self.is_jump.len());
        for (row, SecondDifference { knot, before, after, weight }) in second_differences.into_iter().enumerate() {
            rows[(row, knot - 1)] = -weight / before.sqrt();
            rows[(row, knot)] = weight / after.sqrt();
        }
        rows
    }

    /// The second differences at the knots between two segments that are not jumps.
    fn second_differences(&self) -> Vec<SecondDifference> {
        let inner = 1..self.times_s.len().saturating_sub(1);
        let smooth = inner.filter(|&knot| !self.is_jump[knot - 1] && !self.is_jump[knot]);
        let length = |from: usize| (self.times_s[from + 1] - self.times_s[from]) / self.heated_duration_s;
        let at_knot = |knot: usize| {
            let (before, after) = (length(knot - 1), length(knot));
            SecondDifference { knot, before, after, weight: 2.0 / (before + after) * ((before + after) / 2.0).sqrt() }
        };
        smooth.map(at_knot).collect()
    }

    /// Weights of the trapezoidal rule, s.
    pub(super) fn trapezoidal_weights_s(&self) -> Vec<f64> {
        let half = |from: usize| self.times_s.get(from + 1).map_or(0.0, |next| (next - self.times_s[from]) / 2.0);
        (0..self.times_s.len()).map(|knot| half(knot) + if knot > 0 { half(knot - 1) } else { 0.0 }).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn retracted() -> Schedule {
        Schedule { times_s: vec![0.0, 0.5, 41.0, 41.2], values: vec![0.0, 26.7, 26.7, 0.0] }
    }

    #[test]
    fn corners_are_kept_and_knots_are_spread_over_the_heated_time() {
        let knots = Knots::new(&retracted(), Some(0.0), 80.0, 8);
        let even = [0.0, 0.5, 5.0, 9.5, 14.0, 18.5, 23.0, 27.5, 32.0, 36.5, 41.0, 41.2, 80.0];
        assert_eq!(knots.times_s.len(), even.len());
        assert!(knots.times_s.iter().zip(even).all(|(time_s, even)| (time_s - even).abs() < 1e-9), "{knots:?}");
        let own = |time_s: f64| retracted().before(time_s);
        assert!(
            knots.times_s.iter().zip(&knots.case_values).all(|(&time_s, value)| (value - own(time_s)).abs() < 1e-9)
        );
        let nothing = Knots::new(&Schedule::constant(0.0), Some(0.0), 10.0, 4);
        assert_eq!(nothing.times_s, [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
    }

    #[test]
    fn knots_of_a_gas_temperature_cover_its_duration_and_its_jump_stays_a_jump() {
        let gas = Schedule { times_s: vec![0.0, 10.0, 10.1, 50.0], values: vec![1500.0, 1500.0, 1400.0, 1400.0] };
        let knots = Knots::new(&gas, None, 50.0, 4);
        let even = [0.0, 5.0, 10.0, 10.1, 20.075, 30.05, 40.025, 50.0];
        assert_eq!(knots.times_s.len(), even.len(), "{knots:?}");
        assert!(knots.times_s.iter().zip(even).all(|(time_s, even)| (time_s - even).abs() < 1e-9), "{knots:?}");
        assert_eq!(knots.is_jump, [false, false, true, false, false, false, false]);
    }

    #[test]
    fn the_roughness_of_a_parabola_is_its_curvature_and_that_of_a_jump_is_zero() {
        let knots = Knots::new(&Schedule::constant(1.0), Some(0.0), 10.0, 399);
        let parabola = nalgebra::DVector::from_iterator(401, knots.times_s.iter().map(|t| t * t));
        // H³ ∫ 2² dt over ten seconds, minus the half segments at the two ends, which have no second derivative.
        assert!(((knots.roughness() * parabola).norm_squared() / 4e4 - 1.0).abs() < 0.01);
        let knots = Knots::new(&retracted(), Some(0.0), 80.0, 8);
        assert_eq!(knots.roughness().nrows(), 8, "only between injection and retraction");
        let own = nalgebra::DVector::from_vec(knots.case_values.clone());
        assert!((knots.roughness() * own).norm() < 1e-9);
    }

    #[test]
    fn the_roughness_of_a_walk_is_that_of_the_sum_of_its_increments() {
        let knots = Knots::new(&retracted(), Some(0.0), 80.0, 6);
        let segments = knots.times_s.len() - 1;
        let increments = nalgebra::DVector::from_fn(segments, |segment, _| f64::from((segment as u32 * 7) % 5) - 2.0);
        let mut walk = nalgebra::DVector::zeros(segments + 1);
        for segment in 0..segments {
            let length = (knots.times_s[segment + 1] - knots.times_s[segment]) / knots.heated_duration_s;
            walk[segment + 1] = walk[segment] + increments[segment] * length.sqrt();
        }
        let off = knots.roughness() * walk - knots.walk_roughness() * increments;
        assert!(off.norm() < 1e-9 * knots.roughness().norm(), "{off}");
    }

    #[test]
    fn spans_integrate_straight_lines_exactly() {
        let knots = Knots::new(&retracted(), Some(0.0), 80.0, 5);
        let integral: f64 =
            knots.trapezoidal_weights_s().iter().zip(&knots.case_values).map(|(span_s, own)| span_s * own).sum();
        assert!((integral - 26.7 * (40.5 + 0.25 + 0.1)).abs() < 1e-9, "{integral}");
    }
}
