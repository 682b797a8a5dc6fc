//! Options of an estimate.

use super::{ObservationSelection, check_limit, with_selection};
use crate::case::{Bounds, Case, LossFunction};
use crate::fit::DampingStrategy;
use crate::limits::POSITIONS;
use crate::march::Precision;
use crate::session::error::{InputError, SessionError};
use crate::study::estimate::SearchOptions;
use crate::study::posterior::Walkers;

/// The start value of one factor.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// Its name.
    pub factor: String,
    /// The id of the case whose factor it is; `None`: every case that estimates it.
    pub case: Option<String>,
    /// Its start value.
    pub value: f64,
}

/// The factors to estimate, and the minimisation. What is empty or `None` is taken from the case.
#[derive(Clone, Debug, PartialEq)]
pub struct FitOptions {
    /// Names of the factors to estimate.
    pub factors: Vec<String>,
    /// Start values; the other factors start at their nominal values.
    pub start: Vec<Start>,
    /// Loss function of the residuals.
    pub loss: Option<LossFunction>,
    /// Bounds at which a Gaussian prior has two standard deviations; `Some(None)` is no prior.
    pub prior: Option<Option<Bounds>>,
    /// Step control of the minimisation.
    pub damping_strategy: DampingStrategy,
    /// Number of minimisations (multi-start): the first from the start of the case, the others from random points
    /// between the bounds.
    pub starts: usize,
    /// Names of factors whose profile likelihood is computed.
    pub profiles: Vec<String>,
    /// Maximum number of iterations.
    pub max_iterations: usize,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            factors: Vec::new(),
            start: Vec::new(),
            loss: None,
            prior: None,
            damping_strategy: DampingStrategy::TrustRegion,
            starts: 1,
            profiles: Vec::new(),
            max_iterations: 50,
        }
    }
}

impl FitOptions {
    pub(in crate::session) fn search(&self, precision: Precision) -> SearchOptions {
        let mut search = SearchOptions {
            starts: self.starts,
            profiles: self.profiles.clone(),
            ..SearchOptions::for_precision(precision)
        };
        search.options.max_iterations = self.max_iterations;
        search.options.damping_strategy = self.damping_strategy;
        search
    }
}

/// Least squares over the factors.
#[derive(Clone, Debug, Default)]
pub struct EstimateOptions {
    /// Further cases to fit at once; they share factors by name.
    pub other_cases: Vec<Case>,
    /// A case that is fitted to the same observations separately, for comparison.
    pub comparison_case: Option<Case>,
    /// The observations to fit.
    pub observations: ObservationSelection,
    /// The factors to estimate, and the minimisation.
    pub fit: FitOptions,
    /// Options of the MCMC sampling of the posterior; `None`: no posterior.
    pub posterior: Option<Walkers>,
}

/// The cases of an estimate, with the options in place of their own.
pub(in crate::session) struct PreparedCases {
    pub(in crate::session) case: Case,
    pub(in crate::session) others: Vec<Case>,
    pub(in crate::session) comparison: Option<Case>,
}

impl EstimateOptions {
    /// Check the options for a case, before any computation.
    ///
    /// # Errors
    /// As [`Session::estimate`](crate::Session::estimate) for its input.
    pub fn check(&self, case: &Case) -> Result<(), SessionError> {
        self.prepared(case).map(|_| ())
    }

    pub(in crate::session) fn prepared(&self, case: &Case) -> Result<PreparedCases, SessionError> {
        check_posterior(self.posterior.as_ref())?;
        let apply = |cases| self.fit.apply(self.observations.apply(cases)?);
        let comparison = self.comparison_case.as_ref().map(|other| with_selection(other, apply)).transpose()?;
        let mut cases = vec![case.clone()];
        for other in &self.other_cases {
            if cases.iter().any(|known| known.id == other.id) {
                return Err(InputError::general(format!("two cases have the id {:?}", other.id)).into());
            }
            cases.push(other.clone());
        }
        let mut cases = apply(cases)?;
        let others = cases.split_off(1);
        Ok(PreparedCases { case: cases.remove(0), others, comparison })
    }
}

pub(super) fn check_posterior(posterior: Option<&Walkers>) -> Result<(), SessionError> {
    const MIN_ITERATIONS: usize = 10;
    let Some(&Walkers { number, iterations, .. }) = posterior else { return Ok(()) };
    if iterations < MIN_ITERATIONS {
        let message = format!(" {iterations}: expected at least {MIN_ITERATIONS}");
        return Err(InputError::for_option("iterations", message).into());
    }
    check_limit(&POSITIONS, number as f64 * iterations as f64, "walkers")
}
