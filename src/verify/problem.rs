//! A problem: a case with its reference values.

use super::{Group, VerificationRow};
use crate::adapt::adapt;
use crate::case::{
    Case, Conductivity, EstimationSettings, Exposure, Face, Gas, GasFlow, GasFlowModel, Layup, Material, Observation,
    OpenFace, OutOfRange, Ply, Pores, Provenance, Resolution, Schedule, Sensor, Side, SourceKind, Table,
};
use crate::ensemble::Ensemble;
use crate::march::richardson::march_extrapolated;
use crate::march::{March, MarchError};
use crate::plan::Plan;
use crate::traces::{Gauge, MemberStatus};
use std::sync::Arc;

/// A case with its reference values.
pub struct Problem {
    /// The kind of evidence.
    pub group: Group,
    /// The case; its sensors and instants are those of the reference points.
    pub case: Case,
    /// The comparisons.
    pub checks: Vec<Check>,
}

/// Reference values and their tolerance.
pub struct Check {
    /// Source of the expected values.
    pub reference: &'static str,
    /// The quantity compared.
    pub quantity: &'static str,
    /// Reference points.
    pub points: Vec<ReferencePoint>,
    /// Largest difference that passes, in the unit of the measure.
    pub tolerance: f64,
    /// Scaling of the differences.
    pub measure: ErrorScale,
    /// Reason for the size of the tolerance.
    pub source_of_tolerance: &'static str,
}

/// A reference value of an observable at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferencePoint {
    /// Temperature at a depth, or gauge.
    pub observable: Observable,
    /// Time, s.
    pub time_s: f64,
    /// Expected value: K at a depth, the gauge's own unit for a gauge.
    pub value: f64,
}

impl ReferencePoint {
    /// A temperature at a depth.
    pub fn at(depth_m: f64, time_s: f64, temperature_k: f64) -> Self {
        Self { observable: Observable::Depth(depth_m), time_s, value: temperature_k }
    }
}

/// An observable of a march.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Observable {
    /// Temperature at a depth below the hot face, m.
    Depth(f64),
    /// A gauge of the whole member.
    Gauge(Gauge),
}

impl Observable {
    fn unit(self) -> &'static str {
        match self {
            Self::Depth(_) => "K",
            Self::Gauge(gauge) => gauge.unit(),
        }
    }
}

/// Scaling of a difference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ErrorScale {
    /// Absolute, in the unit of the observable.
    Absolute,
    /// Relative to a driving value, in the unit of the observable.
    RelativeTo(f64),
    /// Relative to each reference value, for values far from zero.
    Relative,
}

impl ErrorScale {
    fn unit(self, place: Observable) -> String {
        match self {
            Self::Absolute => place.unit().to_owned(),
            Self::RelativeTo(driving) => format!("of {driving} {}", place.unit()),
            Self::Relative => "of the reference".to_owned(),
        }
    }

    fn error(self, read: f64, expected: f64) -> f64 {
        let off = (read - expected).abs();
        match self {
            Self::Absolute => off,
            Self::RelativeTo(driving) => off / driving,
            Self::Relative => off / expected.abs(),
        }
    }
}

/// Layup, faces and resolution of a problem.
pub struct ProblemSetup {
    /// Material and thickness (m), from the hot face to the back.
    pub plies: Vec<(Arc<Material>, f64)>,
    /// Uniform initial temperature, K.
    pub start_k: f64,
    /// The exposed face.
    pub hot_face: Face,
    /// The back face.
    pub back_face: Face,
    /// Cells through the thickness.
    pub cells: usize,
    /// First step after a corner of a schedule, s.
    pub first_step_s: f64,
    /// Largest step as a share of the time since the last corner.
    pub step_growth: f64,
}

impl Problem {
    /// A problem that ends at the last of its reference points.
    pub fn new(group: Group, name: &str, setting: ProblemSetup, mut checks: Vec<Check>) -> Self {
        let ProblemSetup { plies, start_k, hot_face, back_face, cells, first_step_s, step_growth } = setting;
        let layup = layup(plies);
        for point in checks.iter_mut().flat_map(|check| &mut check.points) {
            if let Observable::Depth(depth_m) = &mut point.observable {
                *depth_m = snap_to_interface_m(&layup, *depth_m);
            }
        }
        let points: Vec<ReferencePoint> = checks.iter().flat_map(|check| check.points.iter().copied()).collect();
        let duration_s = points.iter().fold(0.0, |end_s: f64, point| end_s.max(point.time_s));
        let sensors = sensors(&points);
        let case = Case {
            input_files: Default::default(),
            id: name.to_owned(),
            name: name.to_owned(),
            note: String::new(),
            observations: vec![placeholder_observations(&points, start_k)],
            layup,
            sensors,
            limits: Vec::new(),
            gas: None,
            exposure: Exposure {
                duration_s,
                initial_k: vec![(0.0, start_k)],
                pressure_pa: Schedule::constant(101_325.0),
                back_pressure_pa: None,
                holder: None,
                hot_face,
                back_face,
            },
            factors: Vec::new(),
            correlation: Default::default(),
            estimate: EstimationSettings::default(),
            reading_notes: Default::default(),
            resolution: Resolution {
                tolerance_k: None,
                cells,
                first_step_s,
                step_growth,
                max_step_s: duration_s,
                output_interval_s: duration_s,
            },
        };
        Self { group, case, checks }
    }

