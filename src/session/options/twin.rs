//! Options of synthetic data and of coverage studies.

use super::{FitOptions, ObservationSelection, check_limit, is_positive, with_selection};
use crate::case::{Bounds, Case, Observation};
use crate::limits::DATA_SETS;
use crate::march::Precision;
use crate::session::error::{InputError, SessionError, index_of};
use crate::study::coverage_study::CoverageDesign;
use crate::study::estimate::SearchOptions;
use crate::study::twin::Noise;

/// One synthetic data set.
#[derive(Clone, Debug, PartialEq)]
pub struct TwinOptions {
    /// True values of factors by name; the other factors are nominal.
    pub truth: Vec<(String, f64)>,
    /// Standard deviation of the noise, K.
    pub noise_k: f64,
    /// Correlation time τ of the noise, s: its autocorrelation is exp(−t/τ). Zero is white noise.
    pub correlation_s: f64,
    /// Seed of the noise.
    pub seed: u64,
}

impl Default for TwinOptions {
    fn default() -> Self {
        Self { truth: Vec::new(), noise_k: 0.0, correlation_s: 0.0, seed: 1 }
    }
}

impl TwinOptions {
    /// Check the options for a case, before any computation.
    ///
    /// # Errors
    /// As [`Session::twin`](crate::Session::twin) for its input.
    pub fn check(&self, case: &Case) -> Result<(), SessionError> {
        self.true_factors(case).map(|_| ())
    }

    /// The true value of every factor.
    pub(in crate::session) fn true_factors(&self, case: &Case) -> Result<Vec<f64>, SessionError> {
        check_noise(self.noise_k, self.correlation_s)?;
        let mut values: Vec<f64> = case.factors.iter().map(|factor| factor.nominal).collect();
        for (name, value) in &self.truth {
            let factor = index_of(case.factors.iter().map(|factor| factor.name.as_str()), name, "truth", "factor")?;
            if !is_positive(*value) {
                return Err(
                    InputError::for_option("truth", format!(" {name}={value}: expected a number above zero")).into()
                );
            }
            values[factor] = *value;
        }
        Ok(values)
    }

    pub(in crate::session) fn noise(&self) -> Noise {
        Noise { correlation_s: self.correlation_s, seed: self.seed }
    }
}

/// A coverage study: many synthetic data sets with random true factors, each of them fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct TwinStudyOptions {
    /// Number of data sets, at least two.
    pub data_sets: usize,
    /// The observations whose times the data sets have.
    pub observations: ObservationSelection,
    /// The factors to estimate, and the minimisation.
    pub fit: FitOptions,
    /// Standard deviation of the noise, K; `None`: that of the observations.
    pub noise_k: Option<f64>,
    /// Correlation time of the noise, s.
    pub correlation_s: f64,
    /// Seed of the true factors and of the noise.
    pub seed: u64,
}

impl TwinStudyOptions {
    /// Data sets with white noise of the observations' standard deviations.
    pub fn new(twins: usize) -> Self {
        Self {
            data_sets: twins,
            observations: ObservationSelection::default(),
            fit: FitOptions::default(),
            noise_k: None,
            correlation_s: 0.0,
            seed: 1,
        }
    }

    /// Check the options for a case, before any computation.
    ///
    /// # Errors
    /// As [`Session::twin_study`](crate::Session::twin_study) for its input.
    pub fn check(&self, case: &Case) -> Result<(), SessionError> {
        self.prepared(case).map(|_| ())
    }

    pub(in crate::session) fn prepared(&self, case: &Case) -> Result<Case, SessionError> {
        if self.data_sets < 2 {
            let message = format!(" {}: expected at least 2 data sets", self.data_sets);
            return Err(InputError::for_option("data_sets", message).into());
        }
        check_limit(&DATA_SETS, self.data_sets as f64, "data_sets")?;
        if !self.fit.profiles.is_empty() {
            let message = ": a coverage study counts the linear intervals of the estimates, not profiles";
            return Err(InputError::for_option("profiles", message).into());
        }
        check_noise(self.noise_k.unwrap_or(0.0), self.correlation_s)?;
        with_selection(case, |cases| self.fit.apply(self.observations.apply(cases)?))
    }

    pub(in crate::session) fn design(&self, precision: Precision) -> CoverageDesign {
        CoverageDesign {
            data_sets: self.data_sets,
            truth_bounds: Bounds::Small,
            noise_k: self.noise_k,
            noise: Noise { correlation_s: self.correlation_s, seed: self.seed },
            search: SearchOptions { landscape: false, ..self.fit.search(precision) },
        }
    }
}

fn check_noise(noise_k: f64, correlation_s: f64) -> Result<(), SessionError> {
    for (option, value, unit) in [("noise_k", noise_k, "K"), ("correlation_s", correlation_s, "s")] {
        if !(value.is_finite() && value >= 0.0) {
            return Err(
                InputError::for_option(option, format!(" {value} {unit}: expected no less than 0 {unit}")).into()
            );
        }
    }
    if noise_k > 0.0 {
        Observation::checked_sigma_k(noise_k)
            .map_err(|message| InputError::for_option("noise_k", format!(": {message}")))?;
    }
    Ok(())
}
