//! The questions of a session, each with its answer.

use super::running_study::{RunningStudy, end_of_log};
use super::{Answers, ESTIMATE_MEMBERS, InputError, MembersCallback, Session, SessionError, SweepPart};
use crate::case::Bounds;
use crate::kept_work::work_log::{NoLog, WorkLog};
use crate::kept_work::{FITS, MARCHES};
use crate::march::{March, Precision};
use crate::question::{self, Goal, Question};
use crate::study::coverage_study::{self, CoverageStudy};
use crate::study::estimate::{ParameterEstimates, SearchOptions};
use crate::study::flux_inversion::{FluxInversion, invert_flux};
use crate::study::nominal::Prediction;
use crate::study::observation_check::{ObservationCheck, check_observations};
use crate::study::sensitivity::Sensitivity;
use crate::study::size::{LOG_COLUMNS, SizeError, Sizing, size};
use crate::study::twin::{SyntheticData, twin};
use crate::study::uncertainty::{Uncertainty, failure_reason};

impl Session {
    /// Ask a question. The method of its name returns the answer alone.
    ///
    /// # Errors
    /// When an option is wrong or without effect, the case lacks what the question needs, the device fails or the march
    /// is cancelled; for a part of a sweep and a single synthetic data set, which have no report.
    pub fn ask(&mut self, question: &Question) -> Result<&Answers, SessionError> {
        self.ask_with(question, &mut |_, _| {})
    }

    /// [`ask`](Self::ask), with a function that is called with every batch of members of a sweep.
    ///
    /// # Errors
    /// As [`ask`](Self::ask).
    pub fn ask_with(
        &mut self,
        question: &Question,
        members: &mut MembersCallback<'_>,
    ) -> Result<&Answers, SessionError> {
        let without_report = |what: &str| SessionError::from(InputError::general(format!("{what} has no report")));
        match question {
            Question::Predict(question) => self.predict_as(question).map(drop)?,
            Question::Observations(_) => self.observations().map(drop)?,
            Question::Uncertainty(question) => match question.goal {
                Goal::Whole => self.uncertainty_with(question, members).map(drop)?,
                Goal::Until(_) => self.uncertainty_until(question, members).map(drop)?,
                Goal::Part(_) | Goal::Piece { .. } => return Err(without_report("a part of a sweep")),
            },
            Question::Sensitivity(question) => self.sensitivity(question).map(drop)?,
            Question::Estimate(question) => self.estimate(question).map(drop)?,
            Question::Study(question) => self.study(question).map(drop)?,
            Question::Size(question) => self.size(question).map(drop)?,
            Question::Trade(question) => self.trade(question).map(drop)?,
            Question::Design(question) => self.design(question).map(drop)?,
            Question::History(question) => self.history(question).map(drop)?,
            Question::Twin(question) if question.data_sets.is_some() => self.twin_study(question).map(drop)?,
            Question::Twin(_) => return Err(without_report("a single synthetic data set")),
        }
        self.answers().ok_or_else(|| InputError::general("the question has no answers").into())
    }

    /// Temperatures and heat balance at nominal factors, compared with the observations.
    ///
    /// # Errors
    /// When the device fails or the march is cancelled.
    pub fn predict(&mut self) -> Result<Prediction, SessionError> {
        self.predict_as(&question::Predict::default())
    }

    fn predict_as(&mut self, question: &question::Predict) -> Result<Prediction, SessionError> {
        question.check(&self.case)?;
        self.run(&question.clone().into(), self.case.clone(), 1, |study| {
            let found = study.predict(Bounds::Small)?;
            study.depth_profiles(question.depth_profiles.as_ref(), None)?;
            Ok(found)
        })
    }

    /// What was read of the observations: rate, gaps, noise, spikes, channels that are stuck or open, drift before the
    /// start. Nothing is marched and no sample is changed.
    ///
    /// # Errors
    /// When the case has no observations, or the device fails.
    pub fn observations(&mut self) -> Result<ObservationCheck, SessionError> {
        let question = question::Observations {};
        question.check(&self.case)?;
        self.run(&question.into(), self.case.clone(), 1, |study| {
            let found = check_observations(&study.answers.case);
            study.answers.observation_check = Some(found.clone());
            Ok(found)
        })
    }

