//! The peak of a trace.

/// Peak temperature of a trace.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Peak {
    /// The highest temperature, K.
    pub temperature_k: f64,
    /// Time of the peak, s.
    pub time_s: f64,
}

impl Peak {
    /// The first maximum of a trace.
    pub fn of(trace_k: &[f64], instants_s: &[f64]) -> Self {
        let none = Self { temperature_k: f64::NEG_INFINITY, time_s: 0.0 };
        trace_k.iter().zip(instants_s).fold(none, |peak, (&temperature_k, &time_s)| {
            if temperature_k > peak.temperature_k { Self { temperature_k, time_s } } else { peak }
        })
    }
}
