//! Readings for temperature limits: the highest temperature of each part with a limit at an instant.

use super::HeldReading;
use super::forcing::Forcing;
use crate::case::{Case, Face, LimitedPart, Sensor, Side, TemperatureLimit};
use crate::traces::Peak;

/// Temperatures of which the reading of a limit is the highest at an instant: those of the nodes of a ply, and of faces
/// of plies at interfaces. The outer faces of the layup have nodes.
pub(super) struct LimitReading {
    /// The ply whose nodes are read.
    pub(super) nodes_of: Option<usize>,
    /// The faces that are read.
    pub(super) faces: Vec<Sensor>,
    /// The highest temperature at 0 s, K, of the initial profile and of prescribed temperatures. Nodes and the fluxes
    /// between them would miss it at a bend of the profile and at an interface.
    pub(super) start_k: f64,
}

impl LimitReading {
    /// The readings of the limits of a case, in their order; a sensor needs no other reading than its own.
    pub(super) fn of_case(case: &Case) -> impl Iterator<Item = Self> {
        case.limits.iter().filter_map(|limit| Self::of_part(case, limit.part))
    }

    fn of_part(case: &Case, part: LimitedPart) -> Option<Self> {
        let faces_m = case.layup.interfaces_m();
        let face = |ply: usize, side| Sensor {
            name: String::new(),
            depth_m: faces_m[ply],
            side,
            time_constant_s: 0.0,
            pyrometer: None,
        };
        match part {
            LimitedPart::Sensor(_) => None,
            LimitedPart::Interface(ply) => {
                let start_k = case.exposure.initial_temperature_k(faces_m[ply]);
                Some(Self { nodes_of: None, faces: vec![face(ply, Side::Above), face(ply, Side::Below)], start_k })
            }
            LimitedPart::Ply(ply) => {
                let above = ply.checked_sub(1).map(|above| face(above, Side::Below));
                let below = (ply < faces_m.len()).then(|| face(ply, Side::Above));
                let faces = above.into_iter().chain(below).collect();
                Some(Self { nodes_of: Some(ply), faces, start_k: highest_start_k(case, ply) })
            }
        }
    }
}

/// The highest temperature of a ply at 0 s, K.
fn highest_start_k(case: &Case, ply: usize) -> f64 {
    let (layup, exposure) = (&case.layup, &case.exposure);
    let faces_m = layup.interfaces_m();
    let top_m = if ply == 0 { layup.origin_m } else { faces_m[ply - 1] };
    let bottom_m = faces_m.get(ply).copied().unwrap_or(layup.back_m());
    let ends_k = [top_m, bottom_m].map(|depth_m| exposure.initial_temperature_k(depth_m));
    let inside = exposure.initial_k.iter().filter(|(depth_m, _)| (top_m..=bottom_m).contains(depth_m));
    let held = [(&exposure.hot_face, 0), (&exposure.back_face, layup.plies.len() - 1)].into_iter();
    let held_k = held.filter_map(|(face, at)| match face {
        Face::Held(temperature_k) if at == ply => Some(temperature_k.after(0.0)),
        _ => None,
    });
    ends_k.into_iter().chain(inside.map(|&(_, start_k)| start_k)).chain(held_k).fold(0.0, f64::max)
}

/// A temperature limit of a plan.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LimitedRow {
    /// Index of the reading among the rows of sensors and readings.
    pub(crate) row: usize,
    /// The limit, K.
    pub(crate) limit_k: f64,
    is_sensor: bool,
    /// The faces of prescribed temperature in the part: 0 hot, 1 back.
    held_faces: Vec<usize>,
    /// The highest prescribed temperature in the part.
    pub(crate) prescribed_peak: Option<Peak>,
    /// Time for which it is above the limit, s.
    pub(crate) prescribed_above_s: f64,
}

impl LimitedRow {
    /// Whether the part has the prescribed temperature: a sensor on a held face, not a ply next to one.
    pub(crate) fn is_prescribed(&self) -> bool {
        self.is_sensor && !self.held_faces.is_empty()
    }

    /// The same limit under another exposure.
    pub(super) fn with_forcing(&self, forcing: &Forcing) -> Self {
        let peaks = self.held_faces.iter().map(|&face| forcing.highest_held(face));
        let above = self.held_faces.iter().map(|&face| forcing.held_above_s(face, self.limit_k));
        Self {
            held_faces: self.held_faces.clone(),
            prescribed_peak: peaks
                .reduce(|one, other| if other.temperature_k > one.temperature_k { other } else { one }),
            prescribed_above_s: above.fold(0.0, f64::max),
            ..*self
        }
    }
}

/// The limits of a case, in their order.
pub(super) fn limited_rows(case: &Case, forcing: &Forcing, held: &[HeldReading]) -> Vec<LimitedRow> {
    let (last, mut next) = (case.layup.plies.len() - 1, case.sensors.len());
    let faces = [&case.exposure.hot_face, &case.exposure.back_face];
    let limited = |limit: &TemperatureLimit| {
        let row = match limit.part {
            LimitedPart::Sensor(sensor) => sensor,
            part => {
                let row = next;
                next += 1 + LimitReading::of_part(case, part).map_or(0, |reading| reading.faces.len());
                row
            }
        };
        let lies_at = |&face: &usize| match limit.part {
            LimitedPart::Ply(ply) => matches!(faces[face], Face::Held(_)) && ply == [0, last][face],
            LimitedPart::Interface(_) => false,
            LimitedPart::Sensor(sensor) => held.iter().any(|held| (held.sensor, held.face) == (sensor, face)),
        };
        let held_faces = (0..faces.len()).filter(lies_at).collect();
        let is_sensor = matches!(limit.part, LimitedPart::Sensor(_));
        let (prescribed_peak, prescribed_above_s) = (None, 0.0);
        LimitedRow { row, limit_k: limit.limit_k, is_sensor, held_faces, prescribed_peak, prescribed_above_s }
            .with_forcing(forcing)
    };
    case.limits.iter().map(limited).collect()
}
