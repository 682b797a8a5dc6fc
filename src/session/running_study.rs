//! A study while it runs: its plan, its march and the answers so far.

use super::{Answers, MembersCallback, Options, SessionError, adapted, with_tolerance};
use crate::adapt::{ACCEPTED_ERROR, checked_at_members, refined_traces, with_nominal_rounding};
use crate::case::{Bounds, Case};
use crate::ensemble::Ensemble;
use crate::kept_work::kept_rows::KeptRows;
use crate::kept_work::sweep_piece::{CaseIdentity, Piece, fingerprint};
use crate::kept_work::work_log::{NoLog, WorkLog};
use crate::kept_work::{ITERATIONS, RowFiles, RowKeeper, SweepKeeper};
use crate::march::monitor::{Monitor, MonitoredMarch};
use crate::march::{March, MarchError, Precision};
use crate::plan::{ErrorEstimate, Plan};
use crate::question::{self, Fit};
use crate::study::coverage_study::{CoverageDesign, CoverageStudy, coverage_study};
use crate::study::depth_profiles::{ProfileInstants, depth_profiles};
use crate::study::driver_emissivity::driver_emissivity;
use crate::study::driver_smoothing::driver_smoothing;
use crate::study::estimate::{EstimateError, ParameterEstimates, SearchOptions, estimate};
use crate::study::model_comparison::compare_models;
use crate::study::nominal::{Prediction, nominal};
use crate::study::posterior::{Posterior, Walkers, posterior};
use crate::study::posterior::{PosteriorError, log_columns};
use crate::study::sensitivity::{Sensitivity, sensitivity};
use crate::study::simultaneous_band::Envelope;
use crate::study::uncertainty::{Sweep, SweepError, SweepStatistics, Uncertainty, sweep_error};
use crate::traces::MemberStatus;
use std::ops::Range;
use std::path::PathBuf;

/// A study while it runs.
pub(super) struct RunningStudy<'a> {
    pub(super) plan: &'a Plan,
    pub(super) march: &'a mut MonitoredMarch,
    pub(super) options: Options,
    pub(super) answers: Answers,
}

