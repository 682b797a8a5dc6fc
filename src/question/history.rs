//! The question of `history`: inverse heat conduction.

use super::error::{InputError, check_limit};
use super::observed::ObservationSelection;
use crate::case::Case;
use crate::limits::KNOTS;
use crate::study::flux_inversion::HeatingQuantity;
use serde::{Deserialize, Serialize};

/// Heating of the hot face over time, from thermocouples (inverse heat conduction).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct History {
    /// The observations to use. Bounds are refused, as no factor is estimated.
    #[cfg_attr(feature = "command", command(flatten))]
    #[serde(flatten)]
    pub observations: ObservationSelection,
    /// Quantity to estimate [default: the only one that the case has]
    #[cfg_attr(feature = "command", arg(long, value_enum))]
    pub quantity: Option<HeatingQuantity>,
    /// Number of knots, in addition to the corners of the case's own schedule; the quantity is linear between knots
    /// [default: half as many as the samples of a sensor, at most 40]
    #[cfg_attr(feature = "command", arg(long))]
    pub knots: Option<usize>,
    /// Tikhonov regularisation weight, relative to the weight at which the Jacobians of data and roughness have equal
    /// norms [default: least expected error, by restricted likelihood]
    #[cfg_attr(feature = "command", arg(long))]
    pub smoothing: Option<f64>,
}

impl History {
    /// Check the question for a case, before any computation.
    ///
    /// # Errors
    /// When an option is wrong or without effect.
    pub fn check(&self, case: &Case) -> Result<(), InputError> {
        self.prepared(case).map(|_| ())
    }

    /// The case with these options in place of its own.
    pub(crate) fn prepared(&self, case: &Case) -> Result<Case, InputError> {
        if self.observations.bounds.is_some() {
            let message = ": a history estimates no factor, and its only bound is zero";
            return Err(InputError::for_option("bounds", message));
        }
        check_limit(&KNOTS, self.knots.unwrap_or(0) as f64, "knots")?;
        if let Some(weight) = self.smoothing
            && !(weight.is_finite() && weight >= 0.0)
        {
            let message = format!(" {weight}: expected a weight of 0 or more");
            return Err(InputError::for_option("smoothing", message));
        }
        self.observations.applied(case)
    }
}
