//! What the thermocouples measured.

/// A sensor's measured trace.
#[derive(Clone, Debug)]
pub struct Observation {
    /// Index into the case's sensors.
    pub sensor: usize,
    /// Strictly rising, within the duration.
    pub times_s: Vec<f64>,
    pub temperatures_k: Vec<f64>,
    /// Standard deviation of each sample, above zero, K.
    pub sigma_k: Vec<f64>,
}
