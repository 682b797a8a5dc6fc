//! Observations made of known factors: what thermocouples would show if the truth were this.

use crate::case::Case;
use crate::chance::Numbers;
use crate::ensemble::Ensemble;
use crate::march::{March, MarchError};
use crate::plan::Plan;
use crate::traces::{Arrival, Traces};

/// Synthetic measurements at every instant of the plan.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Twin {
    /// Instants of the readings, s.
    pub instants_s: Vec<f64>,
    /// Sensor × instant, K.
    pub measured_k: Vec<Vec<f64>>,
}

/// Normal noise that forgets itself over a time: `exp(−Δt/correlation)` is the correlation of two readings, of which those
/// before the first tell nothing more (a first-order autoregression where samples are even).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Noise {
    /// s; zero where every reading has noise of its own.
    pub correlation_s: f64,
    /// The same seed makes the same noise.
    pub seed: u64,
}

/// Why no observations could be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TwinError {
    /// A temperature left the range in which properties are known; with the reason.
    #[error("the truth cannot be marched: {0}")]
    Strayed(String),
    /// The march failed or was cancelled.
    #[error(transparent)]
    March(#[from] MarchError),
}

impl Noise {
    /// Noise of standard deviation one at these times. It depends on the seed, the data set and the sensor's place alone.
    pub fn at(&self, times_s: &[f64], data_set: usize, sensor: usize) -> Vec<f64> {
        let mut numbers = Numbers::of(self.seed, (data_set as u64) << 32 | sensor as u64);
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

/// March the case at `truth`, one value a factor, and add noise of a standard deviation of `noise_k` to every reading.
///
/// # Errors
/// When the truth cannot be marched or the device fails.
pub fn twin(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    truth: Vec<f64>,
    noise_k: f64,
    noise: &Noise,
) -> Result<Twin, TwinError> {
    let traces: Traces = march.march(plan, &Ensemble::at(case.factors.len(), truth), 0..1)?;
    if let Arrival::Strayed { time_s } = traces.arrivals[0] {
        return Err(TwinError::Strayed(format!("a temperature left 0 to 4,000 K at {time_s:.3} s")));
    }
    let measured_k = (0..case.sensors.len()).map(|sensor| {
        let noise = noise.at(&plan.instants_s, 0, sensor);
        traces
            .trace(0, sensor)
            .iter()
            .zip(noise)
            .map(|(temperature_k, noise)| temperature_k + noise_k * noise)
            .collect()
    });
    Ok(Twin { measured_k: measured_k.collect(), instants_s: plan.instants_s.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean square, and correlations of neighbours and of samples two apart.
    fn moments(noise: &[f64]) -> [f64; 3] {
        let mean = |lag: usize| {
            let products = noise.iter().zip(&noise[lag..]).map(|(a, b)| a * b);
            products.sum::<f64>() / (noise.len() - lag) as f64
        };
        [mean(0), mean(1) / mean(0), mean(2) / mean(0)]
    }

    #[test]
    fn noise_correlates_by_the_time_between_readings_and_has_the_deviation_asked_for() {
        let times_s: Vec<f64> = (0..40_000).map(|i| 0.5 * f64::from(i)).collect();
        for correlation_s in [0.0, 2.0] {
            let found = moments(&Noise { correlation_s, seed: 3 }.at(&times_s, 0, 0));
            let kept = if correlation_s > 0.0 { (-0.5_f64 / correlation_s).exp() } else { 0.0 };
            for (found, expected) in found.iter().zip([1.0, kept, kept * kept]) {
                assert!((found - expected).abs() < 0.05, "{correlation_s} s: {found}, not {expected}");
            }
        }
    }

    #[test]
    fn every_data_set_and_sensor_has_noise_of_its_own_and_the_same_each_time() {
        let of = |seed, data_set, sensor| Noise { correlation_s: 1.0, seed }.at(&[0.0, 1.0], data_set, sensor);
        assert_eq!(of(1, 2, 3), of(1, 2, 3));
        for other in [of(2, 2, 3), of(1, 3, 3), of(1, 2, 4)] {
            assert_ne!(of(1, 2, 3), other);
        }
    }
}
