//! How a command ends, and the exit code that says so.

use bondline::case::CaseError;
use bondline::march::MarchError;
use bondline::report::ReportError;
use bondline::session::{InputError, SessionError};

/// A command that ran: what to print, and why it failed all the same, if it did.
pub(crate) struct Ending {
    pub text: String,
    pub why: Option<String>,
}

/// A command that did not run.
pub(crate) enum Failure {
    /// The input is wrong: exit code 2.
    Input(anyhow::Error),
    /// The device failed: exit code 3.
    Device(anyhow::Error),
    /// It ran, but its report could not be written: exit code 1.
    Report(anyhow::Error),
}

/// An input that is wrong.
pub(crate) fn input(message: impl ToString) -> Failure {
    Failure::Input(anyhow::anyhow!(message.to_string()))
}

impl From<CaseError> for Failure {
    fn from(error: CaseError) -> Self {
        Self::Input(error.into())
    }
}

impl From<MarchError> for Failure {
    fn from(error: MarchError) -> Self {
        Self::Device(error.into())
    }
}

impl From<ReportError> for Failure {
    fn from(error: ReportError) -> Self {
        match error {
            ReportError::OtherCase { .. } | ReportError::NotAFolder { .. } => Self::Input(error.into()),
            other => Self::Report(other.into()),
        }
    }
}

impl From<SessionError> for Failure {
    fn from(error: SessionError) -> Self {
        match error {
            SessionError::Input(error) => input(with_flag(&error)),
            SessionError::Report(error) => error.into(),
            other => Self::Device(other.into()),
        }
    }
}

/// What is wrong with an option, by the name under which it is typed.
fn with_flag(error: &InputError) -> String {
    let Some(option) = error.option else { return error.message.clone() };
    let flag = match option {
        "members" => "-n",
        "part" => "--members",
        "twins" => "--study",
        "sensor" | "limit_k" => "--limit",
        "within_m" => "--between",
        "profiles" => "--profile",
        "noise_k" => "--noise",
        "correlation_s" => "--correlation",
        other => return format!("--{other}{}", error.message),
    };
    format!("{flag}{}", error.message)
}
