//! The question of `sensitivity`.

use super::error::InputError;
use super::observed::ObservationSelection;
use crate::case::Case;
use crate::march::Precision;
use crate::study::sensitivity::difference_step;
use serde::{Deserialize, Serialize};

/// Method of differentiation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Derivatives {
    /// Exact derivatives (forward-mode automatic differentiation)
    Tangent,
    /// Central differences, as in the paper
    Difference,
}

/// Derivatives with respect to the factors, and which factors can be estimated together.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct Sensitivity {
    /// The observations for which factors are selected.
    #[cfg_attr(feature = "command", command(flatten))]
    #[serde(flatten)]
    pub observations: ObservationSelection,
    /// How derivatives are computed [default: tangent; difference if --step is given]
    #[cfg_attr(feature = "command", arg(long, value_enum))]
    pub method: Option<Derivatives>,
    /// Relative step of a central difference [default: 1e-5 in f64, 1e-3 in f32]
    #[cfg_attr(feature = "command", arg(long))]
    pub step: Option<f64>,
}

impl Sensitivity {
    /// Check the question for a case, before any computation.
    ///
    /// # Errors
    /// When an option is wrong or without effect, or the case has no factors.
    pub fn check(&self, case: &Case) -> Result<(), InputError> {
        self.prepared(case).map(|_| ())
    }

    /// The case with these options in place of its own.
    pub(crate) fn prepared(&self, case: &Case) -> Result<Case, InputError> {
        if case.factors.is_empty() {
            return Err(InputError::general("the case has no factors to differentiate by"));
        }
        if let Some(step) = self.step {
            if self.method == Some(Derivatives::Tangent) {
                let message = format!(" {step}: exact derivatives have no step; leave it out, or choose differences");
                return Err(InputError::for_option("step", message));
            }
            if !(1e-9..=0.2).contains(&step) {
                let message = format!(" {step}: expected a relative step from 1e-9 to 0.2");
                return Err(InputError::for_option("step", message));
            }
        }
        self.observations.applied(case)
    }

    /// The relative step of central differences; `None` for exact derivatives.
    pub(crate) fn difference_step(&self, precision: Precision) -> Option<f64> {
        let is_difference = self.method == Some(Derivatives::Difference) || self.step.is_some();
        is_difference.then(|| self.step.unwrap_or(difference_step(precision)))
    }
}
