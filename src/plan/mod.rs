//! The bridge: a case flattened for marching. It cannot fail, because a case holds.
//!
//! Variety ends here. Every property becomes a column of a table on one uniform temperature grid, so that a
//! look-up is a floor and a lerp; every face becomes one row of coefficients an instant; every scaled
//! quantity points at a column of the ensemble, and what nobody scales points at column 0, which is one.

mod clock;
mod columns;
mod consistency;
mod forcing;
mod grid;
#[cfg(feature = "internals")]
mod internals;
#[cfg(not(feature = "internals"))]
#[expect(unreachable_pub, reason = "public with the feature `internals`")]
pub(crate) mod layout;
#[cfg(feature = "internals")]
#[expect(missing_docs, reason = "not part of the public interface")]
pub mod layout;
#[cfg(not(feature = "internals"))]
#[expect(unreachable_pub, reason = "public with the feature `internals`")]
mod readout;
#[cfg(feature = "internals")]
pub mod readout;
mod same_instant;
mod steps;
mod substances;
mod tables;

pub use crate::case::GasPath;
use crate::case::air::air_enthalpy_j_kg;
use crate::case::{Case, Conductivity, Emissivity, Face, Material, OpenFace, OutOfRange, Property, Table};
use crate::traces::Gauge;
pub use clock::{Clock, GRADING, Growth, Pace, Slice};
use columns::{column, conductions};
pub use consistency::InconsistentPlan;
use forcing::Forcing;
pub use grid::Density;
use grid::Grid;
use layout::{Conduction, FACE_COLUMNS, Path, Place, Ply, Rows, Scaling, TABLE_NODES};
use readout::Readout;
use std::sync::Arc;
use steps::{beads, instants};
use substances::{bulk, paths, plies, reactions, substances};
use tables::{Tables, states};

/// The estimated discretisation error of one gauge of the nominal member, and its tolerance: of fronts in m, at 95 % of the instants; of
/// the others as a share of their peak, at any instant.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct GaugeError {
    /// Which gauge.
    pub gauge: Gauge,
    /// The estimated error.
    pub error: f64,
    /// The error that adaptation aims for.
    pub tolerance: f64,
}

/// Estimated discretisation errors: of temperatures the largest at any sensor and instant, K.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Reached {
    /// What was asked for.
    pub tolerance_k: f64,
    /// Of the nominal member.
    pub nominal_k: f64,
    /// The largest of members at corners of the factors' small bounds that arrived; none where there are no factors.
    pub corners_k: Option<f64>,
    /// Of the nominal member; none where nothing decomposes and no gas flows.
    pub gauges: Vec<GaugeError>,
}

/// How finely a plan cuts space and time.
#[derive(Clone, Debug, PartialEq)]
pub struct Discretisation {
    /// Cells of each ply.
    pub density: Density,
    /// Steps through time.
    pub pace: Pace,
}

impl Discretisation {
    /// With every cell and every step cut into so many more.
    #[must_use]
    pub fn refined(&self, times: usize) -> Self {
        let mut finer = self.clone();
        finer.density.cuts.iter_mut().for_each(|cuts| *cuts *= times);
        if finer.pace.slices.is_empty() {
            finer.pace.slices.push(Slice { from_s: 0.0, density: 1.0, cuts: 1 });
        }
        finer.pace.slices.iter_mut().for_each(|slice| slice.cuts *= times);
        finer
    }
}

