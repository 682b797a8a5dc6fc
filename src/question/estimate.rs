//! The question of `estimate`: factors fitted to observations.

use super::error::InputError;
use super::fit::{Fit, PosteriorSampling};
use super::named_case::{self, NamedCase};
use super::observed::ObservationSelection;
use super::quantity;
use crate::case::Case;
use crate::study::posterior::Walkers;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Factors fitted to observations by least squares, with 95 % confidence intervals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct Estimate {
    /// Further cases to fit at once; factors of one name that scale the same material are shared
    #[cfg_attr(feature = "command", arg(
        value_name = "CASE", conflicts_with = "compare", value_parser = named_case::parser()
    ))]
    pub others: Vec<NamedCase>,
    /// The observations to fit.
    #[cfg_attr(feature = "command", command(flatten))]
    #[serde(flatten)]
    pub observations: ObservationSelection,
    /// The factors to fit and how.
    #[cfg_attr(feature = "command", command(flatten))]
    #[serde(flatten)]
    pub fit: Fit,
    /// The posterior distribution.
    #[cfg_attr(feature = "command", command(flatten))]
    #[serde(flatten)]
    pub posterior: PosteriorSampling,
    /// Seed of the MCMC random numbers
    #[cfg_attr(feature = "command", arg(long, default_value_t = Estimate::default().seed, requires = "posterior"))]
    #[serde(with = "quantity::seed")]
    pub seed: u64,
    /// Fit this case to the same observations too, and compare the misfits of both
    #[cfg_attr(feature = "command", arg(long, value_name = "CASE", value_parser = named_case::parser()))]
    pub compare: Option<NamedCase>,
}

impl Default for Estimate {
    fn default() -> Self {
        Self {
            others: Vec::new(),
            observations: ObservationSelection::default(),
            fit: Fit::default(),
            posterior: PosteriorSampling::default(),
            seed: 1,
            compare: None,
        }
    }
}

/// The cases of an estimate, with the options in place of their own.
pub(crate) struct PreparedCases {
    pub(crate) case: Case,
    pub(crate) others: Vec<Case>,
    pub(crate) comparison: Option<Case>,
}

impl Estimate {
    /// Check the question for a case, before any computation.
    ///
    /// # Errors
    /// When an option is wrong or without effect.
    pub fn check(&self, case: &Case) -> Result<(), InputError> {
        self.prepared(case).map(|_| ())
    }

    /// The ids of the case and of the further ones.
    #[cfg(feature = "command")]
    pub(crate) fn ids(&self, case: &Case) -> Vec<String> {
        let others = self.others.iter().filter_map(|other| other.case().ok());
        std::iter::once(case).chain(others).map(|case| case.id.clone()).collect()
    }

    pub(crate) fn walkers(&self) -> Option<Walkers> {
        self.posterior.chosen(self.seed)
    }

    pub(crate) fn prepared(&self, case: &Case) -> Result<PreparedCases, InputError> {
        self.posterior.check()?;
        if !self.posterior.posterior && self.seed != Self::default().seed {
            return Err(InputError::for_option("seed", ": without a posterior nothing is drawn"));
        }
        if self.compare.is_some() && !self.others.is_empty() {
            return Err(InputError::for_option("compare", ": expected one case to compare with, without further ones"));
        }
        let compare = |other: &NamedCase| self.fit.applied(&self.observations, other.case()?);
        let comparison = self.compare.as_ref().map(compare).transpose()?;
        let cases = named_case::distinct(case, &self.others)?.into_iter().cloned().collect();
        let mut cases = self.fit.apply(&self.observations, cases)?;
        let others = cases.split_off(1);
        Ok(PreparedCases { case: cases.remove(0), others, comparison })
    }

    /// The numbers of the minimisations of an estimate: one range for those of the data alone, and another one for
    /// those with priors if there are any. A minimisation depends on no other of its range.
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn rounds(&self, case: &Case) -> Result<Vec<Range<usize>>, InputError> {
        let (prepared, starts) = (self.prepared(case)?, self.fit.starts);
        let with_priors = prepared.case.estimate.prior.map(|_| starts..2 * starts);
        Ok(std::iter::once(0..starts).chain(with_priors).collect())
    }
}
