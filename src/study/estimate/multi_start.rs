//! Minimisations from many starts: of the data alone, then with the priors if there are any.
//!
//! A minimisation depends on no other one, so that others can do it: the end of each is a row of the
//! [log](crate::kept_work::work_log), first those of the data alone, then those with the priors, both in the order of
//! the starts. Residuals and derivatives are not in the log, as the minimisation that is the estimate can be repeated.

use super::SearchOptions;
use super::error::EstimateError;
use super::estimand::{Estimand, estimands};
use super::likelihood::{Likelihood, sample_times_s};
use super::start_results::{StartEnd, lowest};
use crate::case::{Bounds, Case};
use crate::ensemble::{Ensemble, Sampling, SamplingKind};
use crate::fit::{DampingStrategy, Fit, Prior, RobustLoss, RobustProblem, WeightedProblem, WithPriors, minimize_all};
use crate::kept_work::work_log::WorkLog;
use crate::march::{March, MarchError, Precision};
use crate::plan::Plan;
use crate::study::thermocouple_residuals::{CaseResiduals, Sample, ThermocoupleResiduals, samples};
use nalgebra::DMatrix;
use std::ops::Range;

/// Seed of the random starts, fixed for reproducibility.
const STARTS_SEED: u64 = 1;

/// The least-squares problem of an estimate, with its starts.
pub(super) struct MultiStart<'a> {
    pub problem: RobustProblem<ThermocoupleResiduals<'a>>,
    pub factors: Vec<Estimand>,
    pub bounds: Vec<(f64, f64)>,
    /// The side constraints that define the priors.
    pub prior: Option<Bounds>,
    pub priors: Vec<Prior>,
    /// Samples, case × fitted observation × sample.
    pub observed: Vec<Vec<Vec<Sample>>>,
    /// All samples in one list.
    pub samples: Vec<Sample>,
    times_s: Vec<Vec<f64>>,
    precision: Precision,
    /// One per column.
    starts: DMatrix<f64>,
    search: &'a SearchOptions,
}

/// The minimisations from all starts.
pub(super) struct Minimisations {
    /// The minimisation with the lowest objective.
    pub fit: Fit,
    /// Index of the start of this minimisation.
    pub lowest: usize,
    /// The ends, in the order of the starts.
    pub ends: Vec<StartEnd>,
}

impl<'a> MultiStart<'a> {
    /// # Errors
    /// When a case selects no factor or no data, or the cases are incompatible.
    pub(super) fn new(
        runs: &[(&'a Case, &'a Plan)],
        march: &'a mut dyn March,
        search: &'a SearchOptions,
    ) -> Result<Self, EstimateError> {
        let cases: Vec<&Case> = runs.iter().map(|(case, _)| *case).collect();
        let factors = estimands(&cases)?;
        let (loss, prior) = common_objective(&cases)?;
        let observed: Vec<Vec<Vec<Sample>>> = runs.iter().map(|(case, plan)| samples(case, plan)).collect();
        check(&cases, &factors, &observed)?;
        prior.map_or(Ok(()), |prior| check_priors(&factors, prior))?;
        let bounds: Vec<(f64, f64)> = factors.iter().map(|factor| factor.bounds).collect();
        let precision = march.backend().precision;
        let parts = runs.iter().zip(&observed).enumerate().map(|(which, ((case, plan), observed))| {
            let places = factors.iter().map(|factor| factor.factor_indices[which]).collect();
            CaseResiduals::new(case, plan, places, observed.concat())
        });
        let mut problem = ThermocoupleResiduals::new(march, parts.collect(), bounds.clone());
        if matches!(search.options.damping_strategy, DampingStrategy::Paper { .. }) {
            problem = problem.with_finite_differences();
        }
        Ok(Self {
            problem: RobustProblem { problem, loss },
            bounds,
            prior,
            priors: priors(&factors, prior),
            samples: observed.iter().flatten().flatten().copied().collect(),
            times_s: sample_times_s(runs, &observed),
            observed,
            precision,
            starts: starts(&factors, search.starts),
            factors,
            search,
        })
    }

    /// The minimisations from all starts: of the data alone, or with the priors and this weight of the data. Ends that
    /// the log has are taken from it, and the others are added to it.
    ///
    /// # Errors
    /// When the device fails.
    pub(super) fn minimise(&mut self, weight: Option<f64>, log: &mut dyn WorkLog) -> Result<Minimisations, MarchError> {
        let (starts, factors) = (self.starts.ncols(), self.factors.len());
        let mut ends = Vec::with_capacity(starts);
        while ends.len() < starts
            && let Some(row) = log.next()
        {
            ends.push(StartEnd::from_row(row, factors));
        }
        let taken = ends.len();
        let mut fits = self.fits(taken..starts, weight)?;
        for fit in &fits {
            let end = self.end(fit, weight);
            log.add(&end.row());
            ends.push(end);
        }
        let lowest = lowest(&ends);
        if lowest < taken {
            fits = self.fits(lowest..lowest + 1, weight)?;
        }
        self.problem.problem.marches += ends.iter().map(|end| end.marches).sum::<usize>();
        Ok(Minimisations { fit: fits.swap_remove(lowest.saturating_sub(taken)), lowest, ends })
    }

