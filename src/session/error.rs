//! Why a session gave no answer.

use crate::case::CaseError;
use crate::march::MarchError;
#[cfg(feature = "report")]
use crate::report::ReportError;
use crate::study::beside::BesideError;
use crate::study::estimate::EstimateError;
use crate::study::history::HistoryError;
use crate::study::posterior::PosteriorError;
use crate::study::size::SizeError;
use crate::study::twin::TwinError;
use std::fmt;

/// Why a session gave no answer.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// An option is wrong, or the case does not go with the question.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The device failed.
    #[error(transparent)]
    March(MarchError),
    /// The cancel token ended the march.
    #[error("cancelled")]
    Cancelled,
    /// The report could not be written.
    #[cfg(feature = "report")]
    #[error(transparent)]
    Report(#[from] ReportError),
}

/// What is wrong with an option or a case.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct InputError {
    /// The field of the options that is wrong; `None` where no single one is.
    pub option: Option<&'static str>,
    /// The rest of the sentence: `: no sensor is called "TC9"; there are TC1, TC2`.
    pub message: String,
}

impl InputError {
    /// A sentence about no single option.
    pub(super) fn plain(message: impl ToString) -> Self {
        Self { option: None, message: message.to_string() }
    }

    /// A sentence that begins with the name of an option; the message follows it directly.
    pub(super) fn of(option: &'static str, message: impl ToString) -> Self {
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
            other => Self::March(other),
        }
    }
}

impl From<CaseError> for SessionError {
    fn from(error: CaseError) -> Self {
        InputError::plain(error).into()
    }
}

/// An error of a study: of its march, or of its input.
macro_rules! from_study {
    ($($error:ident),*) => {
        $(impl From<$error> for SessionError {
            fn from(error: $error) -> Self {
                match error {
                    $error::March(error) => error.into(),
                    other => InputError::plain(other).into(),
                }
            }
        })*
    };
}

from_study!(EstimateError, HistoryError, PosteriorError, SizeError, TwinError);

impl From<BesideError> for SessionError {
    fn from(error: BesideError) -> Self {
        match error {
            BesideError::Estimate(error) => error.into(),
            other => InputError::plain(other).into(),
        }
    }
}

/// The place of a name among those known.
pub(super) fn find<'a>(
    names: impl Iterator<Item = &'a str>,
    name: &str,
    option: &'static str,
    noun: &str,
) -> Result<usize, SessionError> {
    let names: Vec<&str> = names.collect();
    let place = names.iter().position(|known| *known == name);
    place.ok_or_else(|| {
        let known = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        InputError::of(option, format!(": no {noun} is called {name:?}; there are {known}")).into()
    })
}