    /// A Monte Carlo sweep over the factors: percentiles of temperatures, and sensitivity indices of the factors.
    ///
    /// A sweep that is stopped answers from the members that are complete, if there are two: see
    /// [`Uncertainty::is_partial`].
    ///
    /// # Errors
    /// When an option is wrong, the case has no factors, the device fails or the march is cancelled.
    pub fn uncertainty(&mut self, question: &question::Uncertainty) -> Result<Uncertainty, SessionError> {
        self.uncertainty_with(question, &mut |_, _| {})
    }

    /// [`uncertainty`](Self::uncertainty), with a function that is called with every batch of members.
    ///
    /// # Errors
    /// As [`uncertainty`](Self::uncertainty).
    pub fn uncertainty_with(
        &mut self,
        question: &question::Uncertainty,
        members: &mut MembersCallback<'_>,
    ) -> Result<Uncertainty, SessionError> {
        question.check(&self.case)?;
        if question.goal != Goal::Whole {
            return Err(InputError::general("expected the goal of a whole sweep").into());
        }
        self.run(&question.clone().into(), self.case.clone(), question.members, |study| {
            study.predict(question.draw.sampling_bounds)?;
            let found = study.uncertainty(&question.sweep(), members)?;
            if !found.is_partial() {
                study.depth_profiles(question.depth_profiles.as_ref(), Some(&question.sweep()))?;
            }
            Ok(found)
        })
    }

    /// Statistics of a part of the members of a sweep, which can be merged with those of its other parts. They have no
    /// report.
    ///
    /// # Errors
    /// As [`uncertainty`](Self::uncertainty), and when the nominal march fails, as statistics are relative to it.
    pub fn uncertainty_part(
        &mut self,
        question: &question::Uncertainty,
        members: &mut MembersCallback<'_>,
    ) -> Result<SweepPart, SessionError> {
        question.check(&self.case)?;
        let (part, _) = question.part()?;
        let found = self.run(&question.clone().into(), self.case.clone(), question.members, |study| {
            let nominal = study.predict(Bounds::Small)?;
            if let Some(reason) = failure_reason(&study.answers.case, &nominal.status) {
                let message = format!("no statistics without a reference: the nominal march failed: {reason}");
                return Err(InputError::general(message).into());
            }
            let sweep_statistics = study.sweep_statistics(&question.sweep(), &nominal, part.clone(), members)?;
            if sweep_statistics.members() < part.len() {
                return Err(SessionError::Stopped);
            }
            let run = study.answers.run.clone();
            Ok(SweepPart { nominal, statistics: sweep_statistics, backend: study.march.backend(), run })
        });
        self.answers = None;
        found
    }

    /// Derivatives of all temperatures with respect to the factors, and which factors can be estimated together.
    ///
    /// # Errors
    /// When an option is wrong, the case has no factors, the device fails or the march is cancelled.
    pub fn sensitivity(&mut self, question: &question::Sensitivity) -> Result<Sensitivity, SessionError> {
        let case = question.prepared(&self.case)?;
        self.run(&question.clone().into(), case, ESTIMATE_MEMBERS, |study| {
            study.predict(study.answers.case.estimate.bounds)?;
            study.sensitivity(question)
        })
    }

    /// Fit factors to observations by least squares. The posterior and the comparison, if the question includes them,
    /// are in [`answers`](Self::answers).
    ///
    /// # Errors
    /// When an option is wrong, there are no factors to estimate or no observations, the device fails or the march is
    /// cancelled. A minimisation that does not converge is no error: see [`ParameterEstimates::converged`].
    pub fn estimate(&mut self, question: &question::Estimate) -> Result<ParameterEstimates, SessionError> {
        self.estimate_with_log(question, |_, _| Ok(NoLog))
    }

