//! Members at corners of the bounds of the factors.

use super::member_errors_k;
use crate::case::{Bounds, Case, Factor};
use crate::ensemble::Ensemble;
use crate::march::monitor::Monitor;
use crate::march::{MarchError, Precision};
use crate::plan::{ErrorEstimate, Plan};

/// Fewest corners: two SIMD groups in f64.
const MIN_CORNERS: usize = 16;

/// Members at corners of bounds of the factors: all low, all high, and alternating patterns (Walsh functions and their
/// complements) over an order of the factors that is not that of the case. They are an orthogonal array of strength
/// three: among any three factors, each combination of low and high occurs equally often (Hedayat, Sloane & Stufken,
/// *Orthogonal Arrays*, 1999, theorem 7.3).
pub(super) fn corners(case: &Case, bounds: Bounds) -> Ensemble {
    let count = case.factors.len();
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by_key(|&factor| {
        let Factor { name, group, property, state, .. } = &case.factors[factor];
        (*property as usize, group, state, name)
    });
    let row = |corner: usize| {
        let mut values = vec![0.0; count];
        for (place, &factor) in order.iter().enumerate() {
            let is_high = (place & (corner / 2)).count_ones() as usize % 2 != corner % 2;
            let (low, high) = case.factors[factor].bounds(bounds);
            values[factor] = if is_high { high } else { low };
        }
        values
    };
    let members = (2 * count.next_power_of_two()).max(MIN_CORNERS);
    Ensemble::from_values(count, (0..members).flat_map(row).collect())
}

impl ErrorEstimate {
    /// The estimate of a march of a case on a plan in a precision, with its corners at the bounds between which a study
    /// samples.
    ///
    /// # Errors
    /// [`MarchError::Cancelled`] or [`MarchError::Stopped`] by the monitor.
    pub(crate) fn at_corners_of(
        self,
        bounds: Bounds,
        case: &Case,
        plan: &Plan,
        precision: Precision,
        monitor: &Monitor,
    ) -> Result<Self, MarchError> {
        if bounds == self.bounds || case.factors.is_empty() {
            return Ok(self);
        }
        let corners_k = member_errors_k(case, plan, precision, &corners(case, bounds), &monitor.without_progress())?;
        Ok(self.with_corners(bounds, &corners_k))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adapt::{adapt, refined_traces};

    /// Against four times the cells and steps; the claim is from twice as many.
    #[test]
    fn the_error_at_corners_of_the_large_bounds_is_that_of_members_there() {
        let case = Case::load("cases/lamp-test".as_ref()).expect("a shipped case");
        let plan = adapt(&case).expect("the processor does not fail");
        let (small, monitor) = (plan.error_estimate.clone().expect("an adapted plan"), Monitor::default());
        let large = small.clone().at_corners_of(Bounds::Large, &case, &plan, Precision::F64, &monitor);
        let large = large.expect("the processor does not fail");
        let true_k = |bounds| {
            let refined = refined_traces(&case, &plan, Precision::F64, &corners(&case, bounds), &monitor);
            refined.expect("the processor does not fail").temperature_error_k()
        };
        for estimate in [&small, &large] {
            let (claimed_k, true_k) = (estimate.corners_k.expect("corners complete"), true_k(estimate.bounds));
            assert!((0.8 * true_k..=1.4 * true_k).contains(&claimed_k), "{estimate:?}: {true_k} K");
        }
        assert_eq!((small.bounds, large.bounds), (Bounds::Small, Bounds::Large));
        assert!(large.corners_k > small.corners_k.map(|small_k| 1.5 * small_k), "{small:?}, {large:?}");
        assert_eq!((large.corners, large.failed_corners, large.nominal_k), (16, 0, small.nominal_k));
    }

    #[test]
    fn corners_do_not_depend_on_the_order_of_the_factors() {
        let case = Case::load("cases/lcat-2259".as_ref()).expect("a shipped case");
        let mut reversed = case.clone();
        reversed.factors.reverse();
        let (one, other) = (corners(&case, Bounds::Small), corners(&reversed, Bounds::Small));
        for corner in 0..one.len() {
            assert!(one.member(corner).into_iter().eq(other.member(corner).into_iter().rev()), "corner {corner}");
        }
    }

    #[test]
    fn among_any_three_factors_each_combination_of_low_and_high_occurs_at_equally_many_corners() {
        let case = Case::load("cases/lcat-2259".as_ref()).expect("a shipped case");
        for count in [1, 2, 3, 7, 8, 9, 16, 17, 40] {
            let mut case = case.clone();
            let factor = |index: usize| {
                let mut factor = case.factors[index % case.factors.len()].clone();
                factor.name = format!("f{index}");
                factor
            };
            case.factors = (0..count).map(factor).collect();
            let (found, low) = (corners(&case, Bounds::Small), |of: usize| case.factors[of].bounds(Bounds::Small).0);
            let is_high: Vec<Vec<bool>> = (0..found.len())
                .map(|corner| (0..count).map(|of| found.member(corner)[of] > low(of)).collect())
                .collect();
            let triples = (0..count).flat_map(|a| (0..a).flat_map(move |b| (0..b).map(move |c| [a, b, c])));
            for triple in triples.filter(|_| count >= 3) {
                let mut times = [0; 8];
                for corner in &is_high {
                    let [a, b, c] = triple.map(|of| usize::from(corner[of]));
                    times[4 * a + 2 * b + c] += 1;
                }
                assert_eq!(times, [found.len() / 8; 8], "{count} factors, {triple:?}");
            }
            for of in 0..count {
                assert_eq!(is_high.iter().filter(|corner| corner[of]).count(), found.len() / 2, "{count} factors");
            }
        }
    }
}
