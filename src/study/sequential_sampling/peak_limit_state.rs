//! The peak of a sensor below a temperature, as a limit state in standard normal variables.

use crate::ensemble::{Ensemble, StandardNormalSpace};
use crate::fit::reliability::LimitState;
use crate::march::{March, MarchError, march_all};
use crate::plan::Plan;
use crate::traces::{MemberStatus, Traces};

/// Temperature less peak, K: negative where the peak exceeds it, and for a member that fails.
pub(super) struct PeakLimitState<'a> {
    plan: &'a Plan,
    march: &'a mut dyn March,
    space: &'a StandardNormalSpace,
    sensor: usize,
    temperature_k: f64,
    /// Members that failed so far.
    pub failed: usize,
}

/// Step of central differences where the march has no derivatives, in standard deviations. The peak has an error near
/// 1e-4 K in single precision.
const DIFFERENCE_STEP: f64 = 0.05;

impl<'a> PeakLimitState<'a> {
    pub(super) fn new(
        plan: &'a Plan,
        march: &'a mut dyn March,
        space: &'a StandardNormalSpace,
        sensor: usize,
        temperature_k: f64,
    ) -> Self {
        Self { plan, march, space, sensor, temperature_k, failed: 0 }
    }

    fn ensemble(&self, points: &[Vec<f64>]) -> Ensemble {
        let rows = points.iter().flat_map(|point| self.space.factors(point)).collect();
        Ensemble::from_values(self.space.variables(), rows)
    }
}

/// The value of a member of traces.
fn value(traces: &Traces, member: usize, sensor: usize, temperature_k: f64) -> f64 {
    let peak = traces.peak(member, sensor);
    let is_completed = traces.statuses[member] == MemberStatus::Completed;
    if is_completed { temperature_k - peak.temperature_k } else { f64::NEG_INFINITY }
}

impl LimitState for PeakLimitState<'_> {
    type Error = MarchError;

    fn variables(&self) -> usize {
        self.space.variables()
    }

    fn values(&mut self, points: &[Vec<f64>]) -> Result<Vec<f64>, MarchError> {
        let ensemble = self.ensemble(points);
        let Self { plan, sensor, temperature_k, .. } = *self;
        let mut values = Vec::with_capacity(points.len());
        march_all(self.march, plan, &ensemble, &mut |traces| {
            let members = 0..traces.members();
            values.extend(members.map(|member| value(&traces, member, sensor, temperature_k)));
        })?;
        self.failed += values.iter().filter(|value| **value == f64::NEG_INFINITY).count();
        Ok(values)
    }

    fn gradients(&mut self, points: &[Vec<f64>]) -> Result<Vec<(f64, Vec<f64>)>, MarchError> {
        let (factors, ensemble) = ((0..self.variables()).collect::<Vec<_>>(), self.ensemble(points));
        let Some(traces) = self.march.tangents(self.plan, &ensemble, &factors)? else {
            return self.difference_gradients(points);
        };
        let rows = 1 + factors.len();
        let gradient = |(place, point): (usize, &Vec<f64>)| {
            let by_factor = factors.iter().map(|factor| {
                let row = place * rows + 1 + factor;
                -traces.peak(row, self.sensor).temperature_k
            });
            let by_factor: Vec<f64> = by_factor.collect();
            let value = value(&traces, place * rows, self.sensor, self.temperature_k);
            (value, self.space.gradient(point, &by_factor))
        };
        Ok(points.iter().enumerate().map(gradient).collect())
    }
}

impl PeakLimitState<'_> {
    fn difference_gradients(&mut self, points: &[Vec<f64>]) -> Result<Vec<(f64, Vec<f64>)>, MarchError> {
        let moved = |point: &[f64], variable: usize, step: f64| {
            let mut moved = point.to_vec();
            moved[variable] += step;
            moved
        };
        let around = |point: &Vec<f64>| {
            let pairs =
                (0..point.len()).flat_map(|of| [moved(point, of, DIFFERENCE_STEP), moved(point, of, -DIFFERENCE_STEP)]);
            std::iter::once(point.clone()).chain(pairs).collect::<Vec<_>>()
        };
        let values = self.values(&points.iter().flat_map(around).collect::<Vec<_>>())?;
        let gradient = |values: &[f64]| {
            let slopes = values[1..].chunks(2).map(|pair| (pair[0] - pair[1]) / (2.0 * DIFFERENCE_STEP));
            (values[0], slopes.collect())
        };
        Ok(values.chunks(1 + 2 * self.variables()).map(gradient).collect())
    }
}