impl RunningStudy<'_> {
    /// The nominal march, with its discretisation error at corners of the bounds between which the study samples.
    pub(super) fn predict(&mut self, bounds: Bounds) -> Result<Prediction, SessionError> {
        let mut found = nominal(&self.answers.case, self.plan, self.march)?;
        found.error_estimate = self.at_corners_of(bounds, &self.answers.case, self.plan, found.error_estimate)?;
        self.answers.driver_smoothing = driver_smoothing(&self.answers.case, self.plan, self.march, &found)?;
        self.answers.driver_emissivity = driver_emissivity(&self.answers.case, self.plan, self.march, &found)?;
        self.answers.nominal = Some(found.clone());
        Ok(found)
    }

    fn at_corners_of(
        &self,
        bounds: Bounds,
        case: &Case,
        plan: &Plan,
        error_estimate: Option<ErrorEstimate>,
    ) -> Result<Option<ErrorEstimate>, MarchError> {
        let (precision, monitor) = (self.march.backend().precision, self.march.monitor());
        error_estimate.map(|error| error.at_corners_of(bounds, case, plan, precision, &monitor)).transpose()
    }

    pub(super) fn uncertainty(
        &mut self,
        sweep: &Sweep,
        members: &mut MembersCallback<'_>,
    ) -> Result<Uncertainty, SessionError> {
        let nominal = match &self.answers.nominal {
            Some(nominal) => nominal.clone(),
            None => self.predict(sweep.bounds)?,
        };
        let sweep_statistics = self.sweep_statistics(sweep, &nominal, 0..sweep.members, members)?;
        let mut found = sweep_statistics.results(&nominal, &sweep.sampling, sweep.members);
        if !found.is_partial() {
            found.discretisation_error = self.sweep_error(&sweep.ensemble(&self.answers.case))?;
        }
        self.answers.seed = Some(sweep.sampling.seed);
        self.answers.uncertainty = Some(found.clone());
        Ok(found)
    }

    /// Profiles through the thickness, if there are instants for them; with bands over the members of a sweep.
    pub(super) fn depth_profiles(
        &mut self,
        instants: Option<&ProfileInstants>,
        sweep: Option<&Sweep>,
    ) -> Result<(), SessionError> {
        let Some(instants) = instants else { return Ok(()) };
        let found = depth_profiles(&self.answers.case, self.plan, instants, sweep, &self.march.monitor());
        match found {
            // The sweep is complete, and its answer is not thrown away.
            Err(MarchError::Stopped) if sweep.is_some() => {
                self.answers.run.remarks.push("stopped before the profiles through the thickness".to_owned());
            }
            found => self.answers.depth_profiles = found?,
        }
        Ok(())
    }

    /// The discretisation error of members of a sweep; `None` where the study is stopped before it is known.
    pub(super) fn sweep_error(&self, ensemble: &Ensemble) -> Result<Option<SweepError>, MarchError> {
        let precision = self.march.backend().precision;
        match sweep_error(&self.answers.case, self.plan, precision, ensemble, &self.march.monitor()) {
            Err(MarchError::Stopped) => Ok(None),
            found => found,
        }
    }

    /// Statistics of some members of a sweep.
    pub(super) fn sweep_statistics(
        &mut self,
        sweep: &Sweep,
        nominal: &Prediction,
        part: Range<usize>,
        members: &mut MembersCallback<'_>,
    ) -> Result<SweepStatistics, SessionError> {
        let case = &self.answers.case;
        let (bounds, kind) = (sweep.bounds, sweep.sampling.kind);
        let envelope = Envelope::of(case, self.plan, nominal, bounds, kind, &self.march.monitor())?;
        let mut sweep_statistics = SweepStatistics::new(case, nominal, &envelope, bounds, kind)
            .with_driver_emissivity(self.answers.driver_emissivity.as_ref(), sweep.sampling.seed);
        let mut keeper = self.keeper(sweep, nominal, &part, &sweep_statistics);
        let part = match keeper.as_ref().map_or(Ok(None), |keeper| keeper.kept(&sweep_statistics, &part))? {
            Some((kept, next)) => {
                sweep_statistics = kept;
                next..part.end
            }
            None => part,
        };
        self.march.begin_sweep(part.len());
        let (monitor, is_cancelled) =
            (self.march.monitor(), |found: Result<(), MarchError>| matches!(found, Err(MarchError::Cancelled)));
        let marched = sweep_statistics.march(
            case,
            self.plan,
            self.march,
            &sweep.ensemble(case),
            part,
            &mut |so_far, of, batch| {
                members(of, batch);
                if !is_cancelled(monitor.check()) {
                    keeper.iter_mut().for_each(|keeper| keeper.update(so_far));
                }
            },
        );
        if let Some(mut keeper) = keeper {
            if marched.is_err() && sweep_statistics.members() > 0 && !is_cancelled(monitor.check()) {
                keeper.keep(&sweep_statistics);
            }
            self.answers.run.remarks.extend(keeper.remark());
        }
        match marched {
            Err(MarchError::Stopped) if sweep_statistics.completed() >= 2 => {}
            other => other?,
        }
        Ok(sweep_statistics)
    }

    /// Keeps the members of a sweep, if the session has a checkpoint and the nominal march a result to refer to.
    pub(super) fn keeper(
        &self,
        sweep: &Sweep,
        nominal: &Prediction,
        part: &Range<usize>,
        empty: &SweepStatistics,
    ) -> Option<SweepKeeper> {
        let checkpoint = self.options.checkpoint.clone().filter(|_| nominal.status == MemberStatus::Completed)?;
        let case = &self.answers.case;
        let path = case.input_files().first().map_or_else(PathBuf::new, |file| PathBuf::from(&file.path));
        let mark = CaseIdentity { id: case.id.clone(), path, sets: Vec::new(), fingerprint: fingerprint(case) };
        let run = self.answers.run.clone();
        let members = part.start..part.start;
        Some(SweepKeeper::new(
            checkpoint,
            Piece::new(mark, *sweep, &self.march.backend(), run, members, nominal, empty),
        ))
    }

    /// Keeps the rows of the log of a study, if the session has a checkpoint. `size` is the length of a row, and the
    /// number of rows if it is known.
    pub(super) fn row_keeper(
        &self,
        files: RowFiles,
        options: &str,
        size: (usize, Option<usize>),
    ) -> Result<Option<RowKeeper>, SessionError> {
        let Some(checkpoint) = self.options.checkpoint.clone() else { return Ok(None) };
        Ok(Some(RowKeeper::open(checkpoint, files, self.log_head(options, size))?))
    }

    /// Head of the log of this study: the origin of its rows, and their number.
    pub(super) fn log_head(&self, options: &str, size: (usize, Option<usize>)) -> KeptRows {
        let Answers { case, other_cases, run, .. } = &self.answers;
        let cases = std::iter::once(case).chain(other_cases);
        KeptRows::new(cases, &self.march.backend(), run.clone(), options, size)
    }

    pub(super) fn sensitivity(&mut self, question: &question::Sensitivity) -> Result<Sensitivity, SessionError> {
        let step = question.difference_step(self.march.backend().precision);
        let found = sensitivity(&self.answers.case, self.plan, self.march, step)?;
        self.answers.sensitivity = Some(found.clone());
        Ok(found)
    }

    /// Further cases of an estimate.
    pub(super) fn add_other_cases(&mut self, others: Vec<Case>) {
        others.iter().for_each(|case| self.answers.run.add_files(case));
        self.answers.other_cases =
            others.into_iter().map(|other| with_tolerance(other, self.options.tolerance_k)).collect();
    }

    /// The plans of the further cases.
    pub(super) fn other_plans(&self) -> Result<Vec<Plan>, SessionError> {
        Ok(self.answers.other_cases.iter().map(|other| self.adapted(other)).collect::<Result<_, _>>()?)
    }

    /// The plan of another case, with the rounding of the march in its error.
    fn adapted(&self, other: &Case) -> Result<Plan, MarchError> {
        let plan = adapted(other, &self.options, &self.march.monitor())?;
        with_nominal_rounding(other, plan, self.march.backend().precision)
    }

    pub(super) fn estimate<L: WorkLog>(
        &mut self,
        fit: &Fit,
        walkers: Option<&Walkers>,
        log: impl FnOnce(&Self, &SearchOptions) -> Result<L, SessionError>,
    ) -> Result<ParameterEstimates, SessionError> {
        let search = fit.search(self.march.backend().precision);
        let mut log = log(self, &search)?;
        let mut plans = vec![self.plan.clone()];
        plans.extend(self.other_plans()?);
        let Answers { case, other_cases: others, .. } = &self.answers;
        let cases: Vec<&Case> = std::iter::once(case).chain(others).collect();
        let mut found = estimate_adapted(&cases, &mut plans, self.march, &search, &mut log)?;
        let monitor = self.march.monitor();
        for (fitted, (case, plan)) in found.fitted.iter_mut().zip(cases.iter().zip(&plans)) {
            let (bounds, error_estimate) = (case.estimate.bounds, fitted.after.error_estimate.take());
            fitted.after.error_estimate = self.at_corners_of(bounds, case, plan, error_estimate)?;
        }
        let runs = runs(&cases, &plans);
        if let Some(walkers) = walkers {
            let iterations = walkers.iterations;
            let mut log = {
                let options = format!("{search:?}, {:?}, {walkers:?}", found.values);
                let size = (log_columns(&found, walkers), Some(iterations));
                self.row_keeper(ITERATIONS, &options, size)?
            };
            let iterations = iterations - log.as_ref().map_or(0, RowKeeper::finished);
            self.march.begin_sweep(runs.len() * walkers.number * iterations);
            let mut sampled = posterior(&runs, self.march, &found, walkers, &mut log);
            if let Ok(sampled) = &mut sampled {
                let precision = self.march.backend().precision;
                sampled.discretisation_errors_k = posterior_errors_k(&runs, &found, sampled, precision, &monitor)?;
                let remarks = posterior_error_remarks(&cases, sampled);
                self.answers.run.remarks.extend(remarks);
            }
            self.answers.run.remarks.extend(end_of_log(log, matches!(sampled, Err(PosteriorError::March(_)))));
            self.answers.posterior = Some(sampled?);
            self.answers.seed = Some(walkers.seed);
        }
        self.answers.estimated = Some(found.clone());
        Ok(found)
    }

    pub(super) fn coverage(
        &mut self,
        design: &CoverageDesign,
        log: &mut dyn WorkLog,
    ) -> Result<CoverageStudy, SessionError> {
        self.predict(design.truth_bounds)?;
        let found = coverage_study(&self.answers.case, self.plan, self.march, design, log)?;
        self.answers.seed = Some(design.noise.seed);
        self.answers.coverage_study = Some(found.clone());
        Ok(found)
    }

    /// Fit another case to the same observations, and compare the misfits.
    pub(super) fn compare(&mut self, other: Case, fit: &Fit, found: &ParameterEstimates) -> Result<(), SessionError> {
        let Some(first) = found.fitted.first() else { return Ok(()) };
        let (search, other) =
            (fit.search(self.march.backend().precision), with_tolerance(other, self.options.tolerance_k));
        let mut plans = [self.adapted(&other)?];
        let mut fit_other = || estimate_adapted(&[&other], &mut plans, self.march, &search, &mut NoLog);
        self.answers.model_comparison = Some(compare_models((&self.answers.case, first), &other, &mut fit_other)?);
        Ok(())
    }
}

