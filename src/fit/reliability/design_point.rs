//! The design point of a limit state, by the improved Hasofer–Lind–Rackwitz–Fiessler iteration (Zhang & Der
//! Kiureghian, in: Reliability and Optimization of Structural Systems, 1995): Newton steps on the linearised limit
//! state, shortened until a merit function falls.

use super::LimitState;
use statrs::distribution::{ContinuousCDF, Normal};

/// The point of a limit state that is nearest to the origin.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct DesignPoint {
    /// Coordinates: standard normal variables.
    pub scores: Vec<f64>,
    /// Unit vector from the origin towards higher probability of exceedance; its squares are the importance of the
    /// variables and sum to one.
    pub direction: Vec<f64>,
    /// Distance from the origin, β; negative where the origin exceeds the limit.
    pub reliability_index: f64,
    /// Whether the iteration converged.
    pub converged: bool,
    /// Points at which the limit state was evaluated; one with its derivatives counts once.
    pub evaluations: usize,
}

impl DesignPoint {
    /// Probability of exceedance if the limit state were a plane, `Φ(−β)` (FORM).
    pub fn first_order_probability(&self) -> f64 {
        Normal::standard().cdf(-self.reliability_index)
    }
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

/// Find the design point, from the origin.
///
/// # Errors
/// When an evaluation fails as a whole. No convergence is a result.
pub fn find_design_point<L: LimitState>(state: &mut L) -> Result<DesignPoint, L::Error> {
    let mut point = vec![0.0; state.variables()];
    let (mut value, mut gradient) = state.gradient(&point)?;
    let (scale, sign) = (value.abs(), if value < 0.0 { -1.0 } else { 1.0 });
    let (mut evaluations, mut converged) = (1, false);
    for _ in 0..MAX_ITERATIONS {
        let slope = length(&gradient);
        if !(slope.is_finite() && slope > 0.0 && value.is_finite()) {
            break;
        }
        let along = (dot(&gradient, &point) - value) / (slope * slope);
        let mut target: Vec<f64> = gradient.iter().map(|by| along * by).collect();
        let distance = length(&target);
        if distance > MAX_DISTANCE {
            target.iter_mut().for_each(|score| *score *= MAX_DISTANCE / distance);
        }
        let step: Vec<f64> = target.iter().zip(&point).map(|(to, from)| to - from).collect();
        if length(&step) < STEP_TOLERANCE && value.abs() <= VALUE_TOLERANCE * scale {
            converged = true;
            break;
        }
        let trials: Vec<Vec<f64>> = FRACTIONS.iter().map(|share| moved(&point, &step, *share)).collect();
        let values = state.values(&trials)?;
        evaluations += trials.len();
        // The weight of |g| must exceed |u|/|∇g| for the step to descend.
        let weight = 2.0 * length(&point).max(length(&target)) / slope;
        let merit = |point: &[f64], value: f64| 0.5 * dot(point, point) + weight * value.abs();
        let now = merit(&point, value);
        let better = trials.iter().zip(&values).position(|(trial, &value)| merit(trial, value) < now);
        let Some(better) = better else { break };
        point.clone_from(&trials[better]);
        (value, gradient) = state.gradient(&point)?;
        evaluations += 1;
    }
    let slope = length(&gradient);
    let direction = gradient.iter().map(|by| if slope > 0.0 { -by / slope } else { 0.0 }).collect();
    Ok(DesignPoint { reliability_index: sign * length(&point), scores: point, direction, converged, evaluations })
}

fn moved(point: &[f64], step: &[f64], share: f64) -> Vec<f64> {
    point.iter().zip(step).map(|(from, by)| from + share * by).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn length(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::test_states::{Curved, Plane};
    use super::*;

    #[test]
    fn the_design_point_of_a_plane_is_the_foot_of_the_perpendicular() {
        let found = find_design_point(&mut Plane::at(3.5)).expect("it cannot fail");
        assert!(found.converged && (found.reliability_index - 3.5).abs() < 1e-9, "{found:?}");
        assert!((found.first_order_probability() - 2.326e-4).abs() < 1e-7);
        let importance: f64 = found.direction.iter().map(|by| by * by).sum();
        assert!((importance - 1.0).abs() < 1e-12);
        // Negative control: an origin beyond the limit.
        let inside = find_design_point(&mut Plane::at(-1.0)).expect("it cannot fail");
        assert!(inside.reliability_index < 0.0 && inside.first_order_probability() > 0.5);
    }

    /// g = 3 + u₁²/4 − u₂: the nearest point is (0, 3).
    #[test]
    fn the_design_point_of_a_curved_limit_state_is_its_nearest_point() {
        let found = find_design_point(&mut Curved).expect("it cannot fail");
        assert!(found.converged, "{found:?}");
        assert!(found.scores[0].abs() < 0.02 && (found.scores[1] - 3.0).abs() < 0.02, "{found:?}");
    }

    #[test]
    fn a_limit_state_that_no_variable_changes_has_no_design_point() {
        let found = find_design_point(&mut Plane { normal: vec![0.0; 3], distance: 2.0 }).expect("it cannot fail");
        assert!(!found.converged, "{found:?}");
    }
}
