//! The question of `twin`: synthetic observations, and coverage studies of many sets of them.

use super::error::{InputError, check_limit, check_nonnegative, index_of};
use super::fit::Fit;
use super::observed::ObservationSelection;
use super::quantity::{self, FactorValue};
use super::{design, given_option};
use crate::case::{Bounds, Case};
use crate::limits::DATA_SETS;
use crate::march::Precision;
use crate::study::coverage_study::CoverageDesign;
use crate::study::estimate::SearchOptions;
use crate::study::twin::Noise;
use serde::{Deserialize, Serialize};

/// Synthetic observations from known factors, or a coverage study of many sets of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct Twin {
    /// True values of factors, as NAME=VALUE,...; other factors are nominal
    #[cfg_attr(feature = "command", arg(long, value_delimiter = ',', conflicts_with = "study"))]
    #[serde(with = "quantity::list")]
    pub truth: Vec<FactorValue>,
    /// Standard deviation of the noise, with its unit [default: 0 K; with --study, that of the observations]
    #[cfg_attr(feature = "command", arg(
        id = "noise", long = "noise", value_name = "DIFFERENCE", value_parser = quantity::temperature_difference::parse
    ))]
    #[serde(rename = "noise", with = "quantity::temperature_difference")]
    pub noise_k: Option<f64>,
    /// Correlation time τ of the noise, with its unit: the autocorrelation is exp(-t/τ) [default: white noise]
    #[cfg_attr(feature = "command", arg(
        id = "correlation_time", long = "correlation-time", value_name = "TIME", value_parser = quantity::time::parse
    ))]
    #[serde(rename = "correlation_time", with = "quantity::time")]
    pub correlation_time_s: Option<f64>,
    /// Fit N synthetic data sets with random true factors, and count how often the 95 % intervals contain the truth
    #[cfg_attr(feature = "command", arg(id = "study", long = "study", value_name = "N"))]
    #[serde(rename = "study")]
    pub data_sets: Option<usize>,
    /// Seed of the random true factors and of the noise
    #[cfg_attr(feature = "command", arg(long, default_value_t = Twin::default().seed))]
    #[serde(with = "quantity::seed")]
    pub seed: u64,
    /// The observations whose times the data sets have.
    #[cfg_attr(feature = "command", command(flatten))]
    #[serde(flatten)]
    pub observations: ObservationSelection,
    /// The factors to fit and how.
    #[cfg_attr(feature = "command", command(flatten))]
    #[serde(flatten)]
    pub fit: Fit,
}

impl Default for Twin {
    fn default() -> Self {
        Self {
            truth: Vec::new(),
            noise_k: None,
            correlation_time_s: None,
            data_sets: None,
            seed: 1,
            observations: ObservationSelection::default(),
            fit: Fit::default(),
        }
    }
}

impl Twin {
    /// A coverage study of data sets with white noise of the observations' standard deviations.
    pub fn study(data_sets: usize) -> Self {
        Self { data_sets: Some(data_sets), ..Self::default() }
    }

    /// Check the question for a case, before any computation.
    ///
    /// # Errors
    /// When an option is wrong or without effect.
    pub fn check(&self, case: &Case) -> Result<(), InputError> {
        match self.data_sets {
            None => self.true_factors(case).map(|_| ()),
            Some(_) => self.prepared(case).map(|_| ()),
        }
    }

    pub(crate) fn noise(&self) -> Noise {
        Noise { correlation_s: self.correlation_time_s.unwrap_or(0.0), seed: self.seed }
    }

    /// The true value of every factor of a single data set.
    pub(crate) fn true_factors(&self, case: &Case) -> Result<Vec<f64>, InputError> {
        if self.data_sets.is_some() {
            return Err(InputError::for_option("study", ": expected a single data set"));
        }
        self.check_noise()?;
        if let Some(option) = given_option(&self.observations).or_else(|| given_option(&self.fit)) {
            let message = ": without a coverage study nothing is fitted, and observations are written for every sensor";
            return Err(InputError::for_option(option, message));
        }
        let of_noise =
            [("seed", self.seed != Self::default().seed), ("correlation_time", self.correlation_time_s.is_some())];
        if let (Some((option, _)), true) =
            (of_noise.into_iter().find(|(_, is_given)| *is_given), self.noise_k.unwrap_or(0.0) == 0.0)
        {
            return Err(InputError::for_option(option, " without noise has no effect: state its standard deviation"));
        }
        let mut values: Vec<f64> = case.factors.iter().map(|factor| factor.nominal).collect();
        let names = || case.factors.iter().map(|factor| factor.name.as_str());
        for (place, FactorValue { factor, case, value }) in self.truth.iter().enumerate() {
            let name = case.as_ref().map_or(factor.clone(), |id| format!("{factor}@{id}"));
            let index = index_of(names(), &name, "truth", "factor")?;
            if self.truth[..place].iter().any(|other| other.factor == *factor) {
                return Err(InputError::for_option("truth", format!(" names {factor:?} twice")));
            }
            values[index] = *value;
        }
        Ok(values)
    }

    /// The case of a coverage study, with these options in place of its own.
    pub(crate) fn prepared(&self, case: &Case) -> Result<Case, InputError> {
        let Some(data_sets) = self.data_sets else {
            return Err(InputError::for_option("study", ": expected a number of data sets"));
        };
        if data_sets < 2 {
            return Err(InputError::for_option("study", format!(" {data_sets}: expected at least 2 data sets")));
        }
        check_limit(&DATA_SETS, data_sets as f64, "study")?;
        if !self.truth.is_empty() {
            return Err(InputError::for_option("truth", ": a coverage study draws the true factors"));
        }
        if !self.fit.profile.is_empty() {
            let message = ": a coverage study counts the linear intervals of the estimates, not profiles";
            return Err(InputError::for_option("profile", message));
        }
        self.check_noise()?;
        self.fit.applied(&self.observations, case)
    }

    pub(crate) fn design(&self, precision: Precision) -> CoverageDesign {
        CoverageDesign {
            data_sets: self.data_sets.unwrap_or(0),
            truth_bounds: Bounds::Small,
            noise_k: self.noise_k,
            noise: self.noise(),
            search: SearchOptions { landscape: false, ..self.fit.search(precision) },
        }
    }

    fn check_noise(&self) -> Result<(), InputError> {
        let noise_k = self.noise_k.unwrap_or(0.0);
        check_nonnegative("noise", noise_k, "K")?;
        check_nonnegative("correlation_time", self.correlation_time_s.unwrap_or(0.0), "s")?;
        if noise_k > 0.0 { design::check_noise(noise_k) } else { Ok(()) }
    }
}
