//! A case flattened into plain data for the march. Planning cannot fail, because a case is valid.
//!
//! Every property becomes a column of a table over temperature with the nodes of the files, so that a look-up is a
//! floor, two comparisons and a linear interpolation; every boundary schedule becomes four rows a step; every scaled
//! quantity refers to a factor column of the ensemble, and unscaled quantities refer to column 0, which is one.

mod consistency;
mod depth_readings;
mod factor_columns;
mod forcing;
mod grid;
mod internals;
pub(crate) mod interpolation;
mod limited_parts;
mod ply_data;
pub(crate) mod pyrometer_readings;
mod step_data;
mod tables;
mod time_grid;
mod time_tolerance;

use crate::case::{Bounds, Case, Conductivity, Emissivity, Face, GasFlowModel, OpenFace, OutOfRange, Property, Table};
use crate::physics::layout::{self, FaceColumns, GasTransport, PlanData, PlanRows, PressureLevel, SensorLocation};
use crate::traces::{Gauge, Peak};
pub use consistency::InconsistentPlan;
pub use depth_readings::ProfileDepth;
use factor_columns::{conductivity_columns, factor_column};
use forcing::Forcing;
pub use grid::GridDensity;
use grid::{Grid, initial_bends};
use interpolation::RecordInterpolation;
use limited_parts::LimitedRow;
use ply_data::{bulk_properties, ply_rows, reaction_paths, reactions, state_properties};
use pyrometer_readings::{PyrometerReading, pyrometer_readings};
use std::sync::Arc;
use step_data::{lag_weights, records_at_steps};
use tables::{Tables, state_count};
pub use tables::{advances_enthalpy, integrates_conductivity};
pub(crate) use time_grid::instants_s;
pub use time_grid::{GRADING_EXPONENT, StepGrowth, TimeGrid, TimeSegment, TimeStepControl};

/// Estimated error of one gauge of the nominal member, and its tolerance: for fronts in m, at 95 % of
/// the instants; for other gauges relative to their peak, at every instant and of the peak.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct GaugeError {
    /// Which gauge.
    pub gauge: Gauge,
    /// The estimated error.
    pub error: f64,
    /// The tolerance of the adaptation.
    pub tolerance: f64,
}

/// Estimated errors of cells, steps and, in f32, rounding. A temperature error is the largest at any sensor and in any
/// part with a temperature limit, at any instant and of any peak, K.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct ErrorEstimate {
    /// The tolerance of the case.
    pub tolerance_k: f64,
    /// Error of the nominal member.
    pub nominal_k: f64,
    /// The bounds of the factors whose corners are marched: those between which the study samples, or else the small
    /// ones.
    pub bounds: Bounds,
    /// The largest error of the members at corners of these bounds that completed on this plan and on the one with
    /// twice the cells and steps; `None` if none did, as without factors.
    pub corners_k: Option<f64>,
    /// Number of corners that were marched.
    pub corners: usize,
    /// Number of marched corners that did not complete.
    pub failed_corners: usize,
    /// Gauges of the nominal member; empty without decomposition and gas flow.
    pub gauges: Vec<GaugeError>,
    /// Contribution of rounding to these errors; `None` in f64.
    pub rounding: Option<RoundingError>,
}

/// Errors by rounding in f32: the largest differences to f64, as in [`ErrorEstimate`].
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct RoundingError {
    /// Error of the nominal member, K.
    pub nominal_k: f64,
    /// Largest error of the members at corners of the factors' small bounds that complete, K; `None` without factors.
    pub corners_k: Option<f64>,
    /// Gauges of the nominal member.
    pub gauges: Vec<GaugeError>,
    /// Error of the residual of the energy balance of the nominal member, relative to the heat moved.
    pub energy_balance: f64,
    /// Error of the residual of the mass balance of the nominal member, relative to the mass moved.
    pub mass_balance: f64,
}

impl ErrorEstimate {
    /// The estimate for a march without gauges and other members.
    pub(crate) fn of_temperature(nominal_k: f64, tolerance_k: f64) -> Self {
        Self {
            tolerance_k,
            nominal_k,
            bounds: Bounds::Small,
            corners_k: None,
            corners: 0,
            failed_corners: 0,
            gauges: Vec::new(),
            rounding: None,
        }
    }