/// All that a backend reads.
#[derive(Clone, Debug)]
pub struct Plan {
    /// What its cells and steps were made of.
    pub(crate) discretisation: Discretisation,
    /// How far its temperatures are off, where a pilot found out.
    pub(crate) reached: Option<Reached>,
    /// The same with half the cells and half the steps, read at the same instants; of that, none.
    pub(crate) coarse: Option<Box<Self>>,
    /// Times at which the sensors are read, s; the first is zero.
    pub(crate) instants_s: Vec<f64>,
    /// End of each step, s, after a first entry of zero.
    pub(crate) times_s: Vec<f64>,
    /// The record that is made at each of `times_s`, or [`NO_INSTANT`](layout::NO_INSTANT).
    pub(crate) instants: Vec<u32>,
    /// Records of every sensor that a march makes.
    pub(crate) records: usize,
    /// What instants are read from; `None` where they are the records.
    pub(crate) readout: Option<Readout>,
    /// Sensors on faces whose temperature is prescribed.
    pub(crate) held_readings: Vec<HeldReading>,
    pub(crate) plies: Vec<Ply<u32>>,
    /// Ply × state.
    pub(crate) conductions: Vec<Conduction<u32>>,
    /// Scaling columns of the hot and of the back face.
    pub(crate) scalings: [Scaling<u32>; 2],
    /// Where each sensor lies.
    pub(crate) places: Vec<Place<u32>>,
    /// Whether the depth of a sensor is scaled; where none is, nothing is spent on it.
    pub(crate) has_depths: bool,
    /// Conductivity columns of a table: one; two, the last of them radiative, where a factor on density makes a ply more
    /// opaque; solid, gas and radiative where a factor tells them apart. Of plies the most; each has its own.
    pub(crate) parts: usize,
    /// Levels of pressure in the tables: one where the pressure never changes.
    pub(crate) levels: usize,
    /// The pressure half-way up the levels, Pa.
    pub(crate) middle_pa: f64,
    /// Most states of a ply, and most reactions.
    pub(crate) states: usize,
    pub(crate) reactions: usize,
    /// Between which states each reaction leads.
    pub(crate) paths: Vec<Path<u32>>,
    /// How gas leaves; `None` where none is made and none flows.
    pub(crate) gas: Option<GasPath>,
    /// Whether gauges are read at every instant, where there is gas: see [`Plan::without_gauges`].
    pub(crate) has_gauges: bool,
    /// Whether the back face lets gas through.
    pub(crate) back_is_open: bool,
    /// Faces that are anything but insulated, from the hot one on: both, or that one alone, and nothing is spent on the back one.
    pub(crate) open_faces: usize,
    /// Whether a holder takes heat sideways; where none does, nothing is spent on it.
    pub(crate) has_holder: bool,
    /// Factors of a member; columns are one more.
    pub(crate) factors: usize,
    /// Where a ply refuses to leave its tables: the range of temperatures it allows, K.
    pub(crate) allowed_k: Vec<(f64, f64)>,
    pub(crate) rows: Rows<f64>,
    /// The schedules of the exposure, which plans of one case share.
    forcing: Arc<Forcing>,
}

/// A sensor without lag on a face whose temperature is prescribed.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct HeldReading {
    /// The place of the sensor in the case.
    pub(crate) sensor: usize,
    /// Hot 0, back 1.
    pub(crate) face: usize,
    /// The prescribed temperature at every instant, K, where steps smooth it; otherwise the node of the face has it.
    pub(crate) temperatures_k: Option<Vec<f64>>,
}

impl Plan {
    /// A case at the cells and steps that it states, and at half of both.
    pub fn new(case: &Case) -> Self {
        Self::cut(case, Self::stated(case))
    }

    /// A case at what it states, each cell and each step cut into so many: what errors of it are in proportion to is known exactly.
    pub fn finer(case: &Case, cells: usize, steps: usize) -> Self {
        let mut stated = Self::stated(case);
        stated.density.cuts.fill(2 * cells);
        stated.pace.slices = vec![Slice { from_s: 0.0, density: 1.0, cuts: 2 * steps }];
        Self::of(case, &stated, 1, &Tables::new(case), &Arc::new(Forcing::new(case)))
    }

    fn stated(case: &Case) -> Discretisation {
        let density = Density::shared(case, 0.5 * case.resolution.cells as f64);
        Discretisation { density, pace: Pace::slowed(&case.resolution, 2.0) }
    }

    /// A case at a discretisation, and with each cell and step cut into two.
    pub fn cut(case: &Case, discretisation: Discretisation) -> Self {
        Self::sharing(case, discretisation, &Tables::new(case), &Arc::new(Forcing::new(case)))
    }

    /// The steps of a pace for the case of this plan, each cut into so many.
    pub fn clock(&self, case: &Case, pace: &Pace, cuts: usize) -> Clock {
        Clock::new(case, &self.forcing, pace, cuts)
    }

