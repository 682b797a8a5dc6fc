//! Finite-volume grid through the thickness.
//!
//! Interfaces and sensors lie on cell faces; the two outer faces of the layup carry a node of their own, whose cell is
//! half as wide, so that a surface temperature is an unknown like any other. Within a ply spacings widen smoothly away
//! from the hot face: every reading is second order, and a grid of half the spacing lies on the same curve.

use super::limited_parts::LimitReading;
use crate::case::{self, Case, Face, Property, Side};
use crate::physics::layout::{Cell, InitialBend, Sensor, SensorLocation};

/// Cells from hot face to back face, the cell range of each ply, and the sensors.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// Widths and node distances.
    pub cells: Vec<Cell<f64>>,
    /// First cell of each ply, and one past the last.
    pub plies: Vec<(usize, usize)>,
    /// Location of each sensor, and its interpolation data; then the rows of the temperature limits.
    pub sensors: Vec<(SensorLocation<u32>, Sensor<f64>)>,
}

/// Fewest cells of a ply, before subdivision.
const MIN_CELLS_PER_PLY: f64 = 2.0;
/// Offset of the distance from the hot face that sets the widening, as a share of the whole distance (√ of diffusion
/// time).
const WIDENING_OFFSET: f64 = 0.3;

/// Number of cells of each ply before subdivision; a real number, as sensors split plies.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct GridDensity {
    /// Cells of each ply.
    pub cells_per_ply: Vec<f64>,
    /// Equal parts of each cell of a ply. Unlike a density, they refine every stretch, however few cells it has.
    pub subdivisions: Vec<usize>,
}

impl GridDensity {
    /// Shares `cells` among the plies by diffusion time L²ρc/k at the start, to the power 3/8; at least two a ply.
    ///
    /// A power of 1/2 would give every cell the same diffusion time, but insulation conducts several times better once
    /// hot, and fronts are steepest in the cloth: of the powers tried on the paper's layup (1/8, 1/4, 3/8, 1/2 at 48 to
    /// 192 cells) 3/8 has the smallest worst error over the sensors.
    pub fn by_diffusion_time(case: &Case, cells: f64) -> Self {
        let weights: Vec<f64> = sqrt_diffusion_times(case).iter().map(|root| root.powf(0.75)).collect();
        let total: f64 = weights.iter().sum();
        // Where nothing conducts the weights are NaN, which `max` ignores.
        let subdivisions = vec![1; weights.len()];
        Self {
            cells_per_ply: weights.iter().map(|weight| (cells * weight / total).max(MIN_CELLS_PER_PLY)).collect(),
            subdivisions,
        }
    }
}

/// Square root of each ply's diffusion time L²ρc/k at the start, √s: zero for a ply that does not conduct, or whose
/// extrapolated tables are negative there.
fn sqrt_diffusion_times(case: &Case) -> Vec<f64> {
    let start_k = case.exposure.initial_k[0].1;
    let root = |ply: &case::Ply| {
        let material = &ply.material;
        let conductivity: f64 = material.conductivity.parts(start_k, case.exposure.pressure_pa.after(0.0)).iter().sum();
        let root =
            ply.thickness_m * (material.density_kg_m3 * material.heat_capacity.at(start_k) / conductivity).sqrt();
        if root.is_finite() { root } else { 0.0 }
    };
    case.layup.plies.iter().map(root).collect()
}

/// Depths of a ply, and the ratio of its last cell width to its first.
#[derive(Clone, Copy, Debug)]
struct PlySpacing {
    top_m: f64,
    bottom_m: f64,
    expansion_ratio: f64,
}

