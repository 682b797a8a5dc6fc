//! Readings of the temperature through the thickness, on the cells and steps of a plan.

use super::grid::{locate_sensor, same_depth_m, start_reading_k};
use super::{Plan, held_readings};
use crate::case::{Case, Sensor, Side};
use crate::physics::layout::{self, Bead, PlanData, PlanRows, SensorLocation};

/// A depth of a profile.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct ProfileDepth {
    /// Depth below the hot face in the layup of the case, m.
    pub depth_m: f64,
    /// Index of the ply.
    pub ply: usize,
}

/// A place that both resolutions read without interpolation.
#[derive(Clone, Copy)]
enum ReadingPlace {
    /// The face of a cell, on a side of an interface.
    Face(Side),
    /// The node of a cell.
    Node,
}

impl Plan {
    /// The same march, read through the thickness instead of at the sensors: at all cell faces and nodes that both
    /// resolutions have, so that readings converge as those of the sensors, and at interfaces on both sides.
    pub fn with_depth_readings(&self, case: &Case) -> (Self, Vec<ProfileDepth>) {
        let readings = self.depth_readings(case);
        let sensor = |depth: &ProfileDepth, place: &ReadingPlace| Sensor {
            name: String::new(),
            depth_m: depth.depth_m,
            side: if let ReadingPlace::Face(side) = place { *side } else { Side::Both },
            time_constant_s: 0.0,
            pyrometer: None,
        };
        let sensors = readings.iter().map(|(depth, place)| sensor(depth, place)).collect();
        let case = Case { sensors, observations: Vec::new(), limits: Vec::new(), ..case.clone() };
        let (depths, places): (Vec<ProfileDepth>, Vec<ReadingPlace>) = readings.into_iter().unzip();
        (self.read_at(&case, &places), depths)
    }

    /// Depth of the node of every cell.
    pub fn node_depths(&self, case: &Case) -> Vec<ProfileDepth> {
        let faces_m = self.faces_m(case);
        let nodes = self.rows.data.cells.iter().zip(&faces_m).map(|(cell, top_m)| top_m + cell.above_m).enumerate();
        let ply = |cell: usize| self.rows.plies.partition_point(|ply| ply.end_cell as usize <= cell);
        nodes.map(|(cell, depth_m)| ProfileDepth { depth_m, ply: ply(cell) }).collect()
    }

    /// Depths of the faces of all cells, from the hot face to the back face, m.
    fn faces_m(&self, case: &Case) -> Vec<f64> {
        let mut faces_m = vec![case.layup.origin_m];
        for cell in &self.rows.data.cells {
            faces_m.push(faces_m[faces_m.len() - 1] + cell.width_m);
        }
        faces_m
    }

    /// Faces and nodes of the coarser resolution that are faces and nodes of the finer one too. Where cells are halved
    /// between interfaces the faces are, and next to an outer face, whose cell is half as wide, the nodes are.
    fn depth_readings(&self, case: &Case) -> Vec<(ProfileDepth, ReadingPlace)> {
        let coarse = self.coarse.as_deref().unwrap_or(self);
        let close_m = same_depth_m(case);
        let is_among =
            |depths_m: &[f64], depth_m: f64| depths_m.iter().any(|other_m| (other_m - depth_m).abs() <= close_m);
        let (fine_faces_m, faces_m) = (self.faces_m(case), coarse.faces_m(case));
        let fine_nodes_m: Vec<f64> = self.node_depths(case).iter().map(|node| node.depth_m).collect();
        let (nodes, last) = (coarse.node_depths(case), coarse.rows.plies.len() - 1);
        let mut readings = Vec::new();
        for (ply, row) in coarse.rows.plies.iter().enumerate() {
            let (first, end) = (row.first_cell as usize, row.end_cell as usize);
            for face in first..=end {
                let side = match (face == first && ply > 0, face == end && ply < last) {
                    (true, _) => Side::Below,
                    (_, true) => Side::Above,
                    _ => Side::Both,
                };
                let depth_m = faces_m[face];
                if is_among(&fine_faces_m, depth_m) {
                    readings.push((ProfileDepth { depth_m, ply }, ReadingPlace::Face(side)));
                }
                // The nodes at the outer faces are read as faces.
                let is_inner = face < end && face > 0 && face + 1 < nodes.len();
                if is_inner && is_among(&fine_nodes_m, nodes[face].depth_m) {
                    readings.push((nodes[face], ReadingPlace::Node));
                }
            }
        }
        readings
    }

