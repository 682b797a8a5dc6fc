//! The bridge: a case flattened for marching. It cannot fail, because a case holds.
//!
//! Variety ends here. Every property becomes a column of a table on one uniform temperature grid, so that a
//! look-up is a floor and a lerp; every face becomes one row of coefficients an instant; every scaled
//! quantity points at a column of the ensemble, and what nobody scales points at column 0, which is one.

pub mod clock;
pub mod grid;
pub mod layout;

use crate::case::air::air_enthalpy_j_kg;
use crate::case::{Case, Conductivity, Emissivity, Face, Holder, Material, OpenFace, OutOfRange, Property, Schedule};
use clock::Clock;
use grid::Grid;
use layout::{
    Bead, Bulk, Cell, Drive, FACE_COLUMNS, NO_INSTANT, Place, Ply, Scaling, Sensor, TABLE_NODES, TABLE_START_K,
    TABLE_STEP_K,
};

/// All that a backend reads.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Times at which the sensors are read, s; the first is zero.
    pub instants_s: Vec<f64>,
    /// End of each step, s, after a first entry of zero.
    pub times_s: Vec<f64>,
    /// The instant at each of `times_s`, or [`NO_INSTANT`].
    pub instants: Vec<u32>,
    pub plies: Vec<Ply<u32>>,
    /// Scaling columns of the hot and of the back face.
    pub scalings: [Scaling<u32>; 2],
    /// Where each sensor lies.
    pub places: Vec<Place<u32>>,
    /// Whether the depth of a sensor is scaled; where none is, nothing is spent on it.
    pub has_depths: bool,
    /// Conductivity columns of a table: one; two, the last of them radiative, where a factor on density makes a ply more
    /// opaque; solid, gas and radiative where a factor tells them apart.
    pub parts: usize,
    /// Whether a holder takes heat sideways; where none does, nothing is spent on it.
    pub has_holder: bool,
    /// Factors of a member; columns are one more.
    pub factors: usize,
    /// Where a ply refuses to leave its tables: the range of temperatures it allows, K.
    pub allowed_k: Vec<(f64, f64)>,
    pub rows: Rows<f64>,
}

/// The real-valued rows of a plan, in the scalar of a march.
#[derive(Clone, Debug)]
pub struct Rows<S> {
    pub cells: Vec<Cell<S>>,
    pub bulks: Vec<Bulk<S>>,
    /// Contact resistance of each interface, m²K/W.
    pub contacts_m2_k_w: Vec<S>,
    /// Hot, back.
    pub faces: [layout::Face<S>; 2],
    /// Four a step: hot at the start, hot at the end, back at the start, back at the end; and four for the
    /// end of the march.
    pub drives: Vec<Drive<S>>,
    pub lengths_s: Vec<S>,
    /// Ply × node × (conductivity columns, their slopes, heat capacity, enthalpy), SI; then node ×
    /// [`FACE_COLUMNS`].
    pub tables: Vec<S>,
    pub sensors: Vec<Sensor<S>>,
    /// Step × sensor.
    pub beads: Vec<Bead<S>>,
}

impl<S: Copy> Rows<S> {
    /// The same rows in another scalar.
    pub fn map<T>(&self, each: impl Fn(S) -> T + Copy) -> Rows<T> {
        Rows {
            cells: self.cells.iter().map(|row| row.map(each)).collect(),
            bulks: self.bulks.iter().map(|row| row.map(each)).collect(),
            contacts_m2_k_w: self.contacts_m2_k_w.iter().map(|&x| each(x)).collect(),
            faces: [self.faces[0].map(each), self.faces[1].map(each)],
            drives: self.drives.iter().map(|row| row.map(each)).collect(),
            lengths_s: self.lengths_s.iter().map(|&x| each(x)).collect(),
            tables: self.tables.iter().map(|&x| each(x)).collect(),
            sensors: self.sensors.iter().map(|row| row.map(each)).collect(),
            beads: self.beads.iter().map(|row| row.map(each)).collect(),
        }
    }
}

