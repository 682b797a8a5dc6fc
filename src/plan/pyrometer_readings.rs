//! Readings of pyrometers, from the temperature of the hot face after a march.

use super::Plan;
use super::interpolation::{RecordInterpolation, Stencil, value_at};
use crate::case::{Case, Emissivity, Exposure, Face, Schedule, Table};
use crate::numerics::planck::Radiance;
use crate::traces::Peak;

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
    /// The curve of the readings: over the records of the march and the corners of the surroundings, at which readings
    /// bend or jump.
    curve: RecordInterpolation,
    /// The temperature of the face at each record of the curve, from the records of the march.
    stencils: Vec<Stencil>,
    /// Logarithm of the radiance of the surroundings at every record of the curve, at a jump before it.
    surroundings_at_records: Vec<f64>,
    /// Logarithm of the radiance of the surroundings just after the start of every segment of the curve.
    surroundings_at_starts: Vec<f64>,
}

/// The curve of the readings of a pyrometer, of a member and its derivatives.
pub(crate) struct PyrometerCurve<'a> {
    /// Index of the sensor in the case.
    pub(crate) sensor: usize,
    curve: &'a RecordInterpolation,
    rows: usize,
    /// Row × record, K.
    records: Vec<f64>,
    /// Row × segment, K.
    starts: Vec<f64>,
}

impl PyrometerCurve<'_> {
    /// The peak of the member, and the derivatives of the reading at the time of the peak.
    pub(crate) fn peaks(&self) -> impl Iterator<Item = Peak> {
        let [records, starts] = [&self.records, &self.starts].map(|values| values.len() / self.rows);
        let point = self.curve.highest(&self.records[..records], Some(&self.starts[..starts]));
        let start = self.curve.segment_starts()[point.segment];
        (0..self.rows).map(move |row| {
            let mut records_k = self.records[row * records..(row + 1) * records].to_vec();
            records_k[start] = self.starts[row * starts + point.segment];
            Peak { temperature_k: value_at(&point.stencil, &records_k), time_s: point.time_s }
        })
    }

    /// The time for which the member is above a temperature, s.
    pub(crate) fn time_above_s(&self, limit_k: f64) -> f64 {
        let [records, starts] = [&self.records, &self.starts].map(|values| values.len() / self.rows);
        self.curve.time_above_s(&self.records[..records], Some(&self.starts[..starts]), limit_k)
    }
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

/// The pyrometers of a case at the instants and records of a plan.
pub(super) fn pyrometer_readings(
    case: &Case,
    instants_s: &[f64],
    curve: &RecordInterpolation,
) -> Vec<PyrometerReading> {
    let Face::Open(open) = &case.exposure.hot_face else { return Vec::new() };
    let emissivity = match (open.emissivity, case.layup.plies.first()) {
        (Emissivity::Material, Some(ply)) => ply.material.emissivity.clone(),
        (Emissivity::Constant(emissivity), _) => Table::constant(emissivity),
        (Emissivity::Material, None) => return Vec::new(),
    };
    let of_sensor = |(sensor, pyrometer): (usize, crate::case::Pyrometer)| {
        let radiance = pyrometer.spectrum.radiance();
        PyrometerReading {
            sensor,
            radiance,
            setting: pyrometer.emissivity,
            emissivity: emissivity.clone(),
            surroundings: Vec::new(),
            curve: curve.clone(),
            stencils: Vec::new(),
            surroundings_at_records: Vec::new(),
            surroundings_at_starts: Vec::new(),
        }
        .with_surroundings(&open.surroundings_k, instants_s, curve)
    };
    let pyrometers = case.sensors.iter().enumerate();
    pyrometers.filter_map(|(index, sensor)| Some((index, sensor.pyrometer?))).map(of_sensor).collect()
}

impl PyrometerReading {
    /// The same instrument under another exposure.
    pub(super) fn with_exposure(&self, exposure: &Exposure, instants_s: &[f64], curve: &RecordInterpolation) -> Self {
        match &exposure.hot_face {
            Face::Open(open) => self.clone().with_surroundings(&open.surroundings_k, instants_s, curve),
            Face::Held(_) => self.clone(),
        }
    }

