//! Marches of members at individual thicknesses.

use super::required_thickness::{RequiredThickness, ThicknessSearch};
use super::scalable_case::ScalableCase;
use crate::case::Case;
use crate::ensemble::Ensemble;
use crate::kept_work::work_log::WorkLog;
use crate::march::{March, MarchError, march_members};
use crate::plan::Plan;
use crate::study::nominal::Peak;
use crate::study::uncertainty::{Failure, failure_reason};
use crate::traces::MemberStatus;
use std::collections::BTreeMap;

/// Marches of a case at any thickness. The case has the one limit of the requirement.
pub(in crate::study) struct ThicknessMarch<'a> {
    pub scalable: &'a ScalableCase,
    pub plan: &'a Plan,
    pub march: &'a mut dyn March,
    /// Has a row for each member that is marched.
    pub log: &'a mut dyn WorkLog,
    /// Members that were marched.
    pub marches: usize,
}

/// Where the search of a member begins, and between which thicknesses, m.
#[derive(Clone, Copy)]
pub(in crate::study) struct SearchStart {
    pub within_m: (f64, f64),
    pub first_m: f64,
}

/// Peak of a member, infinite where it failed, and the reason of the failure.
pub(in crate::study) struct MemberPeak {
    pub peak: Peak,
    pub failed: Option<String>,
}

/// Numbers of a row of the log: temperature and time of the peak, and the status.
pub(crate) const LOG_COLUMNS: usize = 3;

/// The status in the log: 0 is completed, 1 diverged, and from 2 the ply whose table was left.
fn status_number(status: &MemberStatus) -> f64 {
    match status {
        MemberStatus::Completed => 0.0,
        MemberStatus::Diverged { .. } => 1.0,
        MemberStatus::OutOfTable { ply, .. } => (2 + ply) as f64,
    }
}

impl MemberPeak {
    /// From a row of the log. The reason of a failure depends on neither its time nor its temperature.
    fn of_row(case: &Case, row: &[f64]) -> Self {
        let status = match row[2] as usize {
            0 => MemberStatus::Completed,
            1 => MemberStatus::Diverged { time_s: f64::NAN },
            of_ply => MemberStatus::OutOfTable { ply: of_ply - 2, temperature_k: f64::NAN },
        };
        Self { peak: Peak { temperature_k: row[0], time_s: row[1] }, failed: failure_reason(case, &status) }
    }
}

/// The required thickness of each member, and the reason of each that failed at a thickness.
pub(in crate::study) struct RequiredThicknesses {
    pub required: Vec<RequiredThickness>,
    pub failed: BTreeMap<usize, String>,
}

/// Failures by reason.
pub(in crate::study) fn by_reason(failed: BTreeMap<usize, String>) -> Vec<Failure> {
    let mut failures: Vec<Failure> = Vec::new();
    for (first, reason) in failed {
        match failures.iter_mut().find(|failure| failure.reason == reason) {
            Some(failure) => failure.members += 1,
            None => failures.push(Failure { reason, members: 1, first }),
        }
    }
    failures
}

impl ThicknessMarch<'_> {
    /// Peaks of members at their thicknesses, marched as one ensemble.
    pub(in crate::study) fn peaks(
        &mut self,
        members: impl Iterator<Item = (Vec<f64>, f64)>,
    ) -> Result<Vec<MemberPeak>, MarchError> {
        let rows =
            members.flat_map(|(factors, thickness_m)| self.scalable.member_factors(&factors, thickness_m)).collect();
        let ensemble = Ensemble::from_values(self.scalable.case.factors.len(), rows);
        self.marches += ensemble.len();
        let mut met = Vec::with_capacity(ensemble.len());
        while met.len() < ensemble.len()
            && let Some(row) = self.log.next()
        {
            met.push(MemberPeak::of_row(&self.scalable.case, row));
        }
        let members = met.len()..ensemble.len();
        march_members(self.march, self.plan, &ensemble, members, &mut |traces| {
            for member in 0..traces.members() {
                let status = &traces.statuses[member];
                let mut peak = traces.limited_peak(member, 0);
                if *status != MemberStatus::Completed {
                    peak.temperature_k = f64::INFINITY;
                }
                self.log.add(&[peak.temperature_k, peak.time_s, status_number(status)]);
                met.push(MemberPeak { peak, failed: failure_reason(&self.scalable.case, status) });
            }
        })?;
        Ok(met)
    }

    /// The required thickness of each member that has a start. Each iteration marches all unfinished members as one
    /// ensemble.
    pub(in crate::study) fn required_thicknesses(
        &mut self,
        starts: &[SearchStart],
        curve: &[(f64, Peak)],
        factors: impl Fn(usize) -> Vec<f64>,
    ) -> Result<RequiredThicknesses, MarchError> {
        let limit_k = self.scalable.case.limits[0].limit_k;
        let mut searches: Vec<ThicknessSearch> =
            starts.iter().map(|start| ThicknessSearch::new(start.within_m)).collect();
        let mut failed: BTreeMap<usize, String> = BTreeMap::new();
        loop {
            let open: Vec<usize> = (0..starts.len()).filter(|&member| searches[member].found.is_none()).collect();
            if open.is_empty() {
                break;
            }
            let next = |&member: &usize| {
                let guess = |at_m, off_k| guess_thickness_m(curve, at_m, off_k);
                searches[member].next_trial_m(starts[member].first_m, guess)
            };
            let thicknesses_m: Vec<f64> = open.iter().map(next).collect();
            let rows = open.iter().zip(&thicknesses_m).map(|(&member, &thickness_m)| (factors(member), thickness_m));
            let met = self.peaks(rows)?;
            for ((&member, &thickness_m), met) in open.iter().zip(&thicknesses_m).zip(met) {
                searches[member].record(thickness_m, met.peak.temperature_k - limit_k);
                if let Some(reason) = met.failed {
                    failed.insert(member, reason);
                }
            }
        }
        Ok(RequiredThicknesses { required: searches.iter().filter_map(|search| search.found).collect(), failed })
    }
}

