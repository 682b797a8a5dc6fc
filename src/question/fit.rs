//! The factors to estimate, the minimisation, and the sampling of the posterior.

use super::error::{InputError, check_limit};
use super::observed::{ObservationSelection, chosen_indices, estimates};
use super::quantity::{self, FactorValue};
use crate::case::{Bounds, Case, EstimationSettings, LossFunction};
use crate::fit::DampingStrategy;
use crate::limits::{POSITIONS, STARTS};
use crate::march::Precision;
use crate::study::estimate::{PAPER_RULES, SearchOptions};
use crate::study::posterior::Walkers;
use serde::{Deserialize, Serialize};

/// Bounds of a Gaussian prior.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Prior {
    /// No prior
    None,
    /// Two standard deviations at the small bounds
    Small,
    /// Two standard deviations at the large bounds
    Large,
}

impl Prior {
    fn bounds(self) -> Option<Bounds> {
        match self {
            Self::None => None,
            Self::Small => Some(Bounds::Small),
            Self::Large => Some(Bounds::Large),
        }
    }
}

/// Step control of a minimisation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Minimiser {
    /// Steps within a trust region, whose radius follows the ratio of actual to predicted reduction
    #[default]
    TrustRegion,
    /// Damping times ten after a failed step and divided by ten after a successful one, as in the paper
    Paper,
}

/// The factors to fit and how. The case states what is not given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default)]
pub struct Fit {
    /// Factors to estimate, as f_k_INS,f_cp_INS
    #[cfg_attr(feature = "command", arg(long, value_delimiter = ',', value_parser = quantity::name))]
    #[serde(with = "quantity::list")]
    pub factors: Vec<String>,
    /// Start values, as NAME=VALUE,...; other factors start at their nominal values
    #[cfg_attr(feature = "command", arg(long, value_delimiter = ','))]
    #[serde(with = "quantity::list")]
    pub start: Vec<FactorValue>,
    /// Loss function of the residuals: squares, soft-l1 or huber; with its width in standard deviations, as huber=1.345
    #[cfg_attr(feature = "command", arg(long))]
    #[serde(with = "quantity::text")]
    pub loss: Option<LossFunction>,
    /// Gaussian prior about the nominal values, with two standard deviations at these bounds
    #[cfg_attr(feature = "command", arg(long, value_enum))]
    pub prior: Option<Prior>,
    /// Step control of the minimisation
    #[cfg_attr(feature = "command", arg(long, value_enum, default_value_t = Fit::default().minimiser))]
    pub minimiser: Minimiser,
    /// Number of minimisations (multi-start): the first from the start of the case, the others from random points
    #[cfg_attr(feature = "command", arg(long, default_value_t = Fit::default().starts))]
    pub starts: usize,
    /// Factors whose profile likelihood is computed; it gives an interval without linearisation
    #[cfg_attr(feature = "command", arg(
        long, value_name = "FACTORS", value_delimiter = ',', value_parser = quantity::name
    ))]
    #[serde(with = "quantity::list")]
    pub profile: Vec<String>,
    /// Maximum number of iterations of a minimisation
    #[cfg_attr(feature = "command", arg(long, default_value_t = Fit::default().max_iterations))]
    pub max_iterations: usize,
}

impl Default for Fit {
    fn default() -> Self {
        Self {
            factors: Vec::new(),
            start: Vec::new(),
            loss: None,
            prior: None,
            minimiser: Minimiser::TrustRegion,
            starts: 1,
            profile: Vec::new(),
            max_iterations: 50,
        }
    }
}

impl Fit {
    pub(crate) fn search(&self, precision: Precision) -> SearchOptions {
        let mut search = SearchOptions {
            starts: self.starts,
            profiles: self.profile.clone(),
            ..SearchOptions::for_precision(precision)
        };
        search.options.max_iterations = self.max_iterations;
        search.options.damping_strategy = match self.minimiser {
            Minimiser::TrustRegion => DampingStrategy::TrustRegion,
            Minimiser::Paper => PAPER_RULES,
        };
        search
    }

    /// The cases with these observations, factors, starts, loss and prior in place of their own.
    pub(super) fn apply(&self, observations: &ObservationSelection, cases: Vec<Case>) -> Result<Vec<Case>, InputError> {
        if self.starts == 0 {
            return Err(InputError::for_option("starts", " 0: expected at least 1"));
        }
        check_limit(&STARTS, self.starts as f64, "starts")?;
        let cases = observations.apply(cases)?;
        let mut estimates = estimates(&cases);
        if !self.factors.is_empty() {
            let names = |case: &Case| case.factors.iter().map(|factor| factor.name.clone()).collect();
            let chosen = chosen_indices(&cases, &self.factors, "factors", "factor", names)?;
            for (estimate, chosen) in estimates.iter_mut().zip(chosen) {
                estimate.factors = chosen;
                estimate.start.clear();
            }
        }
        set_starts(&cases, &mut estimates, &self.start)?;
        for estimate in &mut estimates {
            estimate.loss_function = self.loss.unwrap_or(estimate.loss_function);
            estimate.prior = self.prior.map_or(estimate.prior, Prior::bounds);
        }
        let cases = cases.into_iter().zip(estimates).map(|(case, estimate)| case.with_estimate(estimate)).collect();
        check_starts(cases)
    }

