//! Gauges within their bounds: mass lost and the fronts of conversion never fall, fronts lie in the layup, char above
//! virgin material, and gas flows in only by Darcy's law.
//!
//! A cubic between records overshoots where a front starts, crosses a ply at once or arrives at the back face, and
//! where the last gas leaves; so does extrapolation from two resolutions, whose fronts arrive at different times.

use crate::physics::layout::GasTransport;
use crate::plan::Plan;
use crate::traces::{Gauge, GaugePeak, Traces};
use rayon::prelude::*;

/// Members whose gauges a task bounds at least: some ten microseconds.
const MEMBERS_PER_TASK: usize = 16;

/// Gauges that never fall.
const RISING: [Gauge; 3] = [Gauge::MassLost, Gauge::VirginFront, Gauge::CharFront];

/// Call `change` with the row, the values of every gauge at every instant and their peaks, for each member whose gauges
/// are recorded; rows between members are derivatives.
fn for_each_member(
    traces: &mut Traces,
    rows_per_member: usize,
    change: impl Fn(usize, &mut [f64], &mut [GaugePeak]) + Sync,
) {
    let values = traces.gauges.par_chunks_exact_mut((Gauge::ALL.len() * traces.instants).max(1));
    let members = values.zip(traces.gauge_peaks.par_chunks_exact_mut(Gauge::ALL.len())).enumerate();
    let members = members.step_by(rows_per_member).with_min_len(MEMBERS_PER_TASK);
    members.for_each(|(row, (values, peaks))| change(row, values, peaks));
}

/// Readings between two records lie between them where a gauge rises; no gas flows in where it leaves as it is made.
pub(super) fn keep_between_records(readings: &mut Traces, records: &[f64], plan: &Plan, rows_per_member: usize) {
    let (times_s, count, instants) = (plan.interpolation.record_times_s(), plan.rows.records, readings.instants);
    let (last, flows_in) = (times_s.len() - 1, plan.rows.gas == Some(GasTransport::Darcy));
    let after: Vec<usize> = plan
        .instants_s
        .iter()
        .map(|&instant_s| times_s.partition_point(|&time_s| time_s < instant_s).min(last))
        .collect();
    for_each_member(readings, rows_per_member, |row, values, _| {
        for (gauge, values) in Gauge::ALL.into_iter().zip(values.chunks_exact_mut(instants)) {
            let records = &records[(row * Gauge::ALL.len() + gauge as usize) * count..][..count];
            for (value, &after) in values.iter_mut().zip(&after) {
                let (one, other) = (records[after.saturating_sub(1)], records[after]);
                let (low, high) = (one.min(other), one.max(other));
                *value = match gauge {
                    gauge if RISING.contains(&gauge) => value.max(low).min(high),
                    Gauge::GasFlux if !flows_in => value.max(0.0),
                    _ => *value,
                };
            }
        }
    });
    keep_in_order(readings, plan, rows_per_member);
}

/// Fronts lie in the layup, char above virgin material, and neither they nor the mass lost fall.
pub(super) fn keep_in_order(traces: &mut Traces, plan: &Plan, rows_per_member: usize) {
    let layup_m: f64 = plan.rows.data.cells.iter().map(|cell| cell.width_m).sum();
    let instants = traces.instants;
    for_each_member(traces, rows_per_member, |_, values, peaks| order(values, peaks, instants, layup_m));
}

/// Bound gauges × instants and the peaks of gauges of one member.
fn order(values: &mut [f64], peaks: &mut [GaugePeak], instants: usize, layup_m: f64) {
    let bound = |virgin_m: &mut f64, char_m: &mut f64| {
        *virgin_m = virgin_m.max(0.0).min(layup_m);
        *char_m = char_m.max(0.0).min(*virgin_m);
    };
    let (virgin, char) = (Gauge::VirginFront as usize, Gauge::CharFront as usize);
    let (before, char_on) = values.split_at_mut(char * instants);
    before[virgin * instants..].iter_mut().zip(char_on).for_each(|(virgin_m, char_m)| bound(virgin_m, char_m));
    let (before, char_on) = peaks.split_at_mut(char);
    bound(&mut before[virgin].value, &mut char_on[0].value);
    // The last value is the best known: at the end of a ply or of the layup both resolutions agree.
    for gauge in RISING {
        let mut later = f64::INFINITY;
        for value in values[gauge as usize * instants..][..instants].iter_mut().rev() {
            later = later.min(*value);
            *value = later;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fronts_stay_in_the_layup_in_order_and_never_turn_back() {
        let (virgin_m, char_m) = ([0.0, 1.0, 3.2, 3.1, 5.4, 5.0], [-0.1, 1.5, 0.4, 2.0, 5.2, 5.2]);
        let mass_kg_m2 = [0.0, 2.0, 1.0, 3.0, 3.0, 3.0];
        let mut values = [[0.0; 6], mass_kg_m2, virgin_m, char_m, [0.0; 6], [0.0; 6]].concat();
        let mut peaks = [GaugePeak { value: 5.3, time_s: 4.0 }; 6];
        order(&mut values, &mut peaks, 6, 5.0);
        let of = |gauge: Gauge| &values[gauge as usize * 6..][..6];
        assert_eq!(of(Gauge::MassLost), [0.0, 1.0, 1.0, 3.0, 3.0, 3.0]);
        assert_eq!(of(Gauge::VirginFront), [0.0, 1.0, 3.1, 3.1, 5.0, 5.0]);
        assert_eq!(of(Gauge::CharFront), [0.0, 0.4, 0.4, 2.0, 5.0, 5.0]);
        let peak = |gauge: Gauge| peaks[gauge as usize].value;
        assert_eq!([peak(Gauge::VirginFront), peak(Gauge::CharFront), peak(Gauge::GasFlux)], [5.0, 5.0, 5.3]);
    }
}
