//! Design points of a limit state, by the improved Hasofer–Lind–Rackwitz–Fiessler iteration (Zhang & Der Kiureghian,
//! in: Reliability and Optimization of Structural Systems, 1995): Newton steps on the linearised limit state, shortened
//! until a merit function falls.
//!
//! A limit can be reached by several combinations that have nothing in common, such as heat from either face. The
//! search is therefore repeated from points away from those found (after the idea of Der Kiureghian & Dakessian,
//! Struct. Saf. 20, 1998): of the axes and of random directions, those with the lowest values of the limit state. All
//! searches advance side by side, so that a device has many points at once.

use super::LimitState;
use crate::random::RandomStream;
use statrs::distribution::{ContinuousCDF, Normal};

/// A point of a limit state at which its distance from the origin has a minimum.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct DesignPoint {
    /// Coordinates: standard normal variables.
    pub scores: Vec<f64>,
    /// Unit vector from the origin towards higher probability of exceedance; its squares are the importance of the
    /// variables and sum to one.
    pub direction: Vec<f64>,
    /// Distance from the origin, β; negative where the origin exceeds the limit.
    pub reliability_index: f64,
}

impl DesignPoint {
    /// Probability of exceedance if the limit state were a plane, `Φ(−β)` (FORM).
    pub fn first_order_probability(&self) -> f64 {
        Normal::standard().cdf(-self.reliability_index)
    }
}

/// The design points of a limit state.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct DesignPoints {
    /// The nearest first; empty where no search converged.
    pub points: Vec<DesignPoint>,
    /// Points at which the limit state was evaluated; one with its derivatives counts once.
    pub evaluations: usize,
}

const MAX_ITERATIONS: usize = 40;
/// Steps shorter than this, in standard deviations, end the iteration. Samples about the point do not need more.
const STEP_TOLERANCE: f64 = 0.01;
/// Value of the limit state, relative to that at the origin, that counts as zero.
const VALUE_TOLERANCE: f64 = 0.01;
/// Fractions of a step that are tried at once.
const FRACTIONS: [f64; 6] = [1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125];
/// Farthest point: the probability beyond it is 6e-16.
const MAX_DISTANCE: f64 = 8.0;
/// Searches after the first one, from as many starts.
const FURTHER_SEARCHES: usize = 8;
/// Random directions among which starts are chosen.
const RANDOM_DIRECTIONS: usize = 256;
/// Starts are this much further from the origin than the first design point, in standard deviations.
const BEYOND_FIRST: f64 = 0.5;
/// Distance of the starts where the first search did not converge.
const DEFAULT_DISTANCE: f64 = 3.0;
/// Cosine of the angle at the origin above which two directions are one: 45° for starts, 18° for design points.
const SAME_START: f64 = 0.707;
const SAME_POINT: f64 = 0.95;
/// Design points further from the origin than the nearest by more than this are left to the plainly drawn members:
/// their probability is below a twentieth of its.
const MAX_FURTHER: f64 = 1.0;

/// Find the design points.
///
/// # Errors
/// When an evaluation fails as a whole. No convergence is a result.
pub fn find_design_points<L: LimitState>(state: &mut L) -> Result<DesignPoints, L::Error> {
    let origin = vec![0.0; state.variables()];
    let start = state.gradients(std::slice::from_ref(&origin))?;
    let mut evaluations = 1;
    let value = start.first().map_or(f64::NAN, |(value, _)| *value);
    let (scale, sign) = (value.abs(), if value < 0.0 { -1.0 } else { 1.0 });
    let mut found = search(state, vec![origin], start, scale, &mut evaluations)?;
    if sign > 0.0 {
        let starts = further_starts(state, found.first(), &mut evaluations)?;
        let values = state.gradients(&starts)?;
        evaluations += starts.len();
        found.extend(search(state, starts, values, scale, &mut evaluations)?);
    }
    found.iter_mut().for_each(|point| point.reliability_index *= sign);
    found.sort_by(|one, other| one.reliability_index.total_cmp(&other.reliability_index));
    let mut points: Vec<DesignPoint> = Vec::new();
    for point in found {
        let is_near =
            points.first().is_none_or(|first| point.reliability_index <= first.reliability_index + MAX_FURTHER);
        if is_near && points.iter().all(|other| cosine(&point.scores, &other.scores) < SAME_POINT) {
            points.push(point);
        }
    }
    Ok(DesignPoints { points, evaluations })
}

