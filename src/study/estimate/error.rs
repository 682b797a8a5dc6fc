//! Why nothing was estimated.

use crate::case::Case;
use crate::march::MarchError;

/// Why nothing was estimated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EstimateError {
    /// No factor is chosen; with what there is to choose from.
    #[error("nothing to estimate: {0}")]
    NoFactors(String),
    /// A case of a joint estimate has none of the factors of the others.
    #[error("nothing to estimate in {0:?}: it has none of the factors of the others")]
    NothingShared(String),
    /// The chosen sensors have no samples in their window.
    #[error("nothing to estimate from: the sensors chosen of {case:?} have no samples between {from_s} s and {to_s} s")]
    NoSamples {
        /// The case.
        case: String,
        /// Start of the window, s.
        from_s: f64,
        /// End of the window, s.
        to_s: f64,
    },
    /// The bounds of a shared factor have no value in common.
    #[error(
        "factor {factor:?}: the cases allow no value in common; the highest low bound is {low}, the lowest high one {high}"
    )]
    NoRoom {
        /// The factor.
        factor: String,
        /// Its lower bound.
        low: f64,
        /// Its upper bound.
        high: f64,
    },
    /// A profile is wanted of a factor that is not estimated.
    #[error("no profile of {name:?}: it is not estimated; there are {known}")]
    NoProfile {
        /// The name that was given.
        name: String,
        /// The names that there are.
        known: String,
    },
    /// The cases of a joint estimate state different losses or priors.
    #[error("{case:?} asks for another loss or prior than {first:?}; give --loss and --prior for all")]
    OtherObjective {
        /// The first of the two.
        first: String,
        /// The case.
        case: String,
    },
    /// The march failed or was cancelled.
    #[error(transparent)]
    March(#[from] MarchError),
}

impl EstimateError {
    /// No factors were chosen of these cases, and which there are.
    pub(in crate::study) fn no_factors(cases: &[&Case]) -> Self {
        Self::NoFactors(no_factors(cases))
    }
}

/// Why no factor of some cases is estimated, and which there are to choose.
pub fn no_factors(cases: &[&Case]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for factor in cases.iter().flat_map(|case| &case.factors) {
        if !names.contains(&factor.name.as_str()) {
            names.push(&factor.name);
        }
    }
    match names.as_slice() {
        [] => "the case has no [[factor]]".to_owned(),
        names => format!("choose some of the factors {} with --factors, or in [estimate]", names.join(", ")),
    }
}
