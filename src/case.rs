//! Input: a validated case. Pure data; no numerics, no device.
//!
//! Every [`Case`] can be marched: [`CaseBuilder::build`] is the only constructor and reports all errors together. A
//! case file is read into a builder; its errors have a line and a column.

pub mod air;
mod builder;
mod conductivity;
mod decomposition;
mod emissivity_cap;
mod error;
mod estimation_settings;
mod exposure;
mod factor;
mod factor_targets;
mod file;
mod gas;
mod input_files;
mod layup;
pub mod library;
mod material;
mod observation;
mod own_materials;
mod provenance;
mod pyrometer;
mod pyrometer_driver;
mod reading_notes;
mod recorded_channel;
mod resolution;
mod smoothed_driver;
mod suggestion;
mod table;
mod temperature_limit;
mod toml_string;
pub mod unit;
mod validation;
mod variants;

pub use builder::CaseBuilder;
pub use conductivity::{Conductivity, ThreePartConductivity};
pub use decomposition::{
    Decomposition, GAS_CONSTANT_J_MOL_K, MixtureRule, Pores, PyrolysisHeat, Reaction, ReactionScheme, Residue,
};
pub use emissivity_cap::CappedEmissivity;
pub use error::{CaseError, Diagnostic, SourceLocation, unreadable_file_message};
pub use estimation_settings::{EstimationSettings, LossFunction};
pub use exposure::{Emissivity, Exposure, Face, Holder, OpenFace};
pub use factor::{Bounds, Correlation, Factor, Property};
pub use file::{FileSource, Folder};
pub use file::{ImportRecord, ImportedMaterial, MaterialColumns, PatoHeat, PatoOptions, PropertyColumns};
pub use gas::{Gas, GasFlow, GasFlowModel};
pub use input_files::InputFile;
pub use layup::{Layup, Ply, Sensor, Side};
pub use material::Material;
pub use observation::Observation;
pub use provenance::{Provenance, SourceKind};
pub use pyrometer::{Pyrometer, Spectrum};
pub use pyrometer_driver::PyrometerDriver;
pub use recorded_channel::RecordedChannel;
pub(crate) use resolution::MAX_CORNERS;
pub use resolution::Resolution;
pub use smoothed_driver::SmoothedDriver;
pub use table::{OutOfRange, Schedule, Table};
pub use temperature_limit::{LimitedPart, TemperatureLimit};
pub(crate) use toml_string::toml_string;

use input_files::InputFiles;
use reading_notes::ReadingNotes;
use std::sync::Arc;

/// A layup, its exposure, sensors, scale factors and observations; validated and immutable.
///
/// A case is read from a file ([`load`](Self::load), [`from_toml`](Self::from_toml)) or built from values
/// ([`CaseBuilder`]). To change one, start from [`to_builder`](Self::to_builder). The fields are private to the crate:
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
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Case {
    pub(crate) id: String,
    pub(crate) name: String,
    pub(crate) note: String,
    pub(crate) layup: Layup,
    pub(crate) sensors: Vec<Sensor>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) limits: Vec<TemperatureLimit>,
    pub(crate) exposure: Exposure,
    pub(crate) gas: Option<GasFlow>,
    pub(crate) factors: Vec<Factor>,
    pub(crate) correlation: Correlation,
    pub(crate) observations: Vec<Observation>,
    pub(crate) estimate: EstimationSettings,
    pub(crate) resolution: Resolution,
    #[serde(skip)]
    pub(crate) reading_notes: ReadingNotes,
    #[serde(skip)]
    pub(crate) input_files: InputFiles,
}

impl Case {
    /// The name of the folder or file, also used for the output folder.
    pub fn id(&self) -> &str {
        &self.id
    }

    /// Title given by the analyst.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// A few sentences for the report: origin of the data, which data are synthetic.
    pub fn note(&self) -> &str {
        &self.note
    }

    /// Plies from hot face to back face; below a held face only those that are marched.
    pub fn layup(&self) -> &Layup {
        &self.layup
    }

    /// Sensors, at least one.
    pub fn sensors(&self) -> &[Sensor] {
        &self.sensors
    }

    /// Temperature limits, at most one for each ply, interface and sensor.
    pub fn limits(&self) -> &[TemperatureLimit] {
        &self.limits
    }

    /// Whether a sensor has a limit.
    pub(crate) fn has_limit(&self, sensor: usize) -> bool {
        self.limits.iter().any(|limit| limit.part == LimitedPart::Sensor(sensor))
    }

    /// Name of the part that a limit is for: that of the ply or sensor; `INS2/GB` for an interface.
    pub fn limited_part(&self, limit: &TemperatureLimit) -> String {
        limit.part.name(&self.layup, &self.sensors)
    }

    /// Initial temperature, and boundary conditions through time.
    pub fn exposure(&self) -> &Exposure {
        &self.exposure
    }

    /// Gas transport; `None` where no gas flows.
    pub fn gas(&self) -> Option<&GasFlow> {
        self.gas.as_ref()
    }