/// Most adaptations of the plans to an estimate.
const MAX_ADAPTATIONS: usize = 3;

fn runs<'r>(cases: &[&'r Case], plans: &'r [Plan]) -> Vec<(&'r Case, &'r Plan)> {
    cases.iter().copied().zip(plans).collect()
}

/// An estimate on plans that are adapted to it: repeated on others where the error at the estimate exceeds the
/// tolerance. The marches at the estimate get its error.
fn estimate_adapted(
    cases: &[&Case],
    plans: &mut [Plan],
    march: &mut MonitoredMarch,
    search: &SearchOptions,
    log: &mut dyn WorkLog,
) -> Result<ParameterEstimates, EstimateError> {
    let mut found = estimate(&runs(cases, plans), march, search, log)?;
    let (precision, monitor) = (march.backend().precision, march.monitor());
    for _ in 0..MAX_ADAPTATIONS {
        let mut is_adapted_anew = false;
        for (which, (case, plan)) in cases.iter().zip(&mut *plans).enumerate() {
            let at_estimate = found.members(case, which, std::iter::once(found.values.as_slice()));
            let checked = checked_at_members(case, plan, &at_estimate, precision, 1.0, &monitor)?;
            is_adapted_anew |= checked.is_adapted_anew;
            *plan = checked.plan;
            found.fitted[which].after.error_estimate.clone_from(&plan.error_estimate);
        }
        if !is_adapted_anew {
            break;
        }
        found = estimate(&runs(cases, plans), march, search, &mut NoLog)?;
    }
    Ok(found)
}