impl Plan {
    pub fn new(case: &Case) -> Self {
        let grid = Grid::new(case);
        let clock = Clock::new(case);
        let parts = parts(case);
        let (places, sensors): (Vec<_>, Vec<_>) = grid.sensors.into_iter().unzip();
        let rows = Rows {
            bulks: bulks(case),
            contacts_m2_k_w: case.layup.contacts_w_m2_k.iter().map(|h| h.map_or(0.0, |h| 1.0 / h)).collect(),
            faces: [face(&case.exposure.hot_face), face(&case.exposure.back_face)],
            drives: drives(case, &clock),
            lengths_s: clock.times_s.windows(2).map(|pair| pair[1] - pair[0]).collect(),
            tables: {
                let plies = case.layup.plies.iter().flat_map(|ply| table(&ply.material, case, parts));
                plies.chain(face_table(case)).collect()
            },
            sensors,
            beads: beads(case, &clock),
            cells: grid.cells,
        };
        Self {
            instants: instants(&clock),
            plies: plies(case, &grid.plies, parts),
            scalings: scalings(case),
            has_depths: places.iter().any(|place| place.depth > 0),
            places,
            parts,
            has_holder: case.exposure.holder.is_some(),
            factors: case.factors.len(),
            allowed_k: case.layup.plies.iter().map(|ply| allowed(&ply.material)).collect(),
            rows,
            instants_s: clock.instants_s,
            times_s: clock.times_s,
        }
    }

    pub fn steps(&self) -> usize {
        self.rows.lengths_s.len()
    }

    pub fn cells(&self) -> usize {
        self.rows.cells.len()
    }

    /// Columns of a ply's table.
    pub fn table_columns(&self) -> usize {
        2 * self.parts + 2
    }

    /// Where the faces' table begins.
    pub fn face_table(&self) -> usize {
        self.plies.len() * TABLE_NODES * self.table_columns()
    }
}

/// The instant at the start of each step and at the end of the last.
fn instants(clock: &Clock) -> Vec<u32> {
    let mut next = 0;
    clock
        .times_s
        .iter()
        .map(|&time_s| {
            if clock.instants_s.get(next).is_some_and(|&instant_s| instant_s <= time_s) {
                next += 1;
                next as u32 - 1
            } else {
                NO_INSTANT
            }
        })
        .collect()
}

fn parts(case: &Case) -> usize {
    let is_part = |property| {
        matches!(property, Property::ConductivitySolid | Property::ConductivityGas | Property::ConductivityRadiative)
    };
    if case.factors.iter().any(|factor| is_part(factor.property)) {
        3
    } else if case.layup.plies.iter().any(|ply| extinction(case, ply) > 0) {
        2
    } else {
        1
    }
}

/// The column of the factor on the density of a ply, where extinction follows that.
fn extinction(case: &Case, ply: &crate::case::Ply) -> u32 {
    let follows = ply.material.conductivity.extinction_follows_density();
    if follows { column(case, &ply.name, Property::Density) } else { 0 }
}

/// The ensemble column of the factor on a property of a ply (by its group or name, or of all plies), 0 where there is none.
fn column(case: &Case, ply: &str, property: Property) -> u32 {
    let group = case.layup.plies.iter().find(|p| p.name == ply).map_or("", |p| p.group.as_str());
    case.factors
        .iter()
        .position(|factor| {
            let holds = ply.is_empty() || factor.group.is_empty() || factor.group == group || factor.group == ply;
            factor.property == property && holds
        })
        .map_or(0, |factor| factor as u32 + 1)
}

