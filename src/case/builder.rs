//! Construction of a [`Case`] from values, with validation.

use super::error::{CaseError, Diagnostics};
use super::exposure::{Exposure, Face};
use super::factor::{Correlation, Factor};
use super::factor_targets::FactorTargets;
use super::gas::{BACK_PRESSURE_NEEDS_DARCY, BLOWING_NEEDS_GAS, GasFlow, GasFlowModel};
use super::input_files::InputFiles;
use super::layup::{Layup, Ply, Sensor};
use super::observation::Observation;
use super::pyrometer::Pyrometer;
use super::reading_notes::ReadingNotes;
use super::resolution::Resolution;
use super::temperature_limit::TemperatureLimit;
use super::validation::{FieldPath, UniqueNames};
use super::{Case, EstimationSettings};
use crate::limits::{FACTORS, SENSORS, TEMPERATURES};

/// The content of a case, not yet validated: [`build`](Self::build) does that.
///
/// ```
/// use bondline::case::{CaseBuilder, Exposure, Face, Layup, Material, OpenFace, Ply, Schedule, Sensor, Side};
/// use std::sync::Arc;
///
/// let felt = Ply {
///     name: "FELT".to_owned(),
///     group: "FELT".to_owned(),
///     material: Arc::new(Material::named("saffil_96")?),
///     thickness_m: 0.01,
/// };
/// let layup = Layup { plies: vec![felt], contacts_w_m2_k: Vec::new(), origin_m: 0.0 };
/// let exposure = Exposure {
///     duration_s: 60.0,
///     initial_k: vec![(0.0, 300.0)],
///     pressure_pa: Schedule::constant(101_325.0),
///     back_pressure_pa: None,
///     holder: None,
///     hot_face: Face::Held(Schedule::new(vec![0.0, 10.0], vec![300.0, 1200.0])?),
///     back_face: Face::Open(OpenFace::insulated()),
/// };
/// let mut builder = CaseBuilder::new("felt", layup, exposure);
/// let (side, time_constant_s, pyrometer) = (Side::Both, 0.0, None);
/// builder.sensors.push(Sensor { name: "BACK".to_owned(), depth_m: 0.02, side, time_constant_s, pyrometer });
/// let error = builder.clone().build().expect_err("the sensor lies outside the layup");
/// assert_eq!(
///     error.to_string(),
///     "sensors[0].depth_m: depth 20 mm lies outside the layup, from 0 mm to 10 mm\n1 error"
/// );
/// builder.sensors[0].depth_m = 0.01;
/// assert_eq!(builder.build()?.sensors().len(), 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CaseBuilder {
    /// As [`Case::id`].
    pub id: String,
    /// As [`Case::name`].
    pub name: String,
    /// As [`Case::note`].
    pub note: String,
    /// As [`Case::layup`].
    pub layup: Layup,
    /// As [`Case::sensors`].
    pub sensors: Vec<Sensor>,
    /// As [`Case::limits`].
    pub limits: Vec<TemperatureLimit>,
    /// As [`Case::exposure`].
    pub exposure: Exposure,
    /// As [`Case::gas`].
    pub gas: Option<GasFlow>,
    /// As [`Case::factors`].
    pub factors: Vec<Factor>,
    /// As [`Case::correlation`].
    pub correlation: Correlation,
    /// As [`Case::observations`].
    pub observations: Vec<Observation>,
    /// As [`Case::estimate`].
    pub estimate: EstimationSettings,
    /// As [`Case::resolution`].
    pub resolution: Resolution,
}

impl CaseBuilder {
    /// A layup and its exposure at the default resolution; the id is also the name. Add at least one sensor before
    /// [`build`](Self::build).
    pub fn new(id: impl Into<String>, layup: Layup, exposure: Exposure) -> Self {
        let (id, resolution) = (id.into(), Resolution::for_run(layup.plies.len(), exposure.duration_s));
        Self {
            name: id.clone(),
            id,
            note: String::new(),
            layup,
            sensors: Vec::new(),
            limits: Vec::new(),
            exposure,
            gas: None,
            factors: Vec::new(),
            correlation: Correlation::default(),
            observations: Vec::new(),
            estimate: EstimationSettings::default(),
            resolution,
        }
    }

    /// The validated case. A sensor close to a ply face is moved onto it: see
    /// [`Sensor::depth_m`](super::Sensor::depth_m).
    ///
    /// # Errors
    /// All errors of the content, each with the path of its field: `layup.plies[2].thickness_m`.
    pub fn build(mut self) -> Result<Case, CaseError> {
        let diagnostics = Diagnostics::default();
        self.check(&FieldPath::root(&diagnostics));
        diagnostics.into_result(Ok(()))?;
        for sensor in &mut self.sensors {
            sensor.depth_m = self.layup.snap_to_face_m(sensor.depth_m);
        }
        let Self {
            id,
            name,
            note,
            layup,
            sensors,
            limits,
            exposure,
            gas,
            factors,
            correlation,
            observations,
            estimate,
            resolution,
        } = self;
        Ok(Case {
            id,
            name,
            note,
            layup,
            sensors,
            limits,
            exposure,
            gas,
            factors,
            correlation,
            observations,
            estimate,
            resolution,
            reading_notes: ReadingNotes::default(),
            input_files: InputFiles::default(),
        })
    }

