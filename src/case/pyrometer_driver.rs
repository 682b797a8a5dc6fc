//! A pyrometer whose readings hold the hot face.

use super::pyrometer::Pyrometer;
use super::table::Schedule;

/// The readings of a pyrometer that hold the hot face, and the emissivity of the face by which they were converted to
/// its temperature.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct PyrometerDriver {
    /// The instrument.
    pub pyrometer: Pyrometer,
    /// Emissivity of the face in the spectrum of the instrument.
    pub emissivity: f64,
    /// Standard deviation of that emissivity.
    pub emissivity_deviation: f64,
    /// Temperature of the face, K, with an emissivity lower by the standard deviation, and with one that is higher.
    pub face_k: [Schedule; 2],
}

impl PyrometerDriver {
    pub(super) fn new(face: &ObservedFace, readings_k: &Schedule) -> Result<Self, String> {
        Ok(Self {
            pyrometer: face.pyrometer,
            emissivity: face.emissivity,
            emissivity_deviation: face.deviation,
            face_k: [face.face_k(readings_k, -1.0)?, face.face_k(readings_k, 1.0)?],
        })
    }
}

/// The emissivity of a face that a pyrometer looks at, and what it reflects.
#[derive(Clone, Copy, Debug)]
pub(super) struct ObservedFace {
    pub(super) pyrometer: Pyrometer,
    pub(super) emissivity: f64,
    pub(super) deviation: f64,
    pub(super) surroundings_k: f64,
}

impl ObservedFace {
    /// Require an emissivity that is above 0 and at most 1, also one standard deviation lower.
    pub(super) fn check(emissivity: f64, deviation: f64) -> Result<(), String> {
        Pyrometer::checked_emissivity(emissivity)?;
        if (0.0..emissivity).contains(&deviation) {
            return Ok(());
        }
        Err(format!(
            "expected a standard deviation of at least 0, below the emissivity of {emissivity}, found {deviation}"
        ))
    }

    /// The temperature of the face, K, from readings, if its emissivity is off by a number of standard deviations; it
    /// is at most 1.
    ///
    /// # Errors
    /// The face would reflect more radiation of its surroundings than was read.
    pub(super) fn face_k(&self, readings_k: &Schedule, deviations: f64) -> Result<Schedule, String> {
        let radiance = self.pyrometer.spectrum.radiance();
        let surroundings = radiance.logarithm(self.surroundings_k);
        let emissivity = (self.emissivity + deviations * self.deviation).min(1.0);
        let of_reading = |&reading_k: &f64| {
            let found = radiance.face_temperature_k(self.pyrometer.emissivity, reading_k, emissivity, surroundings);
            found.ok_or_else(|| {
                format!(
                    "a reading of {reading_k} K is less than the radiation of surroundings of {} K that a face of \
                     emissivity {emissivity} reflects",
                    self.surroundings_k
                )
            })
        };
        let temperatures_k = readings_k.values().iter().map(of_reading).collect::<Result<_, _>>()?;
        Schedule::new(readings_k.times_s().to_vec(), temperatures_k)
    }
}
