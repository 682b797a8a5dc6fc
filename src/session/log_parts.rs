//! Estimates from many starts and coverage studies whose minimisations other processes do. The result is bit-identical
//! to that of one process.

use super::{ESTIMATE_MEMBERS, InputError, RunningStudy, Session, SessionError};
use crate::case::Case;
use crate::kept_work::kept_rows::KeptRows;
use crate::kept_work::log_part::{LogPart, PartialLog};
use crate::march::March;
use crate::plan::Plan;
use crate::question;
use crate::study::coverage_study::{self, CoverageDesign, CoverageStudy};
use crate::study::estimate::{self, ParameterEstimates, SearchOptions};
use std::ops::Range;

impl Session {
    /// Some minimisations of an estimate: [`rounds`](question::Estimate::rounds) has their numbers. Those with priors
    /// need all of the data alone, which are taken from `earlier` or repeated.
    ///
    /// # Errors
    /// As [`estimate`](Self::estimate), and when there are no such minimisations.
    pub fn estimate_part(
        &mut self,
        question: &question::Estimate,
        rows: Range<usize>,
        earlier: &[LogPart],
    ) -> Result<LogPart, SessionError> {
        let prepared = question.prepared(&self.case)?;
        let found = self.run(&question.clone().into(), prepared.case, ESTIMATE_MEMBERS, |study| {
            study.add_other_cases(prepared.others);
            let search = question.fit.search(study.march.backend().precision);
            let plans = study.other_plans()?;
            let cases = std::iter::once(&study.answers.case).chain(&study.answers.other_cases);
            let runs: Vec<(&Case, &Plan)> = cases.zip(std::iter::once(study.plan).chain(&plans)).collect();
            let head = study.estimate_head(&search)?;
            check_rows(&rows, head.requested)?;
            let mut log = partial_log(&head, earlier)?;
            let found = estimate::log_rows(&runs, study.march, &search, rows.clone(), &mut log)?;
            Ok(LogPart::new(head, rows.start, &found))
        });
        self.answers = None;
        found
    }

    /// [`estimate`](Self::estimate), with minimisations that other processes have done; the others are done here.
    ///
    /// # Errors
    /// As [`estimate`](Self::estimate), and when the parts are of another estimate or one is missing between them.
    pub fn estimate_from(
        &mut self,
        question: &question::Estimate,
        parts: &[LogPart],
    ) -> Result<ParameterEstimates, SessionError> {
        self.estimate_with_log(question, |study, search| partial_log(&study.estimate_head(search)?, parts))
    }

    /// The fits of some data sets of a coverage study.
    ///
    /// # Errors
    /// As [`twin_study`](Self::twin_study), and when there are no such data sets.
    pub fn twin_study_part(
        &mut self,
        question: &question::Twin,
        data_sets: Range<usize>,
    ) -> Result<LogPart, SessionError> {
        let case = question.prepared(&self.case)?;
        let found = self.run(&question.clone().into(), case, question.data_sets.unwrap_or(0), |study| {
            let design = question.design(study.march.backend().precision);
            let head = study.coverage_head(&design)?;
            check_rows(&data_sets, head.requested)?;
            let (case, plan) = (&study.answers.case, study.plan);
            let found = coverage_study::log_rows(case, plan, study.march, &design, data_sets.clone())?;
            Ok(LogPart::new(head, data_sets.start, &found))
        });
        self.answers = None;
        found
    }

    /// [`twin_study`](Self::twin_study), with fits that other processes have done; the others are done here.
    ///
    /// # Errors
    /// As [`twin_study`](Self::twin_study), and when the parts are of another study or one is missing between them.
    pub fn twin_study_from(
        &mut self,
        question: &question::Twin,
        parts: &[LogPart],
    ) -> Result<CoverageStudy, SessionError> {
        let case = question.prepared(&self.case)?;
        self.run(&question.clone().into(), case, question.data_sets.unwrap_or(0), |study| {
            let design = question.design(study.march.backend().precision);
            let mut log = partial_log(&study.coverage_head(&design)?, parts)?;
            study.coverage(&design, &mut log)
        })
    }
}

impl RunningStudy<'_> {
    fn estimate_head(&self, search: &SearchOptions) -> Result<KeptRows, SessionError> {
        let cases: Vec<&Case> = std::iter::once(&self.answers.case).chain(&self.answers.other_cases).collect();
        let (columns, rows) = estimate::log_size(&cases, search)?;
        Ok(self.log_head(&format!("{search:?}"), (columns, Some(rows))))
    }

    fn coverage_head(&self, design: &CoverageDesign) -> Result<KeptRows, SessionError> {
        let size = (coverage_study::log_columns(&self.answers.case)?, Some(design.data_sets));
        Ok(self.log_head(&format!("{design:?}"), size))
    }
}

fn check_rows(rows: &Range<usize>, all: Option<usize>) -> Result<(), InputError> {
    let (Range { start, end }, all) = (rows, all.unwrap_or(0));
    if start < end && *end <= all {
        return Ok(());
    }
    let message = format!(" {start}..{end}: expected a first one before the end, and an end of at most {all}");
    Err(InputError::for_option("rows", message))
}

fn partial_log(head: &KeptRows, parts: &[LogPart]) -> Result<PartialLog, SessionError> {
    PartialLog::of(head, parts).map_err(|message| InputError::general(message).into())
}