    /// The case of this plan at other cells and steps. Tables and schedules depend on neither and are shared: to make the tables takes
    /// about as long as to march a member, and a pilot tries a hundred plans.
    pub fn recut(&self, case: &Case, discretisation: Discretisation) -> Self {
        let places = self.plies.iter().map(|ply| ply.table as usize).collect();
        let tables = Tables { words: Arc::clone(&self.rows.tables), places };
        let plan = Self::sharing(case, discretisation, &tables, &self.forcing);
        if self.has_gauges { plan } else { plan.without_gauges() }
    }

    fn sharing(case: &Case, discretisation: Discretisation, tables: &Tables, forcing: &Arc<Forcing>) -> Self {
        let [coarse, fine] = [1, 2].map(|cuts| Self::of(case, &discretisation, cuts, tables, forcing));
        Self { coarse: Some(Box::new(coarse)), ..fine }
    }

    fn of(case: &Case, discretisation: &Discretisation, cuts: usize, tables: &Tables, forcing: &Arc<Forcing>) -> Self {
        let grid = Grid::new(case, &discretisation.density, cuts);
        let clock = Clock::new(case, forcing, &discretisation.pace, cuts);
        let (instants, records) = match &clock.readout {
            None => (instants(&clock), clock.instants_s.len()),
            Some(_) => ((0..clock.times_s.len() as u32).collect(), clock.times_s.len()),
        };
        let conductions: Vec<_> = case.layup.plies.iter().flat_map(|ply| conductions(case, ply)).collect();
        let parts = tables::parts(case);
        let (levels, middle_pa) = tables::levels(case);
        let states = case.layup.plies.iter().map(|ply| states(&ply.material)).max().unwrap_or(1);
        let (places, sensors): (Vec<_>, Vec<_>) = grid.sensors.into_iter().unzip();
        let holder_w_m3_k = case.exposure.holder.as_ref().map_or(0.0, |holder| holder.conductance_w_m3_k);
        let duration_s = clock.times_s.last().map_or(0.0, |end_s| end_s - clock.times_s[0]);
        let rows = Rows {
            bulks: case.layup.plies.iter().map(|ply| bulk(&ply.material, holder_w_m3_k)).collect(),
            substances: case.layup.plies.iter().flat_map(|ply| substances(&ply.material)).collect(),
            reactions: case.layup.plies.iter().flat_map(|ply| reactions(&ply.material, duration_s)).collect(),
            contacts_m2_k_w: case.layup.contacts_w_m2_k.iter().map(|h| h.map_or(0.0, |h| 1.0 / h)).collect(),
            faces: [face(&case.exposure.hot_face), face(&case.exposure.back_face)],
            drives: forcing.drives(&clock.times_s),
            lengths_s: clock.times_s.windows(2).map(|pair| pair[1] - pair[0]).collect(),
            tables: Arc::clone(&tables.words),
            sensors,
            beads: beads(case, &clock),
            cells: grid.cells,
        };
        Self {
            discretisation: discretisation.clone(),
            coarse: None,
            reached: None,
            instants,
            records,
            readout: clock.readout,
            held_readings: held_readings(case, &places, forcing, &clock.times_s, &clock.instants_s),
            plies: plies(case, &grid.plies, &tables.places, parts),
            conductions,
            scalings: scalings(case),
            has_depths: places.iter().any(|place| place.depth > 0),
            places,
            parts,
            levels,
            middle_pa,
            states,
            reactions: case.layup.plies.iter().map(|ply| paths(&ply.material).len()).max().unwrap_or(0),
            paths: case.layup.plies.iter().flat_map(|ply| paths(&ply.material)).collect(),
            gas: case.gas.as_ref().map(|flow| flow.path),
            has_gauges: case.gas.is_some(),
            back_is_open: case.exposure.back_pressure_pa.is_some(),
            open_faces: match &case.exposure.back_face {
                Face::Open(back) if back.is_insulated() => 1,
                _ => 2,
            },
            has_holder: case.exposure.holder.is_some(),
            factors: case.factors.len(),
            allowed_k: case.layup.plies.iter().map(|ply| allowed(&ply.material)).collect(),
            rows,
            forcing: Arc::clone(forcing),
            instants_s: clock.instants_s,
            times_s: clock.times_s,
        }
    }