    /// The problem with gas flow.
    pub fn with_gas_flow(mut self, path: GasFlowModel, gas: Arc<Gas>) -> Self {
        self.case.gas = Some(GasFlow { model: path, gas });
        self
    }

    /// The problem with a given number of cells and step growth, without adaptation.
    pub fn with_cells(mut self, cells: usize, step_growth: f64) -> Self {
        self.case.resolution = Resolution { tolerance_k: None, cells, step_growth, ..self.case.resolution };
        self
    }

    /// The problem with equal steps.
    pub fn with_equal_steps(mut self, step_s: f64) -> Self {
        self.case.resolution =
            Resolution { first_step_s: step_s, step_growth: 1.0, max_step_s: step_s, ..self.case.resolution };
        self
    }

    /// March the case and compare it with every check.
    ///
    /// # Errors
    /// As [`March::march`].
    pub fn rows(&self, march: &mut dyn March) -> Result<Vec<VerificationRow>, MarchError> {
        let plan = adapt(&self.case)?;
        let ensemble = Ensemble::from_values(0, Vec::new());
        // A problem without a tolerance tests the scheme at given cells and steps; with one, the adapted march.
        let traces = match plan.error_estimate {
            None => march.march(&plan, &ensemble, 0..1)?,
            Some(_) => march_extrapolated(march, &plan, &ensemble, 0..1)?,
        };
        let has_arrived = traces.statuses == [MemberStatus::Completed];
        let read = |point: &ReferencePoint| {
            let instant = instant_index(&plan, point.time_s)?;
            let readings = match point.observable {
                Observable::Gauge(gauge) => traces.gauge(0, gauge)?,
                Observable::Depth(depth_m) => {
                    let sensor = self.case.sensors.iter().position(|sensor| sensor.depth_m == depth_m)?;
                    traces.trace(0, sensor)
                }
            };
            Some(readings[instant])
        };
        let rows = self.checks.iter().map(|check| {
            let worst = check.points.iter().fold(0.0, |worst: f64, point| {
                let off = check.measure.error(read(point).unwrap_or(f64::NAN), point.value);
                // `max` would drop a NaN at the next point.
                if off.is_nan() { f64::INFINITY } else { worst.max(off) }
            });
            VerificationRow {
                group: self.group,
                case: self.case.name.clone(),
                reference: check.reference.to_owned(),
                quantity: check.quantity.to_owned(),
                difference: if has_arrived { worst } else { f64::INFINITY },
                tolerance: check.tolerance,
                unit: check.points.first().map_or_else(String::new, |point| check.measure.unit(point.observable)),
                source_of_tolerance: check.source_of_tolerance.to_owned(),
            }
        });
        Ok(rows.collect())
    }
}

/// Points of a formula of depth and time.
pub fn points(depths_m: &[f64], times_s: &[f64], temperature_k: impl Fn(f64, f64) -> f64) -> Vec<ReferencePoint> {
    let at = |&time_s: &f64| {
        let value = &temperature_k;
        depths_m.iter().map(move |&depth_m| ReferencePoint::at(depth_m, time_s, value(depth_m, time_s)))
    };
    times_s.iter().flat_map(at).collect()
}

/// The same depths and times, with temperatures of a formula.
pub fn with_temperatures(points: &[ReferencePoint], temperature_k: impl Fn(f64, f64) -> f64) -> Vec<ReferencePoint> {
    let of = |point: &ReferencePoint| match point.observable {
        Observable::Depth(depth_m) => ReferencePoint::at(depth_m, point.time_s, temperature_k(depth_m, point.time_s)),
        Observable::Gauge(_) => *point,
    };
    points.iter().map(of).collect()
}

/// Points of a gauge from a formula of time.
pub fn gauge_points(gauge: Gauge, times_s: &[f64], value: impl Fn(f64) -> f64) -> Vec<ReferencePoint> {
    times_s
        .iter()
        .map(|&time_s| ReferencePoint { observable: Observable::Gauge(gauge), time_s, value: value(time_s) })
        .collect()
}