    /// Scale factors.
    pub fn factors(&self) -> &[Factor] {
        &self.factors
    }

    /// Correlation of the factors when members are sampled.
    pub fn correlation(&self) -> &Correlation {
        &self.correlation
    }

    /// Measured traces, at most one per sensor.
    pub fn observations(&self) -> &[Observation] {
        &self.observations
    }

    /// Default settings of an estimate; the options of a study override them.
    pub fn estimate(&self) -> &EstimationSettings {
        &self.estimate
    }

    /// Resolution in space and time.
    pub fn resolution(&self) -> Resolution {
        self.resolution
    }

    /// Columns and samples of the files of the case that were not read, by file. They are no part of the content.
    pub fn unread_data(&self) -> &[Diagnostic] {
        &self.reading_notes.unread
    }

    /// The recorded channel of each observed sensor, with the samples that its observation leaves out. Channels are no
    /// part of the content; a case from a builder has none.
    pub fn recorded_channels(&self) -> &[RecordedChannel] {
        &self.reading_notes.recorded
    }

    /// Measured temperatures of held faces that were smoothed. They are no part of the content, which has the smoothed
    /// ones; a case from a builder has none.
    pub fn smoothed_drivers(&self) -> &[SmoothedDriver] {
        &self.reading_notes.drivers
    }

    /// The exposure with the temperatures of held faces as they were measured; `None` if none was smoothed.
    pub(crate) fn measured_exposure(&self) -> Option<Exposure> {
        let mut exposure = self.exposure.clone();
        for driver in &self.reading_notes.drivers {
            let face = if driver.is_hot_face { &mut exposure.hot_face } else { &mut exposure.back_face };
            *face = Face::Held(driver.measured.clone());
        }
        (!self.reading_notes.drivers.is_empty()).then_some(exposure)
    }

    /// The pyrometer whose readings hold the hot face. It is no part of the content, which has the temperature of the
    /// face; a case from a builder has none.
    pub fn pyrometer_driver(&self) -> Option<&PyrometerDriver> {
        self.reading_notes.pyrometer_driver.as_ref()
    }

    /// Where a material of the case is from: `materials/felt.toml`, or `built in`; `None` if it was made from values.
    pub fn material_origin(&self, material: &Material) -> Option<&str> {
        let mut own = self.reading_notes.materials.used.iter();
        if let Some((_, path)) = own.find(|(id, _)| *id == material.id) {
            return Some(path);
        }
        let material = Arc::new(material.clone()).without_decomposition();
        let built_in = Material::named(&material.id).ok().map(|found| Arc::new(found).without_decomposition());
        (built_in == Some(material)).then_some("built in")
    }

    /// The files that the case was read from; none if it was built from values.
    pub fn input_files(&self) -> &[InputFile] {
        &self.input_files.files
    }

    /// The names and values that replaced those of the files: the overrides of [`load_with`](Self::load_with).
    pub fn overrides(&self) -> &[(String, String)] {
        &self.input_files.overrides
    }

    /// The case with other estimation settings, which the caller has validated.
    pub(crate) fn with_estimate(self, estimate: EstimationSettings) -> Self {
        Self { estimate, ..self }
    }

    /// The case with one time window for all sensors, s; it replaces the windows of single sensors.
    pub(crate) fn with_window_s(mut self, window_s: (f64, f64)) -> Self {
        self.estimate.window_s = Some(window_s);
        self.observations.iter_mut().for_each(|observation| observation.window_s = None);
        self
    }

    /// The case with another tolerance of the discretisation error, K.
    pub(crate) fn with_tolerance_k(mut self, tolerance_k: f64) -> Self {
        self.resolution.tolerance_k = Some(tolerance_k);
        self
    }

    /// Start and end of the samples of a sensor that count, s: its own window, else the common one, else the exposure.
    pub fn window_s(&self, sensor: usize) -> (f64, f64) {
        let observation = self.observations.iter().find(|observation| observation.sensor == sensor);
        observation.and_then(|observation| observation.window_s).unwrap_or(self.default_window_s())
    }

    fn default_window_s(&self) -> (f64, f64) {
        self.estimate.window_s.unwrap_or((0.0, self.exposure.duration_s))
    }

    /// The observations to which a model is fitted: those of the chosen sensors, or all if none is chosen.
    pub fn fitted_observations(&self) -> impl Iterator<Item = &Observation> {
        let chosen = &self.estimate.sensors;
        self.observations.iter().filter(|observation| chosen.is_empty() || chosen.contains(&observation.sensor))
    }

    /// The interval that spans the windows of all fitted observations, s.
    pub fn fit_window_s(&self) -> (f64, f64) {
        let windows_s = self.fitted_observations().map(|observation| self.window_s(observation.sensor));
        let span_s = windows_s.reduce(|(from_s, to_s), window_s| (from_s.min(window_s.0), to_s.max(window_s.1)));
        span_s.unwrap_or(self.default_window_s())
    }
}