    /// Whether most of an error is that of rounding in f32, which finer cells and steps do not reduce.
    pub(crate) fn is_rounding(&self, error: f64, of: impl Fn(&RoundingError) -> f64) -> bool {
        self.rounding.as_ref().is_some_and(|rounding| of(rounding) >= 0.5 * error)
    }
}

impl RoundingError {
    /// Error of a gauge, in its unit or relative to its peak; zero where it is not recorded.
    pub(crate) fn of_gauge(&self, gauge: Gauge) -> f64 {
        self.gauges.iter().find(|found| found.gauge == gauge).map_or(0.0, |found| found.error)
    }
}

/// Resolution of a plan in space and time.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Discretisation {
    /// Cells of each ply.
    pub grid: GridDensity,
    /// Time steps.
    pub time_steps: TimeStepControl,
}

impl Discretisation {
    /// The discretisation with every cell and every step divided into `times` parts.
    #[must_use]
    pub fn refined(&self, times: usize) -> Self {
        let mut finer = self.clone();
        finer.grid.subdivisions.iter_mut().for_each(|parts| *parts *= times);
        if finer.time_steps.segments.is_empty() {
            finer.time_steps.segments.push(TimeSegment { start_s: 0.0, step_density: 1.0, subdivisions: 1 });
        }
        finer.time_steps.segments.iter_mut().for_each(|segment| segment.subdivisions *= times);
        finer
    }
}

/// All input of a backend.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The resolution in space and time.
    pub(crate) discretisation: Discretisation,
    /// Estimated discretisation error, where an adaptation estimated it.
    pub(crate) error_estimate: Option<ErrorEstimate>,
    /// The plan with half the cells and half the steps, with the same instants; it has no coarser one itself.
    pub(crate) coarse: Option<Box<Self>>,
    /// Times at which the sensors are read, s; the first is zero.
    pub(crate) instants_s: Vec<f64>,
    /// End of each step, s, after a first entry of zero.
    pub(crate) times_s: Vec<f64>,
    /// The curve through the records: readings at the instants, and peaks.
    pub(crate) interpolation: RecordInterpolation,
    /// Sensors on faces whose temperature is prescribed.
    pub(crate) held_readings: Vec<HeldReading>,
    /// Pyrometers that look at the hot face.
    pub(crate) pyrometers: Vec<PyrometerReading>,
    /// One for each temperature limit of the case.
    pub(crate) limits: Vec<LimitedRow>,
    /// Range of temperatures in which each ply's tables that refuse extrapolation are valid, K.
    pub(crate) table_limits_k: Vec<(f64, f64)>,
    /// All that a march reads.
    pub(crate) rows: PlanRows,
    /// The schedules of the exposure, shared by plans of one case.
    forcing: Arc<Forcing>,
}

/// A sensor without lag on a face whose temperature is prescribed.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct HeldReading {
    /// Index of the sensor in the case.
    pub(crate) sensor: usize,
    /// 0: hot face; 1: back face.
    pub(crate) face: usize,
    /// The prescribed temperature at every instant, K, where it differs from the temperature of the face node: the
    /// steps smooth it, or it jumps within a step.
    pub(crate) temperatures_k: Option<Vec<f64>>,
    /// The highest prescribed temperature.
    pub(crate) peak: Peak,
}

impl Plan {
    /// The plan at the resolution that a case specifies, and at half of it.
    pub fn new(case: &Case) -> Self {
        Self::with_discretisation(case, Self::specified(case))
    }

    /// The specified resolution with each cell and each step divided into `cells` and `steps` parts, without a coarser
    /// plan: for convergence studies with exact refinement ratios.
    pub fn with_refinement(case: &Case, cells: usize, steps: usize) -> Self {
        let mut stated = Self::specified(case);
        stated.grid.subdivisions.fill(2 * cells);
        stated.time_steps.segments = vec![TimeSegment { start_s: 0.0, step_density: 1.0, subdivisions: 2 * steps }];
        Self::build(case, &stated, 1, &Tables::new(case), &Arc::new(Forcing::new(case)))
    }

