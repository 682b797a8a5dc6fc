//! The key `coverage_study` of `summary.json`.

use crate::report::files::json::{OrderedMap, ProportionRecord};
use crate::study::coverage_study::CoverageStudy;
use serde::Serialize;

#[derive(Serialize)]
pub(super) struct CoverageStudyRecord<'a> {
    requested: usize,
    converged: usize,
    /// Standard deviation, K; `null` where each sample has the standard deviation that the case states.
    noise_k: Option<f64>,
    correlation_time_s: f64,
    /// `small` or `large`: the bounds within which the true factors are sampled.
    truth_bounds: &'a str,
    samples: usize,
    effective_samples: f64,
    coverage: ProportionRecord,
    factors: OrderedMap<'a, FactorCoverage>,
}

#[derive(Serialize)]
struct FactorCoverage {
    bias: f64,
    bias_standard_error: f64,
    rms_error: f64,
    mean_half_width: f64,
    coverage: ProportionRecord,
    at_bound: usize,
}

impl<'a> CoverageStudyRecord<'a> {
    pub(super) fn of(outcome: &'a CoverageStudy) -> Self {
        let factors = outcome.factors.iter().map(|factor| {
            let record = FactorCoverage {
                bias: factor.bias,
                bias_standard_error: factor.bias_error,
                rms_error: factor.rms,
                mean_half_width: factor.half_width,
                coverage: ProportionRecord::of(factor.covered),
                at_bound: factor.at_bound,
            };
            (factor.name.as_str(), record)
        });
        Self {
            requested: outcome.requested,
            converged: outcome.converged(),
            noise_k: outcome.noise_k,
            correlation_time_s: outcome.noise.correlation_s,
            truth_bounds: outcome.truth_bounds.name(),
            samples: outcome.samples,
            effective_samples: outcome.effective_samples,
            coverage: ProportionRecord::of(outcome.covered),
            factors: OrderedMap(factors.collect()),
        }
    }
}