fn plies(case: &Case, cells: &[(usize, usize)], parts: usize) -> Vec<Ply<u32>> {
    let rows = case.layup.plies.iter().zip(cells).enumerate();
    rows.map(|(index, (ply, &(first, end)))| {
        let of = |property| column(case, &ply.name, property);
        Ply {
            first_cell: first as u32,
            end_cell: end as u32,
            table: (index * TABLE_NODES * (2 * parts + 2)) as u32,
            conductivity: of(Property::Conductivity),
            conductivity_solid: of(Property::ConductivitySolid),
            conductivity_gas: of(Property::ConductivityGas),
            conductivity_radiative: of(Property::ConductivityRadiative),
            heat_capacity: of(Property::HeatCapacity),
            density: of(Property::Density),
            thickness: of(Property::Thickness),
            holder: column(case, "", Property::Holder),
            extinction: extinction(case, ply),
            contact: of(Property::Contact),
        }
    })
    .collect()
}

fn bulks(case: &Case) -> Vec<Bulk<f64>> {
    let holder_w_m3_k = case.exposure.holder.as_ref().map_or(0.0, |holder| holder.conductance_w_m3_k);
    let bulk = |ply: &crate::case::Ply| Bulk { density_kg_m3: ply.material.density_kg_m3, holder_w_m3_k };
    case.layup.plies.iter().map(bulk).collect()
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
        Face::Held(_) => layout::Face { film_w_m2_k: 0.0, hot_wall_kg_j: 0.0, held: 1.0 },
        Face::Open(open) => layout::Face {
            film_w_m2_k: open.film_w_m2_k,
            hot_wall_kg_j: open
                .recovery_enthalpy_j_kg
                .map_or(0.0, |recovery| 1.0 / (recovery - air_enthalpy_j_kg(COLD_WALL_K))),
            held: 0.0,
        },
    }
}

fn drives(case: &Case, clock: &Clock) -> Vec<Drive<f64>> {
    let exposure = &case.exposure;
    let mut drives = Vec::with_capacity(4 * clock.times_s.len());
    for step in clock.times_s.windows(2) {
        for face in [&exposure.hot_face, &exposure.back_face] {
            let holder = exposure.holder.as_ref();
            drives.push(drive(face, holder, |schedule| schedule.after(step[0])));
            drives.push(drive(face, holder, |schedule| schedule.before(step[1])));
        }
    }
    let end = [drives[drives.len() - 3], drives[drives.len() - 1]];
    drives.extend([end[0], end[0], end[1], end[1]]);
    drives
}

fn drive(face: &Face, holder: Option<&Holder>, read: impl Fn(&Schedule) -> f64) -> Drive<f64> {
    let holder_k = holder.map_or(0.0, |holder| read(&holder.temperature_k));
    match face {
        Face::Held(temperature_k) => Drive {
            flux_w_m2: 0.0,
            radiant_w_m2: 0.0,
            gas_k: 0.0,
            surroundings_k: 0.0,
            held_k: read(temperature_k),
            holder_k,
        },
        Face::Open(open) => Drive {
            flux_w_m2: read(&open.flux_w_m2),
            radiant_w_m2: read(&open.radiant_w_m2),
            gas_k: read(&open.gas_k),
            surroundings_k: read(&open.surroundings_k),
            held_k: 0.0,
            holder_k,
        },
    }
}

/// Temperatures of the nodes; absolute zero, where gases conduct nothing over nothing, is stood in for.
fn nodes() -> impl Iterator<Item = f64> {
    (0..TABLE_NODES).map(|node| (TABLE_START_K + TABLE_STEP_K * node as f64).max(1e-6))
}

/// Slope of a column at its nodes, per kelvin. Between nodes slopes are interpolated like any property: a slope
/// that jumped from segment to segment would make temperatures jump as a factor moves a cell across a node, by
/// little, but by enough to drown a derivative by differences.
fn slopes(column: &[f64]) -> Vec<f64> {
    let last = column.len() - 1;
    (0..column.len())
        .map(|node| {
            let (under, over) = (node.saturating_sub(1), (node + 1).min(last));
            (column[over] - column[under]) / (TABLE_STEP_K * (over - under) as f64)
        })
        .collect()
}

