//! The design of an experiment.

use super::options::checked_noise_k;
use super::{DesignOptions, ESTIMATE_MEMBERS, RunningStudy, Session, SessionError, adapted, with_tolerance};
use crate::adapt::with_nominal_rounding;
use crate::case::Case;
use crate::march::March;
use crate::study::estimate::{SearchOptions, estimate};
use crate::study::experiment_design::{DesignRequest, ExperimentDesign, SampleNoise, design_experiment};

impl Session {
    /// The depths of thermocouples, the exposure and the run length from which factors are estimated best, with the
    /// standard errors to expect. Noise that the options do not state is that of the residuals of an estimate, if the
    /// case has observations.
    ///
    /// # Errors
    /// When an option is wrong, there is no room for the thermocouples, another case lacks a factor or the target, the
    /// device fails or has no derivatives, or the march is cancelled.
    pub fn design(&mut self, options: &DesignOptions) -> Result<ExperimentDesign, SessionError> {
        let mut request = options.request(&self.case)?;
        self.run("design", self.case.clone(), ESTIMATE_MEMBERS, |study| {
            study.predict()?;
            if request.noise.is_assumed() && study.answers.case.fitted_observations().next().is_some() {
                request.noise = study.noise_of_residuals(&request)?;
            }
            let RunningStudy { march, answers, options: of_session, .. } = study;
            let others = options.others.iter().map(|other| with_tolerance(other.clone(), of_session.tolerance_k));
            answers.other_cases = others.collect();
            answers.other_cases.iter().for_each(|case| answers.run.add_files(case));
            let cases: Vec<Case> = std::iter::once(&answers.case).chain(&answers.other_cases).cloned().collect();
            let monitor = march.monitor();
            march.begin_sweep(cases.len() * request.members);
            let precision = march.backend().precision;
            let mut adapt = |case: &Case| with_nominal_rounding(case, adapted(case, of_session, &monitor)?, precision);
            let found = design_experiment(&cases, *march, &request, &mut adapt)?;
            answers.seed = Some(request.seed);
            answers.experiment_design = Some(found.clone());
            Ok(found)
        })
    }
}

impl RunningStudy<'_> {
    /// The noise of a design, with what is not stated from an estimate of the factors that the case states, or of those
    /// of the design.
    fn noise_of_residuals(&mut self, request: &DesignRequest) -> Result<SampleNoise, SessionError> {
        let mut case = self.answers.case.clone();
        if case.estimate.factors.is_empty() {
            let place = |name: &String| case.factors.iter().position(|factor| factor.name == *name);
            case.estimate.factors = request.factors.iter().filter_map(place).collect();
        }
        let search = SearchOptions { landscape: false, ..SearchOptions::for_precision(self.march.backend().precision) };
        let noise = request.noise.or_estimated(&estimate(&[(&case, self.plan)], self.march, &search)?);
        checked_noise_k(noise.deviation_k)?;
        Ok(noise)
    }
}
