//! Readings of pyrometers, from the temperature of the hot face after a march.

use super::Plan;
use crate::case::{Case, Emissivity, Exposure, Face, OpenFace, Radiance, Table};

/// Half the distance over which the slope of an emissivity table is taken, K.
const SLOPE_STEP_K: f64 = 1e-3;

/// A pyrometer of a plan.
#[derive(Clone, Debug)]
pub(crate) struct PyrometerReading {
    /// Index of the sensor in the case.
    sensor: usize,
    radiance: Radiance,
    /// The emissivity that the instrument is set to.
    setting: f64,
    /// The emissivity of the face at a factor of one.
    emissivity: Table,
    /// Logarithm of the radiance of the surroundings at every instant.
    surroundings: Vec<f64>,
}

/// Rows of traces, and the factors that readings of pyrometers depend on.
pub(crate) struct TraceRows {
    /// Rows of a member: itself, then its derivatives.
    pub(crate) rows_per_member: usize,
    /// The factor on the emissivity of the hot face, of each member; empty without pyrometers.
    pub(crate) emissivity_factors: Vec<f64>,
    /// The row of derivatives by that factor.
    pub(crate) derivative_row: Option<usize>,
}

/// The pyrometers of a case at the instants of a plan.
pub(super) fn pyrometer_readings(case: &Case, instants_s: &[f64]) -> Vec<PyrometerReading> {
    let Face::Open(open) = &case.exposure.hot_face else { return Vec::new() };
    let emissivity = match (open.emissivity, case.layup.plies.first()) {
        (Emissivity::Material, Some(ply)) => ply.material.emissivity.clone(),
        (Emissivity::Constant(emissivity), _) => Table::constant(emissivity),
        (Emissivity::Material, None) => return Vec::new(),
    };
    let of_sensor = |(sensor, pyrometer): (usize, crate::case::Pyrometer)| {
        let radiance = Radiance::new(pyrometer.spectrum);
        PyrometerReading {
            sensor,
            radiance,
            setting: pyrometer.emissivity,
            emissivity: emissivity.clone(),
            surroundings: surroundings(radiance, open, instants_s),
        }
    };
    let pyrometers = case.sensors.iter().enumerate();
    pyrometers.filter_map(|(index, sensor)| Some((index, sensor.pyrometer?))).map(of_sensor).collect()
}

fn surroundings(radiance: Radiance, open: &OpenFace, instants_s: &[f64]) -> Vec<f64> {
    instants_s.iter().map(|&instant_s| radiance.logarithm(open.surroundings_k.after(instant_s))).collect()
}

impl PyrometerReading {
    /// The same instrument under another exposure.
    pub(super) fn with_exposure(&self, exposure: &Exposure, instants_s: &[f64]) -> Self {
        match &exposure.hot_face {
            Face::Open(open) => Self { surroundings: surroundings(self.radiance, open, instants_s), ..self.clone() },
            Face::Held(_) => self.clone(),
        }
    }

    pub(super) fn truncated_at(&self, instant: usize) -> Self {
        Self { surroundings: self.surroundings[..=instant].to_vec(), ..self.clone() }
    }

    /// Replace the temperatures of the face in the rows of one member by readings, and their derivatives by those of
    /// the readings.
    fn read(&self, rows: &mut [f64], instants: usize, row_length: usize, factor: f64, derivative_row: Option<usize>) {
        let place = self.sensor * instants;
        for (instant, &surroundings) in self.surroundings.iter().enumerate() {
            let at = place + instant;
            let temperature_k = rows[at];
            let nominal = |temperature_k: f64| self.emissivity.at(temperature_k);
            // As in `surface_flux`.
            let emissivity = |temperature_k: f64| (factor * nominal(temperature_k)).min(1.0);
            let seen = self.radiance.brightness(self.setting, temperature_k, emissivity(temperature_k), surroundings);
            let [above, below] = [SLOPE_STEP_K, -SLOPE_STEP_K].map(|step_k| emissivity(temperature_k + step_k));
            let emissivity_slope_1_k = (above - below) / (2.0 * SLOPE_STEP_K);
            let by_temperature = seen.by_temperature + seen.by_emissivity_k * emissivity_slope_1_k;
            rows[at] = seen.temperature_k;
            for (index, row) in rows.chunks_exact_mut(row_length).enumerate().skip(1) {
                let is_capped = factor * nominal(temperature_k) > 1.0;
                let is_by_factor = derivative_row == Some(index) && !is_capped;
                let by_factor = if is_by_factor { nominal(temperature_k) } else { 0.0 };
                row[at] = by_temperature * row[at] + seen.by_emissivity_k * by_factor;
            }
        }
    }
}

impl Plan {
    /// Replace the temperatures of the hot face by readings of the pyrometers, in rows of sensors over instants.
    pub(crate) fn read_pyrometers(&self, temperatures_k: &mut [f64], traces: &TraceRows) {
        if self.pyrometers.is_empty() {
            return;
        }
        let instants = self.instants_s.len();
        let row_length = self.rows.sensor_locations.len() * instants;
        let of_members = temperatures_k.chunks_exact_mut(traces.rows_per_member * row_length);
        for (rows, &factor) in of_members.zip(&traces.emissivity_factors) {
            for pyrometer in &self.pyrometers {
                pyrometer.read(rows, instants, row_length, factor, traces.derivative_row);
            }
        }
    }
}