impl PlySpacing {
    /// One per ply. Fronts spread with distance and deep cells affect the sensors less: widths grow as the square root
    /// of the distance in √ of diffusion time, offset by three tenths of the total (benches/LOG.md has the alternatives
    /// tried).
    fn of_layup(case: &Case) -> Vec<Self> {
        let roots = sqrt_diffusion_times(case);
        let (mut position, mut top_m) = (WIDENING_OFFSET * roots.iter().sum::<f64>(), case.layup.origin_m);
        let mut spans = Vec::with_capacity(roots.len());
        for (root, bottom_m) in roots.into_iter().zip(case.layup.faces_m()) {
            let widening = if root > 0.0 { ((position + root) / position).sqrt() } else { 1.0 };
            spans.push(Self { top_m, bottom_m, expansion_ratio: widening });
            (position, top_m) = (position + root, bottom_m);
        }
        spans
    }

    /// Depth at a share of the ply's spacings, m: widths that are linear in their number grow as the square root of the
    /// distance.
    fn depth_m(self, share: f64) -> f64 {
        let position = share * (2.0 + share * (self.expansion_ratio - 1.0)) / (self.expansion_ratio + 1.0);
        self.top_m + position * (self.bottom_m - self.top_m)
    }

    /// Inverse of [`depth_m`](Self::depth_m).
    fn share(self, depth_m: f64) -> f64 {
        let position = (depth_m - self.top_m) / (self.bottom_m - self.top_m) * (self.expansion_ratio + 1.0);
        position / (1.0 + (1.0 + position * (self.expansion_ratio - 1.0)).sqrt())
    }
}

impl Grid {
    /// The cells of a density, each divided into `subdivisions`: grids of different subdivisions differ in nothing
    /// else, so that their difference estimates the discretisation error.
    pub(super) fn new(case: &Case, density: &GridDensity, subdivisions: usize) -> Self {
        let plies_last = case.layup.plies.len() - 1;
        let (mut cells, mut plies) = (Vec::new(), Vec::new());
        let mut faces_m = vec![case.layup.origin_m];
        for (ply, span) in PlySpacing::of_layup(case).into_iter().enumerate() {
            let first = cells.len();
            let marks_m = breakpoints_m(case, span.top_m, span.bottom_m);
            for (stretch, mark) in marks_m.windows(2).enumerate() {
                let is_hot = ply == 0 && stretch == 0;
                let is_back = ply == plies_last && stretch + 2 == marks_m.len();
                let shares = [span.share(mark[0]), span.share(mark[1])];
                let spacings = (density.cells_per_ply[ply] * (shares[1] - shares[0])).round().max(2.0) as usize;
                let units = spacings * density.subdivisions[ply] * subdivisions;
                append_cells(&mut cells, &mut faces_m, span, shares, units, is_hot, is_back);
            }
            plies.push((first, cells.len()));
        }
        link_cells(&mut cells, case, &faces_m);
        let mut sensors: Vec<_> =
            case.sensors.iter().map(|sensor| locate_sensor(&cells, &plies, &faces_m, sensor, case)).collect();
        for LimitReading { nodes_of, faces, start_k } in LimitReading::of_case(case) {
            let rows = faces.iter().map(|face| locate_sensor(&cells, &plies, &faces_m, face, case));
            let rows: Vec<_> = rows.collect();
            let nodes = nodes_of.map_or((0, 0), |ply| plies[ply]);
            sensors.push(locate_part(nodes, rows.len(), start_k));
            sensors.extend(rows);
        }
        Self { cells, plies, sensors }
    }
}

/// Depths of the faces of a ply and of the sensors inside it, in order.
fn breakpoints_m(case: &Case, top_m: f64, bottom_m: f64) -> Vec<f64> {
    let close_m = 1e-9 * case.layup.back_m();
    let mut marks_m: Vec<f64> = case
        .sensors
        .iter()
        .map(|sensor| sensor.depth_m)
        .filter(|depth_m| (top_m + close_m..bottom_m - close_m).contains(depth_m))
        .collect();
    marks_m.extend([top_m, bottom_m]);
    marks_m.sort_by(f64::total_cmp);
    marks_m.dedup_by(|later, earlier| *later - *earlier <= close_m);
    marks_m
}