/// Starts away from the first design point and from each other, with the lowest values of the limit state.
fn further_starts<L: LimitState>(
    state: &mut L,
    first: Option<&DesignPoint>,
    evaluations: &mut usize,
) -> Result<Vec<Vec<f64>>, L::Error> {
    let (variables, mut numbers) = (state.variables(), RandomStream::new(0, 0));
    let distance = first.map_or(DEFAULT_DISTANCE, |first| first.reliability_index + BEYOND_FIRST).min(MAX_DISTANCE);
    let axes = (0..2 * variables).map(|place| {
        let mut axis = vec![0.0; variables];
        axis[place / 2] = if place % 2 == 0 { 1.0 } else { -1.0 };
        axis
    });
    let random = (0..RANDOM_DIRECTIONS).map(|_| (0..variables).map(|_| numbers.normal()).collect());
    let candidates: Vec<Vec<f64>> = axes.chain(random).map(|along: Vec<f64>| at_distance(along, distance)).collect();
    let values = state.values(&candidates)?;
    *evaluations += candidates.len();
    let mut order: Vec<usize> = (0..candidates.len()).collect();
    order.sort_by(|&one, &other| values[one].total_cmp(&values[other]));
    let mut starts: Vec<Vec<f64>> = Vec::new();
    for candidate in order.into_iter().map(|place| &candidates[place]) {
        let taken = starts.iter().chain(first.map(|first| &first.scores));
        if taken.into_iter().all(|other| cosine(candidate, other) < SAME_START) {
            starts.push(candidate.clone());
        }
        if starts.len() == FURTHER_SEARCHES {
            break;
        }
    }
    Ok(starts)
}

/// A search that is under way.
struct Search {
    point: Vec<f64>,
    value: f64,
    gradient: Vec<f64>,
    state: Progress,
}

#[derive(Clone, Copy, PartialEq)]
enum Progress {
    Moving,
    Converged,
    Failed,
}

impl Search {
    /// The step to the point of the linearised limit state nearest to the origin; `None` if the search ends here.
    fn step(&mut self, scale: f64) -> Option<Vec<f64>> {
        let slope = length(&self.gradient);
        if !(slope.is_finite() && slope > 0.0 && self.value.is_finite()) {
            self.state = Progress::Failed;
            return None;
        }
        let along = (dot(&self.gradient, &self.point) - self.value) / (slope * slope);
        let mut target: Vec<f64> = self.gradient.iter().map(|by| along * by).collect();
        if length(&target) > MAX_DISTANCE {
            target = at_distance(target, MAX_DISTANCE);
        }
        let step: Vec<f64> = target.iter().zip(&self.point).map(|(to, from)| to - from).collect();
        if length(&step) < STEP_TOLERANCE && self.value.abs() <= VALUE_TOLERANCE * scale {
            self.state = Progress::Converged;
            return None;
        }
        Some(step)
    }

    /// The first of the trial points that improves on this one, by the merit of Zhang and Der Kiureghian.
    fn better(&self, step: &[f64], trials: &[Vec<f64>], values: &[f64]) -> Option<usize> {
        // The weight of |g| must exceed |u|/|∇g| for the step to descend.
        let target = length(&moved(&self.point, step, 1.0));
        let weight = 2.0 * length(&self.point).max(target) / length(&self.gradient);
        let merit = |point: &[f64], value: f64| 0.5 * dot(point, point) + weight * value.abs();
        let now = merit(&self.point, self.value);
        trials.iter().zip(values).position(|(trial, &value)| merit(trial, value) < now)
    }
}

