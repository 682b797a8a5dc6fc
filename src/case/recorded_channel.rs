//! The recorded channel from which the observation of a sensor was read.

/// The column from which an observation was read, and its samples that are kept out.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct RecordedChannel {
    /// Index of the sensor.
    pub sensor: usize,
    /// The heading of the column; `None` for samples in the case file.
    pub heading: Option<String>,
    /// Rows of the table.
    pub rows: usize,
    /// Rows without a value.
    pub missing: usize,
    /// Times of the first and of the last row, s.
    pub span_s: (f64, f64),
    /// Time of the last sample, s.
    pub last_s: f64,
    /// Samples before the start of the exposure: times, s, below zero.
    pub earlier_times_s: Vec<f64>,
    /// Temperatures of the samples before the start, K.
    pub earlier_temperatures_k: Vec<f64>,
    /// Number of samples after the end of the exposure.
    pub later: usize,
}
