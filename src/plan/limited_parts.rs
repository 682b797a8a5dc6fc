//! Readings for temperature limits: of each part with a limit the hottest temperature at an instant.

use crate::case::{Case, LimitedPart, Sensor, Side, TemperatureLimit};

/// What the reading of a limit compares at an instant: the nodes of a ply, and faces of plies at interfaces. The outer
/// faces of the layup have nodes.
pub(super) struct LimitReading {
    /// The ply whose nodes are read.
    pub(super) nodes_of: Option<usize>,
    /// The faces that are read.
    pub(super) faces: Vec<Sensor>,
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
                Some(Self { nodes_of: None, faces: vec![face(ply, Side::Above), face(ply, Side::Below)] })
            }
            LimitedPart::Ply(ply) => {
                let above = ply.checked_sub(1).map(|above| face(above, Side::Below));
                let below = (ply < faces_m.len()).then(|| face(ply, Side::Above));
                Some(Self { nodes_of: Some(ply), faces: above.into_iter().chain(below).collect() })
            }
        }
    }
}

/// The row of each limit of a case, in their order, among the rows of sensors and readings.
pub(super) fn limit_rows(case: &Case) -> Vec<usize> {
    let mut next = case.sensors.len();
    let row = |limit: &TemperatureLimit| {
        if let LimitedPart::Sensor(sensor) = limit.part {
            return sensor;
        }
        let row = next;
        next += 1 + LimitReading::of_part(case, limit.part).map_or(0, |reading| reading.faces.len());
        row
    };
    case.limits.iter().map(row).collect()
}
