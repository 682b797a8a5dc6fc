//! The quantity that is sampled for, and its half-width.

/// A quantity of the peak of a sensor, and the half-width that its 95 % confidence interval is to have.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct PrecisionTarget {
    /// Index of the sensor.
    pub sensor: usize,
    /// The quantity of its peak.
    pub quantity: TargetQuantity,
    /// Half-width of the interval: largest distance of its ends from the estimate.
    pub half_width: HalfWidth,
}

/// A quantity of the distribution of a peak over the members.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub enum TargetQuantity {
    /// The percentile of a probability between 0 and 1, K.
    Percentile(f64),
    /// The probability that the peak exceeds a temperature.
    Exceedance {
        /// The temperature, K.
        temperature_k: f64,
    },
}

/// The half-width of an interval.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub enum HalfWidth {
    /// Half-width in K, or as a probability.
    Absolute(f64),
    /// Half-width relative to the estimated probability.
    Relative(f64),
}
