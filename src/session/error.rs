//! Errors of sessions.

use crate::case::CaseError;
use crate::march::MarchError;
#[cfg(feature = "report")]
use crate::report::ReportError;
use crate::study::estimate::EstimateError;
use crate::study::experiment_design::DesignError;
use crate::study::flux_inversion::InversionError;
use crate::study::model_comparison::ComparisonError;
use crate::study::posterior::PosteriorError;
use crate::study::size::SizeError;
use crate::study::twin::SyntheticDataError;
use std::fmt;

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
    #[cfg(feature = "report")]
    #[error(transparent)]
    Report(#[from] ReportError),
}

/// An error of an option or of a case.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct InputError {
    /// The option at fault; `None` if it is not a single one.
    pub option: Option<&'static str>,
    /// The rest of the sentence: `: no sensor is called "TC9"; there are TC1, TC2`.
    pub message: String,
}

impl InputError {
    /// An error of no single option.
    pub(super) fn general(message: impl ToString) -> Self {
        Self { option: None, message: message.to_string() }
    }

    /// An error of an option. The message follows the name of the option directly.
    pub(super) fn for_option(option: &'static str, message: impl ToString) -> Self {
        Self { option: Some(option), message: message.to_string() }
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}{}", self.option.unwrap_or_default(), self.message)
    }
}

impl std::error::Error for InputError {}

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

from_study!(DesignError, EstimateError, InversionError, PosteriorError, SizeError);

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

/// The index of `name` in `names`; an error lists them.
pub(super) fn index_of<'a>(
    names: impl Iterator<Item = &'a str>,
    name: &str,
    option: &'static str,
    noun: &str,
) -> Result<usize, SessionError> {
    let names: Vec<&str> = names.collect();
    let index = names.iter().position(|other| *other == name);
    index.ok_or_else(|| {
        let all = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        InputError::for_option(option, format!(": no {noun} is called {name:?}; there are {all}")).into()
    })
}
