//! Output and errors of a command, and the exit code of each error.

use crate::case::CaseError;
use crate::march::MarchError;
use crate::report::ReportError;
use crate::session::{InputError, SessionError};
use std::io::ErrorKind;

/// The output of a command that ran.
pub struct Output {
    /// Text for standard output.
    pub text: String,
    /// The reason for exit code 1, if the command ran and failed all the same.
    pub failure: Option<String>,
}

/// The error of a command that did not run to its end.
pub enum Failure {
    /// Wrong input: exit code 2.
    Input(anyhow::Error),
    /// Device error: exit code 3.
    Device(anyhow::Error),
    /// The report could not be written, the run was stopped before there was an answer, or the only answer cannot be
    /// used: exit code 1.
    Report(anyhow::Error),
}

impl Failure {
    /// The exit code, and the message for standard error.
    pub fn code_and_message(&self) -> (u8, String) {
        match self {
            Self::Report(error) => (1, error.to_string()),
            Self::Input(error) => (2, error.to_string()),
            Self::Device(error) => (3, error.to_string()),
        }
    }
}

/// An error of the input.
pub fn input(message: impl ToString) -> Failure {
    Failure::Input(anyhow::anyhow!(message.to_string()))
}

/// An error of opening the folder of the outputs, before any work. A full disk is no error of the input.
pub fn unusable_folder(error: ReportError) -> Failure {
    match error {
        ReportError::Io { ref source, .. } if source.kind() != ErrorKind::StorageFull => Failure::Input(error.into()),
        other => other.into(),
    }
}

/// An error of writing an output.
pub fn unwritten(message: impl ToString) -> Failure {
    Failure::Report(anyhow::anyhow!(message.to_string()))
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
            ReportError::OtherCase { .. } => input(format!("{error} (--out, --force)")),
            ReportError::Locked { .. } => input(format!("{error} (--out)")),
            ReportError::NotAFolder { .. } => Self::Input(error.into()),
            other => Self::Report(other.into()),
        }
    }
}

impl From<InputError> for Failure {
    fn from(error: InputError) -> Self {
        input(message_with_flag(&error))
    }
}

impl From<SessionError> for Failure {
    fn from(error: SessionError) -> Self {
        match error {
            SessionError::Input(error) => error.into(),
            SessionError::Report(error) => error.into(),
            SessionError::Stopped | SessionError::Unusable(_) => Self::Report(error.into()),
            other => Self::Device(other.into()),
        }
    }
}

/// The message, with the flag of the command line in place of the name of the option.
fn message_with_flag(error: &InputError) -> String {
    let flag = match error.option.as_deref() {
        None => String::new(),
        Some("members") => "-n".to_owned(),
        Some("part") => "--members".to_owned(),
        Some("choices") => "--ply".to_owned(),
        Some(option) => format!("--{}", option.replace('_', "-")),
    };
    format!("{flag}{}", error.message)
}