    /// What its cells and steps were made of.
    pub fn discretisation(&self) -> &Discretisation {
        &self.discretisation
    }

    /// Estimated discretisation errors, where an adaptation estimated them.
    pub fn reached(&self) -> Option<&Reached> {
        self.reached.as_ref()
    }

    /// The plan with half the cells and half the steps, read at the same instants; none of a plan that is itself such.
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

    /// Steps of a march.
    pub fn steps(&self) -> usize {
        self.rows.lengths_s.len()
    }

    /// Cells through the thickness.
    pub fn cells(&self) -> usize {
        self.rows.cells.len()
    }

    /// Properties of a state in a row of a ply's tables.
    pub fn properties(&self) -> usize {
        tables::properties(self.parts)
    }

    /// Where the faces' table begins.
    pub fn face_table(&self) -> usize {
        self.rows.tables.len() - TABLE_NODES * FACE_COLUMNS
    }

    /// Gauges read at every instant: all, or none.
    pub fn gauges(&self) -> usize {
        if self.has_gauges { layout::GAUGES } else { 0 }
    }

    /// The same for members of which nobody asks for gauges: to find fronts in every cell at every instant took 7 % of a march (benches/LOG.md).
    #[must_use]
    pub fn without_gauges(self) -> Self {
        let coarse = self.coarse.map(|coarse| Box::new(coarse.without_gauges()));
        Self { has_gauges: false, coarse, ..self }
    }
}

fn held_readings(
    case: &Case,
    places: &[Place<u32>],
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
            sensor.lag_s == 0.0 && place.depth == 0 && (sensor.depth_m - depth_m).abs() <= close_m
        });
        here.map(move |(sensor, _)| HeldReading {
            sensor,
            face,
            temperatures_k: forcing.held_k(face, times_s, instants_s),
        })
    })
    .collect()
}

fn scalings(case: &Case) -> [Scaling<u32>; 2] {
    let emissivity = |face: &Face, ply: Option<&crate::case::Ply>| match (face, ply) {
        (Face::Open(OpenFace { emissivity: Emissivity::Material, .. }), Some(ply)) => {
            column(case, &ply.name, Property::Emissivity)
        }
        _ => 0,
    };
    let exposure = &case.exposure;
    let heating = column(case, "", Property::Heating);
    let film_heats = matches!(&exposure.hot_face, Face::Open(open) if open.film_heats);
    let loss = column(case, "", Property::Loss);
    [
        Scaling {
            heating,
            film: if film_heats { heating } else { 0 },
            exchange: 0,
            emissivity: emissivity(&exposure.hot_face, case.layup.plies.first()),
        },
        Scaling {
            heating: 0,
            film: loss,
            exchange: loss,
            emissivity: emissivity(&exposure.back_face, case.layup.plies.last()),
        },
    ]
}

/// Temperature of the cold wall at which probe heat flux is stated, K.
const COLD_WALL_K: f64 = 300.0;

fn face(face: &Face) -> layout::Face<f64> {
    match face {
        Face::Held(_) => layout::Face { film_w_m2_k: 0.0, hot_wall_kg_j: 0.0, blowing: 0.0, held: 1.0 },
        Face::Open(open) => layout::Face {
            film_w_m2_k: open.film_w_m2_k,
            hot_wall_kg_j: open
                .recovery_enthalpy_j_kg
                .map_or(0.0, |recovery| 1.0 / (recovery - air_enthalpy_j_kg(COLD_WALL_K))),
            blowing: 2.0 * open.blowing,
            held: 0.0,
        },
    }
}

/// The temperatures a ply may take: those of every table of its material that refuses to be left.
fn allowed(material: &Material) -> (f64, f64) {
    let mut allowed_k = (f64::NEG_INFINITY, f64::INFINITY);
    let mut narrow = |table: &Table| {
        if table.outside == OutOfRange::Refuse {
            let (low, high) = table.range_k();
            allowed_k = (allowed_k.0.max(low), allowed_k.1.min(high));
        }
    };
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