/// Append the cells of a stretch of a ply, from one share of its spacings to another. A cell at an outer face is half
/// as wide; the other half goes to the cell at the other end, or to another cell where both ends are outer faces, so
/// that widths in units of the spacing do not depend on the spacing.
fn append_cells(
    cells: &mut Vec<Cell<f64>>,
    faces_m: &mut Vec<f64>,
    span: PlySpacing,
    shares: [f64; 2],
    spacings: usize,
    is_hot: bool,
    is_back: bool,
) {
    let count = spacings + usize::from(is_hot && is_back);
    let depth_m = |of: f64| span.depth_m(shares[0] + (shares[1] - shares[0]) * of / spacings as f64);
    let mut top = 0.0;
    for i in 0..count {
        let (is_first, is_last) = (i == 0, i + 1 == count);
        let (is_at_hot, is_at_back) = (is_hot && is_first, is_back && is_last);
        let is_widened = is_hot != is_back && (is_hot && is_last || is_back && is_first);
        let bottom = top
            + if is_at_hot || is_at_back {
                0.5
            } else if is_widened {
                1.5
            } else {
                1.0
            };
        let node = if is_at_hot {
            top
        } else if is_at_back {
            bottom
        } else {
            0.5 * (top + bottom)
        };
        let (top_m, node_m, bottom_m) = (depth_m(top), depth_m(node), depth_m(bottom));
        let (above_m, below_m) = (node_m - top_m, bottom_m - node_m);
        cells.push(Cell { width_m: bottom_m - top_m, above_m, below_m, half_over_next_1_m: 0.0, start_k: 0.0 });
        faces_m.push(bottom_m);
        top = bottom;
    }
}

/// Fill in the fields that depend on a neighbour or on the initial temperature.
fn link_cells(cells: &mut [Cell<f64>], case: &Case, faces_m: &[f64]) {
    for i in 0..cells.len() {
        if i + 1 < cells.len() {
            cells[i].half_over_next_1_m = 0.5 / (cells[i].below_m + cells[i + 1].above_m);
        }
        cells[i].start_k = case.exposure.initial_temperature_k(faces_m[i] + cells[i].above_m);
    }
}

/// Largest difference between two depths that are the same, m.
pub(super) fn same_depth_m(case: &Case) -> f64 {
    1e-6 * (case.layup.back_m() - case.layup.origin_m)
}

/// The cell face at a sensor's depth, and its interpolation: the node of an outer face, else one side of the face or
/// both.
pub(super) fn locate_sensor(
    cells: &[Cell<f64>],
    plies: &[(usize, usize)],
    faces_m: &[f64],
    sensor: &case::Sensor,
    case: &Case,
) -> (SensorLocation<u32>, Sensor<f64>) {
    let depth_m = sensor.depth_m;
    let close_m = same_depth_m(case);
    let face = faces_m
        .iter()
        .enumerate()
        .min_by(|a, b| (a.1 - depth_m).abs().total_cmp(&(b.1 - depth_m).abs()))
        .map_or(0, |(face, _)| face);
    debug_assert!((faces_m[face] - depth_m).abs() <= close_m, "every sensor lies on a face by construction");
    let last = cells.len() - 1;
    let (cell, node_above, node_below, above, below) = if face == 0 {
        (0, 0, 0, 0.0, 0.0)
    } else if face > last {
        (last - 1, last, last, 0.0, 1.0)
    } else {
        let (above, below) = match sensor.side {
            Side::Above => (1.0, 0.0),
            Side::Below => (0.0, 1.0),
            Side::Both => (0.5, 0.5),
        };
        (face - 1, face - 1, face, above, below)
    };
    let is_inside = node_above < node_below;
    let (above_m, below_m) =
        if is_inside { (cells[node_above].below_m, cells[node_below].above_m) } else { (0.0, 0.0) };
    let depth = case.factors.iter().position(|f| f.property == Property::SensorDepth && f.group == sensor.name);
    let (low, high) = depth.map_or((1.0, 1.0), |depth| case.factors[depth].widest_bounds());
    let upwards = (1..=node_above).rev().map(|i| cells[i - 1].below_m + cells[i].above_m);
    let downwards = (node_below..last).map(|i| cells[i].below_m + cells[i + 1].above_m);
    let ply_of = |cell| plies.partition_point(|&(_, end)| end <= cell) as u32;
    let place = SensorLocation {
        cell: cell as u32,
        ply_above: ply_of(cell),
        ply_below: ply_of(cell + 1),
        depth: depth.map_or(0, |depth| depth as u32 + 1),
        node_above: node_above as u32,
        steps_above: node_steps_within(above_m, (1.0 - low) * depth_m, upwards),
        node_below: node_below as u32,
        steps_below: node_steps_within(below_m, (high - 1.0) * depth_m, downwards),
        first_node: 0,
        end_node: 0,
        faces: 0,
    };
    (place, Sensor { above, below, above_m, below_m, depth_m, start_k: start_reading_k(sensor, case) })
}