    /// The rows of the log for some of the starts.
    ///
    /// # Errors
    /// When the device fails.
    pub(super) fn rows(&mut self, starts: Range<usize>, weight: Option<f64>) -> Result<Vec<Vec<f64>>, MarchError> {
        Ok(self.fits(starts, weight)?.iter().map(|fit| self.end(fit, weight).row()).collect())
    }

    /// The minimisations from some of the starts. Their members are counted where their ends are.
    fn fits(&mut self, starts: Range<usize>, weight: Option<f64>) -> Result<Vec<Fit>, MarchError> {
        if starts.is_empty() {
            return Ok(Vec::new());
        }
        let (marches, options) = (self.problem.problem.marches, &self.search.options);
        let starts = self.starts.columns(starts.start, starts.len()).into_owned();
        let fits = match weight {
            None => minimize_all(&mut self.problem, &starts, options),
            Some(weight) => {
                let weighed = WeightedProblem { problem: &mut self.problem, weight };
                minimize_all(&mut WithPriors { problem: weighed, priors: self.priors.clone() }, &starts, options)
            }
        };
        self.problem.problem.marches = marches;
        fits
    }

    fn end(&self, fit: &Fit, weight: Option<f64>) -> StartEnd {
        let tolerance_step = self.search.options.tolerance_step;
        let weight = weight.unwrap_or(1.0);
        StartEnd::of(fit, &self.samples, self.precision, tolerance_step, weight, self.observed.len())
    }

    /// The likelihood of the data, from the lowest minimisation of the data alone.
    ///
    /// # Errors
    /// When the march fails.
    pub(super) fn likelihood(&self, of_data: &Fit) -> Result<Likelihood, MarchError> {
        let numerical_error = self.problem.problem.discretisation_errors(of_data.point.as_slice())?;
        Ok(Likelihood::of(of_data, self.problem.loss, &self.priors, numerical_error, &self.times_s))
    }
}

/// The common loss function and priors of all cases.
fn common_objective(cases: &[&Case]) -> Result<(RobustLoss, Option<Bounds>), EstimateError> {
    let objective = |case: &Case| (case.estimate.loss_function, case.estimate.prior);
    let first = cases.first().ok_or_else(|| EstimateError::no_factors(cases))?;
    match cases.iter().find(|case| objective(case) != objective(first)) {
        Some(case) => Err(EstimateError::ObjectivesDiffer { first: first.id.clone(), case: case.id.clone() }),
        None => Ok((first.estimate.loss_function.into(), first.estimate.prior)),
    }
}

/// Check that every case has factors to estimate and data.
fn check(cases: &[&Case], factors: &[Estimand], observed: &[Vec<Vec<Sample>>]) -> Result<(), EstimateError> {
    if factors.is_empty() {
        return Err(EstimateError::no_factors(cases));
    }
    for (which, (case, observed)) in cases.iter().zip(observed).enumerate() {
        if factors.iter().all(|factor| factor.factor_indices[which].is_none()) {
            return Err(EstimateError::NoSharedFactor(case.id.clone()));
        }
        if observed.iter().all(Vec::is_empty) {
            let (from_s, to_s) = case.fit_window_s();
            return Err(EstimateError::NoSamples { case: case.id.clone(), from_s, to_s });
        }
    }
    Ok(())
}

/// Check that the priors do not exclude a part of the bounds: on a side without width the probability is zero.
fn check_priors(factors: &[Estimand], prior: Bounds) -> Result<(), EstimateError> {
    for Estimand { factor, bounds: (low, high), .. } in factors {
        let [below, above] = factor.prior_deviations(prior);
        if below <= 0.0 && *low < factor.nominal || above <= 0.0 && *high > factor.nominal {
            return Err(EstimateError::PriorAtBound {
                factor: factor.name.clone(),
                nominal: factor.nominal,
                bounds: (*low, *high),
                prior,
            });
        }
    }
    Ok(())
}

/// Split normal priors of the factors, from their side constraints.
pub(in crate::study) fn priors(factors: &[Estimand], prior: Option<Bounds>) -> Vec<Prior> {
    let of = |bounds| {
        let each = factors.iter().enumerate();
        each.map(move |(variable, Estimand { factor, .. })| Prior {
            variable,
            mode: factor.nominal,
            deviations: factor.prior_deviations(bounds),
        })
    };
    prior.map(of).into_iter().flatten().collect()
}

/// The case's own start, and others drawn uniformly between the bounds, one per column.
fn starts(factors: &[Estimand], starts: usize) -> DMatrix<f64> {
    let within: Vec<_> = factors
        .iter()
        .map(|estimand| crate::case::Factor { small: estimand.bounds, ..estimand.factor.clone() })
        .collect();
    let sampling = Sampling { kind: SamplingKind::Uniform, seed: STARTS_SEED };
    let drawn = Ensemble::sample(&within, Bounds::Small, &sampling, starts.saturating_sub(1));
    let own = factors.iter().map(|factor| factor.start);
    let others = (0..drawn.len()).flat_map(|member| drawn.member(member));
    DMatrix::from_iterator(factors.len(), starts.max(1), own.chain(others))
}
