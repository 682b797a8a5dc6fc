//! Observations made of known factors: what thermocouples would show if the truth were this.

use crate::case::Case;
use crate::ensemble::Ensemble;
use crate::march::{March, MarchError};
use crate::plan::Plan;
use crate::traces::{Arrival, Traces};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use statrs::distribution::{ContinuousCDF, Normal};

/// Synthetic measurements at every instant of the plan.
#[derive(Clone, Debug)]
pub struct Twin {
    pub instants_s: Vec<f64>,
    /// Sensor × instant, K.
    pub measured_k: Vec<Vec<f64>>,
}

/// Why no observations could be made.
#[derive(Debug, thiserror::Error)]
pub enum TwinError {
    #[error("the truth cannot be marched: {0}")]
    Strayed(String),
    #[error(transparent)]
    March(#[from] MarchError),
}

/// March the case at `truth`, one value a factor, and add normal noise of `noise_k` to every reading. The
/// noise of a sensor depends on the seed and the sensor's place alone.
///
/// # Errors
/// When the truth cannot be marched or the device fails.
pub fn twin(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    truth: Vec<f64>,
    noise_k: f64,
    seed: u64,
) -> Result<Twin, TwinError> {
    let traces: Traces = march.march(plan, &Ensemble::at(case.factors.len(), truth), 0..1)?;
    if let Arrival::Strayed { time_s } = traces.arrivals[0] {
        return Err(TwinError::Strayed(format!("a temperature left 0 to 4,000 K at {time_s:.3} s")));
    }
    let normal = Normal::standard();
    let measured_k = (0..case.sensors.len()).map(|sensor| {
        let mut draws = ChaCha8Rng::seed_from_u64(seed);
        draws.set_stream(sensor as u64);
        let mut noise = || {
            // The middle of one of 2⁵³ equal strata: never nought or one, where the inverse is not finite.
            let uniform = ((draws.next_u64() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64;
            noise_k * normal.inverse_cdf(uniform)
        };
        traces.trace(0, sensor).iter().map(|&temperature_k| temperature_k + noise()).collect()
    });
    Ok(Twin { measured_k: measured_k.collect(), instants_s: plan.instants_s.clone() })
}
