//! Faults of the residuals of an estimate.

use super::ParameterEstimates;
use crate::fit::WARNED_CORRELATION;

/// Largest acceptable ratio of residuals and stated standard deviations, either way.
const MAX_RESIDUAL_RATIO: f64 = 2.0;
/// Correlation time, over the length of the longest trace, from which intervals are too short: with the trace itself 92
/// % of them hold the truth, with three to five traces 79 to 88 %, and the estimate of a time as long is often half of
/// it.
const LONG_CORRELATION: f64 = 0.5;
/// Residuals up to this are rounding where cells and steps are stated and no discretisation error is known, K.
const ROUNDING_K: f64 = 1e-3;

impl ParameterEstimates {
    /// Whether the residuals are much larger or smaller than the stated standard deviations.
    pub(crate) fn scatters_unlike_stated(&self) -> bool {
        let ratio = self.noise_variance.sqrt();
        ratio > MAX_RESIDUAL_RATIO || (ratio < 1.0 / MAX_RESIDUAL_RATIO && self.exceeds_numerical_error())
    }

    /// Whether the residuals are correlated from sample to sample.
    pub(crate) fn has_correlated_residuals(&self) -> bool {
        self.correlation_probability > WARNED_CORRELATION && self.exceeds_numerical_error()
    }

    /// Whether the residuals are correlated over so long that the intervals are too short.
    pub(crate) fn correlates_over_traces(&self) -> bool {
        self.correlation_time_s >= LONG_CORRELATION * self.longest_trace_s() && self.exceeds_numerical_error()
    }

    /// Length of the longest fitted trace, s.
    pub(crate) fn longest_trace_s(&self) -> f64 {
        let traces = self.fitted.iter().flat_map(|fitted| &fitted.residuals);
        let lengths_s = traces.filter_map(|(times_s, _)| Some(times_s.last()? - times_s.first()?));
        lengths_s.fold(0.0, f64::max)
    }

    /// Whether residuals exceed the numerical error at any sensor. Synthetic data without noise leave numerical errors,
    /// which are autocorrelated. The stated standard deviation does not matter: it may be ten times the scatter.
    fn exceeds_numerical_error(&self) -> bool {
        self.fitted.iter().any(|fitted| {
            let error_k = fitted.after.error_estimate.as_ref().map_or(0.0, |reached| reached.nominal_k);
            fitted.misfits.iter().any(|(_, after)| after.rms_k > error_k.max(ROUNDING_K))
        })
    }
}
