//! The question of `study`: all studies in one report.

use super::draw::{Draw, check_members};
use super::error::InputError;
use super::fit::{Fit, PosteriorSampling};
use super::observed::ObservationSelection;
use super::predict::check_profiles;
use super::{given_option, quantity};
use crate::case::Case;
use crate::study::depth_profiles::ProfileInstants;
use crate::study::estimate::no_factors;
use crate::study::posterior::Walkers;
use serde::{Deserialize, Serialize};

/// Prediction, uncertainty, sensitivity and estimate in one report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct Study {
    /// Number of members (random samples of the factors)
    #[cfg_attr(feature = "command", arg(
        short = 'n',
        value_name = "MEMBERS",
        default_value_t = Study::default().members,
        value_parser = quantity::count::parse
    ))]
    #[serde(with = "quantity::count")]
    pub members: usize,
    /// How they are drawn.
    #[cfg_attr(feature = "command", command(flatten))]
    #[serde(flatten)]
    pub draw: Draw,
    /// Profiles through the thickness at these times, as "10s,40s", or at a number of evenly spaced times
    #[cfg_attr(feature = "command", arg(long, value_name = "TIMES"))]
    #[serde(with = "quantity::text")]
    pub depth_profiles: Option<ProfileInstants>,
    /// The observations to fit.
    #[cfg_attr(feature = "command", command(flatten))]
    #[serde(flatten)]
    pub observations: ObservationSelection,
    /// The factors to fit and how.
    #[cfg_attr(feature = "command", command(flatten))]
    #[serde(flatten)]
    pub fit: Fit,
    /// The posterior distribution, with the seed of the sweep.
    #[cfg_attr(feature = "command", command(flatten))]
    #[serde(flatten)]
    pub posterior: PosteriorSampling,
}

impl Default for Study {
    fn default() -> Self {
        Self {
            members: 5000,
            draw: Draw::default(),
            depth_profiles: None,
            observations: ObservationSelection::default(),
            fit: Fit::default(),
            posterior: PosteriorSampling::default(),
        }
    }
}

impl Study {
    /// Check the question for a case, before any computation.
    ///
    /// # Errors
    /// When an option is wrong or without effect.
    pub fn check(&self, case: &Case) -> Result<(), InputError> {
        self.prepared(case).map(|_| ())
    }

    pub(crate) fn walkers(&self) -> Option<Walkers> {
        self.posterior.chosen(self.draw.seed)
    }

    /// The case with these options in place of its own, and the reason if nothing is estimated.
    pub(crate) fn prepared(&self, case: &Case) -> Result<(Case, Option<String>), InputError> {
        self.posterior.check()?;
        check_members(self.members, case)?;
        check_profiles(self.depth_profiles.as_ref(), case)?;
        let case = self.fit.applied(&self.observations, case)?;
        let not_estimated = if case.observations.is_empty() {
            Some("the case has no observations".to_owned())
        } else {
            case.estimate.factors.is_empty().then(|| no_factors(&[&case]))
        };
        // The factors of a fit also state what is not fitted.
        let fit = Fit { factors: Vec::new(), ..self.fit.clone() };
        let of_estimate = given_option(&fit).or_else(|| given_option(&self.posterior));
        match (&not_estimated, of_estimate) {
            (Some(reason), Some(option)) => {
                Err(InputError::for_option(option, format!(": nothing is estimated: {reason}")))
            }
            _ => Ok((case, not_estimated)),
        }
    }
}
