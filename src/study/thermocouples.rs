//! Thermocouples as a least-squares problem: predicted less measured, over the standard deviation.
//!
//! With `r = (T − Y)/σ` the sum of squares is the paper's S (Eqs 3, 4) for σ of one kelvin, and the
//! Jacobian of the residuals its sensitivity matrix (Eq. 5).

use super::nominal::trusted;
use crate::case::{Bounds, Case};
use crate::ensemble::Ensemble;
use crate::fit::LeastSquares;
use crate::march::{March, MarchError, march_all};
use crate::plan::Plan;
use crate::traces::Arrival;
use nalgebra::DMatrix;

/// One number to be met.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    pub sensor: usize,
    pub instant: usize,
    pub measured_k: f64,
    pub sigma_k: f64,
}

/// Some factors of a case, the others at their nominal values, and the samples that judge them.
pub struct Thermocouples<'a> {
    plan: &'a Plan,
    march: &'a mut dyn March,
    nominal: Vec<f64>,
    /// Indices of the factors that vary.
    factors: Vec<usize>,
    bounds: Vec<(f64, f64)>,
    samples: Vec<Sample>,
    /// Members marched so far.
    pub marches: usize,
}

impl<'a> Thermocouples<'a> {
    pub fn new(
        case: &Case,
        plan: &'a Plan,
        march: &'a mut dyn March,
        factors: &[usize],
        bounds: Bounds,
        samples: Vec<Sample>,
    ) -> Self {
        Self {
            plan,
            march,
            nominal: case.factors.iter().map(|factor| factor.nominal).collect(),
            factors: factors.to_vec(),
            bounds: factors.iter().map(|&factor| case.factors[factor].bounds(bounds)).collect(),
            samples,
            marches: 0,
        }
    }

    /// A row of all factors with these values for the ones that vary.
    pub fn row(&self, values: impl IntoIterator<Item = f64>) -> Vec<f64> {
        let mut row = self.nominal.clone();
        for (&factor, value) in self.factors.iter().zip(values) {
            row[factor] = value;
        }
        row
    }
}

impl LeastSquares for Thermocouples<'_> {
    type Error = MarchError;

    fn bounds(&self) -> &[(f64, f64)] {
        &self.bounds
    }

    fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, MarchError> {
        let rows = points.column_iter().flat_map(|point| self.row(point.iter().copied())).collect();
        let ensemble = Ensemble::at(self.nominal.len(), rows);
        let mut residuals = DMatrix::from_element(self.samples.len(), points.ncols(), f64::NAN);
        march_all(self.march, self.plan, &ensemble, &mut |traces| {
            for member in (0..traces.members()).filter(|&member| traces.arrivals[member] == Arrival::Done) {
                for (i, sample) in self.samples.iter().enumerate() {
                    let predicted_k = traces.trace(member, sample.sensor)[sample.instant];
                    residuals[(i, traces.first + member)] = (predicted_k - sample.measured_k) / sample.sigma_k;
                }
            }
        })?;
        self.marches += points.ncols();
        Ok(residuals)
    }
}

/// The trusted samples of the observations of the sensors chosen (all that have any, where none are), one
/// vector an observation.
pub fn samples(case: &Case, plan: &Plan) -> Vec<Vec<Sample>> {
    let chosen = &case.estimate.sensors;
    case.observations
        .iter()
        .filter(|seen| chosen.is_empty() || chosen.contains(&seen.sensor))
        .map(|seen| {
            let pairs = trusted(case, seen, &plan.instants_s).into_iter();
            pairs
                .map(|(sample, instant)| Sample {
                    sensor: seen.sensor,
                    instant,
                    measured_k: seen.temperatures_k[sample],
                    sigma_k: seen.sigma_k[sample],
                })
                .collect()
        })
        .collect()
}
