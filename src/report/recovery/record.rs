//! The key `coverage_study` of `summary.json`.

use crate::report::files::json::{Counted, Named};
use crate::study::recovery::Recovery;
use serde::Serialize;

#[derive(Serialize)]
pub(super) struct RecoveryRecord<'a> {
    requested: usize,
    converged: usize,
    /// Standard deviation, K; `null` where each sample has the standard deviation that the case states.
    noise_k: Option<f64>,
    correlation_time_s: f64,
    /// `small` or `large`: the bounds within which the true factors are sampled.
    truth_bounds: &'a str,
    samples: usize,
    effective_samples: f64,
    coverage: Counted,
    factors: Named<'a, RecoveredRecord>,
}

#[derive(Serialize)]
struct RecoveredRecord {
    bias: f64,
    bias_standard_error: f64,
    rms_error: f64,
    mean_half_width: f64,
    coverage: Counted,
    at_bound: usize,
}

impl<'a> RecoveryRecord<'a> {
    pub(super) fn of(outcome: &'a Recovery) -> Self {
        let factors = outcome.recovered.iter().map(|factor| {
            let record = RecoveredRecord {
                bias: factor.bias,
                bias_standard_error: factor.bias_error,
                rms_error: factor.rms,
                mean_half_width: factor.half_width,
                coverage: Counted::of(factor.covered),
                at_bound: factor.at_bound,
            };
            (factor.name.as_str(), record)
        });
        Self {
            requested: outcome.twins.len(),
            converged: outcome.converged(),
            noise_k: outcome.noise_k,
            correlation_time_s: outcome.noise.correlation_s,
            truth_bounds: outcome.drawn.name(),
            samples: outcome.samples,
            effective_samples: outcome.effective_samples,
            coverage: Counted::of(outcome.covered),
            factors: Named(factors.collect()),
        }
    }
}
