//! The question of `predict`, and what was read of the observations.

use super::error::InputError;
use super::quantity;
use crate::case::Case;
use crate::study::depth_profiles::ProfileInstants;
use serde::{Deserialize, Serialize};

/// Temperatures and heat balance at nominal factors, compared with the observations.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct Predict {
    /// Profiles through the thickness at these times, as "10s,40s", or at a number of evenly spaced times
    #[cfg_attr(feature = "command", arg(long, value_name = "TIMES"))]
    #[serde(with = "quantity::text")]
    pub depth_profiles: Option<ProfileInstants>,
}

impl Predict {
    /// Check the question for a case, before any computation.
    ///
    /// # Errors
    /// When an instant is outside the exposure, or there are none or too many.
    pub fn check(&self, case: &Case) -> Result<(), InputError> {
        check_profiles(self.depth_profiles.as_ref(), case)
    }
}

pub(super) fn check_profiles(instants: Option<&ProfileInstants>, case: &Case) -> Result<(), InputError> {
    let Some(instants) = instants else { return Ok(()) };
    instants.check(case).map_err(|message| InputError::for_option("depth_profiles", format!(": {message}")))
}

/// What was read of the measured data: rate, gaps, noise, spikes, stuck and open channels, drift.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct Observations {}

impl Observations {
    /// Check the question for a case.
    ///
    /// # Errors
    /// When the case has no observations.
    pub fn check(&self, case: &Case) -> Result<(), InputError> {
        match case.observations.is_empty() {
            true => Err(InputError::general("the case has no observations")),
            false => Ok(()),
        }
    }
}