/// The initial temperature at the nominal depth of a sensor, K, where its bead starts. Zero where it starts at its
/// first reading: beads without lag on held faces.
pub(super) fn start_reading_k(sensor: &case::Sensor, case: &Case) -> f64 {
    let exposure = &case.exposure;
    let faces = [(&exposure.hot_face, case.layup.origin_m), (&exposure.back_face, case.layup.back_m())];
    let is_held = faces
        .iter()
        .any(|(face, depth_m)| matches!(face, Face::Held(_)) && (sensor.depth_m - depth_m).abs() <= same_depth_m(case));
    let starts_at_reading = is_held && sensor.time_constant_s == 0.0;
    if starts_at_reading { 0.0 } else { exposure.initial_temperature_k(sensor.depth_m) }
}

/// Bends of an initial profile of points (depth, temperature), which is constant beyond its ends.
pub(super) fn initial_bends(points: &[(f64, f64)]) -> Vec<InitialBend<f64>> {
    let slopes_k_m = points.windows(2).map(|pair| (pair[1].1 - pair[0].1) / (pair[1].0 - pair[0].0));
    let below_k_m = slopes_k_m.clone().chain([0.0]);
    let above_k_m = std::iter::once(0.0).chain(slopes_k_m);
    let bends = points.iter().zip(below_k_m.zip(above_k_m)).map(|(&(depth_m, _), (below_k_m, above_k_m))| {
        InitialBend { depth_m, slope_change_k_m: below_k_m - above_k_m }
    });
    bends.filter(|bend| bend.slope_change_k_m != 0.0).collect()
}

/// The row of a part with a temperature limit: the highest of some nodes, and of the faces in the rows after it.
fn locate_part((first, end): (usize, usize), faces: usize, start_k: f64) -> (SensorLocation<u32>, Sensor<f64>) {
    let place = SensorLocation {
        cell: 0,
        ply_above: 0,
        ply_below: 0,
        depth: 0,
        node_above: 0,
        steps_above: 0,
        node_below: 0,
        steps_below: 0,
        first_node: first as u32,
        end_node: end as u32,
        faces: faces as u32,
    };
    (place, Sensor { above: 0.0, below: 0.0, above_m: 0.0, below_m: 0.0, depth_m: 0.0, start_k })
}

/// Number of node-to-node steps that start within `reach_m`, the first at `first_m`.
fn node_steps_within(first_m: f64, reach_m: f64, lengths_m: impl Iterator<Item = f64>) -> u32 {
    let starts_m = lengths_m.scan(first_m, |start_m, length_m| {
        let here_m = *start_m;
        *start_m += length_m;
        Some(here_m)
    });
    starts_m.take_while(|start_m| *start_m < reach_m).count() as u32
}