/// The largest discretisation error of each case at the ends of the intervals of a posterior, where the other factors
/// are at their medians, with the rounding of a precision, K; `None` where a case states its cells and steps.
fn posterior_errors_k(
    runs: &[(&Case, &Plan)],
    found: &ParameterEstimates,
    posterior: &Posterior,
    precision: Precision,
    monitor: &Monitor,
) -> Result<Vec<Option<f64>>, MarchError> {
    let medians: Vec<f64> = posterior.marginals.iter().map(|marginal| marginal.median).collect();
    let ends = posterior.marginals.iter().enumerate().flat_map(|(factor, marginal)| {
        [marginal.interval.0, marginal.interval.1].map(|end| {
            let mut point = medians.clone();
            point[factor] = end;
            point
        })
    });
    let points: Vec<Vec<f64>> = ends.collect();
    let error_k = |(which, (case, plan)): (usize, &(&Case, &Plan))| -> Result<Option<f64>, MarchError> {
        if plan.error_estimate.is_none() {
            return Ok(None);
        }
        let members = found.members(case, which, points.iter().map(Vec::as_slice));
        Ok(Some(refined_traces(case, plan, precision, &members, monitor)?.temperature_error_k()))
    };
    runs.iter().enumerate().map(error_k).collect()
}

/// A remark for each case whose discretisation error at the ends of the intervals of a posterior exceeds the tolerance.
fn posterior_error_remarks(cases: &[&Case], posterior: &Posterior) -> Vec<String> {
    let remark = |(case, error_k): (&&Case, &Option<f64>)| {
        let (error_k, tolerance_k) = ((*error_k)?, case.resolution.tolerance_k?);
        (error_k > ACCEPTED_ERROR * tolerance_k).then(|| {
            format!(
                "{}: the discretisation error is {error_k:.2} K at the ends of the posterior, above the tolerance of \
                 {tolerance_k} K",
                case.id
            )
        })
    };
    cases.iter().zip(&posterior.discretisation_errors_k).filter_map(remark).collect()
}

/// Keep the last rows of a study that was interrupted. Returns the first error.
pub(super) fn end_of_log(log: Option<RowKeeper>, is_interrupted: bool) -> Option<String> {
    let mut keeper = log?;
    if is_interrupted && keeper.finished() > 0 {
        keeper.keep();
    }
    keeper.remark()
}
