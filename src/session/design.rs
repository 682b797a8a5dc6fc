//! The design of an experiment.

use super::{DesignOptions, ESTIMATE_MEMBERS, RunningStudy, Session, SessionError, adapted, with_tolerance};
use crate::case::Case;
use crate::march::March;
use crate::study::experiment_design::{ExperimentDesign, design_experiment};

impl Session {
    /// The depths of thermocouples, the exposure and the run length from which factors are estimated best, with the
    /// standard errors to expect.
    ///
    /// # Errors
    /// When an option is wrong, there is no room for the thermocouples, another case lacks a factor or the target, the
    /// device fails or has no derivatives, or the march is cancelled.
    pub fn design(&mut self, options: &DesignOptions) -> Result<ExperimentDesign, SessionError> {
        let request = options.request(&self.case)?;
        self.run("design", self.case.clone(), ESTIMATE_MEMBERS, |study| {
            study.predict()?;
            let RunningStudy { march, answers, options: of_session, .. } = study;
            let others = options.others.iter().map(|other| with_tolerance(other.clone(), of_session.tolerance_k));
            answers.other_cases = others.collect();
            answers.other_cases.iter().for_each(|case| answers.run.add_files(case));
            let cases: Vec<Case> = std::iter::once(&answers.case).chain(&answers.other_cases).cloned().collect();
            let monitor = march.monitor();
            march.begin_sweep(cases.len() * request.members);
            let found = design_experiment(&cases, *march, &request, &mut |case| adapted(case, of_session, &monitor))?;
            answers.seed = Some(request.seed);
            answers.experiment_design = Some(found.clone());
            Ok(found)
        })
    }
}
