//! A problem: a case, and what it should read according to someone else.

use super::{Group, Row};
use crate::case::table::{OutOfRange, Table};
use crate::case::{
    Case, Conductivity, Estimate, Exposure, Face, Layup, Material, Observation, OpenFace, Ply, Pores, Resolution,
    Schedule, Sensor, Side,
    material::{Mark, Provenance},
};
use crate::ensemble::Ensemble;
use crate::march::{March, MarchError};
use crate::plan::Plan;
use crate::traces::Arrival;
use std::sync::Arc;

/// A case with its reference beside it.
pub struct Problem {
    pub group: Group,
    /// Its sensors and instants are those of the points of all checks.
    pub case: Case,
    pub checks: Vec<Check>,
}

/// What a case should read, and how nearly.
pub struct Check {
    pub reference: &'static str,
    pub quantity: &'static str,
    pub points: Vec<Point>,
    pub tolerance: f64,
    pub measure: Measure,
    pub source_of_tolerance: &'static str,
}

/// A temperature at a place and time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Below the hot face.
    pub depth_m: f64,
    pub time_s: f64,
    pub temperature_k: f64,
}

/// What a difference is measured in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measure {
    Kelvin,
    /// A share of what drives the problem, K.
    ShareOf(f64),
}

impl Measure {
    pub fn unit(self) -> String {
        match self {
            Self::Kelvin => "K".to_owned(),
            Self::ShareOf(driving_k) => format!("of {driving_k} K"),
        }
    }

    fn of(self, difference_k: f64) -> f64 {
        match self {
            Self::Kelvin => difference_k,
            Self::ShareOf(driving_k) => difference_k / driving_k,
        }
    }
}

/// What a problem is made of.
pub struct Setting {
    /// Material and thickness (m), from the hot face to the back.
    pub plies: Vec<(Arc<Material>, f64)>,
    pub start_k: f64,
    pub hot_face: Face,
    pub back_face: Face,
    pub cells: usize,
    pub first_step_s: f64,
    pub growth: f64,
}

impl Problem {
    /// The problem lasts until the last point of its checks.
    pub fn new(group: Group, name: &str, setting: Setting, mut checks: Vec<Check>) -> Self {
        let Setting { plies, start_k, hot_face, back_face, cells, first_step_s, growth } = setting;
        let layup = layup(plies);
        for point in checks.iter_mut().flat_map(|check| &mut check.points) {
            point.depth_m = snapped_m(&layup, point.depth_m);
        }
        let points: Vec<Point> = checks.iter().flat_map(|check| check.points.iter().copied()).collect();
        let duration_s = points.iter().fold(0.0, |end_s: f64, point| end_s.max(point.time_s));
        let sensors = sensors(&points);
        let case = Case {
            id: name.to_owned(),
            name: name.to_owned(),
            note: String::new(),
            observations: observations(&sensors, &points),
            layup,
            sensors,
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
            estimate: Estimate::default(),
            resolution: Resolution { cells, first_step_s, growth, largest_step_s: duration_s, every_s: duration_s },
        };
        Self { group, case, checks }
    }

    /// March the case and hold it against every check.
    ///
    /// # Errors
    /// As [`March::march`].
    pub fn rows(&self, march: &mut dyn March) -> Result<Vec<Row>, MarchError> {
        let plan = Plan::new(&self.case);
        let traces = march.march(&plan, &Ensemble::at(0, Vec::new()), 0..1)?;
        let has_arrived = traces.arrivals == [Arrival::Done];
        let read_k = |point: &Point| {
            let sensor = self.case.sensors.iter().position(|sensor| sensor.depth_m == point.depth_m)?;
            instant(&plan, point.time_s).map(|instant| traces.trace(0, sensor)[instant])
        };
        let rows = self.checks.iter().map(|check| {
            let worst_k = check.points.iter().fold(0.0, |worst_k: f64, point| {
                let off_k = read_k(point).map_or(f64::NAN, |read_k| (read_k - point.temperature_k).abs());
                if off_k <= worst_k { worst_k } else { off_k }
            });
            Row {
                group: self.group,
                case: self.case.name.clone(),
                reference: check.reference.to_owned(),
                quantity: check.quantity.to_owned(),
                difference: if has_arrived { check.measure.of(worst_k) } else { f64::INFINITY },
                tolerance: check.tolerance,
                unit: check.measure.unit(),
                source_of_tolerance: check.source_of_tolerance.to_owned(),
            }
        });
        Ok(rows.collect())
    }
}

