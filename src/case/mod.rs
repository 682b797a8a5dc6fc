//! What is asked: a case as it holds. Pure data; no numerics, no device.
//!
//! A [`Case`] that exists can be marched: every fault is found when it is loaded.

pub mod air;
pub mod decomposition;
pub mod error;
pub mod exposure;
pub mod factor;
mod file;
pub mod layup;
pub mod library;
pub mod material;
pub mod observation;
pub mod table;
mod thermogram;
pub mod unit;

pub use decomposition::{
    Decomposition, Gas, GasFlow, GasPath, Mixing, Pores, PyrolysisHeat, Reaction, Residue, Sequence,
};
pub use error::{CaseError, Fault, unreadable};
pub use exposure::{Emissivity, Exposure, Face, Holder, OpenFace};
pub use factor::{Bounds, Correlation, Factor, Property};
pub use layup::{Layup, Ply, Sensor, Side};
pub use material::{Conductivity, Material};
pub use observation::Observation;
pub use table::{OutOfRange, Schedule, Table};

use crate::fit::Loss;

/// A layup, its exposure, its sensors, what may vary and what was measured; validated.
#[derive(Clone, Debug)]
pub struct Case {
    /// The folder's or file's name: names the output folder.
    pub id: String,
    /// What the analyst called it.
    pub name: String,
    /// A few sentences for the report: where data come from, what is synthetic.
    pub note: String,
    pub layup: Layup,
    pub sensors: Vec<Sensor>,
    pub exposure: Exposure,
    /// How gas leaves, where a ply makes any or is driven through by it.
    pub gas: Option<GasFlow>,
    pub factors: Vec<Factor>,
    /// Which of them go together where members are drawn.
    pub correlation: Correlation,
    pub observations: Vec<Observation>,
    pub estimate: Estimate,
    /// Of figures of the report, by the names of their files, the numbers of the figures of the paper that they repeat.
    pub paper_figures: Vec<(String, Vec<usize>)>,
    pub resolution: Resolution,
}

impl Case {
    /// Start and end of what is trusted of a sensor, s: its own window, else the one of all, else the whole exposure.
    pub fn window_s(&self, sensor: usize) -> (f64, f64) {
        let own = self.observations.iter().find(|seen| seen.sensor == sensor).and_then(|seen| seen.window_s);
        own.unwrap_or(self.window_of_all_s())
    }

    fn window_of_all_s(&self) -> (f64, f64) {
        self.estimate.window_s.unwrap_or((0.0, self.exposure.duration_s))
    }

    /// The observations that judge: those of the sensors chosen, or all where none are.
    pub fn judges(&self) -> impl Iterator<Item = &Observation> {
        let chosen = &self.estimate.sensors;
        self.observations.iter().filter(|seen| chosen.is_empty() || chosen.contains(&seen.sensor))
    }

    /// From the first start to the last end of the windows of the observations that judge, s.
    pub fn trusted_s(&self) -> (f64, f64) {
        let windows_s = self.judges().map(|seen| self.window_s(seen.sensor));
        let whole = windows_s.reduce(|(from_s, to_s), window_s| (from_s.min(window_s.0), to_s.max(window_s.1)));
        whole.unwrap_or(self.window_of_all_s())
    }
}

/// What the case file proposes to estimate, and from what.
#[derive(Clone, Debug, Default)]
pub struct Estimate {
    /// Indices into the factors.
    pub factors: Vec<usize>,
    /// Indices into the sensors.
    pub sensors: Vec<usize>,
    /// Start and end of the trusted data, s, of every sensor without a window of its own; `None` trusts all.
    pub window_s: Option<(f64, f64)>,
    /// Start of each factor of `factors`; empty starts at the nominal values.
    pub start: Vec<f64>,
    pub bounds: Bounds,
    /// How samples count that are far off.
    pub loss: Loss,
    /// The side constraints that lie two standard deviations from what is known of each factor beforehand, its nominal
    /// value; none where nothing but the data is to speak.
    pub prior: Option<Bounds>,
}

/// How finely space and time are cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resolution {
    /// The error of temperatures for which a pilot is to choose cells and steps, K; `None` where a case states them.
    pub tolerance_k: Option<f64>,
    /// Cells through the layup, shared among plies by diffusion time; every ply has at least four.
    pub cells: usize,
    /// The first step after each corner of a schedule, s.
    pub first_step_s: f64,
    /// A step is at most this share of the time since the last corner.
    pub growth: f64,
    /// No step is longer, s.
    pub largest_step_s: f64,
    /// Interval between the instants of the traces, s; observations add instants of their own.
    pub every_s: f64,
}

impl Default for Resolution {
    /// What a case file gets that names none.
    fn default() -> Self {
        Self {
            tolerance_k: Some(0.05),
            cells: 160,
            first_step_s: 0.005,
            growth: 0.05,
            largest_step_s: 0.5,
            every_s: 1.0,
        }
    }
}