/// A ply's block of tables. Enthalpy is the exact integral of the resampled heat capacity.
fn table(material: &Material, case: &Case, parts: usize) -> Vec<f64> {
    let mut columns = vec![vec![]; parts];
    let (mut heat_capacities, mut enthalpies) = (vec![], vec![0.0]);
    for temperature_k in nodes() {
        let conductivities = material.conductivity.parts(temperature_k, case.exposure.pressure_pa.after(0.0));
        let [solid, gas, radiative] = conductivities;
        let told_apart = match parts {
            1 => vec![solid + gas + radiative],
            2 => vec![solid + gas, radiative],
            _ => vec![solid, gas, radiative],
        };
        columns.iter_mut().zip(told_apart).for_each(|(column, part)| column.push(part));
        heat_capacities.push(material.heat_capacity.at(temperature_k));
    }
    for pair in heat_capacities.windows(2) {
        enthalpies.push(enthalpies[enthalpies.len() - 1] + 0.5 * TABLE_STEP_K * (pair[0] + pair[1]));
    }
    columns.extend(columns.iter().map(|column| slopes(column)).collect::<Vec<_>>());
    columns.extend([heat_capacities, enthalpies]);
    interleaved(&columns)
}

/// Columns node by node.
fn interleaved(columns: &[Vec<f64>]) -> Vec<f64> {
    (0..TABLE_NODES).flat_map(|node| columns.iter().map(move |column| column[node])).collect()
}

fn face_table(case: &Case) -> Vec<f64> {
    let emissivity = |face: &Face, ply: Option<&crate::case::Ply>, temperature_k: f64| match (face, ply) {
        (Face::Open(open), Some(ply)) => match open.emissivity {
            Emissivity::Material => ply.material.emissivity.at(temperature_k),
            Emissivity::Constant(value) => value,
        },
        _ => 0.0,
    };
    let (exposure, plies) = (&case.exposure, &case.layup.plies);
    let cold_wall = air_enthalpy_j_kg(COLD_WALL_K);
    let hot = nodes().map(|temperature_k| emissivity(&exposure.hot_face, plies.first(), temperature_k)).collect();
    let back = nodes().map(|temperature_k| emissivity(&exposure.back_face, plies.last(), temperature_k)).collect();
    let enthalpies: Vec<f64> = nodes().map(|temperature_k| air_enthalpy_j_kg(temperature_k) - cold_wall).collect();
    let rises = slopes(&enthalpies);
    let columns: [Vec<f64>; FACE_COLUMNS] = [hot, enthalpies, rises, back];
    interleaved(&columns)
}

/// Exact weights of a first-order lag under a reading that moves in a straight line over the step.
fn beads(case: &Case, clock: &Clock) -> Vec<Bead<f64>> {
    let mut beads = Vec::with_capacity(clock.times_s.len() * case.sensors.len());
    for step in clock.times_s.windows(2) {
        for sensor in &case.sensors {
            beads.push(if sensor.lag_s > 0.0 {
                let lags = (step[1] - step[0]) / sensor.lag_s;
                let mean = -(-lags).exp_m1() / lags;
                Bead { start: mean - (-lags).exp(), end: 1.0 - mean }
            } else {
                Bead { start: 0.0, end: 1.0 }
            });
        }
    }
    beads
}

/// The temperatures a ply may take: those of every table of its material that refuses to be left.
fn allowed(material: &Material) -> (f64, f64) {
    let mut allowed_k = (f64::NEG_INFINITY, f64::INFINITY);
    let mut narrow = |table: &crate::case::Table| {
        if table.outside == OutOfRange::Refuse {
            let (low, high) = table.range_k();
            allowed_k = (allowed_k.0.max(low), allowed_k.1.min(high));
        }
    };
    narrow(&material.heat_capacity);
    narrow(&material.emissivity);
    if let Conductivity::Tables(tables) = &material.conductivity {
        tables.iter().for_each(|(_, table)| narrow(table));
    }
    allowed_k
}