    /// The same cells and steps, read at the sensors of a case, each at a face or node.
    fn read_at(&self, case: &Case, places: &[ReadingPlace]) -> Self {
        let plies: Vec<(usize, usize)> =
            self.rows.plies.iter().map(|ply| (ply.first_cell as usize, ply.end_cell as usize)).collect();
        let (faces_m, nodes) = (self.faces_m(case), self.node_depths(case));
        let ply_of = |cell: usize| plies.partition_point(|&(_, end)| end <= cell) as u32;
        let locate = |(sensor, place): (&Sensor, &ReadingPlace)| match place {
            ReadingPlace::Face(_) => locate_sensor(&self.rows.data.cells, &plies, &faces_m, sensor, case),
            ReadingPlace::Node => {
                let cell = nearest(&nodes, sensor.depth_m);
                let location = SensorLocation {
                    cell: cell as u32,
                    ply_above: ply_of(cell),
                    ply_below: ply_of(cell + 1),
                    depth: 0,
                    node_above: cell as u32,
                    steps_above: 0,
                    node_below: cell as u32,
                    steps_below: 0,
                    first_node: 0,
                    end_node: 0,
                    faces: 0,
                };
                // Without a part of the way to the face the reading is the node of the cell.
                let (above, below, above_m, below_m) = (0.0, 0.0, 0.0, 0.0);
                let (depth_m, start_k) = (sensor.depth_m, start_reading_k(sensor, case));
                (location, layout::Sensor { above, below, above_m, below_m, depth_m, start_k })
            }
        };
        let (sensor_locations, sensors): (Vec<_>, Vec<_>) = case.sensors.iter().zip(places).map(locate).unzip();
        Self {
            coarse: self.coarse.as_ref().map(|coarse| Box::new(coarse.read_at(case, places))),
            held_readings: held_readings(case, &sensor_locations, &self.forcing, &self.times_s, &self.instants_s),
            pyrometers: Vec::new(),
            limits: Vec::new(),
            rows: PlanRows {
                sensors: sensors.len(),
                has_depth_factors: false,
                data: PlanData {
                    beads: vec![Bead { start: 0.0, end: 1.0 }; self.steps() * sensors.len()],
                    sensors,
                    ..self.rows.data.clone()
                },
                sensor_locations,
                ..self.rows.clone()
            },
            ..self.clone()
        }
    }
}

/// Index of the depth nearest to another.
fn nearest(depths: &[ProfileDepth], depth_m: f64) -> usize {
    let distance_m = |at: &usize| (depths[*at].depth_m - depth_m).abs();
    (0..depths.len()).min_by(|one, other| distance_m(one).total_cmp(&distance_m(other))).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ensemble::Ensemble;
    use crate::march::{Precision, cpu::Cpu, richardson::march_extrapolated};

    #[test]
    fn a_profile_passes_through_the_readings_of_the_sensors_and_has_both_sides_of_a_contact() {
        for id in ["lcat-2259", "lcat-2259-tc3", "lcat-2259-pyrolysis", "slab"] {
            let folder = format!("{}/cases/{id}", env!("CARGO_MANIFEST_DIR"));
            let case = Case::load(folder.as_ref()).expect("a shipped case loads");
            let plan = Plan::new(&case).without_gauges();
            let (profile, depths) = plan.with_depth_readings(&case);
            let coarse = plan.coarse().expect("a coarser plan").cells();
            assert!(depths.len() + 4 > coarse, "{id}: {} depths of {coarse} cells", depths.len());
            assert!(depths.windows(2).all(|pair| pair[0].depth_m <= pair[1].depth_m));
            let nominal = Ensemble::nominal(&case.factors);
            let mut cpu = Cpu::new(Precision::F64);
            let mut march = |plan: &Plan| march_extrapolated(&mut cpu, plan, &nominal, 0..1).expect("it marches");
            let (at_sensors, at_depths) = (march(&plan), march(&profile));
            let close_m = 1e-9;
            for (index, sensor) in case.sensors.iter().enumerate() {
                if sensor.time_constant_s > 0.0 {
                    continue;
                }
                let here: Vec<usize> =
                    (0..depths.len()).filter(|&at| (depths[at].depth_m - sensor.depth_m).abs() < close_m).collect();
                assert!(!here.is_empty(), "{id}: no depth of {}", sensor.name);
                for instant in 0..plan.instants_s.len() {
                    let read = |at: usize| at_depths.trace(0, at)[instant];
                    let expected = match sensor.side {
                        Side::Above => read(here[0]),
                        Side::Below => read(here[here.len() - 1]),
                        Side::Both => here.iter().map(|&at| read(at)).sum::<f64>() / here.len() as f64,
                    };
                    let found = at_sensors.trace(0, index)[instant];
                    assert!((found - expected).abs() < 1e-9, "{id}, {}: {found} K, not {expected} K", sensor.name);
                }
            }
            let jump = |at: usize| {
                let pair = at_depths.trace(0, at).iter().zip(at_depths.trace(0, at + 1));
                pair.map(|(above, below)| (above - below).abs()).fold(0.0, f64::max)
            };
            let jumps: Vec<f64> =
                (0..depths.len() - 1).filter(|&at| depths[at].ply < depths[at + 1].ply).map(jump).collect();
            let has_contact = case.layup.contacts_w_m2_k.iter().any(Option::is_some);
            assert!(!has_contact || jumps.iter().any(|&jump_k| jump_k > 0.1), "{id}: {jumps:?}");
        }
    }
}
