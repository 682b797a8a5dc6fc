//! The findings at the head of the page.

use super::reportable::{self, Finding};
use super::{format, observations};
use crate::study::answers::Answers;
use crate::traces::MemberStatus;

/// All findings: the nominal peak of the deepest sensor and its misfit, the data used, then those of every result.
pub(super) fn all(answers: &Answers) -> Vec<Finding> {
    let mut found = Vec::new();
    let mut add = |about: &'static str, text: String| found.push(Finding { label: about, text });
    let completed = answers.nominal_march().filter(|march| march.status == MemberStatus::Completed);
    if let (Some(nominal), Some(sensor)) = (completed, answers.deepest_sensor()) {
        let name = answers.sensor_name(&answers.case, sensor);
        let peak = nominal.peaks[sensor];
        add(
            "Peak",
            format!(
                "{name}, the deepest sensor, peaks at {} at {}.",
                format::kelvin(peak.temperature_k),
                format::seconds(peak.time_s)
            ),
        );
        let seen = answers.case.observations.iter().zip(&nominal.misfits).find(|(seen, _)| seen.sensor == sensor);
        if let Some((_, misfit)) = seen {
            let way = if misfit.bias_k > 0.0 { "hot" } else { "cold" };
            add(
                "Misfit",
                format!(
                    "{name}, nominal prediction less measurement in the data window: RMSE {}, mean error {} (too \
                     {way}), largest error {} at {}.",
                    format::temperature_difference(misfit.rms_k),
                    format::temperature_difference(misfit.bias_k.abs()),
                    format::temperature_difference(misfit.worst_k.abs()),
                    format::seconds(misfit.worst_time_s)
                ),
            );
        }
    }
    let each = reportable::in_reading_order(answers);
    if each.iter().all(|answer| answer.uses_observations()) {
        observations::data_used(answers).into_iter().for_each(|text| add("Data", text));
    }
    found.extend(each.into_iter().flat_map(|answer| answer.findings(answers)));
    found
}
