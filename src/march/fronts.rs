//! Depths of the conversion fronts, kept as conversion is: it never falls, nowhere exceeds one, and is largest for the
//! smallest threshold.
//!
//! Records of a march are so. A cubic between records overshoots where a front starts, crosses a ply at once or
//! arrives at the back face, and so does extrapolation from two resolutions, whose fronts arrive at different times.

use crate::plan::Plan;
use crate::traces::{Gauge, GaugePeak, Traces};

/// Fronts of a member: values of every gauge at its instants, and its peaks.
struct Fronts<'a> {
    virgin_m: &'a mut [f64],
    char_m: &'a mut [f64],
    peaks: &'a mut [GaugePeak],
}

const VIRGIN: usize = Gauge::VirginFront as usize;
const CHAR: usize = Gauge::CharFront as usize;

/// Call `change` for each member whose fronts are recorded; rows between members are derivatives.
fn for_each_member(traces: &mut Traces, rows_per_member: usize, mut change: impl FnMut(usize, Fronts)) {
    let (gauges, instants) = (Gauge::ALL.len(), traces.instants);
    let values = traces.gauges.chunks_exact_mut((gauges * instants).max(1));
    let members = values.zip(traces.gauge_peaks.chunks_exact_mut(gauges)).enumerate().step_by(rows_per_member);
    for (row, (values, peaks)) in members {
        let (before, char_on) = values.split_at_mut(CHAR * instants);
        let (virgin_m, char_m) = (&mut before[VIRGIN * instants..], &mut char_on[..instants]);
        change(row, Fronts { virgin_m, char_m, peaks });
    }
}

/// Readings between records lie between them.
pub(super) fn keep_between_records(readings: &mut Traces, records: &[f64], plan: &Plan, rows_per_member: usize) {
    let (times_s, count) = (plan.interpolation.record_times_s(), plan.rows.records);
    let last = times_s.len() - 1;
    let after: Vec<usize> = plan
        .instants_s
        .iter()
        .map(|&instant_s| times_s.partition_point(|&time_s| time_s < instant_s).min(last))
        .collect();
    for_each_member(readings, rows_per_member, |row, fronts| {
        for (gauge, values) in [(VIRGIN, fronts.virgin_m), (CHAR, fronts.char_m)] {
            let records = &records[(row * Gauge::ALL.len() + gauge) * count..][..count];
            for (value, &after) in values.iter_mut().zip(&after) {
                let (one, other) = (records[after.saturating_sub(1)], records[after]);
                *value = value.max(one.min(other)).min(one.max(other));
            }
        }
    });
    keep_in_order(readings, plan, rows_per_member);
}

/// Fronts lie in the layup, char above virgin material, and never turn back.
pub(super) fn keep_in_order(traces: &mut Traces, plan: &Plan, rows_per_member: usize) {
    let layup_m: f64 = plan.rows.data.cells.iter().map(|cell| cell.width_m).sum();
    for_each_member(traces, rows_per_member, |_, fronts| order(fronts, layup_m));
}

fn order(fronts: Fronts, layup_m: f64) {
    let Fronts { virgin_m, char_m, peaks } = fronts;
    let pairs = virgin_m.iter_mut().zip(char_m.iter_mut());
    let peaks = peaks[VIRGIN..=CHAR].split_at_mut(1);
    let peaks = peaks.0.iter_mut().zip(peaks.1).map(|(virgin, char)| (&mut virgin.value, &mut char.value));
    for (virgin_m, char_m) in pairs.chain(peaks) {
        *virgin_m = virgin_m.max(0.0).min(layup_m);
        *char_m = char_m.max(0.0).min(*virgin_m);
    }
    // The last depth is the best known: at the end of a ply or of the layup both resolutions agree.
    for values in [virgin_m, char_m] {
        let mut later_m = f64::INFINITY;
        for value in values.iter_mut().rev() {
            later_m = later_m.min(*value);
            *value = later_m;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fronts_stay_in_the_layup_in_order_and_never_turn_back() {
        let mut virgin_m = [0.0, 1.0, 3.2, 3.1, 5.4, 5.0];
        let mut char_m = [-0.1, 1.5, 0.4, 2.0, 5.2, 5.2];
        let mut peaks = [GaugePeak { value: 5.3, time_s: 4.0 }; 6];
        order(Fronts { virgin_m: &mut virgin_m, char_m: &mut char_m, peaks: &mut peaks }, 5.0);
        assert_eq!(virgin_m, [0.0, 1.0, 3.1, 3.1, 5.0, 5.0]);
        assert_eq!(char_m, [0.0, 0.4, 0.4, 2.0, 5.0, 5.0]);
        assert_eq!([peaks[VIRGIN].value, peaks[CHAR].value, peaks[0].value], [5.0, 5.0, 5.3]);
    }
}
