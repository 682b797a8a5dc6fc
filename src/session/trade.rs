//! The trade study.

#[cfg(feature = "serde")]
use super::checkpoint::MARCHES;
#[cfg(feature = "serde")]
use super::end_of_log;
use super::{RunningStudy, Session, SessionError, TradeOptions, with_tolerance};
use crate::case::Case;
#[cfg(feature = "serde")]
use crate::study::size::{LOG_COLUMNS, SizeError};
#[cfg(feature = "serde")]
use crate::study::sweep_piece::fingerprint;
use crate::study::trade::{Trade, trade};
#[cfg(not(feature = "serde"))]
use crate::study::work_log::NoLog;

impl Session {
    /// The layups of all choices of materials, each sized for its limit under all exposures, by their mass per area.
    ///
    /// # Errors
    /// When an option is wrong, a layup is no valid case, the ply cannot be sized, the device fails or the march is
    /// cancelled. That no allowed thickness suffices for a layup is no error: see [`Trade`].
    pub fn trade(&mut self, options: &TradeOptions) -> Result<Trade, SessionError> {
        let sweep = options.size.sweep;
        let tolerance_k = self.options.tolerance_k;
        let exposures: Vec<Case> =
            options.exposures.iter().map(|other| with_tolerance(other.clone(), tolerance_k)).collect();
        let (request, layups) = options.request(&self.case, &exposures)?;
        self.run("trade", self.case.clone(), sweep.members, |study| {
            study.predict(sweep.bounds)?;
            study.answers.other_cases = exposures;
            study.answers.other_cases.iter().for_each(|case| study.answers.run.add_files(case));
            let draw = sweep.sweep();
            #[cfg(feature = "serde")]
            let mut log = {
                let cases = layups.iter().flat_map(|layup| &layup.cases).map(fingerprint).collect::<Vec<_>>();
                let options = format!("{request:?}, {draw:?}, {}", cases.join(" "));
                study.row_keeper(MARCHES, &options, (LOG_COLUMNS, None))?
            };
            #[cfg(not(feature = "serde"))]
            let mut log = NoLog;
            let RunningStudy { march, answers, .. } = study;
            let found = trade(&layups, *march, &request, &draw, &mut log);
            #[cfg(feature = "serde")]
            answers.run.remarks.extend(end_of_log(log, matches!(found, Err(SizeError::March(_)))));
            let found = found?;
            answers.seed = Some(sweep.seed);
            answers.trade = Some(found.clone());
            Ok(found)
        })
    }
}