    fn check(&self, case: &FieldPath<'_>) {
        case.name("id", &self.id);
        case.one_line("name", &self.name);
        let has_depths = self.layup.check(&case.child("layup"));
        self.exposure.check(&case.child("exposure"));
        let layup = has_depths.then_some(&self.layup);
        self.check_sensors(&case.child("sensors"), layup);
        self.check_limits(&case.child("limits"));
        if has_depths {
            self.check_gas(case);
        }
        case.child("factors").require(FACTORS.check(self.factors.len() as f64));
        for (at, factor) in case.child("factors").elements(&self.factors) {
            factor.check(&at);
        }
        if has_depths {
            let scope = FactorTargets {
                layup: &self.layup,
                hot_face: &self.exposure.hot_face,
                back_face: &self.exposure.back_face,
                gas_path: self.gas.as_ref().map(|gas| gas.model),
                has_holder: self.exposure.holder.is_some(),
                sensors: &self.sensors,
            };
            scope.check(&case.child("factors"), &self.factors);
        }
        self.correlation.check(&case.child("correlation"), self.factors.len());
        let duration_s = self.exposure.duration_s;
        self.check_observations(&case.child("observations"), duration_s);
        self.estimate.check(&case.child("estimate"), &self.factors, self.sensors.len(), duration_s);
        let resolution = case.child("resolution");
        if self.resolution.check(&resolution, self.layup.plies.len(), duration_s) {
            let instants = self.instants();
            resolution.require(TEMPERATURES.check((self.sensors.len() * instants) as f64));
            resolution.require(self.resolution.check_work(self.corners_s(), instants, duration_s));
        }
    }

    /// Upper bound of the number of instants: the output instants, and the times of the observations.
    fn instants(&self) -> usize {
        let mut observed_s: Vec<f64> = self.observations.iter().flat_map(|seen| seen.times_s.iter().copied()).collect();
        observed_s.sort_by(f64::total_cmp);
        observed_s.dedup();
        (self.exposure.duration_s / self.resolution.output_interval_s) as usize + 2 + observed_s.len()
    }

    /// The times of all schedules, s.
    fn corners_s(&self) -> Vec<f64> {
        self.exposure.schedules().flat_map(|schedule| schedule.times_s.iter().copied()).collect()
    }

    fn check_sensors(&self, at: &FieldPath<'_>, layup: Option<&Layup>) {
        if self.sensors.is_empty() {
            at.error("no sensor: expected at least one");
        }
        at.require(SENSORS.check(self.sensors.len() as f64));
        let mut names = UniqueNames::new("sensor");
        for (at, sensor) in at.elements(&self.sensors) {
            sensor.check(&at, layup);
            at.child("name").require(names.insert(&sensor.name));
            if let (Some(_), Some(ply)) = (sensor.pyrometer, self.layup.plies.first()) {
                at.child("pyrometer").require(Pyrometer::check_face(&self.exposure.hot_face, &ply.name, &ply.material));
            }
        }
    }

    fn check_limits(&self, at: &FieldPath<'_>) {
        for (index, (at, limit)) in at.elements(&self.limits).enumerate() {
            limit.check(&at, self.layup.plies.len(), self.sensors.len());
            if self.limits[..index].iter().any(|other| other.part == limit.part) {
                at.child("part").error(format!("second limit of a {}: expected one", limit.part.kind()));
            }
        }
    }

    /// Consistency of gas, layup and faces.
    fn check_gas(&self, case: &FieldPath<'_>) {
        let (exposure, at) = (&self.exposure, case.child("gas"));
        match &self.gas {
            Some(gas) => gas.check(&at, &self.layup, exposure.back_pressure_pa.is_some()),
            None if self.layup.plies.iter().any(Ply::decomposes) => {
                at.error("a ply decomposes: expected a gas flow model");
            }
            None => {}
        }
        if exposure.back_pressure_pa.is_some() && self.gas.as_ref().is_none_or(|gas| gas.model != GasFlowModel::Darcy) {
            case.child("exposure.back_pressure_pa").error(BACK_PRESSURE_NEEDS_DARCY);
        }
        let is_blown = matches!(&exposure.hot_face, Face::Open(open) if open.is_blown());
        if is_blown && self.gas.is_none() {
            case.child("exposure.hot_face.blowing").error(BLOWING_NEEDS_GAS);
        }
    }

    fn check_observations(&self, at: &FieldPath<'_>, duration_s: f64) {
        let sensors: Vec<&str> = self.sensors.iter().map(|sensor| sensor.name.as_str()).collect();
        for (index, (at, observation)) in at.elements(&self.observations).enumerate() {
            observation.check(&at, &sensors, duration_s);
            let sensor = observation.sensor;
            if self.observations[..index].iter().any(|other| other.sensor == sensor) {
                at.child("sensor").error(format!("duplicate observation of sensor {sensor}: expected one per sensor"));
            }
        }
    }
}

impl Case {
    /// A builder with the content of this case, which forgets the files that it was read from.
    pub fn to_builder(&self) -> CaseBuilder {
        let Self {
            id,
            name,
            note,
            layup,
            sensors,
            limits,
            exposure,
            gas,
            factors,
            correlation,
            observations,
            estimate,
            resolution,
            reading_notes: _,
            input_files: _,
        } = self.clone();
        CaseBuilder {
            id,
            name,
            note,
            layup,
            sensors,
            limits,
            exposure,
            gas,
            factors,
            correlation,
            observations,
            estimate,
            resolution,
        }
    }
}