    fn specified(case: &Case) -> Discretisation {
        let density = GridDensity::by_diffusion_time(case, 0.5 * case.resolution.cells as f64);
        Discretisation { grid: density, time_steps: TimeStepControl::scaled(&case.resolution, 2.0) }
    }

    /// The plan of a case at a discretisation with each cell and step halved; its coarse plan is the discretisation
    /// itself.
    pub fn with_discretisation(case: &Case, discretisation: Discretisation) -> Self {
        Self::with_shared_tables(case, discretisation, &Tables::new(case), &Arc::new(Forcing::new(case)))
    }

    /// The time grid of a step rule for this case, each step divided into `subdivisions`.
    pub fn time_grid(&self, case: &Case, control: &TimeStepControl, subdivisions: usize) -> TimeGrid {
        TimeGrid::new(case, &self.forcing, control, subdivisions)
    }

    /// The plan of the same case at another discretisation. Tables and schedules do not depend on it and are shared:
    /// building the tables takes about as long as marching a member, and an adaptation tries a hundred plans.
    pub fn rediscretised(&self, case: &Case, discretisation: Discretisation) -> Self {
        let tables = Tables { values: Arc::clone(&self.rows.data.tables), locations: self.rows.tables.clone() };
        let plan = Self::with_shared_tables(case, discretisation, &tables, &self.forcing);
        if self.rows.has_gauges { plan } else { plan.without_gauges() }
    }

    fn with_shared_tables(
        case: &Case,
        discretisation: Discretisation,
        tables: &Tables,
        forcing: &Arc<Forcing>,
    ) -> Self {
        let [coarse, fine] =
            [1, 2].map(|subdivisions| Self::build(case, &discretisation, subdivisions, tables, forcing));
        Self { coarse: Some(Box::new(coarse)), ..fine }
    }

