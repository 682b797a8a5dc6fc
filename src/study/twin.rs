//! Synthetic measurements from known factors (the twin experiment).

use super::uncertainty::failure_reason;
use super::validity::{inaccuracy, unusable};
use crate::adapt::{ACCEPTED_ERROR, checked_at_members};
use crate::case::Case;
use crate::ensemble::Ensemble;
use crate::march::{March, MarchError};
use crate::plan::Plan;
use crate::random::RandomStream;
use crate::traces::{MemberStatus, Traces};

/// Synthetic measurements at every instant of the plan.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct SyntheticData {
    /// Instants of the readings, s.
    pub instants_s: Vec<f64>,
    /// Sensor × instant, K.
    pub measured_k: Vec<Vec<f64>>,
}

/// Gaussian noise with correlation `exp(−Δt/correlation)` between readings: a first-order autoregression on even
/// sampling.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Noise {
    /// Correlation time, s; zero for white noise.
    pub correlation_s: f64,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// Errors of synthetic data.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SyntheticDataError {
    /// The march failed or is too inaccurate; with the reason.
    #[error("the march at the true factors {0}")]
    Unusable(String),
    /// The march failed or was cancelled.
    #[error(transparent)]
    March(#[from] MarchError),
}

impl Noise {
    /// Noise of standard deviation one at these times. It depends only on seed, data set and sensor index.
    pub fn sample(&self, times_s: &[f64], data_set: usize, sensor: usize) -> Vec<f64> {
        let mut numbers = RandomStream::new(self.seed, (data_set as u64) << 32 | sensor as u64);
        let mut before: Option<(f64, f64)> = None;
        let mut next = |&time_s: &f64| {
            let fresh = numbers.normal();
            let noise = match before {
                Some((then_s, noise)) if self.correlation_s > 0.0 => {
                    let kept = (-(time_s - then_s) / self.correlation_s).exp();
                    kept * noise + (1.0 - kept * kept).sqrt() * fresh
                }
                _ => fresh,
            };
            before = Some((time_s, noise));
            noise
        };
        times_s.iter().map(&mut next).collect()
    }
}

/// March the case at `truth`, one value per factor, and add noise of standard deviation `noise_k` to every reading.
/// Cells and steps are adapted anew where those of the plan are too coarse for the truth.
///
/// # Errors
/// When the march at the truth or the device fails.
pub fn twin(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    truth: Vec<f64>,
    noise_k: f64,
    noise: &Noise,
) -> Result<SyntheticData, SyntheticDataError> {
    let truth = Ensemble::from_values(case.factors.len(), truth);
    let (precision, monitor) = (march.backend().precision, march.monitor());
    let plan = checked_at_members(case, plan, &truth, precision, ACCEPTED_ERROR, &monitor)?.plan;
    let traces: Traces = march.march(&plan, &truth, 0..1)?;
    let failure = match traces.statuses[0] {
        MemberStatus::Diverged { time_s } => Some(format!("a temperature left 0 to 4,000 K at {time_s:.3} s")),
        ref status => failure_reason(case, status),
    };
    let failed = failure.map(|reason| format!("failed: {reason}"));
    let unusable = || unusable(inaccuracy(plan.error_estimate(), &traces.balances[0]));
    if let Some(reason) = failed.or_else(unusable) {
        return Err(SyntheticDataError::Unusable(reason));
    }
    let measured_k = (0..case.sensors.len()).map(|sensor| {
        let noise = noise.sample(&plan.instants_s, 0, sensor);
        traces
            .trace(0, sensor)
            .iter()
            .zip(noise)
            .map(|(temperature_k, noise)| temperature_k + noise_k * noise)
            .collect()
    });
    Ok(SyntheticData { measured_k: measured_k.collect(), instants_s: plan.instants_s.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean square, and autocorrelations at lags one and two.
    fn moments(noise: &[f64]) -> [f64; 3] {
        let mean = |lag: usize| {
            let products = noise.iter().zip(&noise[lag..]).map(|(a, b)| a * b);
            products.sum::<f64>() / (noise.len() - lag) as f64
        };
        [mean(0), mean(1) / mean(0), mean(2) / mean(0)]
    }

    #[test]
    fn noise_has_unit_variance_and_exponential_correlation() {
        let times_s: Vec<f64> = (0..40_000).map(|i| 0.5 * f64::from(i)).collect();
        for correlation_s in [0.0, 2.0] {
            let found = moments(&Noise { correlation_s, seed: 3 }.sample(&times_s, 0, 0));
            let kept = if correlation_s > 0.0 { (-0.5_f64 / correlation_s).exp() } else { 0.0 };
            for (found, expected) in found.iter().zip([1.0, kept, kept * kept]) {
                assert!((found - expected).abs() < 0.05, "{correlation_s} s: {found}, not {expected}");
            }
        }
    }

    #[test]
    fn noise_depends_on_seed_data_set_and_sensor_and_is_reproducible() {
        let of = |seed, data_set, sensor| Noise { correlation_s: 1.0, seed }.sample(&[0.0, 1.0], data_set, sensor);
        assert_eq!(of(1, 2, 3), of(1, 2, 3));
        for other in [of(2, 2, 3), of(1, 3, 3), of(1, 2, 4)] {
            assert_ne!(of(1, 2, 3), other);
        }
    }
}
