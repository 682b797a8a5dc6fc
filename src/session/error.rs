//! Errors of sessions.

use crate::case::CaseError;
use crate::march::MarchError;
use crate::question::InputError;
use crate::report::ReportError;
use crate::study::estimate::EstimateError;
use crate::study::experiment_design::DesignError;
use crate::study::flux_inversion::InversionError;
use crate::study::model_comparison::ComparisonError;
use crate::study::posterior::PosteriorError;
use crate::study::size::SizeError;
use crate::study::twin::SyntheticDataError;

/// The error of a study.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// An option is wrong, or the case lacks something that the study needs.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The device failed.
    #[error(transparent)]
    March(MarchError),
    /// The march was cancelled by its token.
    #[error("cancelled")]
    Cancelled,
    /// The march was stopped, by its token or its time limit, before there was an answer.
    #[error("stopped before there was an answer")]
    Stopped,
    /// The march failed or is too inaccurate, and the study has no other answer.
    #[error("{0}")]
    Unusable(String),
    /// The report could not be written.
    #[error(transparent)]
    Report(#[from] ReportError),
}

impl From<MarchError> for SessionError {
    fn from(error: MarchError) -> Self {
        match error {
            MarchError::Cancelled => Self::Cancelled,
            MarchError::Stopped => Self::Stopped,
            other => Self::March(other),
        }
    }
}

impl From<CaseError> for SessionError {
    fn from(error: CaseError) -> Self {
        InputError::general(error).into()
    }
}

/// Conversion of errors of studies: an error of the march, or of the input.
macro_rules! from_study {
    ($($error:ident),*) => {
        $(impl From<$error> for SessionError {
            fn from(error: $error) -> Self {
                match error {
                    $error::March(error) => error.into(),
                    other => InputError::general(other).into(),
                }
            }
        })*
    };
}

from_study!(DesignError, EstimateError, PosteriorError, SizeError);

impl From<InversionError> for SessionError {
    fn from(error: InversionError) -> Self {
        match error {
            InversionError::March(error) => error.into(),
            InversionError::AmbiguousQuantity { .. } | InversionError::QuantityMissing { .. } => {
                InputError::for_option("quantity", format!(": {error}")).into()
            }
            other => InputError::general(other).into(),
        }
    }
}

impl From<SyntheticDataError> for SessionError {
    fn from(error: SyntheticDataError) -> Self {
        match error {
            SyntheticDataError::March(error) => error.into(),
            unusable => Self::Unusable(unusable.to_string()),
        }
    }
}

impl From<ComparisonError> for SessionError {
    fn from(error: ComparisonError) -> Self {
        match error {
            ComparisonError::Estimate(error) => error.into(),
            other => InputError::general(other).into(),
        }
    }
}
