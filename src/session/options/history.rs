//! Options of inverse heat conduction.

use super::{ObservationSelection, check_limit, with_selection};
use crate::case::Case;
use crate::limits::KNOTS;
use crate::session::error::{InputError, SessionError};
use crate::study::flux_inversion::{HeatingQuantity, InversionOptions};

/// The heating of the hot face over time, from observations (inverse heat conduction).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HistoryOptions {
    /// The observations to use. Bounds are refused, as no factor is estimated.
    pub observations: ObservationSelection,
    /// The quantity to estimate; `None`: the only one that the case has.
    pub quantity: Option<HeatingQuantity>,
    /// Number of knots, in addition to the corners of the case's own schedule; `None`: half as many as the samples of a
    /// sensor, at most [`DEFAULT_KNOTS`](crate::study::flux_inversion::DEFAULT_KNOTS).
    pub knots: Option<usize>,
    /// Regularisation weight, relative to the weight at which the Jacobians of data and roughness have equal norms;
    /// `None`: the weight of least expected error, by restricted likelihood.
    pub smoothing: Option<f64>,
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
        check_limit(&KNOTS, self.knots.unwrap_or(0) as f64, "knots")?;
        if let Some(weight) = self.smoothing
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