/// A material; tables are constant beyond their ends.
pub fn material(density_kg_m3: f64, heat_capacity: Table, conductivity: Table) -> Arc<Material> {
    Arc::new(Material {
        id: "reference".to_owned(),
        name: "reference".to_owned(),
        note: String::new(),
        density_kg_m3,
        density_provenance: provenance(),
        heat_capacity,
        heat_capacity_provenance: provenance(),
        conductivity: Conductivity::Tables(vec![(101_325.0, conductivity)]),
        conductivity_provenance: provenance(),
        emissivity: Table::constant(0.0),
        emissivity_provenance: provenance(),
        pores: Pores::IMPERMEABLE,
        pores_provenance: None,
        decomposition: None,
    })
}

/// Provenance of the properties of a problem.
pub(super) fn provenance() -> Provenance {
    Provenance {
        source_kind: SourceKind::ReadInSource,
        source: "the reference problem".to_owned(),
        relative_uncertainty: Some(0.0),
    }
}

/// A material of constant conductivity (W/m/K) and volumetric heat capacity (J/m³/K).
pub fn constant_properties(conductivity_w_m_k: f64, capacity_j_m3_k: f64) -> Arc<Material> {
    material(1.0, Table::constant(capacity_j_m3_k), Table::constant(conductivity_w_m_k))
}

/// A table that is constant beyond its ends.
pub fn clamped_table(temperatures_k: Vec<f64>, values: Vec<f64>) -> Table {
    Table { temperatures_k, values, outside: OutOfRange::Clamp }
}

/// A face held at one temperature.
pub fn held_face(temperature_k: f64) -> Face {
    Face::Held(Schedule::constant(temperature_k))
}

/// An adiabatic, impermeable face.
pub fn insulated_face() -> Face {
    Face::Open(OpenFace::insulated())
}

/// A face under a constant flux into the layup.
pub fn heated_face(flux_w_m2: f64) -> Face {
    Face::Open(OpenFace { flux_w_m2: Schedule::constant(flux_w_m2), ..OpenFace::insulated() })
}

/// A face with convection to a gas.
pub fn convective_face(film_w_m2_k: f64, gas_k: f64) -> Face {
    Face::Open(OpenFace {
        film_w_m2_k: Schedule::constant(film_w_m2_k),
        gas_k: Schedule::constant(gas_k),
        ..OpenFace::insulated()
    })
}

fn layup(plies: Vec<(Arc<Material>, f64)>) -> Layup {
    let contacts_w_m2_k = vec![None; plies.len() - 1];
    let ply = |(index, (material, thickness_m)): (usize, (Arc<Material>, f64))| Ply {
        name: format!("ply {}", index + 1),
        group: String::new(),
        material,
        thickness_m,
    };
    Layup { plies: plies.into_iter().enumerate().map(ply).collect(), contacts_w_m2_k, origin_m: 0.0 }
}

/// The interface at this depth up to rounding, else the depth itself.
fn snap_to_interface_m(layup: &Layup, depth_m: f64) -> f64 {
    let near = |face_m: &f64| (face_m - depth_m).abs() < 1e-9 * layup.back_m();
    layup.faces_m().into_iter().find(near).unwrap_or(depth_m)
}

/// A sensor at each depth of the points; at least one, which carries their times.
fn sensors(points: &[ReferencePoint]) -> Vec<Sensor> {
    let depth_m = |point: &ReferencePoint| match point.observable {
        Observable::Depth(depth_m) => Some(depth_m),
        Observable::Gauge(_) => None,
    };
    let mut depths_m: Vec<f64> = points.iter().filter_map(depth_m).collect();
    depths_m.sort_by(f64::total_cmp);
    depths_m.dedup();
    if depths_m.is_empty() {
        depths_m.push(0.0);
    }
    depths_m
        .into_iter()
        .map(|depth_m| Sensor {
            name: format!("{:.4} mm", 1e3 * depth_m),
            depth_m,
            side: Side::Both,
            time_constant_s: 0.0,
            pyrometer: None,
        })
        .collect()
}

/// Placeholder observations at the times of the points: the march then has an instant at each of them.
fn placeholder_observations(points: &[ReferencePoint], start_k: f64) -> Observation {
    let mut times_s: Vec<f64> = points.iter().map(|point| point.time_s).collect();
    times_s.sort_by(f64::total_cmp);
    times_s.dedup();
    let count = times_s.len();
    Observation { sensor: 0, times_s, temperatures_k: vec![start_k; count], sigma_k: vec![1.0; count], window_s: None }
}

/// The index of the instant at a time. Times closer than 1e-9 of the duration are one instant.
fn instant_index(plan: &Plan, time_s: f64) -> Option<usize> {
    let close_s = 2e-9 * plan.instants_s.last().copied().unwrap_or_default();
    plan.instants_s.iter().position(|instant_s| (instant_s - time_s).abs() <= close_s)
}
