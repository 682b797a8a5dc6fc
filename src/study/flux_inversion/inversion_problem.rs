//! The least-squares problem of the flux inversion: residuals of the data over their standard deviations, followed by
//! the weighted roughness.
//!
//! Schedules belong to a plan and factors to a member, so every point is a plan of its own that differs in its boundary
//! forcing alone. All plans share cells, steps and tables, so finite differences contain no adaptation noise. The
//! alternative, one ensemble column per knot, would add two column look-ups to each stage of each step of every march,
//! on CPU and GPU, for this study alone.

use super::HeatingQuantity;
use crate::case::{Exposure, Schedule};
use crate::ensemble::Ensemble;
use crate::fit::{LeastSquares, Tangent};
use crate::march::{March, MarchError, Precision};
use crate::plan::Plan;
use crate::study::thermocouple_residuals::Sample;
use crate::traces::{MemberStatus, Traces};
use nalgebra::{DMatrix, DVector};

pub(super) struct InversionProblem<'a> {
    pub march: &'a mut dyn March,
    pub quantity: HeatingQuantity,
    /// Plan of a case whose schedule has its corners on the knots.
    pub plan: &'a Plan,
    pub exposure: &'a Exposure,
    pub nominal: &'a Ensemble,
    pub times_s: &'a [f64],
    /// Value of a variable of one, W/m² or K.
    pub scale: f64,
    /// Finite-difference step, in units of the variables.
    pub difference_step: f64,
    pub samples: &'a [Sample],
    pub roughness: &'a DMatrix<f64>,
    /// Weight of the roughness, in standard deviations of a sample.
    pub weight: f64,
    pub bounds: Vec<(f64, f64)>,
    /// Schedules marched so far.
    pub marches: usize,
}

/// Smallest finite-difference step of a flux that blowing nearly cancels, as a fraction of the scale: from zero up to
/// this fraction the effect grows by powers of ten, so the derivative at zero does not predict it.
const MIN_STEP_WITH_BLOWING: f64 = 1e-2;

/// Largest difference of temperatures that rounding can explain, K.
fn rounding_k(precision: Precision) -> f64 {
    match precision {
        Precision::F64 => 1e-8,
        Precision::F32 => 1e-3,
    }
}

impl InversionProblem<'_> {
    /// March schedules, one per column.
    pub(super) fn traces(&mut self, points: &DMatrix<f64>) -> Result<Vec<Traces>, MarchError> {
        let driven = |point: nalgebra::DVectorView<'_, f64>| {
            let values = point.iter().map(|value| value * self.scale).collect();
            let schedule = Schedule { times_s: self.times_s.to_vec(), values };
            self.plan.with_exposure(&self.quantity.with_schedule(self.exposure, schedule))
        };
        let plans: Vec<Plan> = points.column_iter().map(driven).collect();
        self.marches += plans.len();
        self.march.march_plans(&plans.iter().collect::<Vec<_>>(), self.nominal, 0..1)
    }
}

impl LeastSquares for InversionProblem<'_> {
    type Error = MarchError;

    fn bounds(&self) -> &[(f64, f64)] {
        &self.bounds
    }

    fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, MarchError> {
        let traces = self.traces(points)?;
        let rough = self.roughness * points * self.weight;
        let samples = self.samples.len();
        Ok(DMatrix::from_fn(samples + rough.nrows(), points.ncols(), |i, column| {
            let Some(sample) = self.samples.get(i) else { return rough[(i - samples, column)] };
            if traces[column].statuses[0] != MemberStatus::Completed {
                return f64::NAN;
            }
            (traces[column].trace(0, sample.sensor)[sample.instant] - sample.measured_k) / sample.sigma_k
        }))
    }

    /// Forward differences, because the variables are bounded below only. The step is a fraction of the scale, not of
    /// the value: a step relative to a knot value near zero would vanish and leave rounding in place of the derivative.
    /// A knot that changes no reading beyond rounding has zero derivatives, so that the minimiser does not follow
    /// rounding.
    fn tangents(&mut self, points: &DMatrix<f64>) -> Result<Option<Vec<Tangent>>, MarchError> {
        let least_k = rounding_k(self.march.backend().precision);
        let (samples, knots) = (self.samples.len(), points.nrows());
        let mut tangents = Vec::with_capacity(points.ncols());
        for point in points.column_iter() {
            let mut stencil = DMatrix::from_fn(knots, knots + 1, |knot, _| point[knot]);
            let steps = DVector::from_fn(knots, |knot, _| {
                let least = if point[knot] < MIN_STEP_WITH_BLOWING && self.quantity.is_reduced_by_blowing(self.exposure)
                {
                    MIN_STEP_WITH_BLOWING
                } else {
                    0.0
                };
                let step = (self.difference_step * point[knot].abs().max(1.0)).max(least);
                (point[knot] + step) - point[knot]
            });
            (0..knots).for_each(|knot| stencil[(knot, knot + 1)] += steps[knot]);
            let computed = self.residuals(&stencil)?;
            let residuals = computed.column(0).into_owned();
            let mut jacobian = DMatrix::from_fn(residuals.len(), knots, |row, knot| {
                (computed[(row, knot + 1)] - residuals[row]) / steps[knot]
            });
            for knot in 0..knots {
                let moved_k = |(row, sample): (usize, &Sample)| {
                    (computed[(row, knot + 1)] - residuals[row]).abs() * sample.sigma_k
                };
                // A NaN fails this comparison, and the minimiser handles it.
                if self.samples.iter().enumerate().map(moved_k).all(|moved_k| moved_k <= least_k) {
                    jacobian.view_mut((0, knot), (samples, 1)).fill(0.0);
                }
            }
            tangents.push(Tangent { residuals, jacobian });
        }
        Ok(Some(tangents))
    }
}
