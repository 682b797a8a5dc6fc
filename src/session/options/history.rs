//! Options of inverse heat conduction.

use super::{ObservationSelection, check_limit, with_selection};
use crate::case::Case;
use crate::limits::KNOTS;
use crate::session::error::{InputError, SessionError};
use crate::study::flux_inversion::{HeatingQuantity, InversionOptions, Smoothing};

/// The heating of the hot face over time, from observations (inverse heat conduction).
#[derive(Clone, Debug, PartialEq)]
pub struct HistoryOptions {
    /// The observations to use. Bounds are refused, as no factor is estimated.
    pub observations: ObservationSelection,
    /// The quantity to estimate; `None`: the only one that the case has.
    pub quantity: Option<HeatingQuantity>,
    /// Number of knots, in addition to the corners of the case's own schedule.
    pub knots: usize,
    /// Choice of the regularisation weight.
    pub smoothing: Smoothing,
}

impl Default for HistoryOptions {
    fn default() -> Self {
        let observations = ObservationSelection::default();
        Self { observations, quantity: None, knots: 20, smoothing: Smoothing::Discrepancy }
    }
}

impl HistoryOptions {
    /// Check the options for a case, before any computation.
    ///
    /// # Errors
    /// As [`Session::history`](crate::Session::history) for its input.
    pub fn check(&self, case: &Case) -> Result<(), SessionError> {
        self.prepared(case).map(|_| ())
    }

    pub(in crate::session) fn prepared(&self, case: &Case) -> Result<Case, SessionError> {
        if self.observations.bounds.is_some() {
            let message = ": a history estimates no factor, and its only bound is zero";
            return Err(InputError::for_option("bounds", message).into());
        }
        check_limit(&KNOTS, self.knots as f64, "knots")?;
        if let Smoothing::Stated(weight) = self.smoothing
            && !(weight.is_finite() && weight >= 0.0)
        {
            let message = format!(" {weight}: expected a weight of 0 or more");
            return Err(InputError::for_option("smoothing", message).into());
        }
        with_selection(case, |cases| self.observations.apply(cases))
    }

    pub(in crate::session) fn request(&self) -> InversionOptions {
        InversionOptions { quantity: self.quantity, knots: self.knots, smoothing: self.smoothing }
    }
}