    fn with_surroundings(self, surroundings_k: &Schedule, instants_s: &[f64], records: &RecordInterpolation) -> Self {
        let (curve, stencils) = records.with_corners(surroundings_k.times_s());
        let records_s = curve.record_times_s();
        let starts_s = curve.segment_starts().iter().map(|&record| records_s[record]);
        let of = |temperature_k: f64| self.radiance.logarithm(temperature_k);
        Self {
            surroundings: instants_s.iter().map(|&time_s| of(surroundings_k.after(time_s))).collect(),
            surroundings_at_records: records_s.iter().map(|&time_s| of(surroundings_k.before(time_s))).collect(),
            surroundings_at_starts: starts_s.map(|time_s| of(surroundings_k.after(time_s))).collect(),
            stencils,
            curve,
            ..self
        }
    }

    /// The same instrument up to an instant; `records` is the truncated curve of the march.
    pub(super) fn truncated_at(&self, instant: usize, records: &RecordInterpolation) -> Self {
        let last_s = records.record_times_s()[records.last_record()];
        let last = self.curve.record_times_s().partition_point(|&time_s| time_s <= last_s) - 1;
        let curve = self.curve.until_record(last);
        Self {
            surroundings: self.surroundings[..=instant].to_vec(),
            stencils: self.stencils[..=last].to_vec(),
            surroundings_at_records: self.surroundings_at_records[..=last].to_vec(),
            surroundings_at_starts: self.surroundings_at_starts[..curve.segment_starts().len()].to_vec(),
            curve,
            ..self.clone()
        }
    }

    /// The curve of one member and its derivatives, from rows of temperatures of the face over the records of the
    /// march.
    fn read_curve(&self, rows: &[&[f64]], factor: f64, derivative_row: Option<usize>) -> PyrometerCurve<'_> {
        let at_records = rows.iter().flat_map(|row| self.stencils.iter().map(|taps| value_at(taps, row)));
        let mut records: Vec<f64> = at_records.collect();
        let (length, segments) = (self.stencils.len(), self.curve.segment_starts());
        let at_starts = records.chunks_exact(length).flat_map(|row| segments.iter().map(|&start| row[start]));
        let mut starts: Vec<f64> = at_starts.collect();
        self.read(&mut records, &self.surroundings_at_records, 0, length, factor, derivative_row);
        self.read(&mut starts, &self.surroundings_at_starts, 0, segments.len(), factor, derivative_row);
        PyrometerCurve { sensor: self.sensor, curve: &self.curve, rows: rows.len(), records, starts }
    }

    /// Replace the temperatures of the face in the rows of one member, from `place` of each row, by readings, and their
    /// derivatives by those of the readings.
    fn read(
        &self,
        rows: &mut [f64],
        surroundings: &[f64],
        place: usize,
        row_length: usize,
        factor: f64,
        derivative_row: Option<usize>,
    ) {
        for (instant, &surroundings) in surroundings.iter().enumerate() {
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
                let place = pyrometer.sensor * instants;
                pyrometer.read(rows, &pyrometer.surroundings, place, row_length, factor, traces.derivative_row);
            }
        }
    }

    /// The readings of the pyrometers of the `index`-th of some members: `records_k` has the rows of the member and its
    /// derivatives, sensors over records.
    pub(crate) fn pyrometer_curves(
        &self,
        records_k: &[f64],
        traces: &TraceRows,
        index: usize,
    ) -> Vec<PyrometerCurve<'_>> {
        let Some(&factor) = traces.emissivity_factors.get(index) else { return Vec::new() };
        let records = self.rows.records;
        let row_length = self.rows.sensor_locations.len() * records;
        let mut curves = Vec::with_capacity(self.pyrometers.len());
        for pyrometer in &self.pyrometers {
            let rows: Vec<&[f64]> =
                records_k.chunks_exact(row_length).map(|row| &row[pyrometer.sensor * records..][..records]).collect();
            curves.push(pyrometer.read_curve(&rows, factor, traces.derivative_row));
        }
        curves
    }
}
