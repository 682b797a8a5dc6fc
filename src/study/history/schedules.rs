//! Flux on knots as a least-squares problem: predicted less measured over the standard deviation, and behind these how rough the
//! history is.
//!
//! Schedules belong to a plan and factors to a member, so every point is a plan of its own, the same in all but its drives: cells, steps
//! and tables are shared, so that differences hold no noise of choosing. The road not taken, a column of the ensemble for every knot, would
//! have each stage of each step of every march look two columns up, in both twins, for what one study asks.

use crate::case::{Exposure, Face, Schedule};
use crate::ensemble::Ensemble;
use crate::fit::LeastSquares;
use crate::march::{March, MarchError};
use crate::plan::Plan;
use crate::study::thermocouples::Sample;
use crate::traces::{Arrival, Traces};
use nalgebra::DMatrix;

pub(super) struct Schedules<'a> {
    pub march: &'a mut dyn March,
    /// Of a case whose flux has its corners on the knots.
    pub plan: &'a Plan,
    pub exposure: &'a Exposure,
    pub nominal: &'a Ensemble,
    pub times_s: &'a [f64],
    /// What a variable of one means, W/m².
    pub scale_w_m2: f64,
    pub samples: &'a [Sample],
    pub roughness: &'a DMatrix<f64>,
    /// By what roughness counts, in standard deviations of a sample.
    pub weight: f64,
    pub bounds: Vec<(f64, f64)>,
    /// Histories marched so far.
    pub marches: usize,
}

/// An exposure with another flux at its hot face; one that is held has none.
pub(super) fn heated(exposure: &Exposure, flux_w_m2: Schedule) -> Exposure {
    let mut exposure = exposure.clone();
    if let Face::Open(open) = &mut exposure.hot_face {
        open.flux_w_m2 = flux_w_m2;
    }
    exposure
}

impl Schedules<'_> {
    /// March histories, one a column.
    pub(super) fn traces(&mut self, points: &DMatrix<f64>) -> Result<Vec<Traces>, MarchError> {
        let driven = |point: nalgebra::DVectorView<'_, f64>| {
            let values = point.iter().map(|value| value * self.scale_w_m2).collect();
            let flux_w_m2 = Schedule { times_s: self.times_s.to_vec(), values };
            self.plan.driven(&heated(self.exposure, flux_w_m2))
        };
        let plans: Vec<Plan> = points.column_iter().map(driven).collect();
        self.marches += plans.len();
        self.march.march_plans(&plans.iter().collect::<Vec<_>>(), self.nominal, 0..1)
    }
}

impl LeastSquares for Schedules<'_> {
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
            if traces[column].arrivals[0] != Arrival::Done {
                return f64::NAN;
            }
            (traces[column].trace(0, sample.sensor)[sample.instant] - sample.measured_k) / sample.sigma_k
        }))
    }
}