    fn build(
        case: &Case,
        discretisation: &Discretisation,
        subdivisions: usize,
        tables: &Tables,
        forcing: &Arc<Forcing>,
    ) -> Self {
        let grid = Grid::new(case, &discretisation.grid, subdivisions);
        let time_grid = TimeGrid::new(case, forcing, &discretisation.time_steps, subdivisions);
        let steps = time_grid.times_s.len() - 1;
        let mut conductions: Vec<_> = case.layup.plies.iter().flat_map(|ply| conductivity_columns(case, ply)).collect();
        let mut pores = vec![];
        let pores_of_states = case.layup.plies.iter().flat_map(|ply| tables::pores_of(case, ply));
        for (row, own) in conductions.iter_mut().zip(pores_of_states) {
            row.first_pore = pores.len() as u32;
            pores.extend(own);
            row.end_pore = pores.len() as u32;
        }
        let levels_pa = case.layup.plies.iter().flat_map(|ply| tables::pressure_levels_pa(case, ply));
        let parts = tables::conductivity_parts(case);
        let states = case.layup.plies.iter().map(|ply| state_count(&ply.material)).max().unwrap_or(1);
        let (places, sensors): (Vec<_>, Vec<_>) = grid.sensors.into_iter().unzip();
        let holder_w_m3_k = case.exposure.holder.as_ref().map_or(0.0, |holder| holder.conductance_w_m3_k);
        let duration_s = time_grid.times_s.last().map_or(0.0, |end_s| end_s - time_grid.times_s[0]);
        let has_depth_factors = places.iter().any(|place| place.depth > 0);
        let data = PlanData {
            bulk_properties: case.layup.plies.iter().map(|ply| bulk_properties(&ply.material, holder_w_m3_k)).collect(),
            state_properties: case.layup.plies.iter().flat_map(|ply| state_properties(&ply.material)).collect(),
            pressure_levels: levels_pa.map(|level_pa| PressureLevel { log_pressure: level_pa.ln() }).collect(),
            pore_classes: pores,
            reactions: case.layup.plies.iter().flat_map(|ply| reactions(case, ply, duration_s)).collect(),
            contacts_m2_k_w: case.layup.contacts_w_m2_k.iter().map(|h| h.map_or(0.0, |h| 1.0 / h)).collect(),
            faces: [face(&case.exposure.hot_face), face(&case.exposure.back_face)],
            boundary_forcing: forcing.at_step_ends(&time_grid.times_s),
            step_lengths_s: time_grid.times_s.windows(2).map(|pair| pair[1] - pair[0]).collect(),
            tables: Arc::clone(&tables.values),
            sensors,
            initial_bends: if has_depth_factors { initial_bends(&case.exposure.initial_k) } else { Vec::new() },
            beads: lag_weights(case, &time_grid, places.len()),
            cells: grid.cells,
        };
        let rows = PlanRows {
            record_at_step: records_at_steps(steps, &time_grid.recorded_steps),
            records: time_grid.recorded_steps.len(),
            plies: ply_rows(case, &grid.plies),
            has_steep_conductivities: tables.locations.iter().any(|location| location.conductivity_integral > 0),
            has_enthalpy_steps: tables.locations.iter().any(|location| location.enthalpy_search_span > 0),
            tables: tables.locations.clone(),
            conductivity_columns: conductions,
            face_columns: face_columns(case),
            has_depth_factors,
            sensors: case.sensors.len(),
            sensor_locations: places,
            conductivity_parts: parts,
            max_states: states,
            max_reactions: case.layup.plies.iter().map(|ply| reaction_paths(&ply.material).len()).max().unwrap_or(0),
            reaction_paths: case.layup.plies.iter().flat_map(|ply| reaction_paths(&ply.material)).collect(),
            gas: case.gas.as_ref().map(|flow| gas_transport(flow.model)),
            has_gauges: case.gas.is_some(),
            back_is_open: case.exposure.back_pressure_pa.is_some(),
            exchanging_faces: match &case.exposure.back_face {
                Face::Open(back) if back.is_insulated() => 1,
                _ => 2,
            },
            has_holder: case.exposure.holder.is_some(),
            factors: case.factors.len(),
            data,
        };
        let (times_s, instants_s) = (time_grid.times_s, time_grid.instants_s);
        let held_readings = held_readings(case, &rows.sensor_locations, forcing, &times_s, &instants_s);
        Self {
            discretisation: discretisation.clone(),
            coarse: None,
            error_estimate: None,
            pyrometers: pyrometer_readings(case, &instants_s, &time_grid.interpolation),
            interpolation: time_grid.interpolation,
            limits: limited_parts::limited_rows(case, forcing, &held_readings),
            held_readings,
            table_limits_k: (0..case.layup.plies.len()).map(|ply| table_limits(case, ply)).collect(),
            rows,
            forcing: Arc::clone(forcing),
            instants_s,
            times_s,
        }
    }

    /// The resolution in space and time.
    pub fn discretisation(&self) -> &Discretisation {
        &self.discretisation
    }

    /// Estimated discretisation errors, where an adaptation estimated them.
    pub fn error_estimate(&self) -> Option<&ErrorEstimate> {
        self.error_estimate.as_ref()
    }

    /// The plan with half the cells and half the steps, with the same instants; `None` for a coarse plan.
    pub fn coarse(&self) -> Option<&Self> {
        self.coarse.as_deref()
    }

    /// Times at which the sensors are read, s; the first is zero.
    pub fn instants_s(&self) -> &[f64] {
        &self.instants_s
    }

    /// End of each step, s, after a first entry of zero.
    pub fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// The end of the march, s.
    pub(crate) fn end_s(&self) -> f64 {
        self.times_s[self.times_s.len() - 1]
    }

    /// Steps of a march.
    pub fn steps(&self) -> usize {
        self.rows.steps()
    }

    /// Cells through the thickness.
    pub fn cells(&self) -> usize {
        self.rows.cells()
    }

    /// Readings of a march: sensors, or depths of a plan with depth readings.
    pub fn sensors(&self) -> usize {
        self.rows.sensor_locations.len()
    }

    /// Number of gauges recorded at every instant: all, or none.
    pub fn gauges(&self) -> usize {
        self.rows.gauges()
    }