/// Points of a formula over depths and times.
pub fn points(depths_m: &[f64], times_s: &[f64], temperature_k: impl Fn(f64, f64) -> f64) -> Vec<Point> {
    let at = |&time_s: &f64| {
        let temperature_k = &temperature_k;
        depths_m.iter().map(move |&depth_m| Point { depth_m, time_s, temperature_k: temperature_k(depth_m, time_s) })
    };
    times_s.iter().flat_map(at).collect()
}

/// A substance of the given properties; what a table leaves open is held at its end.
pub fn material(density_kg_m3: f64, heat_capacity: Table, conductivity: Table) -> Arc<Material> {
    let provenance =
        || Provenance { mark: Mark::Read, source: "the reference problem".to_owned(), relative_uncertainty: 0.0 };
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
        pores: Pores::SEALED,
        pores_provenance: None,
        decomposition: None,
    })
}

/// A substance of constant properties: W/m/K and J/m³/K.
pub fn constant(conductivity_w_m_k: f64, capacity_j_m3_k: f64) -> Arc<Material> {
    material(1.0, Table::constant(capacity_j_m3_k), Table::constant(conductivity_w_m_k))
}

/// A table held at its ends.
pub fn clamped(temperatures_k: Vec<f64>, values: Vec<f64>) -> Table {
    Table { temperatures_k, values, outside: OutOfRange::Clamp }
}

/// A face held at one temperature.
pub fn held(temperature_k: f64) -> Face {
    Face::Held(Schedule::constant(temperature_k))
}

pub fn insulated() -> Face {
    Face::Open(OpenFace::insulated())
}

/// A face under a constant flux into the layup.
pub fn heated(flux_w_m2: f64) -> Face {
    Face::Open(OpenFace { flux_w_m2: Schedule::constant(flux_w_m2), ..OpenFace::insulated() })
}

/// A face under a film to a gas.
pub fn convected(film_w_m2_k: f64, gas_k: f64) -> Face {
    Face::Open(OpenFace { film_w_m2_k, gas_k: Schedule::constant(gas_k), ..OpenFace::insulated() })
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

/// A depth, or the interface that it means: sums of thicknesses differ from it in the last digit.
fn snapped_m(layup: &Layup, depth_m: f64) -> f64 {
    let near = |face_m: &f64| (face_m - depth_m).abs() < 1e-9 * layup.back_m();
    layup.faces_m().into_iter().find(near).unwrap_or(depth_m)
}

fn sensors(points: &[Point]) -> Vec<Sensor> {
    let mut depths_m: Vec<f64> = points.iter().map(|point| point.depth_m).collect();
    depths_m.sort_by(f64::total_cmp);
    depths_m.dedup();
    depths_m
        .into_iter()
        .map(|depth_m| Sensor { name: format!("{:.4} mm", 1e3 * depth_m), depth_m, side: Side::Both, lag_s: 0.0 })
        .collect()
}

/// The points as if measured: this makes the march read its sensors when they are due.
fn observations(sensors: &[Sensor], points: &[Point]) -> Vec<Observation> {
    let of = |(sensor, place): (usize, &Sensor)| {
        let mut seen: Vec<&Point> = points.iter().filter(|point| point.depth_m == place.depth_m).collect();
        seen.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        seen.dedup_by_key(|point| point.time_s);
        Observation {
            sensor,
            times_s: seen.iter().map(|point| point.time_s).collect(),
            temperatures_k: seen.iter().map(|point| point.temperature_k).collect(),
            sigma_k: vec![1.0; seen.len()],
        }
    };
    sensors.iter().enumerate().map(of).collect()
}

/// The instant at a time; a clock takes times closer than a billionth of the march for one.
fn instant(plan: &Plan, time_s: f64) -> Option<usize> {
    let close_s = 2e-9 * plan.instants_s.last().copied().unwrap_or_default();
    plan.instants_s.iter().position(|instant_s| (instant_s - time_s).abs() <= close_s)
}
