//! What is asked: a case as it holds. Pure data; no numerics, no device.
//!
//! A [`Case`] that exists can be marched: [`CaseBuilder::build`] is the one way to make it, and finds every fault. A file
//! is read into a builder, its faults found at their lines and columns.

pub mod air;
mod builder;
mod check;
mod conductivity;
mod decomposition;
mod error;
mod estimate;
mod exposure;
mod factor;
mod file;
mod gas;
mod layup;
pub mod library;
mod material;
mod nearest;
mod observation;
mod provenance;
mod resolution;
mod scope;
mod table;
mod thermogram;
pub mod unit;

pub use builder::CaseBuilder;
pub use conductivity::{Conductivity, Parts};
pub use decomposition::{
    Decomposition, GAS_CONSTANT_J_MOL_K, Mixing, Pores, PyrolysisHeat, Reaction, Residue, Sequence,
};
pub use error::{CaseError, Fault, Place, unreadable};
pub use estimate::{Estimate, LossFunction};
pub use exposure::{Emissivity, Exposure, Face, Holder, OpenFace};
pub use factor::{Bounds, Correlation, Factor, Property};
pub use file::{Files, Folder};
pub use gas::{Gas, GasFlow, GasPath};
pub use layup::{Layup, Ply, Sensor, Side};
pub use material::Material;
pub use observation::Observation;
pub use provenance::{Mark, Provenance};
pub use resolution::Resolution;
pub use table::{OutOfRange, Schedule, Table};

/// A layup, its exposure, its sensors, what may vary and what was measured; validated.
///
/// It is read of a file ([`load`](Self::load), [`from_toml`](Self::from_toml)) or built of values ([`CaseBuilder`]), and
/// never changes: another case is built of [`to_builder`](Self::to_builder). From outside of the crate its fields can
/// neither be written nor put together:
///
/// ```compile_fail,E0616
/// let mut case = bondline::Case::load("cases/slab".as_ref()).expect("a shipped case");
/// case.sensors.clear();
/// ```
///
/// ```compile_fail,E0451
/// let case = bondline::Case::load("cases/slab".as_ref()).expect("a shipped case");
/// let other = bondline::Case { sensors: Vec::new(), ..case };
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Case {
    pub(crate) id: String,
    pub(crate) name: String,
    pub(crate) note: String,
    pub(crate) layup: Layup,
    pub(crate) sensors: Vec<Sensor>,
    pub(crate) exposure: Exposure,
    pub(crate) gas: Option<GasFlow>,
    pub(crate) factors: Vec<Factor>,
    pub(crate) correlation: Correlation,
    pub(crate) observations: Vec<Observation>,
    pub(crate) estimate: Estimate,
    pub(crate) paper_figures: Vec<(String, Vec<usize>)>,
    pub(crate) resolution: Resolution,
}

impl Case {
    /// The folder's or file's name: names the output folder.
    pub fn id(&self) -> &str {
        &self.id
    }

    /// What the analyst called it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// A few sentences for the report: where data come from, what is synthetic.
    pub fn note(&self) -> &str {
        &self.note
    }

    /// Plies from hot face to back face, as marched.
    pub fn layup(&self) -> &Layup {
        &self.layup
    }

    /// Where temperature is read, one sensor at least.
    pub fn sensors(&self) -> &[Sensor] {
        &self.sensors
    }

    /// What happens at the faces through time.
    pub fn exposure(&self) -> &Exposure {
        &self.exposure
    }

    /// How gas leaves, where a ply makes any or is driven through by it.
    pub fn gas(&self) -> Option<&GasFlow> {
        self.gas.as_ref()
    }

    /// What may vary.
    pub fn factors(&self) -> &[Factor] {
        &self.factors
    }

    /// Which of the factors go together where members are drawn.
    pub fn correlation(&self) -> &Correlation {
        &self.correlation
    }

    /// What sensors measured, at most one trace each.
    pub fn observations(&self) -> &[Observation] {
        &self.observations
    }

    /// What the case proposes to estimate, and from what. The options of a question stand in its place.
    pub fn estimate(&self) -> &Estimate {
        &self.estimate
    }

    /// Of figures of the report, by the names of their files, the numbers of the figures of the paper that they repeat.
    pub fn paper_figures(&self) -> &[(String, Vec<usize>)] {
        &self.paper_figures
    }

    /// How finely space and time are cut.
    pub fn resolution(&self) -> Resolution {
        self.resolution
    }

    /// The case with another choice of what to estimate, which the options of a question have checked.
    pub(crate) fn with_estimate(self, estimate: Estimate) -> Self {
        Self { estimate, ..self }
    }

    /// The case with one window of the samples of every sensor, also where a sensor has one of its own, s.
    pub(crate) fn with_window_s(mut self, window_s: (f64, f64)) -> Self {
        self.estimate.window_s = Some(window_s);
        self.observations.iter_mut().for_each(|seen| seen.window_s = None);
        self
    }

    /// The case with cells and steps adapted to another discretisation error, K.
    pub(crate) fn with_tolerance_k(mut self, tolerance_k: f64) -> Self {
        self.resolution.tolerance_k = Some(tolerance_k);
        self
    }

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
