//! Peaks of members, from the records at the steps of a march and the curve between them.
//!
//! Instants may be far apart: a pulse between two of them would leave no trace. Peaks, times above limits and extremes
//! of gauges are therefore found where the records are, for each batch, before readings at the instants replace them.

use crate::physics::layout::GasTransport;
use crate::plan::Plan;
use crate::plan::interpolation::value_at;
use crate::plan::pyrometer_readings::TraceRows;
use crate::traces::{Gauge, GaugePeak, Peak, Traces};
use rayon::prelude::*;

/// Members whose peaks a task finds at least: some ten microseconds.
const MEMBERS_PER_TASK: usize = 4;

/// Peaks of rows of traces, in the order of the fields of [`Traces`].
#[derive(Default)]
pub(super) struct RecordPeaks {
    pub(super) peaks: Vec<Peak>,
    pub(super) limited_peaks: Vec<Peak>,
    pub(super) times_above_s: Vec<f64>,
    pub(super) gauge_peaks: Vec<GaugePeak>,
}

impl RecordPeaks {
    /// The peaks of members and their derivatives, whose traces are over records.
    pub(super) fn of(records: &Traces, plan: &Plan, rows: &TraceRows) -> Self {
        let of_member = |index: usize| {
            let size = rows.rows_per_member * records.sensors * records.instants;
            let gauges = records.gauges.len() / (records.members() / rows.rows_per_member).max(1);
            let records_k = &records.temperatures_k[index * size..(index + 1) * size];
            Self::of_member(records_k, &records.gauges[index * gauges..(index + 1) * gauges], plan, rows, index)
        };
        let members = (0..records.members() / rows.rows_per_member).into_par_iter().with_min_len(MEMBERS_PER_TASK);
        members.map(of_member).collect::<Vec<Self>>().into_iter().fold(Self::default(), |mut all, member| {
            all.peaks.extend(member.peaks);
            all.limited_peaks.extend(member.limited_peaks);
            all.times_above_s.extend(member.times_above_s);
            all.gauge_peaks.extend(member.gauge_peaks);
            all
        })
    }

    /// The peaks of a member and its derivatives: row × sensor × record, and row × gauge × record.
    fn of_member(records_k: &[f64], gauges: &[f64], plan: &Plan, rows: &TraceRows, index: usize) -> Self {
        let (count, records, curve) = (rows.rows_per_member, plan.rows.records, &plan.interpolation);
        let all = plan.rows.sensor_locations.len();
        let pyrometers = plan.pyrometer_curves(records_k, rows, index);
        // Reading × row.
        let mut readings: Vec<Peak> = Vec::with_capacity(all * count);
        for reading in 0..all {
            if let Some(pyrometer) = pyrometers.iter().find(|pyrometer| pyrometer.sensor == reading) {
                readings.extend(pyrometer.peaks());
                continue;
            }
            let of_row = |row: usize| &records_k[(row * all + reading) * records..][..records];
            let point = curve.highest(of_row(0), None);
            let own = Peak { temperature_k: point.value, time_s: point.time_s };
            let held = plan.held_readings.iter().find(|held| held.sensor == reading);
            readings.push(held.map_or(own, |held| held.peak));
            readings.extend((1..count).map(|row| Peak { temperature_k: value_at(&point.stencil, of_row(row)), ..own }));
        }
        let peak = |row: usize, reading: usize| readings[reading * count + row];
        let sensors = plan.rows.sensors;
        let mut found = Self {
            peaks: (0..count * sensors).map(|place| peak(place / sensors, place % sensors)).collect(),
            ..Self::default()
        };
        for row in 0..count {
            for limit in &plan.limits {
                let prescribed = limit.prescribed_peak.filter(|prescribed| {
                    limit.is_prescribed() || prescribed.temperature_k > peak(0, limit.row).temperature_k
                });
                found.limited_peaks.push(match prescribed {
                    None => peak(row, limit.row),
                    Some(prescribed) if row == 0 => prescribed,
                    Some(Peak { time_s, .. }) => Peak { temperature_k: 0.0, time_s },
                });
                let marched_s = || match pyrometers.iter().find(|pyrometer| pyrometer.sensor == limit.row) {
                    Some(pyrometer) => pyrometer.time_above_s(limit.limit_k),
                    None => curve.time_above_s(&records_k[limit.row * records..][..records], None, limit.limit_k),
                };
                found.times_above_s.push(match row {
                    0 if limit.is_prescribed() => limit.prescribed_above_s,
                    0 => limit.prescribed_above_s.max(marched_s()),
                    _ => 0.0,
                });
            }
        }
        let gauge_records = |row: usize, gauge: usize| &gauges[(row * Gauge::ALL.len() + gauge) * records..][..records];
        let points: Vec<_> = (0..plan.gauges())
            .map(|gauge| {
                let own = gauge_records(0, gauge);
                let extreme =
                    own.iter().fold(0.0_f64, |most, value| if value.abs() > most.abs() { *value } else { most });
                let signed: Vec<f64> = own.iter().map(|value| value * extreme.signum()).collect();
                match Gauge::ALL[gauge] {
                    // A front jumps from a ply to the next, between which no curve leads; mass lost never falls.
                    Gauge::MassLost | Gauge::VirginFront | Gauge::CharFront => curve.highest_record(&signed),
                    // Just after a jump of the pressure or of a temperature, Darcy's law has no bound of the flux.
                    Gauge::GasFlux | Gauge::PeakPressure if plan.rows.gas == Some(GasTransport::Darcy) => {
                        curve.farthest_reading(own, &plan.instants_s)
                    }
                    _ => curve.highest(&signed, None),
                }
            })
            .collect();
        for row in 0..count {
            for (gauge, point) in points.iter().enumerate() {
                // Adding zero turns a negative zero into a positive one.
                let value = value_at(&point.stencil, gauge_records(row, gauge)) + 0.0;
                found.gauge_peaks.push(GaugePeak { value, time_s: point.time_s });
            }
        }
        found
    }
}
