//! What temperatures does the case predict?

use crate::traces::{Arrival, Balance};

/// The march at the nominal factors.
#[derive(Clone, Debug)]
pub struct Nominal {
    pub instants_s: Vec<f64>,
    /// Sensor × instant, K.
    pub temperatures_k: Vec<Vec<f64>>,
    /// One a sensor.
    pub peaks: Vec<Peak>,
    pub arrival: Arrival,
    pub balance: Balance,
    /// Coldest and hottest temperature of each ply, K.
    pub extremes_k: Vec<(f64, f64)>,
    /// One an observation, in their order.
    pub misfits: Vec<Misfit>,
    pub steps: usize,
    pub cells: usize,
}

/// The highest temperature of a trace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    pub temperature_k: f64,
    pub time_s: f64,
}

/// Prediction less measurement, over the trusted window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misfit {
    pub rms_k: f64,
    pub bias_k: f64,
    pub worst_k: f64,
    pub worst_time_s: f64,
    pub samples: usize,
}
