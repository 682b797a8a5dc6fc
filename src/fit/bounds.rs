//! Bound constraints: a low and a high bound per variable, either of which may be infinite.

use nalgebra::DVector;

/// The nearest point between the bounds.
pub(super) fn clamped(point: &DVector<f64>, bounds: &[(f64, f64)]) -> DVector<f64> {
    DVector::from_iterator(point.len(), point.iter().zip(bounds).map(|(value, &(low, high))| value.max(low).min(high)))
}

/// Whether a bound is active: the variable lies on it and the objective decreases outwards. `slope` has the sign of the
/// derivative of the objective by the variable.
pub(super) fn is_active(value: f64, slope: f64, (low, high): (f64, f64)) -> bool {
    (value <= low && slope > 0.0) || (value >= high && slope < 0.0)
}

/// The first bound crossed on the line from a point to a target: the variable, its bound, and the fraction of the line
/// up to it. `None` where the target lies between all bounds.
pub(super) fn first_crossed(
    point: &DVector<f64>,
    target: &DVector<f64>,
    bounds: &[(f64, f64)],
) -> Option<(usize, f64, f64)> {
    let crossed = (0..point.len()).filter_map(|j| {
        let (low, high) = bounds[j];
        let bound = if target[j] < low {
            low
        } else if target[j] > high {
            high
        } else {
            return None;
        };
        Some((j, bound, (bound - point[j]) / (target[j] - point[j])))
    });
    crossed.min_by(|a, b| a.2.total_cmp(&b.2))
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: [(f64, f64); 3] = [(0.0, 1.0), (0.0, 1.0), (f64::NEG_INFINITY, f64::INFINITY)];

    #[test]
    fn the_first_bound_crossed_limits_the_step() {
        let point = DVector::from_vec(vec![0.5, 0.5, 0.0]);
        assert_eq!(first_crossed(&point, &DVector::from_vec(vec![2.5, -0.6, 9.0]), &BOUNDS), Some((0, 1.0, 0.25)));
        let met = first_crossed(&point, &DVector::from_vec(vec![1.1, -0.6, 9.0]), &BOUNDS);
        assert!(matches!(met, Some((1, 0.0, share)) if (share - 0.5 / 1.1).abs() < 1e-15));
        assert_eq!(first_crossed(&point, &DVector::from_vec(vec![0.0, 1.0, 9.0]), &BOUNDS), None);
    }

    #[test]
    fn a_bound_is_active_only_where_the_objective_decreases_outwards() {
        assert!(is_active(0.0, 1.0, BOUNDS[0]) && !is_active(0.0, -1.0, BOUNDS[0]));
        assert!(is_active(1.0, -1.0, BOUNDS[0]) && !is_active(1.0, 1.0, BOUNDS[0]));
        assert!(!is_active(0.5, 1.0, BOUNDS[0]));
    }
}
