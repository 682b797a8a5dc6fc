//! The trade study.

use super::running_study::{RunningStudy, end_of_log};
use super::{Session, SessionError, with_tolerance};
use crate::case::Case;
use crate::kept_work::MARCHES;
use crate::kept_work::sweep_piece::fingerprint;
use crate::question;
use crate::study::size::{LOG_COLUMNS, SizeError};
use crate::study::trade::{Trade, trade};

impl Session {
    /// The layups of all choices of materials, each sized for its limit under all exposures, by their mass per area.
    ///
    /// # Errors
    /// When an option is wrong, a layup is no valid case, the ply cannot be sized, the device fails or the march is
    /// cancelled. That no allowed thickness suffices for a layup is no error: see [`Trade`].
    pub fn trade(&mut self, question: &question::Trade) -> Result<Trade, SessionError> {
        let tolerance_k = self.options.tolerance_k;
        let exposures: Vec<Case> =
            question.exposures()?.into_iter().map(|other| with_tolerance(other, tolerance_k)).collect();
        let (request, layups) = question.resolved(&self.case, &exposures)?;
        let draw = question.draw.sweep(question.members);
        self.run(&question.clone().into(), self.case.clone(), question.members, |study| {
            study.predict(draw.bounds)?;
            study.answers.other_cases = exposures;
            study.answers.other_cases.iter().for_each(|case| study.answers.run.add_files(case));
            // Files of materials that only candidates have; those of the exposures are the same.
            let candidates = layups.iter().filter_map(|layup| layup.cases.first());
            candidates.for_each(|case| study.answers.run.add_files(case));
            let mut log = {
                let cases = layups.iter().flat_map(|layup| &layup.cases).map(fingerprint).collect::<Vec<_>>();
                let options = format!("{request:?}, {draw:?}, {}", cases.join(" "));
                study.row_keeper(MARCHES, &options, (LOG_COLUMNS, None))?
            };
            let RunningStudy { march, answers, .. } = study;
            let found = trade(&layups, *march, &request, &draw, &mut log);
            answers.run.remarks.extend(end_of_log(log, matches!(found, Err(SizeError::March(_)))));
            let found = found?;
            answers.seed = Some(draw.sampling.seed);
            answers.trade = Some(found.clone());
            Ok(found)
        })
    }
}