    /// [`estimate`](Self::estimate), with a log of the minimisations.
    pub(super) fn estimate_with_log<L: WorkLog>(
        &mut self,
        question: &question::Estimate,
        log: impl FnOnce(&RunningStudy<'_>, &SearchOptions) -> Result<L, SessionError> + Send,
    ) -> Result<ParameterEstimates, SessionError> {
        let prepared = question.prepared(&self.case)?;
        self.run(&question.clone().into(), prepared.case, ESTIMATE_MEMBERS, |study| {
            study.add_other_cases(prepared.others);
            prepared.comparison.iter().for_each(|case| study.answers.run.add_files(case));
            let found = study.estimate(&question.fit, question.walkers().as_ref(), log)?;
            if let Some(other) = prepared.comparison {
                study.compare(other, &question.fit, &found)?;
            }
            Ok(found)
        })
    }

    /// Prediction, uncertainty and sensitivity, and an estimate if the case has observations and factors for it.
    ///
    /// # Errors
    /// As those studies.
    pub fn study(&mut self, question: &question::Study) -> Result<&Answers, SessionError> {
        let (case, not_estimated) = question.prepared(&self.case)?;
        let sweep = question.draw.sweep(question.members);
        self.run(&question.clone().into(), case, question.members, |study| {
            study.predict(sweep.bounds)?;
            if study.uncertainty(&sweep, &mut |_, _| {})?.is_partial() {
                study.answers.not_estimated = Some("the sweep was stopped".to_owned());
                return Ok(());
            }
            study.depth_profiles(question.depth_profiles.as_ref(), Some(&sweep))?;
            study.sensitivity(&question::Sensitivity::default())?;
            if not_estimated.is_none() {
                study.estimate(&question.fit, question.walkers().as_ref(), |_, _| Ok(NoLog))?;
            }
            study.answers.not_estimated = not_estimated;
            Ok(())
        })?;
        self.answers().ok_or_else(|| InputError::general("the study has no answers").into())
    }

    /// The thickness of a ply that keeps a sensor below a temperature limit.
    ///
    /// # Errors
    /// When an option is wrong, the ply cannot be sized, the device fails or the march is cancelled. If no allowed
    /// thickness suffices, that is no error: see [`Sizing`].
    pub fn size(&mut self, question: &question::Size) -> Result<Sizing, SessionError> {
        let (demand, draw) = (question.resolved(&self.case)?, question.draw.sweep(question.members));
        self.run(&question.clone().into(), self.case.clone(), question.members, |study| {
            study.predict(draw.bounds)?;
            let mut log = study.row_keeper(MARCHES, &format!("{demand:?}, {draw:?}"), (LOG_COLUMNS, None))?;
            let RunningStudy { march, answers, .. } = study;
            let found = size(&answers.case, *march, &demand, &draw, &mut log);
            answers.run.remarks.extend(end_of_log(log, matches!(found, Err(SizeError::March(_)))));
            let found = found?;
            answers.seed = Some(draw.sampling.seed);
            answers.sizing = Some(found.clone());
            Ok(found)
        })
    }

    /// The heating of the hot face over time, from observations (inverse heat conduction).
    ///
    /// # Errors
    /// When an option is wrong, the case does not have the quantity to estimate, the device fails or the march is
    /// cancelled.
    pub fn history(&mut self, question: &question::History) -> Result<FluxInversion, SessionError> {
        let case = question.prepared(&self.case)?;
        self.run(&question.clone().into(), case, 1, |study| {
            study.predict(Bounds::Small)?;
            let RunningStudy { march, answers, .. } = study;
            let found = invert_flux(&answers.case, *march, question)?;
            answers.flux_inversion = Some(found.clone());
            Ok(found)
        })
    }

    /// One synthetic data set: the readings of the sensors for true values of the factors, with noise. It is computed
    /// in f64 unless the session has a precision, and has no report.
    ///
    /// # Errors
    /// When an option is wrong, the march with the true factors fails, the device fails or the march is cancelled.
    pub fn twin(&mut self, question: &question::Twin) -> Result<SyntheticData, SessionError> {
        let (truth, case) = (question.true_factors(&self.case)?, self.case.clone());
        let precision = self.options.march.precision.or(Some(Precision::F64));
        self.with_march(1, precision, |plan, march| {
            Ok(twin(&case, plan, march, truth, question.noise_k.unwrap_or(0.0), &question.noise())?)
        })
    }

    /// A coverage study: many synthetic data sets with random true factors are fitted, and the 95 % intervals that
    /// contain the truth are counted.
    ///
    /// # Errors
    /// When an option is wrong, there are no factors to estimate, the device fails or the march is cancelled. A fit
    /// that does not converge is counted.
    pub fn twin_study(&mut self, question: &question::Twin) -> Result<CoverageStudy, SessionError> {
        let case = question.prepared(&self.case)?;
        self.run(&question.clone().into(), case, question.data_sets.unwrap_or(0), |study| {
            let design = question.design(study.march.backend().precision);
            let mut log = {
                let size = (coverage_study::log_columns(&study.answers.case)?, Some(design.data_sets));
                study.row_keeper(FITS, &format!("{design:?}"), size)?
            };
            let found = study.coverage(&design, &mut log);
            {
                let is_complete = found.as_ref().is_ok_and(|found| !found.is_partial());
                study.answers.run.remarks.extend(end_of_log(log, !is_complete));
            }
            found
        })
    }
}