/// The searches from some starts, at which the limit state is known, that converge; distances are not signed.
fn search<L: LimitState>(
    state: &mut L,
    starts: Vec<Vec<f64>>,
    values: Vec<(f64, Vec<f64>)>,
    scale: f64,
    evaluations: &mut usize,
) -> Result<Vec<DesignPoint>, L::Error> {
    let begin = |(point, (value, gradient))| Search { point, value, gradient, state: Progress::Moving };
    let mut searches: Vec<Search> = starts.into_iter().zip(values).map(begin).collect();
    for _ in 0..MAX_ITERATIONS {
        let moving = searches.iter_mut().enumerate().filter(|(_, search)| search.state == Progress::Moving);
        let steps: Vec<(usize, Vec<f64>)> =
            moving.filter_map(|(place, search)| Some((place, search.step(scale)?))).collect();
        if steps.is_empty() {
            break;
        }
        let trial =
            |(place, step): &(usize, Vec<f64>)| FRACTIONS.map(|share| moved(&searches[*place].point, step, share));
        let trials: Vec<Vec<f64>> = steps.iter().flat_map(trial).collect();
        let values = state.values(&trials)?;
        let mut advanced: Vec<usize> = Vec::new();
        let each = trials.chunks(FRACTIONS.len()).zip(values.chunks(FRACTIONS.len()));
        for ((place, step), (trials, values)) in steps.iter().zip(each) {
            let search = &mut searches[*place];
            match search.better(step, trials, values) {
                None => search.state = Progress::Failed,
                Some(better) => {
                    search.point.clone_from(&trials[better]);
                    advanced.push(*place);
                }
            }
        }
        let points: Vec<Vec<f64>> = advanced.iter().map(|&place| searches[place].point.clone()).collect();
        let found = state.gradients(&points)?;
        *evaluations += trials.len() + points.len();
        for (place, (value, gradient)) in advanced.into_iter().zip(found) {
            (searches[place].value, searches[place].gradient) = (value, gradient);
        }
    }
    let converged = searches.into_iter().filter(|search| search.state == Progress::Converged);
    let design_point = |Search { point, gradient, .. }: Search| {
        let slope = length(&gradient);
        let direction = gradient.iter().map(|by| -by / slope).collect();
        DesignPoint { reliability_index: length(&point), scores: point, direction }
    };
    Ok(converged.map(design_point).collect())
}

fn moved(point: &[f64], step: &[f64], share: f64) -> Vec<f64> {
    point.iter().zip(step).map(|(from, by)| from + share * by).collect()
}

fn at_distance(mut along: Vec<f64>, distance: f64) -> Vec<f64> {
    let scale = distance / length(&along);
    along.iter_mut().for_each(|score| *score *= scale);
    along
}

fn cosine(a: &[f64], b: &[f64]) -> f64 {
    dot(a, b) / (length(a) * length(b)).max(f64::MIN_POSITIVE)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn length(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::test_states::{Curved, Planes};
    use super::*;

    fn found<L: LimitState<Error = std::convert::Infallible>>(mut state: L) -> Vec<DesignPoint> {
        let Ok(found) = find_design_points(&mut state);
        found.points
    }

    #[test]
    fn the_design_point_of_a_plane_is_the_foot_of_the_perpendicular() {
        let [point] = &found(Planes::one(3.5))[..] else { panic!("a plane has one design point") };
        assert!((point.reliability_index - 3.5).abs() < 1e-9, "{point:?}");
        assert!((point.first_order_probability() - 2.326e-4).abs() < 1e-7);
        let importance: f64 = point.direction.iter().map(|by| by * by).sum();
        assert!((importance - 1.0).abs() < 1e-12);
        // Negative control: an origin beyond the limit.
        let inside = &found(Planes::one(-1.0))[0];
        assert!(inside.reliability_index < 0.0 && inside.first_order_probability() > 0.5);
    }

    /// g = 3 + u₁²/4 − u₂: the nearest point is (0, 3).
    #[test]
    fn the_design_point_of_a_curved_limit_state_is_its_nearest_point() {
        let [point] = &found(Curved)[..] else { panic!("one design point") };
        assert!(point.scores[0].abs() < 0.02 && (point.scores[1] - 3.0).abs() < 0.02, "{point:?}");
    }

    #[test]
    fn each_of_several_planes_has_its_design_point_and_one_that_is_far_away_has_none() {
        for distances in [vec![2.5, 2.5], vec![3.0, 3.4, 2.9], vec![4.0, 3.2, 3.6]] {
            let mut expected = distances.clone();
            expected.sort_by(f64::total_cmp);
            let indices: Vec<f64> =
                found(Planes::some(&distances)).iter().map(|point| point.reliability_index).collect();
            assert_eq!(indices.len(), expected.len(), "{distances:?}: {indices:?}");
            assert!(indices.iter().zip(&expected).all(|(one, other)| (one - other).abs() < 1e-6), "{indices:?}");
        }
        assert_eq!(found(Planes::some(&[2.5, 4.0])).len(), 1);
    }

    #[test]
    fn a_limit_state_that_no_variable_changes_has_no_design_point() {
        assert_eq!(found(Planes { normals: vec![vec![0.0; 3]], distances: vec![2.0] }), []);
    }
}
