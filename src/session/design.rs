//! The design of an experiment.

use super::{ESTIMATE_MEMBERS, RunningStudy, Session, SessionError, adapted, with_tolerance};
use crate::adapt::with_nominal_rounding;
use crate::case::{Case, Observation};
use crate::kept_work::work_log::NoLog;
use crate::march::March;
use crate::question::{self, InputError, named_cases};
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
    pub fn design(&mut self, question: &question::Design) -> Result<ExperimentDesign, SessionError> {
        let mut request = request(question, &self.case)?;
        let others: Vec<Case> = named_cases(&self.case, &question.others)?.into_iter().skip(1).cloned().collect();
        self.run(&question.clone().into(), self.case.clone(), ESTIMATE_MEMBERS, |study| {
            study.predict(question.sampling_bounds)?;
            if request.noise.is_assumed() && study.answers.case.fitted_observations().next().is_some() {
                request.noise = study.noise_of_residuals(&request)?;
            }
            let RunningStudy { march, answers, options: of_session, .. } = study;
            let others = others.into_iter().map(|other| with_tolerance(other, of_session.tolerance_k));
            answers.other_cases = others.collect();
            answers.other_cases.iter().for_each(|case| answers.run.add_files(case));
            let cases: Vec<Case> = std::iter::once(&answers.case).chain(&answers.other_cases).cloned().collect();
            let monitor = march.monitor();
            march.begin_sweep(cases.len() * request.question.members);
            let precision = march.backend().precision;
            let mut adapt = |case: &Case| with_nominal_rounding(case, adapted(case, of_session, &monitor)?, precision);
            let found = design_experiment(&cases, *march, &request, &mut adapt)?;
            answers.seed = Some(request.question.seed);
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
            case.estimate.factors = request.question.factors.iter().filter_map(place).collect();
        }
        let search = SearchOptions { landscape: false, ..SearchOptions::for_precision(self.march.backend().precision) };
        let noise = request.noise.or_estimated(&estimate(&[(&case, self.plan)], self.march, &search, &mut NoLog)?);
        Observation::checked_sigma_k(noise.deviation_k)
            .map_err(|message| InputError::general(format!("noise of the residuals of an estimate: {message}")))?;
        Ok(noise)
    }
}

/// A question with all that it leaves open to the case.
fn request(question: &question::Design, case: &Case) -> Result<DesignRequest, SessionError> {
    let question = question.resolved(case)?;
    let target = case.sensors.iter().position(|sensor| Some(&sensor.name) == question.target.as_ref()).unwrap_or(0);
    let noise = SampleNoise::stated(question.noise_k, question.correlation_time_s);
    Ok(DesignRequest { question, noise, target })
}
