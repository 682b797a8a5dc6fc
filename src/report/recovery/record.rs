//! What `twin --study` found, for a program.

use crate::report::files::json::{Counted, Named};
use crate::study::recovery::Recovery;
use serde::Serialize;

#[derive(Serialize)]
pub(super) struct RecoveryRecord<'a> {
    asked: usize,
    converged: usize,
    /// K; `null` where each sample had the standard deviation that the case states.
    noise_k: Option<f64>,
    correlation_s: f64,
    drawn: &'a str,
    samples: usize,
    effective_samples: f64,
    covered: Counted,
    factors: Named<'a, RecoveredRecord>,
}

#[derive(Serialize)]
struct RecoveredRecord {
    bias: f64,
    bias_standard_error: f64,
    rms: f64,
    half_width: f64,
    covered: Counted,
    at_bound: usize,
}

impl<'a> RecoveryRecord<'a> {
    pub(super) fn of(outcome: &'a Recovery) -> Self {
        let factors = outcome.recovered.iter().map(|factor| {
            let record = RecoveredRecord {
                bias: factor.bias,
                bias_standard_error: factor.bias_error,
                rms: factor.rms,
                half_width: factor.half_width,
                covered: Counted::of(factor.covered),
                at_bound: factor.at_bound,
            };
            (factor.name.as_str(), record)
        });
        Self {
            asked: outcome.twins.len(),
            converged: outcome.converged(),
            noise_k: outcome.noise_k,
            correlation_s: outcome.noise.correlation_s,
            drawn: outcome.drawn.name(),
            samples: outcome.samples,
            effective_samples: outcome.effective_samples,
            covered: Counted::of(outcome.covered),
            factors: Named(factors.collect()),
        }
    }
}
