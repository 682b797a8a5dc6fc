//! Candidate depths of thermocouples.

use super::DesignRequest;
use crate::case::{Case, Sensor, Side};

/// A depth at which a thermocouple may lie.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Candidate {
    /// The sensor's name in the case; empty for a depth without one.
    pub sensor: String,
    /// Depth below the hot face, m.
    pub depth_m: f64,
    /// Index of the ply that the depth is in, or below which it is.
    pub ply: usize,
    /// Whether the depth is an interface or the back face, below the ply.
    pub is_interface: bool,
    /// Side of an interface.
    #[serde(skip)]
    pub side: Side,
}

/// Parts of the layup between two candidate depths, without a stated grid.
const PARTS: f64 = 24.0;

/// The depths that may be chosen: the lower face of every ply, and a grid inside.
pub(super) fn selectable(case: &Case, request: &DesignRequest) -> Vec<Candidate> {
    let faces_m = case.layup.faces_m();
    let total_m = faces_m[faces_m.len() - 1] - case.layup.origin_m;
    let grid_m = request.question.grid_m.unwrap_or(total_m / PARTS);
    let mut found = Vec::new();
    let mut top_m = case.layup.origin_m;
    for (ply, &bottom_m) in faces_m.iter().enumerate() {
        let parts = (((bottom_m - top_m) / grid_m).round() as usize).max(1);
        for part in 1..=parts {
            let is_interface = part == parts;
            let depth_m = if is_interface { bottom_m } else { top_m + (bottom_m - top_m) * part as f64 / parts as f64 };
            found.push(Candidate { sensor: String::new(), depth_m, ply, is_interface, side: Side::Both });
        }
        top_m = bottom_m;
    }
    found
}

/// The thermocouples of a case.
pub(super) fn existing(case: &Case) -> Vec<Candidate> {
    let faces_m = case.layup.faces_m();
    let close_m = 1e-6 * faces_m[faces_m.len() - 1].abs();
    let of = |sensor: &Sensor| {
        let ply = faces_m.partition_point(|face_m| *face_m < sensor.depth_m - close_m).min(faces_m.len() - 1);
        Candidate {
            sensor: sensor.name.clone(),
            depth_m: sensor.depth_m,
            ply,
            is_interface: (faces_m[ply] - sensor.depth_m).abs() <= close_m,
            side: sensor.side,
        }
    };
    case.sensors.iter().filter(|sensor| sensor.pyrometer.is_none()).map(of).collect()
}

/// The case with a thermocouple at each candidate, and the sensor whose peak is predicted after them.
pub(super) fn instrumented(case: &Case, candidates: &[Candidate], target: &Sensor, sampling_s: Option<f64>) -> Case {
    let sensor = |(index, candidate): (usize, &Candidate)| Sensor {
        name: format!("candidate {}", index + 1),
        depth_m: candidate.depth_m,
        side: candidate.side,
        time_constant_s: 0.0,
        pyrometer: None,
    };
    let mut instrumented = Case { observations: Vec::new(), limits: Vec::new(), ..case.clone() };
    instrumented.sensors = candidates.iter().enumerate().map(sensor).chain([target.clone()]).collect();
    if let Some(sampling_s) = sampling_s {
        instrumented.resolution.output_interval_s = sampling_s;
    }
    instrumented
}
