//! Options of all studies in one report.

use super::estimate::check_posterior;
use super::{FitOptions, ObservationSelection, UncertaintyOptions, with_selection};
use crate::case::Case;
use crate::session::error::SessionError;
use crate::study::estimate::no_factors;
use crate::study::posterior::Walkers;

/// Prediction, uncertainty, sensitivity and estimate in one report.
#[derive(Clone, Debug, Default)]
pub struct StudyOptions {
    /// The Monte Carlo sweep.
    pub sweep: UncertaintyOptions,
    /// The observations to fit.
    pub observations: ObservationSelection,
    /// The factors to estimate, and the minimisation.
    pub fit: FitOptions,
    /// Options of the MCMC sampling of the posterior; `None`: no posterior.
    pub posterior: Option<Walkers>,
}

impl StudyOptions {
    /// Check the options for a case, before any computation. Returns the reason if nothing will be estimated.
    ///
    /// # Errors
    /// As [`Session::study`](crate::Session::study) for its input.
    pub fn check(&self, case: &Case) -> Result<Option<String>, SessionError> {
        self.prepared(case).map(|(_, not_estimated)| not_estimated)
    }

    pub(in crate::session) fn prepared(&self, case: &Case) -> Result<(Case, Option<String>), SessionError> {
        check_posterior(self.posterior.as_ref())?;
        self.sweep.check(case)?;
        let case = with_selection(case, |cases| self.fit.apply(self.observations.apply(cases)?))?;
        let not_estimated = if case.observations.is_empty() {
            Some("the case has no observations".to_owned())
        } else {
            case.estimate.factors.is_empty().then(|| no_factors(&[&case]))
        };
        Ok((case, not_estimated))
    }
}