/// The thickness at which the nominal peak is lower by `lower_k` than at `at_m`, along the nominal curve; the end of
/// the curve where it is outside.
pub(in crate::study) fn guess_thickness_m(curve: &[(f64, Peak)], at_m: f64, lower_k: f64) -> f64 {
    let along = |pair: &[(f64, Peak)], value: f64, of: fn(&(f64, Peak)) -> f64, to: fn(&(f64, Peak)) -> f64| {
        let share = (value - of(&pair[0])) / (of(&pair[1]) - of(&pair[0]));
        to(&pair[0]) + share * (to(&pair[1]) - to(&pair[0]))
    };
    let (thickness, peak) = (|point: &(f64, Peak)| point.0, |point: &(f64, Peak)| point.1.temperature_k);
    let (first, last) = (&curve[0], &curve[curve.len() - 1]);
    let here = curve.windows(2).find(|pair| at_m <= pair[1].0);
    let target_k = here.map_or(peak(last), |pair| along(pair, at_m, thickness, peak)) - lower_k;
    if target_k >= peak(first) {
        return first.0;
    }
    let there = curve.windows(2).find(|pair| peak(&pair[1]) <= target_k && peak(&pair[0]).is_finite());
    there.map_or(last.0, |pair| along(pair, target_k, peak, thickness))
}

#[cfg(test)]
mod tests {
    use super::super::scalable_case::with_scaled_plies;
    use super::*;
    use crate::adapt::adapt;
    use crate::case::{LimitedPart, TemperatureLimit};
    use crate::kept_work::work_log::NoLog;
    use crate::march::Precision;
    use crate::march::cpu::Cpu;
    use crate::study::nominal::nominal;

    /// Nominal peak of a part at a thickness ratio: by the thickness factor, and by a case with scaled plies.
    fn peaks_k(mut case: Case, group: &str, part: &str, ratio: f64) -> (f64, f64) {
        case.resolution.cells = 64;
        let parts = LimitedPart::all(&case.layup, &case.sensors);
        let part = parts.into_iter().find(|found| found.name(&case.layup, &case.sensors) == part);
        let (part, limit_k) = (part.expect("a part of the case"), 600.0);
        case.limits = vec![TemperatureLimit { part, limit_k }];
        let mut march = Cpu::new(Precision::F64);
        let scalable = ScalableCase::new(&case, group).expect("a ply of the case");
        let (drawn_m, plies) = (scalable.case_thickness_m, scalable.plies.clone());
        let (plan, mut log) = (adapt(&scalable.case).expect("a march"), NoLog);
        let mut trial =
            ThicknessMarch { scalable: &scalable, plan: &plan, march: &mut march, log: &mut log, marches: 0 };
        let row: Vec<f64> = case.factors.iter().map(|factor| factor.nominal).collect();
        let met = trial.peaks(std::iter::once((row, ratio * drawn_m))).expect("a march");
        let anew = with_scaled_plies(&case, &plies, ratio);
        let again = nominal(&anew, &Plan::new(&anew), &mut march).expect("a march");
        (met[0].peak.temperature_k, again.margins[0].peak.temperature_k)
    }

    #[test]
    fn scaling_by_a_factor_equals_scaling_the_layup_for_parts_behind_and_within() {
        let lcat = || Case::load("cases/lcat-2259".as_ref()).expect("a shipped case");
        for (group, part, ratio) in [
            ("INS", "TC4", 1.6),
            ("INS", "TC3", 1.6),
            ("INS1", "TC4", 0.5),
            ("GB", "TC4", 2.0),
            ("INS", "INS2/GB", 1.6),
            ("INS", "GB", 1.6),
        ] {
            let (stretched_k, drawn_k) = peaks_k(lcat(), group, part, ratio);
            // The two grids distribute 64 cells differently: half a kelvin.
            assert!((stretched_k - drawn_k).abs() < 0.5, "{group} {part}: {stretched_k} and {drawn_k}");
        }
        let mut within = lcat();
        within.sensors[2].depth_m = 2.5e-3;
        let anew = with_scaled_plies(&within, &[2, 3], 2.0);
        assert!((anew.sensors[2].depth_m - (1.02e-3 + 2.0 * 1.48e-3)).abs() < 1e-12);
        assert_eq!(anew.sensors[3].depth_m, anew.layup.faces_m()[3], "a sensor on an interface stays on it");
        assert_eq!(anew.sensors[0].depth_m, within.sensors[0].depth_m, "a sensor ahead of the ply does not move");
    }

    #[test]
    fn a_guess_follows_the_curve_and_ends_with_it() {
        let peak = |temperature_k| Peak { temperature_k, time_s: 0.0 };
        let curve = [(1.0, peak(f64::INFINITY)), (2.0, peak(900.0)), (3.0, peak(700.0)), (4.0, peak(600.0))];
        assert!((guess_thickness_m(&curve, 2.5, 100.0) - 3.0).abs() < 1e-12);
        assert!((guess_thickness_m(&curve, 4.0, -50.0) - 3.5).abs() < 1e-12);
        assert_eq!((guess_thickness_m(&curve, 3.0, 400.0), guess_thickness_m(&curve, 3.0, f64::INFINITY)), (4.0, 4.0));
    }
}