    /// [`apply`](Self::apply) to one case.
    pub(super) fn applied(&self, observations: &ObservationSelection, case: &Case) -> Result<Case, InputError> {
        Ok(self.apply(observations, vec![case.clone()])?.remove(0))
    }
}

/// Set the start values of every case that estimates the factor, or of the one case that the start names.
fn set_starts(cases: &[Case], estimates: &mut [EstimationSettings], starts: &[FactorValue]) -> Result<(), InputError> {
    if starts.is_empty() {
        return Ok(());
    }
    for (case, estimate) in cases.iter().zip(estimates.iter_mut()) {
        estimate.start = estimate.factors.iter().map(|&factor| case.factors[factor].nominal).collect();
    }
    for FactorValue { factor: name, case: only, value } in starts {
        let mut is_estimated = false;
        let pairs = cases.iter().zip(estimates.iter_mut());
        for (case, estimate) in pairs.filter(|(case, _)| only.as_ref().is_none_or(|id| *id == case.id)) {
            let index = estimate.factors.iter().position(|&chosen| case.factors[chosen].name == *name);
            let Some(index) = index else { continue };
            let (low, high) = case.factors[estimate.factors[index]].bounds(estimate.bounds);
            if !(low..=high).contains(value) {
                let message = format!(" {name}={value}: outside its bounds {low} to {high}");
                return Err(InputError::for_option("start", message));
            }
            estimate.start[index] = *value;
            is_estimated = true;
        }
        if !is_estimated {
            return Err(InputError::for_option("start", format!(" {name}: that factor is not estimated")));
        }
    }
    Ok(())
}

fn check_starts(cases: Vec<Case>) -> Result<Vec<Case>, InputError> {
    for case in &cases {
        for (&factor, &start) in case.estimate.factors.iter().zip(&case.estimate.start) {
            let (factor, bounds) = (&case.factors[factor], case.estimate.bounds);
            let (low, high) = factor.bounds(bounds);
            if !(low..=high).contains(&start) {
                let (id, name, bounds) = (&case.id, &factor.name, bounds.name());
                let message = format!(
                    ": {id}: the start {start} of {name:?} in the case lies outside its {bounds} bounds {low} to {high}"
                );
                return Err(InputError::for_option("start", message));
            }
        }
    }
    Ok(cases)
}

/// The posterior distribution of the estimated factors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default)]
pub struct PosteriorSampling {
    /// Sample the posterior by ensemble MCMC: credible intervals of any shape, prediction intervals of every sensor
    #[cfg_attr(feature = "command", arg(long))]
    pub posterior: bool,
    /// Number of MCMC walkers
    #[cfg_attr(feature = "command", arg(
        long, default_value_t = PosteriorSampling::default().walkers, requires = "posterior"
    ))]
    pub walkers: usize,
    /// Number of MCMC iterations of each walker
    #[cfg_attr(feature = "command", arg(
        long, default_value_t = PosteriorSampling::default().mcmc_iterations, requires = "posterior"
    ))]
    pub mcmc_iterations: usize,
}

impl Default for PosteriorSampling {
    fn default() -> Self {
        Self { posterior: false, walkers: 2000, mcmc_iterations: 500 }
    }
}

impl PosteriorSampling {
    /// The walkers; `None` without a posterior.
    pub(crate) fn chosen(self, seed: u64) -> Option<Walkers> {
        self.posterior.then_some(Walkers { number: self.walkers, iterations: self.mcmc_iterations, seed })
    }

    pub(super) fn check(self) -> Result<(), InputError> {
        const MIN_ITERATIONS: usize = 10;
        let (iterations, unchanged) = (self.mcmc_iterations, Self::default());
        if !self.posterior {
            for (option, is_given) in [
                ("walkers", self.walkers != unchanged.walkers),
                ("mcmc_iterations", self != Self { walkers: self.walkers, ..unchanged }),
            ] {
                if is_given {
                    return Err(InputError::for_option(option, ": without a posterior nothing is sampled"));
                }
            }
            return Ok(());
        }
        if iterations < MIN_ITERATIONS {
            let message = format!(" {iterations}: expected at least {MIN_ITERATIONS}");
            return Err(InputError::for_option("mcmc_iterations", message));
        }
        check_limit(&POSITIONS, self.walkers as f64 * iterations as f64, "walkers")
    }
}