    /// The same plan without gauges: locating the fronts in every cell at every instant took 7 % of a march
    /// (benches/LOG.md).
    #[must_use]
    pub fn without_gauges(self) -> Self {
        let coarse = self.coarse.map(|coarse| Box::new(coarse.without_gauges()));
        Self { coarse, rows: PlanRows { has_gauges: false, ..self.rows }, ..self }
    }
}

fn held_readings(
    case: &Case,
    places: &[SensorLocation<u32>],
    forcing: &Forcing,
    times_s: &[f64],
    instants_s: &[f64],
) -> Vec<HeldReading> {
    let faces = [(&case.exposure.hot_face, case.layup.origin_m), (&case.exposure.back_face, case.layup.back_m())];
    let close_m = grid::same_depth_m(case);
    let held = faces.into_iter().enumerate().filter(|(_, (face, _))| matches!(face, Face::Held(_)));
    held.flat_map(|(face, (_, depth_m))| {
        let sensors = case.sensors.iter().zip(places).enumerate();
        let here = sensors.filter(move |(_, (sensor, place))| {
            sensor.time_constant_s == 0.0 && place.depth == 0 && (sensor.depth_m - depth_m).abs() <= close_m
        });
        here.map(move |(sensor, _)| HeldReading {
            sensor,
            face,
            temperatures_k: forcing.held_k(face, times_s, instants_s),
            peak: forcing.highest_held(face),
        })
    })
    .collect()
}

fn face_columns(case: &Case) -> [FaceColumns<u32>; 2] {
    let emissivity = |face: &Face, ply: Option<&crate::case::Ply>| match (face, ply) {
        (Face::Open(OpenFace { emissivity: Emissivity::Material, .. }), Some(ply)) => {
            factor_column(case, &ply.name, Property::Emissivity)
        }
        _ => 0,
    };
    let exposure = &case.exposure;
    let heating = factor_column(case, "", Property::Heating);
    let film_heats = matches!(&exposure.hot_face, Face::Open(open) if open.heating_scales_film);
    let loss = factor_column(case, "", Property::BackFaceLoss);
    [
        FaceColumns {
            heating,
            film: if film_heats { heating } else { 0 },
            exchange: 0,
            emissivity: emissivity(&exposure.hot_face, case.layup.plies.first()),
        },
        FaceColumns {
            heating: 0,
            film: loss,
            exchange: loss,
            emissivity: emissivity(&exposure.back_face, case.layup.plies.last()),
        },
    ]
}

fn gas_transport(model: GasFlowModel) -> GasTransport {
    match model {
        GasFlowModel::Instantaneous => GasTransport::Instantaneous,
        GasFlowModel::QuasiSteady => GasTransport::QuasiSteady,
        GasFlowModel::Darcy => GasTransport::Darcy,
    }
}

fn face(face: &Face) -> layout::Face<f64> {
    layout::Face { held: if matches!(face, Face::Held(_)) { 1.0 } else { 0.0 } }
}

/// The range of temperatures in which all tables of a ply and its gas that refuse extrapolation are valid, K.
fn table_limits(case: &Case, ply: usize) -> (f64, f64) {
    let material = &case.layup.plies[ply].material;
    let mut allowed_k = (f64::NEG_INFINITY, f64::INFINITY);
    let mut narrow = |table: &Table| {
        if table.outside == OutOfRange::Error {
            let (low, high) = table.range_k();
            allowed_k = (allowed_k.0.max(low), allowed_k.1.min(high));
        }
    };
    case.gas_tables(ply).into_iter().for_each(|(_, table)| narrow(table));
    let mut each = |heat_capacity, emissivity, conductivity: &Conductivity| {
        narrow(heat_capacity);
        narrow(emissivity);
        if let Conductivity::Tables(tables) = conductivity {
            tables.iter().for_each(|(_, table)| narrow(table));
        }
    };
    each(&material.heat_capacity, &material.emissivity, &material.conductivity);
    for residue in material.decomposition.iter().flat_map(|decomposition| &decomposition.residues) {
        each(&residue.heat_capacity, &residue.emissivity, &residue.conductivity);
    }
    allowed_k
}
