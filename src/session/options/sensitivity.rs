//! Options of sensitivities.

use super::{ObservationSelection, with_selection};
use crate::case::Case;
use crate::march::Precision;
use crate::session::error::{InputError, SessionError};
use crate::study::sensitivity::difference_step;

/// Method of differentiation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Derivatives {
    /// Exact, by forward-mode differentiation of the march; central differences on a backend without it.
    #[default]
    Exact,
    /// Central differences with this relative step; `None`: 1e-5 in f64 and 1e-3 in f32.
    Difference(Option<f64>),
}

/// Derivatives of temperatures with respect to factors.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SensitivityOptions {
    /// The observations for which factors are selected.
    pub observations: ObservationSelection,
    /// Method of differentiation.
    pub derivatives: Derivatives,
}

impl SensitivityOptions {
    /// Check the options for a case, before any computation.
    ///
    /// # Errors
    /// As [`Session::sensitivity`](crate::Session::sensitivity) for its input.
    pub fn check(&self, case: &Case) -> Result<(), SessionError> {
        self.prepared(case).map(|_| ())
    }

    /// The case with these options in place of its own.
    pub(in crate::session) fn prepared(&self, case: &Case) -> Result<Case, SessionError> {
        if case.factors.is_empty() {
            return Err(InputError::general("the case has no factors to differentiate by").into());
        }
        if let Derivatives::Difference(Some(step)) = self.derivatives
            && !(1e-9..=0.2).contains(&step)
        {
            let message = format!(" {step}: expected a relative step from 1e-9 to 0.2");
            return Err(InputError::for_option("step", message).into());
        }
        with_selection(case, |cases| self.observations.apply(cases))
    }

    /// The relative step of central differences; `None` for exact derivatives.
    pub(in crate::session) fn step(&self, precision: Precision) -> Option<f64> {
        match self.derivatives {
            Derivatives::Exact => None,
            Derivatives::Difference(step) => Some(step.unwrap_or(difference_step(precision))),
        }
    }
}
