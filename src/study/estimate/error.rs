//! Errors of an estimation.

use crate::case::{Bounds, Case};
use crate::march::MarchError;

/// Errors of an estimation.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EstimateError {
    /// No factor is selected; the text lists the factors available.
    #[error("no factor to estimate: {0}")]
    NoFactors(String),
    /// A case of a joint estimate shares no factor with the others.
    #[error("no factor to estimate in {0:?}: it shares no estimated factor with the other cases")]
    NoSharedFactor(String),
    /// The selected sensors have no samples in their windows.
    #[error(
        "no data to estimate from: the selected sensors of {case:?} have no samples between {from_s} s and {to_s} s"
    )]
    NoSamples {
        /// The case.
        case: String,
        /// Start of the window, s.
        from_s: f64,
        /// End of the window, s.
        to_s: f64,
    },
    /// The bounds of a shared factor do not overlap.
    #[error(
        "factor {factor:?}: the bounds of the cases do not overlap; the highest lower bound is {low}, the lowest upper \
         bound {high}"
    )]
    DisjointBounds {
        /// The factor.
        factor: String,
        /// The highest lower bound.
        low: f64,
        /// The lowest upper bound.
        high: f64,
    },
    /// A profile is requested for a factor that is not estimated.
    #[error("no profile of {name:?}: it is not estimated; the estimated factors are {known}")]
    ProfileNotEstimated {
        /// The requested name.
        name: String,
        /// The names of the estimated factors.
        known: String,
    },
    /// The cases of a joint estimate have different losses or priors.
    #[error("{case:?} has another loss or prior than {first:?}; state one loss and one prior for all cases")]
    ObjectivesDiffer {
        /// The first of the two.
        first: String,
        /// The case.
        case: String,
    },
    /// The nominal value of a factor is at a bound of its prior, which then has no width on one side, but the estimate
    /// may go there.
    #[error(
        "factor {factor:?}: its nominal value {nominal} is at one of the {} bounds, at which a prior has two standard \
         deviations, so that values beyond it have no probability; but the estimate may take values from {} to {}: \
         use the same bounds for both",
        prior.name(), bounds.0, bounds.1
    )]
    PriorAtBound {
        /// The factor.
        factor: String,
        /// Nominal value of the factor.
        nominal: f64,
        /// The bounds of the estimate.
        bounds: (f64, f64),
        /// The bounds that define the prior.
        prior: Bounds,
    },
    /// The march failed or was cancelled.
    #[error(transparent)]
    March(#[from] MarchError),
}

impl EstimateError {
    /// The error for cases that select no factor.
    pub(in crate::study) fn no_factors(cases: &[&Case]) -> Self {
        Self::NoFactors(no_factors(cases))
    }
}

/// Text that lists the factors available in cases that select none.
pub fn no_factors(cases: &[&Case]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for factor in cases.iter().flat_map(|case| &case.factors) {
        if !names.contains(&factor.name.as_str()) {
            names.push(&factor.name);
        }
    }
    match names.as_slice() {
        [] => "the case has no [[factor]]".to_owned(),
        names => format!(
            "select some of the factors {} with the option factors or in [estimate] of the case",
            names.join(", ")
        ),
    }
}
