//! What was found, in sentences: the same for the page and, shortened, for the screen.

use super::answer::{self, Finding};
use super::{observed, words};
use crate::study::answers::Answers;

/// All findings: the nominal peak of the deepest sensor and its misfit, what observations count for, then those of
/// every answer.
pub(super) fn all(answers: &Answers) -> Vec<Finding> {
    let mut found = Vec::new();
    let mut say = |about: &'static str, said: String| found.push(Finding { about, said });
    if let (Some(nominal), Some(sensor)) = (answers.nominal_march(), answers.bondline()) {
        let name = answers.sensor(&answers.case, sensor);
        let peak = nominal.peaks[sensor];
        say(
            "Peak",
            format!(
                "{name}, the deepest sensor, peaks at {} at {}.",
                words::kelvin(peak.temperature_k),
                words::seconds(peak.time_s)
            ),
        );
        let seen = answers.case.observations.iter().zip(&nominal.misfits).find(|(seen, _)| seen.sensor == sensor);
        if let Some((_, misfit)) = seen {
            let way = if misfit.bias_k > 0.0 { "hot" } else { "cold" };
            say(
                "Misfit",
                format!(
                    "Nominally {name} is predicted {} too {way} on average over the trusted window ({} root mean \
                     square, {} at worst, at {}).",
                    words::misfit(misfit.bias_k.abs()),
                    words::misfit(misfit.rms_k),
                    words::misfit(misfit.worst_k.abs()),
                    words::seconds(misfit.worst_time_s)
                ),
            );
        }
    }
    let each = answer::in_reading_order(answers);
    if each.iter().all(|answer| answer.uses_observations()) {
        observed::apart(answers).into_iter().for_each(|said| say("Trusted", said));
    }
    found.extend(each.into_iter().flat_map(|answer| answer.findings(answers)));
    found
}
