//! Temperature limits of plies, interfaces and sensors.

use super::validation::{FieldPath, checked_index, checked_layup_temperature_k};
use super::{Layup, Sensor};

/// The highest temperature that a part of a case may reach.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct TemperatureLimit {
    /// The part to which the limit applies.
    pub part: LimitedPart,
    /// The limit, K.
    pub limit_k: f64,
}

/// A part of a case that has a temperature limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum LimitedPart {
    /// A ply, by its index: the limit is for its hottest point, inside or on one of its faces.
    Ply(usize),
    /// The interface below a ply, by the index of that ply: the limit is for the hotter of the two faces in contact.
    Interface(usize),
    /// A sensor, by its index: the limit is for its reading.
    Sensor(usize),
}

impl LimitedPart {
    /// `ply`, `interface` or `sensor`.
    pub fn kind(self) -> &'static str {
        match self {
            Self::Ply(_) => "ply",
            Self::Interface(_) => "interface",
            Self::Sensor(_) => "sensor",
        }
    }

    /// All parts of a layup with sensors: first the sensors, then the plies and the interfaces.
    pub(crate) fn all(layup: &Layup, sensors: &[Sensor]) -> Vec<Self> {
        let plies = layup.plies.len();
        let sensors = (0..sensors.len()).map(Self::Sensor);
        sensors.chain((0..plies).map(Self::Ply)).chain((1..plies).map(|below| Self::Interface(below - 1))).collect()
    }

    /// Name of the part: that of the ply or sensor; `INS2/GB` for the interface between two plies.
    pub(crate) fn name(self, layup: &Layup, sensors: &[Sensor]) -> String {
        match self {
            Self::Ply(ply) => layup.plies[ply].name.clone(),
            Self::Interface(ply) => format!("{}/{}", layup.plies[ply].name, layup.plies[ply + 1].name),
            Self::Sensor(sensor) => sensors[sensor].name.clone(),
        }
    }
}

impl TemperatureLimit {
    /// Record all errors of the fields.
    pub(super) fn check(&self, at: &FieldPath<'_>, plies: usize, sensors: usize) {
        at.child("limit_k").require(checked_layup_temperature_k(self.limit_k));
        at.child("part").require(match self.part {
            LimitedPart::Ply(ply) => checked_index(ply, plies, "ply"),
            LimitedPart::Interface(ply) => checked_index(ply, plies.saturating_sub(1), "interface"),
            LimitedPart::Sensor(sensor) => checked_index(sensor, sensors, "sensor"),
        });
    }
}
