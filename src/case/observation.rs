//! What the thermocouples measured.

/// A sensor's measured trace.
#[derive(Clone, Debug)]
pub struct Observation {
    /// Index into the case's sensors.
    pub sensor: usize,
    /// Strictly rising, within the duration.
    pub times_s: Vec<f64>,
    pub temperatures_k: Vec<f64>,
    /// Standard deviation of each sample, above zero, K: what it weighs is one over its square.
    pub sigma_k: Vec<f64>,
    /// Start and end of what is trusted of this sensor, s, where that is another stretch than of the others: a thermocouple that
    /// came loose is worth no less before.
    pub window_s: Option<(f64, f64)>,
}
