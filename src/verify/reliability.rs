//! Verification rows of reliability: limit states with a known probability of exceedance, without any heat transfer.

use super::{Group, VerificationRow};
use crate::fit::reliability::{ImportanceEstimate, ImportanceSampling, LimitState, find_design_points};
use statrs::distribution::{ContinuousCDF, Normal};
use std::convert::Infallible;

/// The plane `β − a·u` in ten standard normal variables, with a unit vector `a`: its probability is `Φ(−β)`.
struct Plane {
    distance: f64,
}

const VARIABLES: usize = 10;
const MEMBERS: usize = 20_000;
/// Standard errors of the estimate that pass: one in 16,000 seeds is further away.
const STANDARD_ERRORS: f64 = 4.0;

impl Plane {
    fn direction() -> Vec<f64> {
        let squares: f64 = (1..=VARIABLES).map(|n| (n * n) as f64).sum();
        (1..=VARIABLES).map(|n| n as f64 / squares.sqrt()).collect()
    }
}

impl LimitState for Plane {
    type Error = Infallible;

    fn variables(&self) -> usize {
        VARIABLES
    }

    fn values(&mut self, points: &[Vec<f64>]) -> Result<Vec<f64>, Infallible> {
        let direction = Self::direction();
        let along = |point: &Vec<f64>| point.iter().zip(&direction).map(|(u, a)| u * a).sum::<f64>();
        Ok(points.iter().map(|point| self.distance - along(point)).collect())
    }

    fn gradients(&mut self, points: &[Vec<f64>]) -> Result<Vec<(f64, Vec<f64>)>, Infallible> {
        let gradient: Vec<f64> = Self::direction().iter().map(|a| -a).collect();
        Ok(self.values(points)?.into_iter().map(|value| (value, gradient.clone())).collect())
    }
}

/// The design point and the probability of planes at three distances.
pub(super) fn reliability_rows() -> Vec<VerificationRow> {
    [2.0, 4.0, 6.0].into_iter().flat_map(rows).collect()
}

fn rows(distance: f64) -> [VerificationRow; 2] {
    let mut state = Plane { distance };
    let Ok(design) = find_design_points(&mut state);
    let index = design.points.first().map_or(f64::NAN, |point| point.reliability_index);
    let sampling = ImportanceSampling::new(design.points.into_iter().map(|point| point.scores).collect(), 1);
    let mut found = ImportanceEstimate::default();
    for index in 0..MEMBERS {
        let member = sampling.member(index);
        let Ok(values) = state.values(std::slice::from_ref(&member.scores));
        found.add(&member, values[0] < 0.0);
    }
    let probability = Normal::standard().cdf(-distance);
    // The part that the design point leaves out has a standard error of its own.
    let elsewhere = found.probability() - found.covered();
    let standard_error = found.covered_standard_error().hypot((elsewhere / found.plain as f64).sqrt());
    let row = |quantity: String, difference, tolerance, unit: &str, source: &str| VerificationRow {
        group: Group::Fit,
        case: format!("linear limit state, β = {distance}"),
        reference: "Melchers and Beck (2018), section 3.3".to_owned(),
        quantity,
        difference,
        tolerance,
        unit: unit.to_owned(),
        source_of_tolerance: source.to_owned(),
    };
    [
        row(
            "reliability index".to_owned(),
            (index - distance).abs(),
            1e-9,
            "standard deviations",
            "rounding; wide: a plane takes one step",
        ),
        row(
            format!("probability {probability:.2e} by importance sampling"),
            (found.probability() / probability - 1.0).abs(),
            STANDARD_ERRORS * standard_error / probability,
            "of the reference",
            "four standard errors of 20,000 members; wide: a random difference may be small",
        ),
    ]
}
