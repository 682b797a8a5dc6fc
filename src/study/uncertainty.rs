//! How far may the prediction be off, and which factor is to blame?

use super::nominal::Peak;

/// What a Monte Carlo over the factors says.
#[derive(Clone, Debug)]
pub struct Uncertainty {
    pub seed: u64,
    /// `normal`, `uniform`, `lhs`, `sobol`.
    pub sampling: &'static str,
    pub asked: usize,
    pub ok: usize,
    /// Why members failed, how many each, and one of them.
    pub failures: Vec<Failure>,
    pub instants_s: Vec<f64>,
    /// One a sensor.
    pub spreads: Vec<Spread>,
    /// The members' own peaks: one a sensor.
    pub peaks: Vec<PeakSpread>,
}

/// A reason for failure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    pub reason: String,
    pub members: usize,
    /// The first member that failed so.
    pub first: usize,
}

/// One sensor through time: each vector over the instants, K.
#[derive(Clone, Debug)]
pub struct Spread {
    pub mean_k: Vec<f64>,
    pub deviation_k: Vec<f64>,
    pub low_k: Vec<f64>,
    pub high_k: Vec<f64>,
    /// Percentiles 2.5, 25, 50, 75, 97.5, in this order.
    pub percentiles_k: [Vec<f64>; 5],
    /// Factor × instant: Pearson correlation of factor and temperature (the paper's Eq. 13).
    pub correlations: Vec<Vec<f64>>,
    /// Factor × instant: squared correlations over their sum; zero where nothing varies.
    pub shares: Vec<Vec<f64>>,
}

/// The distribution of a sensor's peak.
#[derive(Clone, Debug)]
pub struct PeakSpread {
    pub nominal: Peak,
    pub mean_k: f64,
    pub deviation_k: f64,
    /// Percentiles 2.5, 25, 50, 75, 97.5 of the peak temperature, K.
    pub percentiles_k: [f64; 5],
    /// Percentiles 2.5, 25, 50, 75, 97.5 of the time of the peak, s.
    pub percentiles_s: [f64; 5],
    /// Pearson correlation of each factor with the peak temperature.
    pub correlations: Vec<f64>,
}
